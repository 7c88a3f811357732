// Runs the built programs as a person would, and looks at what they leave behind.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "hal/sim/bench.hpp"
#include "rt/station/station.hpp"
#include "tools/shared/station_segments.hpp"

namespace punctum::e2e {

// For runs in real time that must end well although this machine may stall: beyond the relay's ordinary 50 ms
// without a heartbeat the drives lose their power, as they should.
inline constexpr const char* kPatientRelay = "sim.estop.relay_timeout_ms=1000";

namespace fs = std::filesystem;
using namespace std::chrono_literals;

inline std::string read_all(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A program that runs; its words go to a file.
class Running {
 public:
  Running(const std::vector<std::string>& args, fs::path output, const char* name = "punctum")
      : output_(std::move(output)) {
    pid_ = fork();
    if (pid_ == 0) {
      const int out = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      const int null = open("/dev/null", O_RDONLY);
      if (out < 0 || null < 0) {
        _exit(127);
      }
      dup2(null, 0);
      dup2(out, 1);
      dup2(out, 2);
      const std::string program = std::string(PUNCTUM_BIN_DIR) + "/" + name;
      std::vector<char*> argv{const_cast<char*>(program.c_str())};
      for (const auto& a : args) {
        argv.push_back(const_cast<char*>(a.c_str()));
      }
      argv.push_back(nullptr);
      execv(program.c_str(), argv.data());
      _exit(127);
    }
  }
  ~Running() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void send(int signal) const { kill(pid_, signal); }
  int wait() {  // exit code, or -signal
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  [[nodiscard]] std::string output() const { return read_all(output_); }

 private:
  fs::path output_;
  pid_t pid_ = -1;
};

// samples.csv by column.
struct Table {
  std::map<std::string, std::size_t> column;
  std::vector<std::vector<std::string>> rows;
  explicit Table(const fs::path& file) {
    std::ifstream in(file);
    std::string line;
    const auto split = [](const std::string& text) {
      std::vector<std::string> cells;
      std::string cell;
      std::istringstream s(text);
      while (std::getline(s, cell, ',')) {
        cells.push_back(cell);
      }
      return cells;
    };
    std::getline(in, line);
    for (const auto& name : split(line)) {
      column.emplace(name, column.size());
    }
    while (std::getline(in, line)) {
      rows.push_back(split(line));
    }
  }
  [[nodiscard]] const std::string& text(std::size_t row, const std::string& name) const {
    return rows.at(row).at(column.at(name));
  }
  [[nodiscard]] double number(std::size_t row, const std::string& name) const {
    return std::strtod(text(row, name).c_str(), nullptr);
  }
};

class Programs : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-e2e-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    if (!HasFailure()) {
      fs::remove_all(folder_);
    }
  }

  [[nodiscard]] std::string report(const std::string& name = "r") const { return (folder_ / name).string(); }
  [[nodiscard]] fs::path words(const std::string& name = "r") const { return folder_ / (name + ".txt"); }

  // Runs to the end. `args` after the command; the report goes to report(name), in place of an earlier one.
  int punctum(std::vector<std::string> args, const std::string& name = "r") {
    if (args.front() == "run") {
      args.insert(args.end(), {"--report", report(name), "--overwrite", "--no-figure", "--no-frames"});
    }
    Running running(args, words(name));
    const int code = running.wait();
    said_ = running.output();
    return code;
  }
  [[nodiscard]] nlohmann::json json(const std::string& name = "r") const {
    return nlohmann::json::parse(read_all(fs::path(report(name)) / "report.json"), nullptr, false);
  }
  static std::vector<std::string> phase_names(const nlohmann::json& report) {
    std::vector<std::string> names;
    for (const auto& p : report["phases"]) {
      names.push_back(p["name"]);
    }
    return names;
  }

  fs::path folder_;
  std::string said_;
};

// Looks into the segments of a run while it runs.
class Look {
 public:
  Look(const std::string& scene, const Running& running) : Look(scene, running.pid()) {}
  Look(const std::string& scene, pid_t parent) : name_(scene + "-" + std::to_string(parent)) {}

  // Waits until the core has come to a phase; false after 60 s.
  bool until(rt::Phase phase) {
    for (int i = 0; i < 6000; ++i, std::this_thread::sleep_for(10ms)) {
      if (!attach()) {
        continue;
      }
      const rt::CoreStatus& core = (*core_)->status;
      if (core.started.load() != 0 && core.phase.load() == static_cast<std::uint64_t>(phase)) {
        return true;
      }
    }
    return false;
  }
  bool until_started() { return until(rt::Phase::free); }
  [[nodiscard]] pid_t core() const { return static_cast<pid_t>((*core_)->status.pid.load()); }
  [[nodiscard]] std::uint64_t ticks() const { return (*core_)->status.ticks.load(); }
  // Of the newest tick. Missed ticks count here.
  [[nodiscard]] double t_s() const {
    const rt::CoreStatus& core = (*core_)->status;
    return static_cast<double>(core.tick_index.load() * core.period_ns.load()) * 1e-9;
  }
  [[nodiscard]] const sim::Bench& bench() const { return **bench_; }
  [[nodiscard]] const rt::ObservationSegment& observation() const { return **observation_; }
  [[nodiscard]] pid_t vision() const { return static_cast<pid_t>((*camera_)->pid.load()); }

 private:
  bool attach() {
    if (core_ && bench_ && camera_) {
      return true;
    }
    const auto station = hal::Joined::join(name_);
    if (!station) {
      return false;
    }
    const auto descriptor = [&station](const char* name) { return station->descriptor(name); };
    if (auto s = hal::Shared<const rt::CoreSegment>::attach(tools::kCoreSegment,
                                                            descriptor(tools::kCoreSegment))) {
      core_ = std::move(*s);
    }
    if (auto b =
            hal::Shared<const sim::Bench>::attach(tools::kBenchSegment, descriptor(tools::kBenchSegment))) {
      bench_ = std::move(*b);
    }
    if (auto c = hal::Shared<const sim::CameraAnswers>::attach(tools::kCameraSegment,
                                                               descriptor(tools::kCameraSegment))) {
      camera_ = std::move(*c);
    }
    if (auto o = hal::Shared<const rt::ObservationSegment>::attach(tools::kObservationSegment,
                                                                   descriptor(tools::kObservationSegment))) {
      observation_ = std::move(*o);
    }
    return core_ && bench_ && camera_;
  }
  std::string name_;
  std::optional<hal::Shared<const rt::CoreSegment>> core_;
  std::optional<hal::Shared<const sim::Bench>> bench_;
  std::optional<hal::Shared<const sim::CameraAnswers>> camera_;
  std::optional<hal::Shared<const rt::ObservationSegment>> observation_;
};

// What the core left of the simulated devices, by the bench's newest snapshot.
inline void expect_devices_off(const sim::Bench& bench) {
  sim::Snapshot last;
  std::uint64_t index = 0;
  ASSERT_EQ(bench.snapshots.newest(last, index), hal::Read::ok);
  EXPECT_EQ(hal::Vec3(last.hand.commanded_N).norm(), 0);
  EXPECT_EQ(last.injector.gate, 0U);
  EXPECT_EQ(last.stage.enable_line, 0);
}

// From now on no file that this process writes may grow beyond so many bytes. It takes the place of a full
// disk: a test may set it without rights, and the program sees the same, a write that fails.
inline void let_no_file_grow(pid_t pid, rlim_t bytes) {
  const rlimit limit{.rlim_cur = bytes, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(prlimit(pid, RLIMIT_FSIZE, &limit, nullptr), 0);
}

inline bool alive(pid_t pid) {
  const std::string stat = read_all("/proc/" + std::to_string(pid) + "/stat");
  const auto close = stat.rfind(')');
  return close != std::string::npos && stat.size() > close + 2 && stat[close + 2] != 'Z';
}

}  // namespace punctum::e2e
