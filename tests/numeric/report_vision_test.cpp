// Topic vision on its quick frames: no other settings are both faster and better than the shipped ones. Times
// are only compared with each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>

#include "tools/report/topic.hpp"

namespace {

using namespace punctum::report;

using Line = std::map<std::string, std::string>;

std::vector<Line> lines_of(const Table& t) {
  std::vector<Line> lines;
  for (const Row& row : t.rows) {
    lines.emplace_back();
    for (std::size_t i = 0; i < row.size(); ++i) {
      lines.back()[t.columns[i]] = row[i].text();
    }
  }
  return lines;
}
double number(const Line& line, const std::string& column) {
  return std::strtod(line.at(column).c_str(), nullptr);
}

TEST(ReportVision, nothing_faster_than_the_shipped_settings_sees_better) {
  const auto topic =
      std::find_if(topics().begin(), topics().end(), [](const Topic& t) { return t.name == "vision"; });
  ASSERT_NE(topic, topics().end());
  Progress progress("vision");
  const Result result = topic->run({.quick = true, .out = {}, .progress = progress});
  ASSERT_FALSE(result.tables.empty());
  EXPECT_EQ(result.tables.front().name, "vision");
  EXPECT_FALSE(result.reading.empty());
  const std::vector<Line> lines = lines_of(result.tables.front());
  std::map<std::string, const Line*> shipped;  // per noise level
  for (const Line& l : lines) {
    if (l.at("shipped") != "1") {
      continue;
    }
    EXPECT_TRUE(shipped.emplace(l.at("noise_grey"), &l).second);
  }
  ASSERT_GE(shipped.size(), 2U);
  for (const Line& l : lines) {
    const Line& s = *shipped.at(l.at("noise_grey"));
    const bool does_less = l.at("method").find("only") != std::string::npos;
    if (does_less || number(l, "median_ns") > 0.8 * number(s, "median_ns")) {
      continue;
    }
    EXPECT_GT(number(l, "outer_rms_um"), 0.95 * number(s, "outer_rms_um"))
        << l.at("method") << " " << l.at("knob");
  }
  for (const auto& [noise, s] : shipped) {
    EXPECT_EQ(number(*s, "seen_share"), 1) << noise;
    EXPECT_GT(number(*s, "within_2px_share"), 0.95) << noise;
    // Between the bound, which no method reaches, and one pixel.
    EXPECT_GT(number(*s, "outer_rms_um"), number(*s, "bound_um")) << noise;
    EXPECT_LT(number(*s, "outer_rms_um"), 0.25) << noise;
    EXPECT_LT(number(*s, "inner_rms_um"), 0.825) << noise;
    EXPECT_LT(number(*s, "tip_rms_um"), 0.825) << noise;
    EXPECT_LT(number(*s, "R_rms_um"), 0.1) << noise;
  }
}

}  // namespace
