// Whole runs: the programs as built, started as a person starts them.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "rt/forces/list.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// ---- scene `free`: core and parent only ----

TEST_F(Programs, free_ends_well_at_its_time_limit) {
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
  for (const char* file : {"scene.toml", "samples.csv", "report.json", "core.log"}) {
    EXPECT_TRUE(fs::exists(fs::path(report()) / file)) << file;
  }
  const Table t(fs::path(report()) / "samples.csv");
  EXPECT_EQ(t.rows.size(), r["ticks"]);
  EXPECT_EQ(t.text(0, "phase"), "free");
}

TEST_F(Programs, the_first_columns_of_samples_are_those_other_programs_rely_on) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
  const std::string csv = read_all(fs::path(report()) / "samples.csv");
  EXPECT_TRUE(
      csv.starts_with("t_s,phase,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,tip_x_m,tip_y_m,tip_z_m,cmd_x_m,cmd_y_m,"
                      "cmd_z_m,fx_N,fy_N,fz_N,"
                      "membrane_N,cone_N,axis_N,damping_N,guard_N,wd_m,a_m,R_m,obs_age_s,estop,fault"))
      << csv.substr(0, 300);
}

TEST_F(Programs, the_same_seed_gives_the_same_bytes_and_another_seed_others) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "4"}, "a"), 0) << said_;
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "4"}, "b"), 0) << said_;
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "3", "--seed", "5"}, "c"), 0) << said_;
  const std::string a = read_all(fs::path(report("a")) / "samples.csv");
  EXPECT_GT(a.size(), 100'000U);
  EXPECT_TRUE(a == read_all(fs::path(report("b")) / "samples.csv"));
  EXPECT_FALSE(a == read_all(fs::path(report("c")) / "samples.csv"));
}

TEST_F(Programs, the_resolved_scene_in_the_report_runs_again_to_the_same_bytes) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "2", "--set", "damping.B1_Ns_m=0.3",
                     "--set", "damping.B2_Ns_m=0.7"},
                    "a"),
            0)
      << said_;
  ASSERT_EQ(punctum({"run", report("a") + "/scene.toml"}, "b"), 0) << said_;
  EXPECT_TRUE(read_all(fs::path(report("a")) / "samples.csv") ==
              read_all(fs::path(report("b")) / "samples.csv"));
}

TEST_F(Programs, every_rate_runs_on_its_grid) {
  for (const char* rate : {"1000", "2000", "4000", "8000"}) {
    ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.5", "--rate", rate}), 0) << said_;
    const Table t(fs::path(report()) / "samples.csv");
    EXPECT_NEAR(t.number(1, "t_s") - t.number(0, "t_s"), 1 / std::atof(rate), 1e-9);
  }
}

TEST_F(Programs, a_run_that_may_last_long_is_recorded_thinner_and_says_so) {
  // At its time limit it would have a million and a half ticks; it is stopped long before.
  constexpr std::uint64_t kEnough = 60'000;
  Running run({"run", "free", "--clock", "virtual", "--seconds", "1500", "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  while (alive(run.pid()) && look.ticks() < kEnough) {
    std::this_thread::sleep_for(1ms);
  }
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << run.output();
  const auto r = json();
  EXPECT_GE(r["ticks"], kEnough);
  EXPECT_EQ(r["samples"]["every"], 3);
  EXPECT_NEAR(r["samples"]["rows"].get<double>(), r["ticks"].get<double>() / 3, 10);
  EXPECT_NE(run.output().find("one row for 3 ticks"), std::string::npos) << run.output();
  EXPECT_EQ(r["samples"]["lost"], 0);
}

TEST_F(Programs, two_runs_at_once_do_not_meet) {
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

TEST_F(Programs, a_folder_with_somebodys_own_files_is_no_report_folder) {
  fs::create_directories(fs::path(report()) / "frames");
  std::ofstream(fs::path(report()) / "frames" / "000012.png") << "a picture of theirs";
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 2);
  EXPECT_NE(said_.find("no run has written it"), std::string::npos) << said_;
  EXPECT_TRUE(fs::exists(fs::path(report()) / "frames" / "000012.png"));
}

TEST_F(Programs, frames_that_are_to_be_played_are_not_cleared_away) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
  const fs::path frames = fs::path(report()) / "frames";
  fs::create_directories(frames);
  std::ofstream(frames / "000000.png") << "a picture";
  EXPECT_EQ(punctum({"run", "recorded", "--seconds", "0.1", "--set", "camera.frames=" + frames.string()}), 2);
  EXPECT_NE(said_.find("the recorded frames come from there"), std::string::npos) << said_;
  EXPECT_TRUE(fs::exists(frames / "000000.png"));
}

TEST_F(Programs, output_that_nobody_takes_ends_no_run) {
  // Unbuffered, so that the very first word meets the full device. stdbuf preloads a library, which a
  // sanitized program takes amiss unless told not to.
  const std::string run = std::string("ASAN_OPTIONS=verify_asan_link_order=0 stdbuf -o0 ") + PUNCTUM_BIN_DIR +
                          "/punctum run free --clock virtual --seconds 1 --no-figure --report " + report() +
                          " >/dev/full 2>&1";
  EXPECT_EQ(WEXITSTATUS(std::system(run.c_str())), 0);
  EXPECT_EQ(json()["outcome"], "done");
}

TEST_F(Programs, a_scene_may_have_any_file_name) {
  for (const char* name : {"it's_mine.toml", "a b.toml", "caf\xe9.toml"}) {
    const fs::path file = folder_ / name;
    ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}, "plain"), 0);
    fs::copy_file(fs::path(report("plain")) / "scene.toml", file);
    Running run({"run", file.string(), "--clock", "virtual", "--seconds", "0.5", "--report", report("r"),
                 "--overwrite"},
                words());
    EXPECT_EQ(run.wait(), 0) << run.output();
    for (const char* left : {"figure.svg", "report.html"}) {
      EXPECT_TRUE(fs::exists(fs::path(report("r")) / left)) << run.output();
    }
  }
}

TEST_F(Programs, a_run_that_ends_well_leaves_the_drive_without_power) {
  Running run({"run", "free", "--clock", "virtual", "--seconds", "30", "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  EXPECT_EQ(run.wait(), 0) << run.output();
  expect_devices_off(look.bench());
}

// ---- the safety chain, under the virtual clock ----

TEST_F(Programs, a_pressed_emergency_stop_latches_and_the_run_ends_as_a_fault) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "sim.estop_press=[{at_s=1, for_s=0.5}]"}),
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
    if (t.number(i, "t_s") < 1.03) {
      continue;
    }
    ASSERT_EQ(t.number(i, "fx_N"), 0) << t.text(i, "t_s");
    ASSERT_EQ(t.text(i, "fault"), "estop");
  }
}

TEST_F(Programs, a_fault_leaves_its_last_seconds_at_full_rate_and_tells_its_events) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "8", "--samples-every", "10", "--set",
                     "sim.estop_press=[{at_s=5, for_s=0.5}]"}),
            3)
      << said_;
  const Table thin(fs::path(report()) / "samples.csv");
  const Table full(fs::path(report()) / "fault.csv");
  EXPECT_EQ(thin.column, full.column);
  ASSERT_GT(full.rows.size(), 2000U);
  std::size_t at = 0;
  while (at < full.rows.size() && full.text(at, "fault") == "none") {
    ++at;
  }
  ASSERT_LT(at, full.rows.size());
  EXPECT_NEAR(full.number(at, "t_s") - full.number(0, "t_s"), 2, 0.002);
  for (std::size_t i = 1; i < full.rows.size(); ++i) {
    ASSERT_NEAR(full.number(i, "t_s") - full.number(i - 1, "t_s"), 1e-3, 1e-9);
  }
  const auto events = json()["events"];
  const auto first = [&events](const char* what) {
    return std::find_if(events.begin(), events.end(), [what](const auto& e) { return e["event"] == what; });
  };
  ASSERT_NE(first("fault"), events.end());
  EXPECT_EQ((*first("fault"))["what"], "estop");
  EXPECT_NEAR((*first("fault"))["t_s"].get<double>(), full.number(at, "t_s"), 1e-9);
  EXPECT_EQ(events.back()["event"], "ended");
  EXPECT_EQ(events.back()["what"], "fault");
  EXPECT_EQ(json()["events_not_listed"], 0);
  // The next run into this folder has no fault, and no such file.
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
  EXPECT_FALSE(fs::exists(fs::path(report()) / "fault.csv"));
}

TEST_F(Programs, release_and_reset_clear_the_stop_and_the_run_goes_on) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "sim.estop_press=[{at_s=1, for_s=0.5, reset_after=true}]"}),
            3)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done after a fault") << "somebody should look into it";
  EXPECT_GT(r["seconds"], 3.5);
  ASSERT_EQ(r["faults"].size(), 1U);
  EXPECT_EQ(r["faults"][0]["name"], "estop");
}

TEST_F(Programs, the_operator_resets_a_station_whose_relay_has_opened) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "8", "--set",
                     "sim.failure=[{device=\"estop\", kind=\"drop\", at_s=1, for_s=0.1}]"}),
            3)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done after a fault");
  ASSERT_EQ(r["faults"].size(), 1U);
  EXPECT_EQ(r["faults"][0]["name"], "estop_lost");
}

TEST_F(Programs, a_lost_hand_stops_the_station) {
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "4", "--set",
                     "sim.failure=[{device=\"haptic\", kind=\"disconnect\", at_s=1}]"}),
            3)
      << said_;
  EXPECT_EQ(json()["outcome_detail"], "hand_lost");
}

// ---- what is refused ----

TEST_F(Programs, bad_input_is_refused_in_one_line_and_nothing_starts) {
  const std::vector<std::pair<Strings, std::string>> wrong = {
      {{"run", "icsy"}, "icsy: unknown scene (did you mean icsi?)"},
      {{"run", "free", "--rate", "3000"}, "--rate: 3000 is not one of the choices"},
      {{"run", "free", "--set", "damping.B1_Ns_m=-1"}, "--set: damping.B1_Ns_m: -1 is out of range"},
      {{"run", "free", "--set", "nonsense"}, "--set: nonsense: not an override"},
      {{"run", "free", "--seed", "abc"}, "--seed: \"abc\" is not a whole number"},
      {{"run", "free", "--seconds", "-3"}, "--seconds: "},
      {{"run", "free", "--seconds", "nan"}, "--seconds: nan: not a time limit"},
      {{"run", "free", "--seconds", "0"}, "--seconds: 0: not a time limit"},
      {{"run", "free", "--rate", "0"}, "--rate: 0 is not one of the choices"},
      {{"run", "free", "--seed", ""}, "--seed: "},
      {{"run", "free", "--samples-every", "-3"}, "--samples-every: "},
      {{"run", "free", "--samples-every", "0"}, "--samples-every: 0, allowed: from 1"},
      {{"run", "free", "--report", ""}, "--report: names no folder"},
      {{"run", "free", "--overwrite"}, "--overwrite: allowed with --report"},
      {{"run", "free", "--clock", "sundial"}, "--clock: "},
      {{"exprot", "a.mcap"}, "exprot: unknown command (did you mean export?)"},
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

TEST_F(Programs, a_report_folder_that_cannot_be_is_refused) {
  std::ofstream(folder_ / "file") << "x";
  Running run(
      {"run", "free", "--clock", "virtual", "--seconds", "1", "--report", (folder_ / "file").string()},
      words());
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.output().find("cannot be used as report folder"), std::string::npos) << run.output();
}

TEST_F(Programs, the_core_alone_refuses_what_it_cannot_run_with) {
  const auto core = [this](const std::string& args) {
    const int status = std::system(
        (std::string(PUNCTUM_BIN_DIR) + "/punctum-core " + args + " >" + words().string() + " 2>&1").c_str());
    said_ = read_all(words());
    return WEXITSTATUS(status);
  };
  EXPECT_EQ(core(""), 2);
  EXPECT_EQ(core("--scene free --segments core=77"), 2);
  EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  EXPECT_EQ(core("--scene"), 2);
  EXPECT_EQ(core("--wings 2"), 2);
}

TEST_F(Programs, every_program_tells_its_version_and_commit) {
  int programs = 0;
  for (const auto& entry : fs::directory_iterator(PUNCTUM_BIN_DIR)) {
    const std::string name = entry.path().filename().string();
    Running run({"--version"}, words(), name.c_str());
    EXPECT_EQ(run.wait(), 0) << name;
    EXPECT_TRUE(std::regex_match(
        run.output(), std::regex(name + " [0-9]+\\.[0-9]+ \\((unknown|[0-9a-f]{12}(\\+changes)?)\\)\n")))
        << run.output();
    ++programs;
  }
  EXPECT_GE(programs, 2);
}

// ---- explain and check ----

TEST_F(Programs, explain_says_what_runs_and_what_is_left_out) {
  ASSERT_EQ(punctum({"explain", "icsi"}), 0);
  for (const char* word : {"punctum-core", "punctum-vision", "SCHED_FIFO 80", "1000 Hz", "membrane",
                           "cone guide", "withdrawal axis", "damping", "256 points", "25 per s"}) {
    EXPECT_NE(said_.find(word), std::string::npos) << word;
  }
  ASSERT_EQ(punctum({"explain", "icsi", "--set", "vision.method=paper"}), 0);
  EXPECT_NE(said_.find("snake, 16 nodes"), std::string::npos);
  ASSERT_EQ(punctum({"explain", "free"}), 0);
  EXPECT_EQ(said_.find("punctum-vision"), std::string::npos);
  EXPECT_NE(said_.find("left out"), std::string::npos);
  EXPECT_NE(said_.find("no vision process"), std::string::npos);
  ASSERT_EQ(punctum({"explain", "free", "--keys"}), 0);
  EXPECT_NE(said_.find("a number from"), std::string::npos);
}

TEST_F(Programs, check_says_of_each_device_whether_it_is_there_and_devices_lists_those_that_are) {
  EXPECT_EQ(punctum({"check", "icsi"}), 0) << said_;
  EXPECT_NE(said_.find("ok   stage              simulated"), std::string::npos) << said_;
  // No machine has this chip.
  EXPECT_EQ(punctum({"check", "free", "--set", "gpiod=on", "--set", "estop.device=\"gpiod\"", "--set",
                     "gpiod.chip=\"/dev/none\"", "--set", "gpiod.contact_a=0", "--set", "gpiod.contact_b=1",
                     "--set", "gpiod.reset=2", "--set", "gpiod.heartbeat=3"}),
            2)
      << said_;
  EXPECT_NE(said_.find("FAIL estop              gpiod: /dev/none: "), std::string::npos) << said_;
  EXPECT_NE(said_.find("cannot run"), std::string::npos) << said_;
  EXPECT_EQ(punctum({"devices"}), 0) << said_;
  EXPECT_NE(said_.find("GPIO chips"), std::string::npos) << said_;
}

TEST_F(Programs, check_and_run_agree_about_a_processor_that_is_not_there) {
  const Strings elsewhere{"icsi",  "--clock",        "virtual", "--seconds",      "0.1",
                          "--set", "servo.cpu=1023", "--set",   "vision.cpu=1023"};
  Strings args{"check"};
  args.insert(args.end(), elsewhere.begin(), elsewhere.end());
  EXPECT_EQ(punctum(args), 0) << said_;
  EXPECT_NE(said_.find("note vision.cpu         CPU 1023 of "), std::string::npos) << said_;
  args.front() = "run";
  EXPECT_EQ(punctum(args), 1) << said_;
  EXPECT_EQ(json()["outcome"], "time limit") << said_;
}

TEST_F(Programs, check_finds_frames_that_are_not_there) {
  EXPECT_EQ(punctum({"check", "free"}), 0) << said_;
  EXPECT_EQ(punctum({"check", "recorded", "--set", "camera.frames=/nowhere"}), 2);
  EXPECT_NE(said_.find("FAIL files"), std::string::npos) << said_;
}

}  // namespace
}  // namespace punctum::e2e
