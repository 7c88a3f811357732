// What happens to programs on a machine that is used by others: descriptors that are closed, a second run,
// kills and stops of any process at any time, garbage in the shared memory, files that may not grow. Whatever
// comes, every process ends, nothing is left behind, and the outcome is one that is defined.
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <random>
#include <thread>

#include "tests/support/descendants.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

const std::string kBin = PUNCTUM_BIN_DIR;
const std::string kPunctum = kBin + "/punctum";

class Survive : public Programs {
 protected:
  static void SetUpTestSuite() { reap_descendants(); }
  void TearDown() override {
    EXPECT_TRUE(nobody_is_left()) << "a process outlived its run";
    Programs::TearDown();
  }
  [[nodiscard]] Strings free_run(const Strings& more, const std::string& name = "r") const {
    Strings args{"run",         "free",    "--report", report(name), "--no-figure",
                 "--no-frames", "--quiet", "--set",    kPatientRelay};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }
  [[nodiscard]] std::string said(const std::string& name = "r") const { return read_all(words(name)); }
  [[nodiscard]] bool folder_is_free(const std::string& name = "r") const {
    const int folder = open(report(name).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool free = folder < 0 || flock(folder, LOCK_EX | LOCK_NB) == 0;
    close(folder);
    return free;
  }
};

// ---- descriptors ----

std::string target_of(pid_t pid, int fd) {
  std::error_code error;
  return fs::read_symlink("/proc/" + std::to_string(pid) + "/fd/" + std::to_string(fd), error).string();
}

TEST_F(Survive, with_standard_descriptors_closed_nothing_else_gets_their_numbers) {
  const auto close_all = [] {
    for (const int fd : {0, 1, 2}) {
      close(fd);
    }
  };
  Program run(kPunctum, free_run({"--seconds", "60"}), words(), close_all);
  Look look("free", run.pid());
  ASSERT_TRUE(look.until_started());
  for (const pid_t pid : {run.pid(), look.core()}) {
    for (const int fd : {0, 1, 2}) {
      const std::string target = target_of(pid, fd);
      EXPECT_TRUE(target == "/dev/null" || target.ends_with("core.log")) << pid << " " << fd << " " << target;
    }
  }
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0);
  EXPECT_EQ(json()["outcome"], "done");
}

TEST_F(Survive, whichever_of_the_standard_descriptors_is_closed_the_run_is_the_same) {
  for (const Strings& args : {Strings{"run"}, Strings{"explain"}}) {
    for (unsigned closed = 1; closed < 8; ++closed) {
      const auto close_some = [closed] {
        for (int fd = 0; fd < 3; ++fd) {
          if ((closed >> static_cast<unsigned>(fd) & 1U) != 0) {
            close(fd);
          }
        }
      };
      const std::string name = "r" + std::to_string(closed);
      const bool runs = args.front() == "run";
      Program run(
          kPunctum,
          runs ? free_run({"--clock", "virtual", "--seconds", "0.2"}, name) : Strings{"explain", "free"},
          words(name), close_some);
      EXPECT_EQ(run.wait(), 0) << closed;
      if (runs) {
        EXPECT_EQ(json(name)["outcome"], "done") << closed;
        EXPECT_TRUE(read_all(fs::path(report(name)) / "samples.csv").starts_with("t_s,")) << closed;
      }
    }
  }
}

// ---- one folder, one run; one station, one core ----

TEST_F(Survive, a_second_run_into_the_folder_of_a_running_one_is_refused_and_told_who_has_it) {
  Program first(kPunctum, free_run({"--seconds", "60"}), words("first"));
  Look look("free", first.pid());
  ASSERT_TRUE(look.until_started());
  const std::string scene = read_all(fs::path(report()) / "scene.toml");
  Program second(kPunctum, free_run({"--clock", "virtual", "--seconds", "0.1", "--seed", "7"}),
                 words("second"));
  EXPECT_EQ(second.wait(), 2);
  EXPECT_NE(said("second").find("(process " + std::to_string(first.pid()) + ")"), std::string::npos)
      << said("second");
  const std::string words_of_second = said("second");
  EXPECT_EQ(std::count(words_of_second.begin(), words_of_second.end(), '\n'), 1) << words_of_second;
  EXPECT_EQ(read_all(fs::path(report()) / "scene.toml"), scene);
  first.send(SIGINT);
  EXPECT_EQ(first.wait(), 0) << said("first");
  EXPECT_EQ(Table(fs::path(report()) / "samples.csv").rows.size(), json()["samples"]["rows"]);
  EXPECT_TRUE(folder_is_free());
}

TEST_F(Survive, the_folder_of_a_run_that_was_killed_is_free) {
  {
    Program run(kPunctum, free_run({"--seconds", "60"}), words());
    Look look("free", run.pid());
    ASSERT_TRUE(look.until_started());
    EXPECT_FALSE(folder_is_free());
    run.send(SIGKILL);
    EXPECT_EQ(run.wait(), -SIGKILL);
  }
  ASSERT_TRUE(nobody_is_left());
  EXPECT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1"}), 0) << said_;
}

TEST_F(Survive, the_core_runs_the_scene_of_its_parent_whatever_others_write_into_the_folder) {
  for (const char* name : {"a", "b", "c"}) {
    const std::jthread writer([this, name](const std::stop_token& over) {
      while (!over.stop_requested()) {
        if (fs::exists(fs::path(report(name)) / "scene.toml")) {
          std::ofstream(fs::path(report(name)) / "scene.toml") << "[nothing of the kind]\n";
        }
      }
    });
    Program run(kPunctum, free_run({"--clock", "virtual", "--seconds", "0.2"}, name), words(name));
    ASSERT_EQ(run.wait(), 0) << said(name);
    ASSERT_EQ(json(name)["outcome"], "done");
  }
}

// The descriptors of a run's segments: name of the segment and number.
std::map<std::string, int> segments_of(pid_t parent, const std::string& scene) {
  const std::string begin = "/memfd:punctum." + scene + "-" + std::to_string(parent) + ".";
  std::map<std::string, int> found;
  std::error_code error;
  for (const auto& file : fs::directory_iterator("/proc/" + std::to_string(parent) + "/fd", error)) {
    const std::string target = fs::read_symlink(file.path(), error).string();
    if (target.starts_with(begin)) {
      const std::string rest = target.substr(begin.size());
      found.emplace(rest.substr(0, rest.find(' ')), std::stoi(file.path().filename()));
    }
  }
  return found;
}

TEST_F(Survive, a_second_core_on_one_station_is_refused_in_one_line) {
  Program run(kPunctum, free_run({"--seconds", "60"}), words());
  Look look("free", run.pid());
  ASSERT_TRUE(look.until_started());
  std::string handed;
  std::vector<int> open_here;
  for (const auto& [name, number] : segments_of(run.pid(), "free")) {
    const std::string path = "/proc/" + std::to_string(run.pid()) + "/fd/" + std::to_string(number);
    open_here.push_back(open(path.c_str(), O_RDONLY));  // without O_CLOEXEC
    ASSERT_GE(open_here.back(), 0) << path;
    handed += (handed.empty() ? "" : ",") + name + "=" + std::to_string(open_here.back());
  }
  Program second(kBin + "/punctum-core", {"--scene", "free", "--segments", handed}, words("second"));
  EXPECT_EQ(second.wait(), 2);
  EXPECT_EQ(said("second"),
            "shared segment core: is already written by process " + std::to_string(look.core()) + "\n");
  for (const int fd : open_here) {
    close(fd);
  }
  EXPECT_TRUE(alive(look.core()));
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 0) << said();
}

// ---- the parent's watch over its children ----

TEST_F(Survive, a_core_that_hangs_before_its_first_tick_is_noticed) {
  for (int attempt = 0;; ++attempt) {
    ASSERT_LT(attempt, 20) << "it was never met before its first tick";
    Program run(kPunctum, free_run({"--seconds", "1"}), words());
    pid_t core = 0;
    while (core == 0 && alive(run.pid())) {
      core = child_named(run.pid(), "punctum-core");
    }
    kill(core, SIGSTOP);
    const int code = run.wait(60s);
    ASSERT_NE(code, Program::kHangs) << "nobody noticed";
    if (said().find("before its first tick") == std::string::npos) {
      continue;  // it ticked already
    }
    EXPECT_EQ(code, 3) << said();
    EXPECT_EQ(json()["outcome"], "core died");
    EXPECT_EQ(json()["ticks"], 0);
    return;
  }
}

TEST_F(Survive, every_signal_that_asks_the_run_to_end_ends_it_in_order_with_a_report) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    Program run(kPunctum, free_run({"--seconds", "60", "--overwrite"}), words());
    Look look("free", run.pid());
    ASSERT_TRUE(look.until_started());
    run.send(signal);
    EXPECT_EQ(run.wait(), 0) << signal << said();
    EXPECT_EQ(json()["outcome"], "done") << signal;
    EXPECT_LT(json()["seconds"].get<double>(), 59) << signal;  // not at its limit
  }
}

#ifdef PUNCTUM_WITH_VISION
TEST_F(Survive, vision_that_dies_at_every_start_is_started_six_times_and_no_more) {
  // Programs are looked for beside the parent: there stands one that dies at once.
  const fs::path bin = folder_ / "bin";
  fs::create_directories(bin);
  for (const char* name : {"punctum", "punctum-core"}) {
    fs::copy_file(fs::path(kBin) / name, bin / name);
  }
  const fs::path starts = folder_ / "starts";
  std::ofstream(bin / "punctum-vision") << "#!/bin/sh\necho once more >>" << starts.string() << "\nexit 1\n";
  fs::permissions(bin / "punctum-vision", fs::perms::owner_all);
  Program run(
      bin / "punctum",
      {"run", "icsi", "--seconds", "300", "--report", report(), "--no-figure", "--set", kPatientRelay},
      words());
  for (int i = 0; i < 6000 && said().find("are enough") == std::string::npos; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_NE(said().find("going on without it"), std::string::npos) << said();
  std::this_thread::sleep_for(1s);  // another start would come within this time
  const std::string lines = read_all(starts);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 6);
  EXPECT_TRUE(alive(run.pid()));
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 1) << said();
  EXPECT_EQ(json()["vision_restarts"].size(), 6U);  // the last is the one that was given up
}
#endif

TEST_F(Survive, an_early_stop_leaves_nothing_behind_at_whatever_moment_it_comes) {
  std::mt19937 random(20);
  int by_the_signal = 0, in_order = 0;
  for (int i = 0; i < 40; ++i) {
    Program run(kPunctum, free_run({"--seconds", "60"}), words());
    const pid_t pid = run.pid();
    const bool has_begun = i % 2 == 0;  // there is something to leave behind
    while (has_begun && !fs::exists(report()) && alive(pid)) {
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % (has_begun ? 5'000 : 200'000)));
    run.send(SIGTERM);
    const int code = run.wait(60s);
    ASSERT_TRUE((code == -SIGTERM && !has_begun) || code == 0 || code == 1 || code == 3) << code << said();
    ++(code == -SIGTERM ? by_the_signal : in_order);
    ASSERT_TRUE(nobody_is_left()) << said();
    EXPECT_TRUE(hal::Rendezvous::open("free-" + std::to_string(pid))) << "its socket is still there";
    EXPECT_TRUE(folder_is_free());
    fs::remove_all(report());
  }
  std::printf("ended by the signal %d, in order %d\n", by_the_signal, in_order);
}

// ---- files that may not grow ----

TEST_F(Survive, a_limit_on_the_size_of_files_is_a_write_error_and_not_the_end) {
  const auto limit = [](rlim_t bytes) {
    return [bytes] {
      const rlimit most{bytes, bytes};
      setrlimit(RLIMIT_FSIZE, &most);
    };
  };
  // The shared memory fits, the samples do not.
  Program run(kPunctum, free_run({"--clock", "virtual", "--seconds", "200"}, "small"), words("small"),
              limit(40U << 20));
  EXPECT_EQ(run.wait(), 1) << said("small");
  EXPECT_NE(said("small").find("samples.csv is not kept from here on: File too large"), std::string::npos)
      << said("small");
  EXPECT_LE(fs::file_size(fs::path(report("small")) / "samples.csv"), 40U << 20);
  EXPECT_EQ(json("small")["outcome"], "done");
  // Not even the shared memory fits: refused in one line before anything starts.
  Program none(kPunctum, free_run({"--clock", "virtual", "--seconds", "1"}, "none"), words("none"),
               limit(64U << 10));
  EXPECT_EQ(none.wait(), 2);
  const std::string words_of_none = said("none");
  EXPECT_EQ(std::count(words_of_none.begin(), words_of_none.end(), '\n'), 1) << words_of_none;
}

// ---- garbage in the shared memory ----

// A descriptor of another process, by the right to debug one's own child. -1: not allowed here.
int taken_from(pid_t pid, int number) {
  const int process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  const int taken = static_cast<int>(syscall(SYS_pidfd_getfd, process, number, 0));
  close(process);
  return taken;
}

// Writes random words into every segment of a run that its parent holds for writing.
class Scribbler {
 public:
  Scribbler(pid_t parent, const std::string& scene, unsigned seed) : random_(seed) {
    for (const auto& [name, number] : segments_of(parent, scene)) {
      const int fd = taken_from(parent, number);
      struct stat info = {};
      if (fd < 0 || (fcntl(fd, F_GETFL) & O_ACCMODE) != O_RDWR || fstat(fd, &info) != 0) {
        close(fd);
        continue;
      }
      const auto size = static_cast<std::size_t>(info.st_size);
      void* data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
      close(fd);
      if (data != MAP_FAILED) {
        maps_.push_back({static_cast<std::uint64_t*>(data), size / 8});
      }
    }
  }
  ~Scribbler() {
    for (const Map& map : maps_) {
      munmap(map.words, map.count * 8);
    }
  }
  Scribbler(const Scribbler&) = delete;
  Scribbler& operator=(const Scribbler&) = delete;

  [[nodiscard]] std::size_t segments() const { return maps_.size(); }
  // Half of the words go to the first page after the header, where the counters and the status are, half of
  // the values are small: enumerators, counts and indices just out of range.
  void scribble(int words) {
    for (int i = 0; i < words; ++i) {
      const Map& map = maps_[random_() % maps_.size()];
      const std::size_t most = random_() % 2 == 0 ? std::min<std::size_t>(map.count, 512) : map.count;
      const std::size_t at = 8 + random_() % (most - 8);
      const std::uint64_t value = random_() % 2 == 0 ? random_() % 300 : random_();
      std::atomic_ref(map.words[at]).store(value, std::memory_order_relaxed);
    }
  }

 private:
  struct Map {
    std::uint64_t* words;
    std::size_t count;
  };
  std::vector<Map> maps_;
  std::mt19937_64 random_;
};

TEST_F(Survive, garbage_in_every_segment_ends_no_reader_in_disorder) {
  int codes[4] = {};
  for (unsigned seed = 1; seed <= 6; ++seed) {
#ifdef PUNCTUM_WITH_VISION
    const std::string scene = seed % 2 == 0 ? "icsi" : "free";
#else
    const std::string scene = "free";
#endif
    Program run(kPunctum,
                {"run", scene, "--seconds", "60", "--report", report(), "--no-frames", "--no-figure",
                 "--clock", seed % 3 == 0 ? "virtual" : "real", "--set", kPatientRelay},
                words());
    Look look(scene, run.pid());
    ASSERT_TRUE(look.until_started()) << said();
    Scribbler scribbler(run.pid(), scene, seed);
    if (scribbler.segments() == 0) {
      run.send(SIGKILL);
      GTEST_SKIP() << "this machine lets no process take a descriptor from its child";
    }
    for (int i = 0; i < 100; ++i) {
      scribbler.scribble(seed < 4 ? 3 : 2000);
      std::this_thread::sleep_for(10ms);
    }
    run.send(SIGINT);
    const int code = run.wait(120s);
    ASSERT_TRUE(code == 0 || code == 1 || code == 3) << "seed " << seed << ", code " << code << "\n"
                                                     << said();
    ++codes[code];
    const auto r = json();
    ASSERT_TRUE(r.is_object() && r.contains("outcome")) << "seed " << seed << "\n" << said();
    ASSERT_TRUE(nobody_is_left()) << "seed " << seed;
    for (const char c : said()) {
      ASSERT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << "a control character, seed " << seed;
    }
  }
  std::printf("exit codes 0: %d, 1: %d, 3: %d\n", codes[0], codes[1], codes[3]);
}

// ---- a recording that goes silent ----

TEST_F(Survive, samples_that_stop_coming_while_the_core_ticks_are_told_at_once_and_in_the_report) {
  Program run(kPunctum, free_run({"--seconds", "60"}), words());
  Look look("free", run.pid());
  ASSERT_TRUE(look.until_started()) << said();
  const int fd = taken_from(run.pid(), segments_of(run.pid(), "free")["core"]);
  void* data = mmap(nullptr, sizeof(rt::CoreSegment), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (data == MAP_FAILED) {
    run.send(SIGKILL);
    GTEST_SKIP() << "this machine lets no process take a descriptor from its child";
  }
  // The ring's counter, its first word, leaps by a thousand rounds and one: what the recorder waits for comes
  // no more, until the core has gone round the whole ring, 8 s.
  auto& counter = *reinterpret_cast<hal::Word*>(&static_cast<rt::CoreSegment*>(data)->telemetry);
  constexpr std::uint64_t kLeap = 1000 * rt::TelemetryRing::kSize + 1;
  while (counter.load() < kLeap && alive(run.pid())) {  // again where the core wrote it at the same time
    counter.store(counter.load() + kLeap);
    std::this_thread::sleep_for(10ms);
  }
  munmap(data, sizeof(rt::CoreSegment));
  for (int i = 0; i < 2000 && said().find("the recording has a gap from") == std::string::npos; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_NE(said().find("the recording has a gap from"), std::string::npos) << said();
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 1) << said();
  EXPECT_EQ(json()["outcome"], "done");
  EXPECT_TRUE(json()["samples"].contains("silent_from_s"));
  EXPECT_NE(said().find("no samples came from"), std::string::npos) << said();
}

// ---- kills and stops ----

struct Attack {
  Strings args;
  std::string victim;
  int signal = 0;
  int after_ms = 0;
  int continue_after_ms = 0;  // of a stopped victim; 0: never

  [[nodiscard]] std::string text() const {
    std::string all;
    for (const auto& a : args) {
      all += a + " ";
    }
    return all + ": " + victim + " gets " + strsignal(signal) + " after " + std::to_string(after_ms) +
           " ms, goes on after " + std::to_string(continue_after_ms) + " ms";
  }
};

Attack random_attack(std::mt19937& random) {
  const auto one_of = [&random](auto... choices) {
    const std::common_type_t<decltype(choices)...> list[] = {choices...};
    return list[random() % sizeof...(choices)];
  };
  Attack a;
  const bool in_real_time = random() % 3 != 0;
#ifdef PUNCTUM_WITH_VISION
  const bool sees = random() % 2 == 0;
#else
  const bool sees = false;
#endif
  a.args = {sees ? "icsi" : "free", "--clock", in_real_time ? "real" : "virtual", "--seconds",
            in_real_time ? "2" : (sees ? "20" : "60")};
  if (sees && !in_real_time) {  // drawn and looked at, thirty seconds may take minutes
    a.args.insert(a.args.end(), {"--set", "vision.method=truth"});
  }
  a.victim = sees ? one_of("punctum", "punctum-core", "punctum-vision") : one_of("punctum", "punctum-core");
  a.signal = one_of(SIGKILL, SIGKILL, SIGSTOP, SIGSTOP, SIGTERM, SIGINT, SIGHUP, SIGQUIT);
  a.after_ms = static_cast<int>(random() % 1500);
  if (a.signal == SIGSTOP) {
    // The parent is the one who would notice; and virtual time waits long before it does.
    const bool goes_on = a.victim == "punctum" || !in_real_time || random() % 2 == 0;
    a.continue_after_ms = goes_on ? 1 + static_cast<int>(random() % 3000) : 0;
  }
  return a;
}

// PUNCTUM_KILLS runs with PUNCTUM_KILLS_SEED: toolchain/checks/kills.
TEST_F(Survive, whoever_is_killed_or_stopped_at_whatever_time_nothing_hangs_and_nothing_is_left) {
  const char* wanted = std::getenv("PUNCTUM_KILLS");
  const char* seed = std::getenv("PUNCTUM_KILLS_SEED");
  const int runs = wanted != nullptr ? std::atoi(wanted) : 10;
  std::mt19937 random(seed != nullptr ? static_cast<unsigned>(std::atoi(seed)) : 1);
  std::map<std::string, int> tally;
  int hits = 0;  // of a process that was there
  for (int i = 0; i < runs; ++i) {
    const Attack a = random_attack(random);
    Strings args{"run", "--report", report(), "--no-figure", "--no-frames", "--quiet"};
    args.insert(args.begin() + 1, a.args.begin(), a.args.end());
    fs::remove_all(report());
    Program run(kPunctum, args, words());
    const pid_t parent = run.pid();
    std::this_thread::sleep_for(std::chrono::milliseconds(a.after_ms));
    pid_t victim = a.victim == "punctum" ? parent : 0;
    for (int wait = 0; victim == 0 && wait < 1000 && alive(parent); ++wait) {  // it may not be there yet
      victim = child_named(parent, a.victim);
      std::this_thread::sleep_for(1ms);
    }
    if (victim > 0) {
      kill(victim, a.signal);
      ++hits;
    }
    if (victim > 0 && a.continue_after_ms > 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(a.continue_after_ms));
      kill(victim, SIGCONT);
    }
    const int code = run.wait(300s);
    const bool own = victim == parent && code == -a.signal;  // killed, or a signal before there was a handler
    EXPECT_TRUE(own || code == 0 || code == 1 || code == 3) << a.text() << ", code " << code << "\n"
                                                            << said();
    EXPECT_TRUE(nobody_is_left()) << a.text();
    EXPECT_TRUE(hal::Rendezvous::open(a.args.front() + "-" + std::to_string(parent))) << a.text();
    EXPECT_TRUE(folder_is_free()) << a.text();
    if (!own && said().find("before anything was started") == std::string::npos) {
      const auto r = json();
      EXPECT_TRUE(r.is_object() && r.contains("outcome")) << a.text() << "\n" << said();
      ++tally[r.is_object() ? r.value("outcome", "none") : "none"];
    } else {
      ++tally["no report: " + std::string(own ? "the parent was killed" : "stopped before the start")];
    }
    ASSERT_FALSE(HasFailure()) << "run " << i;
  }
  std::printf("%6d of %d runs were hit\n", hits, runs);
  for (const auto& [outcome, count] : tally) {
    std::printf("%6d  %s\n", count, outcome.c_str());
  }
}

}  // namespace
}  // namespace punctum::e2e
