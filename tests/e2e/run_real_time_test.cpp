// Runs in real time, one at a time: the core's grid and rights, and what happens when a program is ended,
// killed or stopped.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/mman.h>

#include <array>
#include <map>
#include <sstream>

#include "rt/forces/list.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

TEST_F(Programs, in_real_time_the_core_keeps_its_grid_without_faults_or_allocations) {
  ASSERT_EQ(punctum({"run", "free", "--seconds", "2", "--set", kPatientRelay}), 0) << said_;
  const auto r = json();
  EXPECT_EQ(r["clock"], "real");
  const double missed = r["missed"];
  EXPECT_NEAR(r["ticks"].get<double>() + missed, 2100, 50 + missed) << "a machine that stalls ends later";
  EXPECT_FALSE(r["rights"].empty());
  EXPECT_EQ(r["page_faults"]["major"], 0);
  if (!r["allocations"].is_null()) {
    EXPECT_EQ(r["allocations"], 0);
  }
}

TEST_F(Programs, a_running_core_has_no_rights_left_that_it_does_not_need) {
  Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  std::istringstream status(read_all("/proc/" + std::to_string(look.core()) + "/status"));
  std::map<std::string, std::string> says;
  for (std::string line; std::getline(status, line);) {
    std::istringstream words_of(line);
    std::string key, value;
    words_of >> key >> value;
    says[key] = value;
  }
  for (const char* set : {"CapInh:", "CapPrm:", "CapEff:", "CapAmb:"}) {
    EXPECT_EQ(says[set], "0000000000000000") << set;
  }
  EXPECT_EQ(says["NoNewPrivs:"], "1");
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << run.output();
}

TEST_F(Programs, ctrl_c_stops_cleanly_and_the_report_is_written) {
  Running run({"run", "free", "--seconds", "60", "--set", "scene.cells=0", "--set", kPatientRelay, "--report",
               report(), "--no-figure"},
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

// A terminal on which somebody pressed Ctrl-S takes no words: the stop does not wait for them, and Ctrl-Z,
// which would leave the needle to a core that nobody watches, does nothing.
TEST_F(Programs, a_halted_terminal_keeps_no_stop_waiting) {
  constexpr char kSuspend = '\x1a', kHalt = '\x13', kGoOn = '\x11';
  int master = -1;
  const pid_t pid = forkpty(&master, nullptr, nullptr, nullptr);
  if (pid == 0) {
    const std::string program = std::string(PUNCTUM_BIN_DIR) + "/punctum", folder = report();
    execl(program.c_str(), "punctum", "run", "free", "--seconds", "60", "--set", "scene.cells=0", "--set",
          kPatientRelay, "--no-figure", "--report", folder.c_str(), nullptr);
    _exit(127);
  }
  ASSERT_GT(pid, 0);
  const auto press = [master](char key) { ASSERT_EQ(write(master, &key, 1), 1); };
  const fs::path samples = fs::path(report()) / "samples.csv", told = fs::path(report()) / "report.json";
  const auto comes = [](const auto& what) {
    for (int i = 0; i < 2000; ++i) {
      if (what()) {
        return true;
      }
      std::this_thread::sleep_for(10ms);
    }
    return false;
  };
  std::string words;
  const auto listen = [&] {
    std::array<char, 4096> some{};
    pollfd ready{master, POLLIN, 0};
    while (poll(&ready, 1, 0) > 0) {
      const ssize_t n = read(master, some.data(), some.size());
      if (n <= 0) {
        return;
      }
      words.append(some.data(), static_cast<std::size_t>(n));
    }
  };
  EXPECT_TRUE(comes([&] {
    listen();
    return words.find("left") != std::string::npos;  // the line with the time that is left
  })) << words;
  press(kSuspend);
  press(kHalt);
  std::this_thread::sleep_for(500ms);
  const std::string before = read_all(samples);
  EXPECT_TRUE(comes([&] { return read_all(samples).size() > before.size(); })) << "suspended";
  kill(pid, SIGTERM);
  EXPECT_TRUE(comes([&] { return fs::exists(told); })) << "the stop waits for the terminal";
  press(kGoOn);
  int status = -1;
  EXPECT_TRUE(comes([&] {
    listen();
    return waitpid(pid, &status, WNOHANG) == pid;
  }));
  if (status == -1) {
    kill(pid, SIGKILL);
    waitpid(pid, &status, 0);
  }
  close(master);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status << words;
  EXPECT_EQ(json()["outcome"], "done");
  EXPECT_LT(json()["seconds"], 30);
}

TEST_F(Programs, a_core_that_is_told_three_times_to_end_leaves_its_devices_without_force_and_power) {
  Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  std::this_thread::sleep_for(500ms);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {  // different ones: none is lost in another
    kill(look.core(), signal);
  }
  (void)run.wait();
  EXPECT_NE(json()["outcome"], "core died") << run.output();
  expect_devices_off(look.bench());
}

TEST_F(Programs, every_signal_that_ends_a_program_stops_the_core_in_order) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGQUIT}) {
    Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(),
                 "--overwrite", "--no-figure"},
                words());
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    std::this_thread::sleep_for(300ms);
    kill(look.core(), signal);
    EXPECT_EQ(run.wait(), 0) << signal << run.output();
    EXPECT_EQ(json()["outcome"], "done") << signal;
    expect_devices_off(look.bench());
  }
}

TEST_F(Programs, when_the_core_is_killed_the_devices_go_to_their_safe_state_and_the_parent_says_so) {
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
  // Fewer than two seconds: all are kept. The tick in whose middle it was killed is counted, but has no row.
  const auto rows = static_cast<double>(Table(fs::path(report()) / "fault.csv").rows.size());
  EXPECT_NEAR(rows, r["ticks"].get<double>() - 0.5, 0.5);
  EXPECT_TRUE(r["events"].is_array());
  EXPECT_NE(run.output().find("the control core was killed by signal 9"), std::string::npos) << run.output();
}

TEST_F(Programs, when_the_core_hangs_it_is_noticed_and_the_devices_go_to_their_safe_state) {
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

TEST_F(Programs, when_the_parent_is_killed_the_core_stops_by_itself_and_nothing_is_left_of_the_station) {
  pid_t core = 0;
  std::string station;
  {
    Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure"}, words());
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    core = look.core();
    station = "free-" + std::to_string(run.pid());
    EXPECT_TRUE(hal::Joined::join(station));
    run.send(SIGKILL);
    EXPECT_EQ(run.wait(), -SIGKILL);
  }
  for (int i = 0; i < 500 && alive(core); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_FALSE(alive(core));
  EXPECT_FALSE(hal::Joined::join(station));
  EXPECT_TRUE(hal::Rendezvous::open(station)) << "its name is free again";
  for (const auto& file : fs::directory_iterator("/dev/shm")) {
    EXPECT_EQ(file.path().string().find(station), std::string::npos) << file.path();
  }
}

TEST_F(Programs, nobody_can_cut_off_the_memory_that_core_and_parent_share) {
  Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  int tried = 0;
  for (const auto& file : fs::directory_iterator("/proc/" + std::to_string(run.pid()) + "/fd")) {
    std::error_code error;
    if (fs::read_symlink(file.path(), error).string().find("punctum.") == std::string::npos) {
      continue;
    }
    ++tried;
    const int fd = open(file.path().c_str(), O_RDWR | O_CLOEXEC);
    EXPECT_NE(ftruncate(fd, 0), 0) << file.path();
    EXPECT_NE(ftruncate(fd, 1 << 30), 0) << file.path();
    close(fd);
  }
  EXPECT_GE(tried, 3);  // core, commands, bench
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(alive(run.pid()));
  EXPECT_TRUE(alive(look.core()));
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_EQ(json()["outcome"], "done");
}

TEST_F(Programs, when_the_parent_is_killed_a_core_that_has_stopped_already_ends_too) {
  pid_t core = 0;
  {
    Running run({"run", "free", "--seconds", "60", "--report", report(), "--no-figure", "--set",
                 "sim.failure=[{device=\"haptic\", kind=\"disconnect\", at_s=0.2}]"},
                words());
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    core = look.core();
    std::this_thread::sleep_for(1500ms);
    ASSERT_TRUE(alive(core));  // a reset could still clear it
    run.send(SIGKILL);
    EXPECT_EQ(run.wait(), -SIGKILL);
  }
  for (int i = 0; i < 500 && alive(core); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_FALSE(alive(core));
  if (alive(core)) {
    kill(core, SIGKILL);
  }
}

TEST_F(Programs, an_operator_beside_the_run_changes_gains_by_commands_that_the_report_tells) {
  Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  const auto joined = hal::Joined::join("free-" + std::to_string(run.pid()));
  ASSERT_TRUE(joined) << joined.error();
  const std::string name = tools::command_segment(rt::kConsole);
  {
    auto console = hal::Shared<rt::CommandSegment>::claim(name, joined->descriptor(name));
    ASSERT_TRUE(console) << console.error();
    EXPECT_FALSE(hal::Shared<rt::CommandSegment>::claim(name, joined->descriptor(name))) << "one at a time";
    EXPECT_TRUE((*console)->queue.try_push({rt::Command::force_scale, 0.5}));
    EXPECT_TRUE((*console)->queue.try_push({rt::Command::effect_gain, 0, rt::effect_damping}));
    EXPECT_TRUE((*console)->queue.try_push({rt::Command::effect_gain, 0, rt::effect_membrane}));
    for (const std::uint64_t ramped = look.ticks() + 1000; look.ticks() < ramped && alive(look.core());) {
      std::this_thread::sleep_for(10ms);
    }
    EXPECT_TRUE((*console)->queue.try_push({rt::Command::stop, 0}));
  }
  EXPECT_EQ(run.wait(), 0) << run.output();
  const auto r = json();
  std::vector<std::string> told;
  for (const auto& e : r["events"]) {
    if (e["event"] == "command" || e["event"] == "command_refused") {
      EXPECT_EQ(e["writer"], "console");
      told.push_back(e["event"].get<std::string>() + " " + e["what"].get<std::string>() +
                     (e.contains("target") ? " " + e["target"].get<std::string>() : ""));
    }
  }
  EXPECT_EQ(told, (Strings{"command force_scale", "command effect_gain damping",
                           "command_refused effect_gain membrane", "command stop"}));
  // Without damping, the only effect of this scene, there is no force.
  const Table t(fs::path(report()) / "samples.csv");
  std::size_t before_stop = t.rows.size() - 1;
  while (before_stop > 0 && t.number(before_stop, "stop") != 0) {
    --before_stop;
  }
  EXPECT_EQ(t.number(before_stop, "damping_N"), 0) << t.text(before_stop, "t_s");
}

TEST_F(Programs, whoever_joins_a_running_station_may_read_it_and_is_no_second_core) {
  Running run({"run", "free", "--seconds", "60", "--set", kPatientRelay, "--report", report(), "--no-figure"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  const std::string station = "free-" + std::to_string(run.pid());
  const auto joined = hal::Joined::join(station);
  ASSERT_TRUE(joined) << joined.error();
  const auto second =
      hal::Shared<rt::CoreSegment>::claim(tools::kCoreSegment, joined->descriptor(tools::kCoreSegment));
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().find("already written by process " + std::to_string(look.core())),
            std::string::npos)
      << second.error();
  for (const char* name : {tools::kCoreSegment, tools::kBenchSegment}) {
    EXPECT_EQ(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, joined->descriptor(name), 0),
              MAP_FAILED)
        << name;
  }
  EXPECT_EQ(joined->descriptor(tools::command_segment(rt::kParent)), -1) << "the parent's own";
  EXPECT_FALSE(hal::Rendezvous::open(station)) << "the name of a running station is taken";
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_EQ(json()["outcome"], "done");
}

}  // namespace
}  // namespace punctum::e2e
