// Topic vision on its quick frames: no other settings are both faster and better than the shipped ones. Times
// are only compared with each other.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/e2e/quick_report.hpp"
#include "tests/support/programs.hpp"
#include "tools/report/foreign_frames.hpp"
#include "tools/report/vision_phases.hpp"

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

TEST(ReportVision, judges_every_phase_of_both_methods_in_the_stations_pictures) {
  ASSERT_EQ(quick_report().code, 0) << quick_report().said;
  const Table lines(quick_report().folder() / "vision_phases.csv");
  int of_station = 0;
  for (std::size_t l = 0; l < lines.rows.size(); ++l) {
    if (lines.text(l, "renderer") != "station") {
      continue;
    }
    ++of_station;
    const double bias = lines.number(l, "bias_um"), spread = lines.number(l, "spread_um");
    EXPECT_NEAR(std::hypot(bias, spread), lines.number(l, "rms_um"), 1e-9) << l;
    EXPECT_LE(lines.number(l, "right_low"), lines.number(l, "right_share")) << l;
    EXPECT_GE(lines.number(l, "right_high"), lines.number(l, "right_share")) << l;
    EXPECT_LE(lines.number(l, "claimed"), lines.number(l, "frames")) << l;
    if (lines.text(l, "method") == "tracker" && lines.text(l, "membrane") == "outer") {
      EXPECT_LT(lines.number(l, "rms_um"), 0.825) << lines.text(l, "phase");
      EXPECT_GT(lines.number(l, "rms_um"), 0.5 * lines.number(l, "bound_um")) << lines.text(l, "phase");
    }
  }
  EXPECT_EQ(of_station, 4 * (3 + 2)) << "phases; membranes of the tracker with the surface, of the paper";
}

// Of Wilson (1927), by hand: 150 of 150, and 5 of 10.
TEST(ReportVision, tells_the_interval_of_a_share) {
  EXPECT_NEAR(report::share_interval(150, 150).low, 1 / (1 + 1.96 * 1.96 / 150), 1e-12);
  EXPECT_NEAR(report::share_interval(150, 150).high, 1, 1e-12);
  EXPECT_NEAR(report::share_interval(5, 10).low, 0.2366, 1e-4);
  EXPECT_NEAR(report::share_interval(5, 10).high, 0.7634, 1e-4);
}

// 0.344 sqrt(K / L) px at a noise of 5, contrast 30 and a blur of 1.2 px.
TEST(ReportVision, tells_the_bound_of_cramer_and_rao) {
  constexpr double kLength_px = 457;
  EXPECT_NEAR(report::contour_bound_px(5, kLength_px, 1.2, 30),
              0.344 * std::sqrt(report::kContourModes / kLength_px), 2e-4);
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

TEST(ReportVision, a_truth_that_lacks_something_is_refused_with_its_file_frame_and_key) {
  const fs::path folder = fs::path(testing::TempDir()) / ("truth_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string contour = "[[1, 1], [9, 1], [9, 9]]";
  const std::string whole =
      R"("phase": "contact", "wd_px": 1, "tip": [1, 1], "outer": )" + contour + R"(, "inner": )" + contour;
  const std::vector<std::pair<std::string, std::string>> refused{
      {"[{" + whole + "}]", "'holder'"}, {R"([{"phase": 3}])", "must be string"}, {"[{]", "parse error"}};
  for (const auto& [text, named] : refused) {
    std::ofstream(folder / "truth.json") << text;
    try {
      (void)report::read_foreign(folder);
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& e) {
      const std::string said = e.what();
      EXPECT_NE(said.find("truth.json: frame 0: "), std::string::npos) << said;
      EXPECT_NE(said.find(named), std::string::npos) << said;
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace punctum::e2e
