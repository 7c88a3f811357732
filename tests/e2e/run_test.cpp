// Whole runs: the programs as built, started as a person starts them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/e2e/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// ---- scene `free`: core and parent only ----

TEST_F(Programs, FreeEndsWellAtItsTimeLimit) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "5"}), 0) << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_EQ(r["missed"], 0);
  EXPECT_GE(r["ticks"], 5000);
  EXPECT_LT(r["ticks"], 7000);
  EXPECT_TRUE(r["faults"].empty());
  EXPECT_EQ(r["samples"]["lost"], 0);
  EXPECT_EQ(r["samples"]["gaps"], 0);
  // Damping takes energy from the hand and nothing else acts; the tip follows what the tremor filter lets
  // through.
  EXPECT_LT(r["tremor_ratio"], 0.3);
  EXPECT_GT(r["peak_hand_force_N"], 0);
  for (const char* file : {"scene.toml", "samples.csv", "report.json", "core.log"})
    EXPECT_TRUE(fs::exists(fs::path(report()) / file)) << file;
  const Table t(fs::path(report()) / "samples.csv");
  EXPECT_EQ(t.rows.size(), r["ticks"]);
  EXPECT_EQ(t.text(0, "phase"), "free");
}

TEST_F(Programs, TheFirstColumnsOfSamplesAreThoseOtherProgramsRelyOn) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
  const std::string csv = read_all(fs::path(report()) / "samples.csv");
  EXPECT_TRUE(
      csv.starts_with("t_s,phase,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,tip_x_m,tip_y_m,tip_z_m,cmd_x_m,cmd_y_m,"
                      "cmd_z_m,fx_N,fy_N,fz_N,"
                      "membrane_N,cone_N,axis_N,damping_N,guard_N,wd_m,a_m,R_m,obs_age_s,estop,fault"))
      << csv.substr(0, 300);
}

TEST_F(Programs, TheSameSeedGivesTheSameBytesAndAnotherSeedOthers) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "4"}, "a"), 0) << said_;
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "4"}, "b"), 0) << said_;
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "5"}, "c"), 0) << said_;
  const std::string a = read_all(fs::path(report("a")) / "samples.csv");
  EXPECT_GT(a.size(), 100'000U);
  EXPECT_TRUE(a == read_all(fs::path(report("b")) / "samples.csv"));
  EXPECT_FALSE(a == read_all(fs::path(report("c")) / "samples.csv"));
}

TEST_F(Programs, TheResolvedSceneInTheReportRunsAgainToTheSameBytes) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "2", "--set", "damping.B1_Ns_m=0.3",
                     "--set", "damping.B2_Ns_m=0.7"},
                    "a"),
            0)
      << said_;
  ASSERT_EQ(punctum({"run", report("a") + "/scene.toml"}, "b"), 0) << said_;
  EXPECT_TRUE(read_all(fs::path(report("a")) / "samples.csv") ==
              read_all(fs::path(report("b")) / "samples.csv"));
}

TEST_F(Programs, EveryRateRunsOnItsGrid) {
  for (const char* rate : {"1000", "2000", "4000", "8000"}) {
    ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.5", "--rate", rate}), 0) << said_;
    const Table t(fs::path(report()) / "samples.csv");
    EXPECT_NEAR(t.number(1, "t_s") - t.number(0, "t_s"), 1 / std::atof(rate), 1e-9);
  }
}

TEST_F(Programs, ALongRunIsRecordedThinnerAndSaysSo) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "1500"}), 0) << said_;
  const auto r = json();
  EXPECT_EQ(r["samples"]["every"], 3);
  EXPECT_NEAR(r["samples"]["rows"].get<double>(), r["ticks"].get<double>() / 3, 10);
  EXPECT_NE(said_.find("one row for 3 ticks"), std::string::npos) << said_;
  EXPECT_EQ(r["samples"]["lost"], 0);
}

TEST_F(Programs, TwoRunsAtOnceDoNotMeet) {
  const auto args = [this](const char* name, const char* seed) {
    return Strings{"run",    "free", "--clock",  "virtual",    "--seconds",   "20",
                   "--seed", seed,   "--report", report(name), "--no-figure", "--no-frames"};
  };
  Running a(args("a", "1"), words("a"));
  Running b(args("b", "1"), words("b"));
  EXPECT_EQ(a.wait(), 0) << a.output();
  EXPECT_EQ(b.wait(), 0) << b.output();
  EXPECT_TRUE(read_all(fs::path(report("a")) / "samples.csv") ==
              read_all(fs::path(report("b")) / "samples.csv"));
}

TEST_F(Programs, ASecondRunIntoTheSameFolderReplacesTheFirst) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "1"}), 0) << said_;
  std::ofstream(fs::path(report()) / "notes.txt") << "mine";
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.5"}), 0) << said_;
  EXPECT_LT(json()["seconds"], 0.8);
  EXPECT_EQ(read_all(fs::path(report()) / "notes.txt"), "mine");
}

TEST_F(Programs, AFolderWithSomebodysOwnFilesIsNoReportFolder) {
  fs::create_directories(fs::path(report()) / "frames");
  std::ofstream(fs::path(report()) / "frames" / "000012.png") << "a picture of theirs";
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 2);
  EXPECT_NE(said_.find("no run has written it"), std::string::npos) << said_;
  EXPECT_TRUE(fs::exists(fs::path(report()) / "frames" / "000012.png"));
}

TEST_F(Programs, FramesThatAreToBePlayedAreNotClearedAway) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
  const fs::path frames = fs::path(report()) / "frames";
  fs::create_directories(frames);
  std::ofstream(frames / "000000.png") << "a picture";
  EXPECT_EQ(punctum({"run", "recorded", "--seconds", "0.1", "--set", "camera.frames=" + frames.string()}), 2);
  EXPECT_NE(said_.find("the recorded frames come from there"), std::string::npos) << said_;
  EXPECT_TRUE(fs::exists(frames / "000000.png"));
}

TEST_F(Programs, OutputThatNobodyTakesEndsNoRun) {
  // Unbuffered, so that the very first word meets the full device. stdbuf preloads a library, which a
  // sanitized program takes amiss unless told not to.
  const std::string run = std::string("ASAN_OPTIONS=verify_asan_link_order=0 stdbuf -o0 ") + PUNCTUM_BIN_DIR +
                          "/punctum run free --clock virtual --seconds 1 --no-figure --report " + report() +
                          " >/dev/full 2>&1";
  EXPECT_EQ(WEXITSTATUS(std::system(run.c_str())), 0);
  EXPECT_EQ(json()["outcome"], "done");
}

TEST_F(Programs, ASceneMayHaveAnyFileName) {
  for (const char* name : {"it's_mine.toml", "a b.toml", "caf\xe9.toml"}) {
    const fs::path file = folder_ / name;
    ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}, "plain"), 0);
    fs::copy_file(fs::path(report("plain")) / "scene.toml", file);
    Running run({"run", file.string(), "--clock", "virtual", "--seconds", "0.5", "--report", report("r")},
                words());
    EXPECT_EQ(run.wait(), 0) << run.output();
    if (run.output().find("gnuplot is not installed") == std::string::npos) {
      EXPECT_TRUE(fs::exists(fs::path(report("r")) / "figure.png")) << run.output();
    }
  }
}

TEST_F(Programs, InRealTimeTheCoreKeepsItsGridWithoutFaultsOrAllocations) {
  ASSERT_EQ(punctum({"run", "free", "--seconds", "2"}), 0) << said_;
  const auto r = json();
  EXPECT_EQ(r["clock"], "real");
  EXPECT_NEAR(r["ticks"].get<double>() + r["missed"].get<double>(), 2100, 150);
  EXPECT_FALSE(r["rights"].empty());
  EXPECT_EQ(r["page_faults"]["major"], 0);
  if (!r["allocations"].is_null()) {
    EXPECT_EQ(r["allocations"], 0);
  }
}

TEST_F(Programs, CtrlCStopsCleanlyAndTheReportIsWritten) {
  Running run(
      {"run", "free", "--seconds", "60", "--set", "scene.cells=0", "--report", report(), "--no-figure"},
      words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  std::this_thread::sleep_for(300ms);
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << run.output();  // open-ended: the user ends it
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_LT(r["seconds"], 20);
  EXPECT_NE(run.output().find("stopping"), std::string::npos);
}

TEST_F(Programs, WhenTheCoreIsKilledTheDevicesGoToTheirSafeStateAndTheParentSaysSo) {
  Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure"}, words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  std::this_thread::sleep_for(500ms);
  ASSERT_GT(look.core(), 1);
  kill(look.core(), SIGKILL);
  EXPECT_EQ(run.wait(), 3) << run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "core died");
  EXPECT_TRUE(r["unattended"]["safe"]);
  EXPECT_LT(r["unattended"]["relay_opened_s"], 0.1);
  EXPECT_TRUE(r["page_faults"]["minor"].is_null());  // nobody counted them: not zero
  EXPECT_NE(run.output().find("the control core was killed by signal 9"), std::string::npos) << run.output();
}

TEST_F(Programs, WhenTheCoreHangsItIsNoticedAndTheDevicesGoToTheirSafeState) {
  Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure"}, words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  std::this_thread::sleep_for(500ms);
  ASSERT_GT(look.core(), 1);
  kill(look.core(), SIGSTOP);
  EXPECT_EQ(run.wait(), 3) << run.output();
  EXPECT_TRUE(json()["unattended"]["safe"]);
  EXPECT_NE(run.output().find("has not ticked"), std::string::npos) << run.output();
}

TEST_F(Programs, WhenTheParentIsKilledTheCoreStopsByItselfAndTheNextRunCleansUp) {
  pid_t core = 0;
  std::string station;
  {
    Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure"}, words());
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    core = look.core();
    station = "/dev/shm/punctum.free-" + std::to_string(run.pid()) + ".station";
    EXPECT_TRUE(fs::exists(station));
    run.send(SIGKILL);
    EXPECT_EQ(run.wait(), -SIGKILL);
  }
  for (int i = 0; i < 500 && alive(core); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(alive(core));
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}, "next"), 0) << said_;
  EXPECT_FALSE(fs::exists(station));
}

TEST_F(Programs, WhenTheParentIsKilledACoreThatHasStoppedAlreadyEndsToo) {
  pid_t core = 0;
  {
    Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure", "--set",
                 "failure=[{device=\"haptic\", kind=\"disconnect\", at_s=0.2}]"},
                words());
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    core = look.core();
    std::this_thread::sleep_for(1500ms);
    ASSERT_TRUE(alive(core));  // a reset could still clear it
    run.send(SIGKILL);
    EXPECT_EQ(run.wait(), -SIGKILL);
  }
  for (int i = 0; i < 500 && alive(core); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(alive(core));
  if (alive(core)) kill(core, SIGKILL);
}

// ---- the safety chain, under the virtual clock ----

TEST_F(Programs, APressedEmergencyStopLatchesAndTheRunEndsAsAFault) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "estop_press=[{at_s=1, for_s=0.5}]"}),
            3)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "fault");
  EXPECT_EQ(r["outcome_detail"], "estop");
  ASSERT_EQ(r["faults"].size(), 1U);
  EXPECT_NEAR(r["faults"][0]["t_s"].get<double>(), 1, 0.003);
  // Within the ramp the force is gone, and nothing moves it back when the button is released.
  const Table t(fs::path(report()) / "samples.csv");
  for (std::size_t i = 0; i < t.rows.size(); ++i) {
    if (t.number(i, "t_s") < 1.03) continue;
    ASSERT_EQ(t.number(i, "fx_N"), 0) << t.text(i, "t_s");
    ASSERT_EQ(t.text(i, "fault"), "estop");
  }
}

TEST_F(Programs, ReleaseAndResetClearTheStopAndTheRunGoesOn) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "estop_press=[{at_s=1, for_s=0.5, reset_after=true}]"}),
            0)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  ASSERT_EQ(r["faults"].size(), 1U);
  EXPECT_EQ(r["faults"][0]["name"], "estop");
}

TEST_F(Programs, ALostHandStopsTheStation) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "failure=[{device=\"haptic\", kind=\"disconnect\", at_s=1}]"}),
            3)
      << said_;
  EXPECT_EQ(json()["outcome_detail"], "hand_lost");
}

// ---- what is refused ----

TEST_F(Programs, BadInputIsRefusedInOneLineAndNothingStarts) {
  const std::vector<std::pair<Strings, std::string>> wrong = {
      {{"run", "icsy"}, "icsy: unknown scene (did you mean icsi?)"},
      {{"run", "free", "--rate", "3000"}, "--set: servo.rate_hz: 3000 is not one of the choices"},
      {{"run", "free", "--set", "damping.B1_Ns_m=-1"}, "--set: damping.B1_Ns_m: -1 is out of range"},
      {{"run", "free", "--set", "nonsense"}, "--set: nonsense: not an override"},
      {{"run", "free", "--seed", "abc"}, "--set: scene.seed: \"abc\" is not a whole number"},
      {{"run", "free", "--seconds", "-3"}, "--seconds: "},
      {{"run", "free", "--seconds", "nan"}, "--seconds: nan: not a time limit"},
      {{"run", "free", "--seconds", "0"}, "--seconds: 0: not a time limit"},
      {{"run", "free", "--rate", "0"}, "--set: servo.rate_hz: 0 is not one of the choices"},
      {{"run", "free", "--seed", ""}, "--set: scene.seed: "},
      {{"run", "free", "--samples-every", "-3"}, "--samples-every: "},
      {{"run", "free", "--clock", "sundial"}, "--clock: "},
      {{"run"}, "SCENE is required"},
      {{"dance"}, ""},
      {{"explain", "icsi", "--set", "cone.K=1"}, "--set: cone.K: unknown key (did you mean K_N_m?)"},
      {{"check", "/nowhere.toml"}, "/nowhere.toml: no such file"},
      {{"run", "recorded", "--set", "camera.frames=/nowhere"}, "camera.frames: /nowhere: nothing there"},
  };
  for (const auto& [args, message] : wrong) {
    Running run(args, words());
    EXPECT_EQ(run.wait(), 2) << args.back();
    const std::string said = run.output();
    EXPECT_NE(said.find(message), std::string::npos) << said;
    if (args.size() > 1) {
      EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    }
  }
}

TEST_F(Programs, AReportFolderThatCannotBeIsRefused) {
  std::ofstream(folder_ / "file") << "x";
  Running run(
      {"run", "free", "--clock", "virtual", "--seconds", "1", "--report", (folder_ / "file").string()},
      words());
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.output().find("cannot be used as report folder"), std::string::npos) << run.output();
}

TEST_F(Programs, TheCoreAloneRefusesWhatItCannotRunWith) {
  const auto core = [this](const std::string& args) {
    const int status = std::system(
        (std::string(PUNCTUM_BIN_DIR) + "/punctum-core " + args + " >" + words().string() + " 2>&1").c_str());
    said_ = read_all(words());
    return WEXITSTATUS(status);
  };
  EXPECT_EQ(core(""), 2);
  EXPECT_EQ(core("--scene free --station nobody.station --bench nobody.bench"), 2);
  EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  EXPECT_EQ(core("--scene"), 2);
  EXPECT_EQ(core("--wings 2"), 2);
}

// ---- explain and check ----

TEST_F(Programs, ExplainSaysWhatRunsAndWhatIsLeftOut) {
  ASSERT_EQ(punctum({"explain", "icsi"}), 0);
  for (const char* word : {"punctum-core", "punctum-vision", "SCHED_FIFO 80", "1000 Hz", "membrane",
                           "cone guide", "withdrawal axis", "damping", "snake", "25 per s"})
    EXPECT_NE(said_.find(word), std::string::npos) << word;
  ASSERT_EQ(punctum({"explain", "free"}), 0);
  EXPECT_EQ(said_.find("punctum-vision"), std::string::npos);
  EXPECT_NE(said_.find("left out"), std::string::npos);
  EXPECT_NE(said_.find("no vision process"), std::string::npos);
  ASSERT_EQ(punctum({"explain", "free", "--keys"}), 0);
  EXPECT_NE(said_.find("a number from"), std::string::npos);
}

TEST_F(Programs, CheckFindsFramesThatAreNotThere) {
  EXPECT_EQ(punctum({"check", "free"}), 0) << said_;
  EXPECT_EQ(punctum({"check", "recorded", "--set", "camera.frames=/nowhere"}), 2);
  EXPECT_NE(said_.find("FAIL files"), std::string::npos) << said_;
}

}  // namespace
}  // namespace punctum::e2e
