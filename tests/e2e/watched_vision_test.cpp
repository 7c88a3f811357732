// Vision that hangs, is ended or sees nothing for a while, and what a run says of it, of the dose and of the
// needle at its end: the programs as built.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// ---- its health ----

// Waits for a vision process other than this one; 0 after 30 s.
pid_t other_vision(const Look& look, pid_t than) {
  for (int i = 0; i < 3000; ++i) {
    if (look.vision() != 0 && look.vision() != than) {
      return look.vision();
    }
    std::this_thread::sleep_for(10ms);
  }
  return 0;
}

TEST_F(Programs, vision_that_hangs_or_that_somebody_ends_is_started_again_and_the_run_says_so) {
  Running run({"run", "icsi", "--set", "vision.method=truth", "--set", kPatientRelay, "--report", report(),
               "--no-figure", "--no-frames"},
              words());
  Look look("icsi", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  const pid_t first = other_vision(look, 0);
  ASSERT_GT(first, 1) << run.output();
  kill(first, SIGTERM);
  ASSERT_GT(other_vision(look, first), 1) << run.output();
  ASSERT_TRUE(look.until(rt::Phase::indentation)) << run.output();
  const pid_t hung = look.vision();
  kill(hung, SIGSTOP);
  ASSERT_GT(other_vision(look, hung), 1) << run.output();
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 1) << run.output();
  EXPECT_NE(run.output().find("a signal asked it to stop"), std::string::npos) << run.output();
  EXPECT_NE(run.output().find("vision hung for"), std::string::npos) << run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "stopped");
  ASSERT_EQ(r["vision_restarts"].size(), 2U) << run.output();
  EXPECT_NE(r["vision_restarts"][1]["why"].get<std::string>().find("hung"), std::string::npos);
}

TEST_F(Programs, vision_finds_the_needle_again_after_seconds_without_a_frame_in_contact) {
  ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--seconds", "40", "--set",
                     "sim.failure=[{device=\"camera\", kind=\"drop\", at_s=6, for_s=3.5}]"}),
            0)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_LT(r["stale_s"], 3.5 + 1) << "as quickly as a vision that was started again";
  EXPECT_EQ(r["vision_restarts"].size(), 0U) << "a camera without frames is no vision that hangs";
}

TEST_F(Programs, vision_goes_on_when_none_of_its_files_can_be_kept) {
  Running run({"run", "icsi", "--clock", "virtual", "--seconds", "8", "--no-figure", "--report", report()},
              words());
  Look look("icsi", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  const rlimit limit{.rlim_cur = 3000, .rlim_max = RLIM_INFINITY};  // in place of a full disk
  ASSERT_GT(look.vision(), 1);
  ASSERT_EQ(prlimit(look.vision(), RLIMIT_FSIZE, &limit, nullptr), 0);
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

TEST_F(Programs, frames_that_show_nothing_most_of_the_time_are_no_run_that_is_done) {
  const fs::path frames = folder_ / "frames";
  fs::create_directory(frames);
  for (int i = 0; i < 60; ++i) {
    std::ofstream file(frames / (std::to_string(1000 + i) + ".pgm"), std::ios::binary);
    if (i < 5) {
      file << "P5 320 240 255\n" << std::string(std::size_t{320} * 240, static_cast<char>(120 + i));
    } else {
      file << "no picture";
    }
  }
  EXPECT_EQ(punctum({"run", "recorded", "--set", "camera.frames=" + frames.string(), "--set", kPatientRelay}),
            1)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "without vision") << said_;
  EXPECT_GT(r["without_vision_s"].get<double>(), 0.5 * r["seconds"].get<double>());
  EXPECT_EQ(r["vision_restarts"].size(), 0U) << "frames that cannot be read are no vision that hangs";
}

TEST_F(Programs, recorded_frames_that_end_while_a_fault_is_latched_end_the_run_with_the_fault) {
  const fs::path frames = folder_ / "frames";
  fs::create_directory(frames);
  for (int i = 0; i < 20; ++i) {
    std::ofstream(frames / (std::to_string(1000 + i) + ".pgm"), std::ios::binary)
        << "P5 320 240 255\n"
        << std::string(std::size_t{320} * 240, static_cast<char>(120 + i));
  }
  constexpr double kLimit_s = 30;  // a reset would be waited for until then
  EXPECT_EQ(punctum({"run", "recorded", "--seconds", std::to_string(kLimit_s), "--set",
                     "camera.frames=" + frames.string(), "--set", "camera.fps=20", "--set", kPatientRelay,
                     "--set", "sim.failure=[{device=\"haptic\", kind=\"disconnect\", at_s=0.3}]"}),
            3)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "fault") << said_;
  EXPECT_EQ(r["outcome_detail"], "hand_lost") << said_;
  EXPECT_LT(r["seconds"].get<double>(), kLimit_s) << said_;
}

TEST_F(Programs, ctrl_c_tells_that_the_needle_is_still_inside_the_cell) {
  Running run({"run", "icsi", "--set", "vision.method=truth", "--set", kPatientRelay, "--report", report(),
               "--no-figure", "--no-frames"},
              words());
  Look look("icsi", run);
  ASSERT_TRUE(look.until(rt::Phase::puncture)) << run.output();
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 1) << run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "stopped");
  EXPECT_EQ(r["needle_at_end"]["where"], "inside");
  EXPECT_EQ(r["needle_at_end"]["known_from"], "truth");
  sim::Snapshot last;
  std::uint64_t index = 0;
  ASSERT_EQ(look.bench().snapshots.newest(last, index), hal::Read::ok);
  EXPECT_NEAR(r["needle_at_end"]["depth_um"].get<double>(), last.cell_reading.depth_m * 1e6, 1);
  EXPECT_NE(run.output().find("INSIDE THE CELL"), std::string::npos) << run.output();
}

}  // namespace
}  // namespace punctum::e2e
