// Topic vision on its quick frames: no other settings are both faster and better than the shipped ones. Times
// are only compared with each other.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "tests/e2e/quick_report.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

TEST(ReportVision, nothing_faster_than_the_shipped_settings_sees_better) {
  ASSERT_EQ(quick_report().code, 0) << quick_report().said;
  const Table lines(quick_report().folder() / "vision.csv");
  const auto number = [&lines](std::size_t line, const char* column) { return lines.number(line, column); };
  std::map<std::string, std::size_t> shipped;  // per noise level
  for (std::size_t l = 0; l < lines.rows.size(); ++l) {
    if (lines.text(l, "shipped") != "1") {
      continue;
    }
    EXPECT_TRUE(shipped.emplace(lines.text(l, "noise_grey"), l).second);
  }
  ASSERT_GE(shipped.size(), 2U);
  for (std::size_t l = 0; l < lines.rows.size(); ++l) {
    const std::size_t s = shipped.at(lines.text(l, "noise_grey"));
    const bool does_less = lines.text(l, "method").find("only") != std::string::npos;
    if (does_less || number(l, "median_ns") > 0.8 * number(s, "median_ns")) {
      continue;
    }
    EXPECT_GT(number(l, "outer_rms_um"), 0.95 * number(s, "outer_rms_um"))
        << lines.text(l, "method") << " " << lines.text(l, "knob");
  }
  for (const auto& [noise, s] : shipped) {
    EXPECT_EQ(number(s, "seen_share"), 1) << noise;
    EXPECT_GT(number(s, "within_2px_share"), 0.95) << noise;
    // Between the bound, which no method reaches, and one pixel.
    EXPECT_GT(number(s, "outer_rms_um"), number(s, "bound_um")) << noise;
    EXPECT_LT(number(s, "outer_rms_um"), 0.25) << noise;
    EXPECT_LT(number(s, "inner_rms_um"), 0.825) << noise;
    EXPECT_LT(number(s, "tip_rms_um"), 0.825) << noise;
    EXPECT_LT(number(s, "R_rms_um"), 0.1) << noise;
  }
}

TEST(ReportVision, frames_of_another_renderer_are_seen_as_well_or_what_is_missing_is_said) {
  const fs::path file = quick_report().folder() / "vision_foreign.csv";
  if (!fs::exists(file)) {
    EXPECT_NE(quick_report().said.find("Frames of another renderer: not (all) drawn: "), std::string::npos)
        << quick_report().said;
    return;
  }
  const Table lines(file);
  int shipped = 0;
  for (std::size_t l = 0; l < lines.rows.size(); ++l) {
    if (lines.text(l, "shipped") == "1") {
      ++shipped;
      EXPECT_EQ(lines.number(l, "seen_share"), 1);
      EXPECT_GT(lines.number(l, "outer_rms_um"), lines.number(l, "bound_um"));
      EXPECT_LT(lines.number(l, "outer_rms_um"), 0.25);
      EXPECT_LT(lines.number(l, "wd_rms_um"), 0.825);
    }
  }
  EXPECT_EQ(shipped, 1);
}

}  // namespace
}  // namespace punctum::e2e
