// Vision that hangs, is ended or sees nothing for a while, and what a run says of it, of the dose and of the
// needle at its end: the programs as built.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/e2e/pause.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// ---- its health ----

TEST_F(Programs, after_five_seconds_without_a_frame_in_any_phase_vision_finds_everything_again) {
  ASSERT_EQ(punctum(slow_injection({"--clock", "virtual"})), 0) << said_;
  const auto undisturbed = json();
  ASSERT_EQ(undisturbed["outcome"], "done");
  int paused = 0;
  for (const auto& phase : undisturbed["phases"]) {
    if (phase["name"] == "clear") {
      continue;
    }
    const std::string name = phase["name"];
    SCOPED_TRACE(name);
    const double at_s = 0.7 * phase["start_s"].get<double>() + 0.3 * phase["end_s"].get<double>();
    const int code = punctum(
        slow_injection({"--clock", "virtual", "--set",
                        "sim.failure=[{device=\"camera\", kind=\"drop\", at_s=" + std::to_string(at_s) +
                            ", for_s=" + std::to_string(kPause_s) + "}]"}));
    const auto r = json();
    // Within the cell nothing is injected while nobody sees the needle, and the operator does not wait for
    // that.
    EXPECT_EQ(r["outcome"], name == "puncture"    ? "not injected"
                            : name == "injection" ? "injected in part"
                                                  : "done");
    EXPECT_EQ(code, r["outcome"] == "done" ? 0 : 1) << said_;
    EXPECT_EQ(r["cells"]["lost"], 0);
    EXPECT_EQ(r["needle_at_end"]["where"], "outside");
    EXPECT_EQ(r["vision_restarts"].size(), 0U) << "a camera without frames is no vision that hangs";
    EXPECT_LT(r["stale_s"], kPause_s + 1);
    EXPECT_GT(expect_no_advance_while_stale(Table(fs::path(report()) / "samples.csv")), 4500U);
    expect_everything_found(Table(fs::path(report()) / "obs.csv"), at_s + kPause_s);
    ++paused;
  }
  EXPECT_EQ(paused, 6);
}

// The needle's end then lies in the wall of the cell, or beside it, where a start has least to hold on to.
TEST_F(Programs, after_a_pause_that_ends_while_the_needle_leaves_the_wall_vision_finds_everything_again) {
  for (const char* seed : {"1", "6"}) {
    ASSERT_EQ(punctum(slow_injection({"--clock", "virtual", "--no-figure", "--no-frames", "--seed", seed})),
              0)
        << said_;
    const auto undisturbed = json();
    const auto withdrawal = std::find_if(undisturbed["phases"].begin(), undisturbed["phases"].end(),
                                         [](const auto& phase) { return phase["name"] == "withdrawal"; });
    ASSERT_NE(withdrawal, undisturbed["phases"].end());
    const double began_s = (*withdrawal)["start_s"];
    for (const double after_s : {1.1, 1.7, 2.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << after_s);
      const double at_s = began_s + after_s;
      EXPECT_EQ(
          punctum(slow_injection({"--clock", "virtual", "--no-figure", "--no-frames", "--seed", seed, "--set",
                                  "sim.failure=[{device=\"camera\", kind=\"drop\", at_s=" +
                                      std::to_string(at_s) + ", for_s=" + std::to_string(kPause_s) + "}]"})),
          0)
          << said_;
      // The first picture may be looked at before all is settled.
      expect_everything_found(Table(fs::path(report()) / "obs.csv"), at_s + kPause_s + 0.1);
    }
  }
}

TEST_F(Programs, vision_goes_on_when_none_of_its_files_can_be_kept) {
  Running run({"run", "icsi", "--clock", "virtual", "--seconds", "8", "--no-figure", "--report", report()},
              words());
  Look look("icsi", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  ASSERT_GT(look.vision(), 1);
  let_no_file_grow(look.vision(), 3000);
  EXPECT_EQ(run.wait(), 1) << run.output();
  const std::string said = run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "time limit") << said;
  EXPECT_EQ(r["vision_restarts"].size(), 0U) << said;
  EXPECT_GT(r["observations"], 150) << said;
  EXPECT_EQ(r["stale_observations"], 0) << said;
  std::vector<std::string> files;
  for (const auto& n : r["not_kept"]) {
    files.push_back(n["file"]);
  }
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (Strings{"frames", "obs.csv"})) << said;
  EXPECT_LT(said.find("obs.csv is not kept from here on"), said.find("outcome")) << said;
  EXPECT_TRUE(read_all(fs::path(report()) / "obs.csv").ends_with('\n'));
  for (const auto& file : fs::recursive_directory_iterator(report())) {
    EXPECT_EQ(file.path().string().find(".part"), std::string::npos) << file.path();
  }
}

// ---- the surfaces ----

TEST_F(Programs, vision_puts_the_surfaces_of_both_membranes_into_the_station_only_if_the_scene_asks) {
  for (const bool asked : {true, false}) {
    Running run({"run", "icsi", "--clock", "virtual", "--seconds", "6", "--no-figure", "--report", report(),
                 "--set", asked ? "vision.surface=true" : "vision.surface=false"},
                words());
    Look look("icsi", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    const rt::ObservationSegment& seen = look.observation();
    EXPECT_EQ(run.wait(), 1) << run.output();
    rt::CellSurface surface;
    rt::Observation observation;
    std::uint64_t index = 0;
    ASSERT_EQ(seen.slot.newest(observation, index), hal::Read::ok);
    ASSERT_EQ(seen.surface.newest(surface, index) == hal::Read::ok, asked);
    if (!asked) {
      continue;
    }
    EXPECT_EQ(surface.frame, observation.frame);
    EXPECT_EQ(surface.exposure_ns, observation.exposure_ns);
    ASSERT_TRUE(surface.has(rt::CellSurface::outer_ok) && surface.has(rt::CellSurface::inner_ok));
    // The first control point is a pole, where the needle's axis meets the membrane; the last is the other.
    const hal::Vec3 centre(observation.centre_m), entry(observation.entry_m);
    const auto& control = surface.outer.control_m;
    EXPECT_NEAR(std::hypot(control[0][0] - entry.x(), control[0][1] - entry.y()), 0, 2e-6);
    EXPECT_NEAR(std::hypot(control[31][0] - centre.x(), control[31][1] - centre.y()), observation.R_m, 2e-6);
    double widest_m = 0;
    for (const auto& c : control) {
      widest_m = std::max(widest_m, c[4]);
    }
    EXPECT_NEAR(widest_m, observation.R_m, 2e-6);
    EXPECT_LT(surface.inner.control_m[15][4], surface.outer.control_m[15][4]);
  }
}

// ---- the outcome ----

TEST_F(Programs, a_time_limit_before_the_injection_is_called_a_time_limit) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--seconds", "9", "--set", "vision.method=truth",
                     "--set", "sim.operator.reaction_s=2"}),
            1)
      << said_;
  EXPECT_EQ(json()["outcome"], "time limit") << said_;
}

TEST_F(Programs, a_part_of_the_dose_is_not_done_and_the_report_tells_what_was_given_of_what_was_asked) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--set",
                     "injector.max_open_s=0.39"}),
            1)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "injected in part");
  EXPECT_NEAR(r["dose"]["asked_s"].get<double>(), 1.5, 0.01);  // sim.operator.dwell_s
  EXPECT_NEAR(r["dose"]["given_s"].get<double>(), 0.39, 0.01);
  EXPECT_EQ(r["cells"]["injected_in_part"], 1);
  EXPECT_NE(said_.find("0.39 s of 1.50 s"), std::string::npos) << said_;
}

}  // namespace
}  // namespace punctum::e2e
