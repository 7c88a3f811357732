// Results of punctum-jitter: distributions by hand, differences between random measurements whose truth is
// known, machines made of files, and the loop itself for a moment.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "rt/station/station.hpp"
#include "tools/jitter/answer.hpp"
#include "tools/jitter/audit.hpp"
#include "tools/jitter/comparison.hpp"
#include "tools/jitter/difference.hpp"
#include "tools/jitter/load.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/jitter/picture.hpp"
#include "tools/jitter/result.hpp"
#include "tools/jitter/servo_tick.hpp"
#include "tools/shared/cause.hpp"
#include "tools/shared/station_segments.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum::jitter;
using namespace punctum::tools::late;

Distribution of(const std::vector<double>& us, std::size_t bins = 200) {
  Distribution d;
  d.count.resize(bins, 0);
  for (const double v : us) {
    if (v < static_cast<double>(bins)) {
      ++d.count[static_cast<std::size_t>(v)];
    } else {
      ++d.longer;
    }
    d.max_us = std::max(d.max_us, v);
  }
  return d;
}

TEST(Distribution, tells_quantiles_within_a_bin_of_the_sorted_values) {
  std::mt19937 random(4);
  std::lognormal_distribution<double> latency(2.5, 0.8);
  std::vector<double> us(5000);
  std::generate(us.begin(), us.end(), [&] { return latency(random); });
  const Distribution d = of(us, 100);
  std::sort(us.begin(), us.end());
  for (const double part : {0.01, 0.5, 0.9, 0.99}) {
    EXPECT_NEAR(d.quantile_us(part), us[static_cast<std::size_t>(part * 5000)], 1.0) << part;
  }
  ASSERT_GT(d.longer, 0U);
  EXPECT_EQ(d.quantile_us(1), us.back());
  EXPECT_EQ(d.entries(), 5000U);
  EXPECT_EQ(Distribution{}.quantile_us(0.5), 0);
}

TEST(Distribution, of_a_part_knows_no_maximum_of_another) {
  const Distribution first = of({3, 5, 250}, 100), both = of({3, 5, 250, 7, 130}, 100);
  Distribution part = since(first, both);
  EXPECT_EQ(part.entries(), 2U);
  EXPECT_EQ(part.longer, 1U);
  EXPECT_EQ(part.max_us, 100) << "it was longer than the bins, and nobody knows by how much";
  part = since(first, of({3, 5, 250, 7}, 100));
  EXPECT_EQ(part.max_us, 8);
  EXPECT_EQ(since(first, of({3, 5, 250, 310}, 100)).max_us, 310);
}

// Sixty parts whose latencies hang together: each has a level of its own, of which the next one keeps a
// share. tail_us is added to the latest 3 %.
Result measured(unsigned seed, double tail_us = 0, double all_us = 0, double kept = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> level(0, 1.5);
  std::exponential_distribution<double> latency(0.25);
  Result r;
  r.rate_Hz = 1000;
  double drift = level(random);
  for (int part = 0; part < 60; ++part) {
    drift = kept * drift + std::sqrt(1 - kept * kept) * level(random);
    const double here = 15 + std::abs(drift) + all_us;
    std::vector<double> us(1000);
    for (double& v : us) {
      const double late = latency(random);
      v = here + late + (late > 14 ? tail_us : 0);
    }
    r.parts.push_back(of(us));
  }
  return r;
}

#ifndef PUNCTUM_SANITIZED  // statistics of a hundred comparisons: minutes there
bool differs(const Result& a, const Result& b, double part) {
  const auto found = difference(a, b);
  EXPECT_TRUE(found) << found.error();
  return std::any_of(found->quantiles.begin(), found->quantiles.end(),
                     [part](const auto& q) { return q.differs && (part == 0 || q.part == part); });
}

TEST(Difference, is_rarely_seen_between_measurements_of_one_machine) {
  int wrong = 0;
  constexpr unsigned kPairs = 24;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    wrong += differs(measured(2 * pair + 1), measured(2 * pair + 2), 0) ? 1 : 0;
  }
  // 5 % are 1.2; more than 4 come by chance in one of 150.
  EXPECT_LE(wrong, 4);
}

TEST(Difference, is_rarely_seen_where_the_machine_has_its_moods) {
  int wrong = 0;
  constexpr unsigned kPairs = 24;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    wrong += differs(measured(2 * pair + 1, 0, 0, 0.7), measured(2 * pair + 2, 0, 0, 0.7), 0) ? 1 : 0;
  }
  EXPECT_LE(wrong, 4);
}

// Levels that wander on every time scale up to that of the whole: the halves of one measurement.
std::pair<Result, Result> halves_of_a_wandering_machine(unsigned seed, std::size_t parts) {
  std::mt19937 random(seed);
  std::normal_distribution<double> step(0, 1);
  std::exponential_distribution<double> latency(0.25);
  std::array<double, 5> drift{};
  const std::array<double, 5> scale{1, 4, 16, 64, 256};  // parts
  for (double& d : drift) {
    d = step(random);
  }
  std::pair<Result, Result> out;
  for (std::size_t part = 0; part < 2 * parts; ++part) {
    double level = 20;
    for (std::size_t i = 0; i < drift.size(); ++i) {
      const double kept = std::exp(-1 / scale[i]);
      drift[i] = kept * drift[i] + std::sqrt(1 - kept * kept) * step(random);
      level += drift[i];
    }
    std::vector<double> us(300);
    std::generate(us.begin(), us.end(), [&] { return std::max(level, 0.0) + latency(random); });
    (part < parts ? out.first : out.second).parts.push_back(of(us));
  }
  return out;
}

TEST(Difference, is_rarely_seen_between_the_halves_of_a_machine_that_wanders) {
  int wrong = 0;
  constexpr unsigned kPairs = 40;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = halves_of_a_wandering_machine(pair + 1, 30);
    wrong += differs(a, b, 0) ? 1 : 0;
  }
  // 5 % are 2; more than 5 come by chance in one of 70.
  EXPECT_LE(wrong, 5);
}

TEST(Difference, of_three_microseconds_in_the_tail_is_found_where_it_is) {
  int found = 0, elsewhere = 0;
  constexpr unsigned kPairs = 20;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    const Result a = measured(500 + pair), b = measured(700 + pair, 3);
    found += differs(a, b, 0.99) ? 1 : 0;
    elsewhere += differs(a, b, 0.5) ? 1 : 0;
  }
  EXPECT_GE(found, 19);
  EXPECT_LE(elsewhere, 2);
}
#endif

TEST(Difference, lies_in_its_interval) {
  const auto found = difference(measured(31), measured(32, 0, 5));
  ASSERT_TRUE(found);
  for (const QuantileDifference& q : found->quantiles) {
    EXPECT_LE(q.low_us, 5) << q.part;
    EXPECT_GE(q.high_us, 5) << q.part;
    EXPECT_TRUE(q.differs) << q.part;
  }
}

// In `stopped` of its parts the machine stood still, and each time the loop missed a thousand releases.
Result with_stops(unsigned seed, std::size_t stopped, std::uint64_t each = 1000) {
  Result r = measured(seed);
  r.missed_in_parts.assign(r.parts.size(), 0);
  for (std::size_t i = 0; i < stopped; ++i) {
    r.missed_in_parts[7 * i % r.parts.size()] = each;
    r.missed += each;
  }
  return r;
}

TEST(Difference, of_missed_releases_is_one_though_no_quantile_tells_it) {
  const Result still = with_stops(1, 0), stops = with_stops(1, 10);
  const auto found = difference(still, stops);
  ASSERT_TRUE(found);
  EXPECT_TRUE(std::none_of(found->quantiles.begin(), found->quantiles.end(),
                           [](const auto& q) { return q.differs; }));
  EXPECT_TRUE(found->missed.differs) << found->missed.chance;
  EXPECT_TRUE(found->any());
  const std::string text = difference_text(*found, still, stops);
  EXPECT_NE(text.find("10000"), std::string::npos) << text;
  EXPECT_NE(text.find("10 of 60 parts"), std::string::npos) << text;
  EXPECT_NE(text.find("they differ"), std::string::npos) << text;
}

TEST(Difference, of_missed_releases_counts_stops_and_not_releases) {
  // Two stops in one of two measurements come by chance in every second pair, however long they are.
  const auto found = difference(with_stops(1, 0), with_stops(1, 2, 100'000));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->missed.differs);
  EXPECT_NEAR(found->missed.chance, 0.5, 0.1);
  EXPECT_FALSE(difference(with_stops(1, 5), with_stops(1, 5))->missed.differs);
  EXPECT_EQ(difference(measured(1), with_stops(1, 10))->missed.chance, 1) << "one does not tell them";
}

TEST(Difference, of_a_quantile_that_no_wake_up_lies_beyond_is_not_told) {
  Result few = measured(1), many = measured(2, 0, 40);
  few.parts.resize(8);
  many.parts.resize(8);
  for (Distribution& part : few.parts) {
    part = of({10, 11, 12, 13, 14});
  }
  const auto found = difference(few, many);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->quantiles[0].told);
  EXPECT_FALSE(found->quantiles[2].told);
  EXPECT_FALSE(found->quantiles[2].differs);
}

TEST(Difference, needs_enough_parts) {
  Result few = measured(1);
  few.parts.resize(7);
  EXPECT_FALSE(difference(few, measured(2)));
  few.parts.resize(60);  // empty ones are none
  EXPECT_FALSE(difference(measured(2), few));
}

TEST(ResultFile, is_read_as_it_was_written) {
  Result r = measured(9);
  r.wake = of({1.5, 20, 20.5, 900});
  r.tick = of({0.5});
  r.ticks = 4;
  r.missed = 1;
  r.machine = "a \"machine\"";
  const auto again = result_of_json(json_of(r));
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(again->ticks, 4U);
  EXPECT_EQ(again->missed, 1U);
  EXPECT_EQ(again->machine, r.machine);
  EXPECT_EQ(again->wake.longer, 1U);
  EXPECT_EQ(again->wake.max_us, 900);
  EXPECT_EQ(again->wake.quantile_us(0.5), r.wake.quantile_us(0.5));
  ASSERT_EQ(again->parts.size(), r.parts.size());
  EXPECT_EQ(again->parts[7].quantile_us(0.9), r.parts[7].quantile_us(0.9));
}

TEST(ResultFile, tells_missed_releases_by_parts_or_not_at_all) {
  EXPECT_EQ(result_of_json(json_of(with_stops(1, 3)))->missed_in_parts, with_stops(1, 3).missed_in_parts);
  EXPECT_TRUE(result_of_json(json_of(measured(1)))->missed_in_parts.empty());
  nlohmann::json mixed = nlohmann::json::parse(json_of(measured(1)));
  mixed["parts"][3]["missed"] = 1;
  EXPECT_FALSE(result_of_json(mixed.dump()));
}

TEST(ResultFile, tells_a_quantile_only_where_a_wake_up_lies_beyond_it) {
  Result r = measured(1);
  r.wake = of(std::vector<double>(1000, 20));
  const nlohmann::json wake = nlohmann::json::parse(json_of(r))["wake_us"];
  EXPECT_TRUE(wake["p99_9"].is_number());
  EXPECT_TRUE(wake["p99_99"].is_null());
  EXPECT_TRUE(of(std::vector<double>(10, 20)).tells(0.9));
  EXPECT_FALSE(of(std::vector<double>(9, 20)).tells(0.9));
}

TEST(ResultFile, is_refused_with_one_line_that_says_where) {
  const nlohmann::json good = nlohmann::json::parse(json_of(measured(9)));
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return changed.dump();
  };
  for (const auto& [text, word] : std::vector<std::pair<std::string, std::string>>{
           {"", "no JSON at byte 1"},
           {"{\"kind\": \"punctum-jitter\"}", "key 'rate_Hz' not found"},
           {"[]", "no result"},
           {"{\"kind\": 3}", "type"},
           {with("/kind", "cyclictest"), "no result"},
           {with("/ticks", -1), "ticks"},
           {with("/rate_Hz", "fast"), "rate_Hz"},
           {with("/parts", 3), "parts"},
           {with("/parts/0/bins_us", nlohmann::json::array({3})), "bins_us"},
           {with("/wake_us/bins_us", {{1e9, 1}}), "bins_us"},
           {with("/wake_us/bins_us", {{1'000'000'000, 1}}), "bin 1000000000"},
           {with("/wake_us/max_us", -1), "max_us"}}) {
    const auto result = result_of_json(text);
    ASSERT_FALSE(result) << text.substr(0, 80);
    EXPECT_NE(result.error().find(word), std::string::npos) << result.error();
    EXPECT_EQ(result.error().find('\n'), std::string::npos) << result.error();
    EXPECT_EQ(result.error().find("exception"), std::string::npos) << result.error();
  }
}

TEST(Histogram, is_written_as_cyclictest_does) {
  EXPECT_EQ(histogram_text(of({1.5, 3.2, 3.9, 7}, 5)),
            "# Histogram\n000000 000000\n000001 000001\n000002 000000\n000003 000002\n000004 000000\n"
            "# Total: 000000003\n# Min Latencies: 00001\n# Avg Latencies: 00002\n# Max Latencies: 00007\n"
            "# Histogram Overflows: 00001\n");
}

TEST(Histogram, of_cyclictest_is_read_whole_or_refused) {
  const auto seen = read_histogram(
      "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000000 000000\n000011 000001\n000012 000040\n"
      "# Total: 000000041\n# Min Latencies: 00011\n# Avg Latencies: 00012\n# Max Latencies: 02312\n"
      "# Histogram Overflows: 00002\n# Histogram Overflow at cycle number:\n# Thread 0: 00162 00583\n");
  ASSERT_TRUE(seen) << seen.error();
  EXPECT_EQ(seen->entries(), 43U);
  EXPECT_EQ(seen->count[12], 40U);
  EXPECT_EQ(seen->max_us, 2312);
  for (const char* text : {"", "# Histogram\n", "000001\n", "a b\n", "000001 -3\n", "5000 1\n"}) {
    EXPECT_FALSE(read_histogram(text)) << text;
  }
}

TEST(TheLoad, ends_with_its_object_and_leaves_nobody_behind) {
  const auto children = [] {
    std::ifstream in("/proc/self/task/" + std::to_string(getpid()) + "/children");
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  ASSERT_EQ(children(), "");
  {
    const auto load = Load::start();
    ASSERT_TRUE(load) << load.error();
    EXPECT_NE(children(), "");
  }
  EXPECT_EQ(children(), "");
}

TEST(TheLoad, is_refused_where_there_is_no_disk_to_write_to) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before != nullptr ? before : "";
  ASSERT_EQ(setenv("TMPDIR", "/nonexistent", 1), 0);
  const auto load = Load::start();
  before != nullptr ? setenv("TMPDIR", kept.c_str(), 1) : unsetenv("TMPDIR");
  ASSERT_FALSE(load);
  EXPECT_NE(load.error().find("/nonexistent"), std::string::npos) << load.error();
}

// A cyclictest that never ends, found before another one.
TEST(Comparison, that_is_stopped_leaves_nobody_behind) {
  const fs::path folder = fs::temp_directory_path() / ("punctum_comparison_" + std::to_string(getpid()));
  fs::create_directories(folder / "tmp");
  const std::string began = (folder / "began").string();
  for (const char* program : {"cyclictest", "punctum-jitter"}) {
    std::ofstream(folder / program) << "#!/bin/sh\necho $$ >" + began + "\nexec sleep 1000\n";
    fs::permissions(folder / program, fs::perms::owner_all);
  }
  const pid_t comparing = fork();
  if (comparing == 0) {
    setenv("PATH", (folder.string() + ":" + std::getenv("PATH")).c_str(), 1);
    setenv("TMPDIR", (folder / "tmp").c_str(), 1);
    Wanted wanted;
    wanted.seconds = 60;
    _exit(compare_with_cyclictest(wanted, {}) ? 1 : 0);
  }
  pid_t child = 0;
  while (child == 0) {
    std::ifstream(began) >> child;
    usleep(1000);
  }
  (void)kill(comparing, SIGTERM);
  int status = 0;
  ASSERT_EQ(waitpid(comparing, &status, 0), comparing);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_NE(kill(child, 0), 0) << "its child goes on";
  EXPECT_TRUE(fs::is_empty(folder / "tmp"));
  fs::remove_all(folder);
}

// A machine made of files.
class FileMachine : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("punctum_jitter_test_" + std::to_string(getpid()));
    fs::remove_all(root_);
  }
  void TearDown() override { fs::remove_all(root_); }
  void file(const std::string& path, const std::string& text) const {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  [[nodiscard]] Finding finding(const std::string& name, int cpu = 3) const {
    for (const Finding& f : audit(cpu, 80, nullptr, {.root = root_.string()})) {
      if (f.name == name) {
        return f;
      }
    }
    ADD_FAILURE() << name;
    return {};
  }
  fs::path root_;
};

TEST_F(FileMachine, is_told_what_is_not_ready_and_what_mends_it) {
  file("proc/swaps", "Filename Type Size Used Priority\n/dev/sda2 partition 8 0 -2\n");
  file("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  file("proc/irq/default_smp_affinity", "00000001,0000000f\n");
  file("sys/devices/system/cpu/online", "0-63\n");
  EXPECT_NE(finding("no swap").remedy.find("swapoff"), std::string::npos);
  EXPECT_NE(finding("clock source").remedy.find("tsc"), std::string::npos);
  EXPECT_EQ(finding("clock source").mend.boot, "")
      << "the kernel has given it up, and no file may overrule that";
  file("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm \n");
  EXPECT_EQ(finding("clock source").mend.boot, "clocksource=tsc");
  EXPECT_NE(finding("interrupts elsewhere", 3).remedy.find("irqaffinity=0-2,4-63"), std::string::npos);
  EXPECT_NE(finding("interrupts elsewhere", 32).remedy, "");
  EXPECT_EQ(finding("interrupts elsewhere", 4).remedy, "");
  EXPECT_EQ(finding("interrupts elsewhere", 64).remedy, "");
  // Some are there already, or cannot be moved.
  file("proc/irq/24/effective_affinity_list", "4\n");
  file("proc/irq/24/eth0-rx/x", "");
  file("proc/irq/25/effective_affinity_list", "4\n");  // nobody handles it
  file("proc/irq/26/effective_affinity_list", "3\n");
  file("proc/irq/26/eth0-tx/x", "");
  const Finding served = finding("interrupts elsewhere", 4);
  EXPECT_NE(served.found.find("CPU 4 serves 24 (eth0-rx)"), std::string::npos) << served.found;
  EXPECT_NE(served.remedy.find("echo 0-3,5-63 > /proc/irq/NUMBER/smp_affinity_list"), std::string::npos)
      << served.remedy;
  EXPECT_NE(finding("interrupts elsewhere", -1).remedy, "");
}

TEST_F(FileMachine, keeps_interrupts_from_other_isolated_cpus_too) {
  file("proc/irq/default_smp_affinity", "f\n");
  file("sys/devices/system/cpu/online", "0-3\n");
  file("sys/devices/system/cpu/isolated", "2-3\n");
  EXPECT_EQ(finding("interrupts elsewhere", 3).mend.boot, "irqaffinity=0-1");
  file("sys/devices/system/cpu/isolated", "0-2\n");
  EXPECT_EQ(finding("interrupts elsewhere", 3).mend.boot, "irqaffinity=0-2") << "none else is left";
}

TEST_F(FileMachine, does_not_switch_off_the_cpu_of_the_loop) {
  file("sys/devices/system/cpu/online", "0-3\n");
  file("sys/devices/system/cpu/smt/active", "1\n");
  file("sys/devices/system/cpu/cpu2/topology/thread_siblings_list", "2-3\n");
  file("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "2-3\n");
  EXPECT_NE(finding("first thread of a core", 3).remedy.find("--cpu 2"), std::string::npos);
  EXPECT_EQ(plan(audit(3, 80, nullptr, {.root = root_.string()}))["boot-line"].find("nosmt"),
            std::string::npos);
  const std::vector<Finding> of_first = audit(2, 80, nullptr, {.root = root_.string()});
  EXPECT_TRUE(std::none_of(of_first.begin(), of_first.end(),
                           [](const Finding& f) { return f.name == "first thread of a core"; }));
}

TEST_F(FileMachine, has_no_plan_for_a_cpu_that_is_not_there) {
  file("proc/irq/default_smp_affinity", "ff\n");
  file("sys/devices/system/cpu/online", "0-3\n");
  const Finding affinity = finding("CPU affinity", 7);
  EXPECT_TRUE(affinity.required);
  EXPECT_NE(affinity.found.find("CPU 7"), std::string::npos) << affinity.found;
  EXPECT_NE(affinity.remedy.find("0-3"), std::string::npos) << affinity.remedy;
  EXPECT_EQ(plan(audit(7, 80, nullptr, {.root = root_.string()}))["boot-line"].find("cpus="),
            std::string::npos);
}

TEST_F(FileMachine, keeps_the_timer_tick_from_the_loop) {
  file("sys/devices/system/cpu/online", "0-3\n");
  EXPECT_EQ(finding("no timer tick").remedy, "") << "a kernel without it";
  file("sys/devices/system/cpu/nohz_full", "(null)\n");
  file("proc/cmdline", "quiet\n");
  EXPECT_NE(finding("no timer tick").mend.boot.find("nohz_full=3 rcu_nocbs=3"), std::string::npos);
  file("sys/devices/system/cpu/nohz_full", "2-3\n");
  EXPECT_EQ(finding("no timer tick").remedy, "");
  EXPECT_NE(finding("no timer tick", 1).remedy, "");
}

TEST_F(FileMachine, isolates_what_its_boot_line_isolates_already_too) {
  file("sys/devices/system/cpu/online", "0-3\n");
  file("sys/devices/system/cpu/isolated", "2\n");
  file("sys/devices/system/cpu/nohz_full", "2\n");
  file("proc/cmdline", "quiet isolcpus=managed_irq,domain,2 nohz_full=2\n");
  EXPECT_EQ(finding("no timer tick").mend.boot, "") << "a second isolcpus= would be ignored";
  EXPECT_NE(
      finding("no timer tick")
          .remedy.find("isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1 in place "
                       "of isolcpus=managed_irq,domain,2 nohz_full=2"),
      std::string::npos)
      << finding("no timer tick").remedy;
  file("etc/default/grub.d/punctum.cfg",
       "GRUB_CMDLINE_LINUX=\"$GRUB_CMDLINE_LINUX isolcpus=managed_irq,domain,2 nohz_full=2\"\n");
  EXPECT_NE(finding("no timer tick").mend.boot.find("nohz_full=2-3"), std::string::npos) << "the plan's own";
}

TEST_F(FileMachine, does_not_isolate_the_cpu_that_it_boots_on) {
  file("sys/devices/system/cpu/online", "0-3\n");
  file("sys/devices/system/cpu/nohz_full", "(null)\n");
  file("proc/irq/default_smp_affinity", "f\n");
  for (const char* name : {"no timer tick", "interrupts elsewhere"}) {
    EXPECT_NE(finding(name, 0).remedy.find("take another one"), std::string::npos) << finding(name, 0).remedy;
    EXPECT_EQ(finding(name, 0).mend.boot, "");
  }
}

TEST_F(FileMachine, sends_nothing_to_a_thread_that_its_plan_switches_off) {
  file("sys/devices/system/cpu/online", "0-3\n");
  file("sys/devices/system/cpu/smt/active", "1\n");
  file("proc/irq/default_smp_affinity", "f\n");
  for (const int cpu : {0, 1, 2, 3}) {
    file("sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/topology/thread_siblings_list",
         cpu < 2 ? "0-1\n" : "2-3\n");
  }
  EXPECT_EQ(finding("interrupts elsewhere", 2).mend.boot, "irqaffinity=0");
  file("sys/devices/system/cpu/online", "0-1\n");
  EXPECT_EQ(finding("interrupts elsewhere", 0).mend.boot, "") << "one core";
  EXPECT_NE(finding("interrupts elsewhere", 0).found.find("no other CPU"), std::string::npos);
}

TEST_F(FileMachine, keeps_what_an_earlier_plan_has_mended) {
  file("proc/swaps", "Filename\n/dev/sda2\n");
  file("sys/devices/system/cpu/online", "0-3\n");
  file("proc/irq/default_smp_affinity", "f\n");
  std::vector<Finding> first = audit(3, 80, nullptr, {.root = root_.string()});
  first.push_back(finding_of({.name = "isolated CPU", .remedy = "by hand"}, 3, "0-2", root_.string()));
  first.push_back(finding_of({.name = "SCHED_FIFO priority", .remedy = "by hand"}, 3, "0-2"));
  first.push_back(finding_of({.name = "CPU sleep held off", .remedy = "by hand"}, 3, "0-2"));
  ASSERT_TRUE(write_plan(plan(first, root_.string()), (root_ / "plan").string()));
  fs::copy(root_ / "plan/etc", root_ / "etc", fs::copy_options::recursive);
  // All of it was done, and another thing is found.
  Finding other;
  other.name = "SMT";
  other.remedy = "by files";
  other.mend = {
      .boot = "nosmt irqaffinity=0-1", .command = "true", .udev = "RULE", .limits = "@punctum - nice -1"};
  const auto files = plan({other}, root_.string());
  const std::string& boot = files.at("boot-line");
  for (const char* word : {"nosmt", "isolcpus=managed_irq,domain,3", "nohz_full=3", "irqaffinity=0-1"}) {
    EXPECT_NE(boot.find(word), std::string::npos) << boot;
  }
  EXPECT_EQ(boot.find("irqaffinity"), boot.rfind("irqaffinity")) << boot;
  for (const char* line : {"\nswapoff -a || failed=1\n", "\ntrue || failed=1\n"}) {
    EXPECT_NE(files.at("etc/punctum/machine").find(line), std::string::npos) << line;
  }
  EXPECT_NE(files.at("etc/udev/rules.d/61-punctum-machine.rules").find("cpu_dma_latency"), std::string::npos);
  EXPECT_NE(files.at("etc/security/limits.d/punctum.conf").find("rtprio"), std::string::npos);
}

TEST_F(FileMachine, that_shows_no_cpus_is_not_taken_for_one_of_a_single_cpu) {
  EXPECT_NE(finding("CPUs").remedy, "");
}

TEST_F(FileMachine, that_is_ready_needs_nothing) {
  file("proc/swaps", "Filename Type Size Used Priority\n");
  file("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  file("proc/irq/default_smp_affinity", "07\n");
  for (const char* name : {"no swap", "clock source", "interrupts elsewhere"}) {
    EXPECT_EQ(finding(name).remedy, "") << name;
  }
}

std::string output_of(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string out;
  for (int c = 0; pipe != nullptr && (c = std::fgetc(pipe)) != EOF;) {
    out += static_cast<char>(c);
  }
  EXPECT_EQ(pclose(pipe), 0) << command;
  return out;
}

// A Falcon and a camera on one USB controller, a CAN card, GPIO lines without an interrupt.
class FilesOfDevices : public FileMachine {
 protected:
  void SetUp() override {
    FileMachine::SetUp();
    file("sys/devices/system/cpu/online", "0-3\n");
    const std::string usb = "sys/devices/pci0000:00/0000:00:14.0/usb1/";
    file("sys/devices/pci0000:00/0000:00:14.0/irq", "16\n");
    file("sys/devices/pci0000:00/0000:00:14.0/msi_irqs/126", "msi\n");
    file(usb + "1-1/idVendor", "0403\n");
    file(usb + "1-1/idProduct", "cb48\n");
    file(usb + "1-2/video4linux/video0/name", "a camera\n");
    link("sys/bus/usb/devices/1-1", usb + "1-1");
    link("sys/class/video4linux/video0", usb + "1-2/video4linux/video0");
    link(usb + "1-2/video4linux/video0/device", usb + "1-2");
    file("sys/devices/pci0000:00/0000:00:05.0/irq", "11\n");
    file("sys/devices/pci0000:00/0000:00:05.0/net/can0/type", "280\n");
    link("sys/class/net/can0", "sys/devices/pci0000:00/0000:00:05.0/net/can0");
    file("sys/devices/platform/gpio-sim.0/gpiochip0/uevent", "\n");
    link("sys/bus/gpio/devices/gpiochip0", "sys/devices/platform/gpio-sim.0/gpiochip0");
    file("proc/irq/126/smp_affinity_list", "0-3\n");
    file("proc/irq/126/xhci_hcd/nothing", "");
    file("proc/irq/11/smp_affinity_list", "0-2\n");
    file("proc/irq/11/can0/nothing", "");
    file("proc/irq/16/smp_affinity_list", "0-3\n");
    file("proc/irq/16/ahci/nothing", "");
    thread(77, "irq/126-xhci_hcd", 50, 1);
    thread(78, "irq/11-can0", 85, 1);
  }
  void link(const std::string& at, const std::string& to) const {
    fs::create_directories((root_ / at).parent_path());
    fs::create_directory_symlink(root_ / to, root_ / at);
  }
  void thread(int pid, const std::string& comm, int priority, int policy) const {
    std::string stat = std::to_string(pid) + " (" + comm + ") S";
    for (int field = 4; field < 40; ++field) {
      stat += " 0";
    }
    file("proc/" + std::to_string(pid) + "/comm", comm + "\n");
    file("proc/" + std::to_string(pid) + "/stat",
         stat + " " + std::to_string(priority) + " " + std::to_string(policy) + " 0\n");
  }
  [[nodiscard]] std::vector<Finding> found(const std::string& scene, int cpu = 3) const {
    const auto loaded = punctum::tools::load_scene(scene);
    EXPECT_TRUE(loaded);
    return audit(cpu, 80, &*loaded, {.root = root_.string(), .coalescing = [](const std::string& interface) {
                                       return interface == "eth0"
                                                  ? std::optional(Coalescing{.rx_us = 50, .adaptive = true})
                                                  : std::nullopt;
                                     }});
  }
  [[nodiscard]] static Finding named(const std::vector<Finding>& findings, const std::string& begin) {
    const auto at = std::find_if(findings.begin(), findings.end(),
                                 [&](const Finding& f) { return f.name.starts_with(begin); });
    EXPECT_NE(at, findings.end()) << begin;
    return at != findings.end() ? *at : Finding{};
  }
};

TEST_F(FilesOfDevices, are_audited_by_the_interrupts_that_serve_them) {
  const std::vector<Finding> findings = found("loopback");
  const Finding usb = named(findings, "irq 126 xhci_hcd");
  EXPECT_NE(usb.found.find("falcon"), std::string::npos) << usb.found;
  EXPECT_NE(usb.found.find("camera"), std::string::npos) << usb.found;
  EXPECT_NE(usb.found.find("SCHED_FIFO 50"), std::string::npos) << usb.found;
  EXPECT_NE(usb.remedy.find("echo 0-2 > /proc/irq/126/smp_affinity_list"), std::string::npos) << usb.remedy;
  EXPECT_NE(usb.remedy.find("chrt -f -p 85"), std::string::npos) << usb.remedy;
  EXPECT_EQ(usb.mend.command.find("126"), std::string::npos) << "another number after the next boot";
  EXPECT_EQ(named(findings, "irq 11 can0").remedy, "");
  EXPECT_NE(named(findings, "estop").found.find("no interrupt"), std::string::npos);
  EXPECT_EQ(std::count_if(findings.begin(), findings.end(),
                          [](const Finding& f) { return f.name.starts_with("irq "); }),
            2);
}

// The kernel cuts a thread's name: with another number, another part of it is left. In place of /proc and
// chrt, files and a word.
TEST_F(FilesOfDevices, are_found_by_a_shell_after_their_numbers_changed) {
  std::string command = named(found("loopback"), "irq 126 xhci_hcd").mend.command;
  command = command.substr(command.find("ok=false"));
  for (std::size_t at = 0; (at = command.find("/proc/", at)) != std::string::npos;
       at += root_.string().size() + 6) {
    command.insert(at, root_.string());
  }
  // Of the path, so much stands before the number.
  command.replace(command.find("cut -d/ -f3"), 11, "rev | cut -d/ -f2 | rev");
  command.replace(command.find("chrt"), 4, "echo");
  file("proc/irq/1128/xhci_hcd/nothing", "");
  thread(79, "irq/1128-xhci_h", 50, 1);
  std::string said = output_of(command);
  EXPECT_NE(said.find("-f -p 85 77"), std::string::npos) << said;
  EXPECT_NE(said.find("-f -p 85 79"), std::string::npos) << said;
  fs::remove_all(root_ / "proc/77");
  fs::remove_all(root_ / "proc/79");
  EXPECT_NE(std::system(command.c_str()), 0) << "it has done nothing";
}

TEST_F(FilesOfDevices, are_not_all_there_or_not_urgent_enough) {
  fs::remove(root_ / "sys/bus/usb/devices/1-1");
  thread(78, "irq/11-can0", 85, 0);  // of ordinary priority, whatever that field says
  const std::vector<Finding> findings = found("loopback");
  EXPECT_NE(named(findings, "haptic: falcon").remedy.find("punctum check loopback"), std::string::npos);
  EXPECT_NE(named(findings, "irq 11 can0").remedy.find("chrt"), std::string::npos);
  EXPECT_EQ(named(found("icsi"), "devices").remedy, "");
  fs::remove_all(root_ / "proc/irq/11/can0");
  EXPECT_NE(named(found("loopback"), "stage: cia402").remedy.find("again"), std::string::npos);
}

TEST_F(FilesOfDevices, of_a_machine_with_a_single_processor_cannot_go_elsewhere) {
  file("sys/devices/system/cpu/online", "0\n");
  file("proc/irq/126/smp_affinity_list", "0\n");
  file("proc/irq/default_smp_affinity", "1\n");
  const std::vector<Finding> findings = found("loopback", 0);
  EXPECT_EQ(named(findings, "irq 126").remedy.find("smp_affinity"), std::string::npos);
  EXPECT_EQ(named(findings, "interrupts elsewhere").remedy, "");
}

TEST_F(FilesOfDevices, and_the_network_in_use_are_told_what_to_do_at_once) {
  EXPECT_EQ(named(found("icsi"), "no NIC coalescing").remedy, "");
  file("proc/net/route", "Iface\tDestination\tGateway\neth1\t000200C0\t0\neth0\t00000000\t010200C0\n");
  EXPECT_EQ(named(found("icsi"), "no NIC coalescing").remedy, "ethtool -C eth0 adaptive-rx off rx-usecs 0");
  EXPECT_EQ(named(found("icsi"), "no irqbalance").remedy, "");
  file("proc/99/comm", "irqbalance\n");
  EXPECT_NE(named(found("icsi"), "no irqbalance").remedy, "");
}

TEST_F(FilesOfDevices, are_mended_by_files_that_a_shell_can_read) {
  file("proc/net/route", "Iface\tDestination\tGateway\neth0\t00000000\t010200C0\n");
  file("proc/swaps", "Filename\n/dev/sda2\n");
  std::vector<Finding> findings = found("loopback");
  for (const char* name : {"SCHED_FIFO priority", "locked memory", "isolated CPU", "CPU sleep held off",
                           "performance governor", "no SMT siblings"}) {
    findings.push_back(finding_of({.name = name, .remedy = "by hand"}, 3, "0-2"));
  }
  findings.push_back(finding_of({.name = "PREEMPT_RT kernel", .remedy = "install it"}, 3, "0-2"));
  findings.push_back(finding_of(
      {.name = "no RT throttling", .remedy = "only so: sysctl -w kernel.sched_rt_runtime_us=-1"}, 3, "0-2"));
  const auto files = plan(findings);
  const fs::path folder = root_ / "plan";
  ASSERT_TRUE(write_plan(files, folder.string()));
  EXPECT_FALSE(write_plan(files, folder.string())) << "it is not empty any more";
  const std::string boot =
      output_of("GRUB_CMDLINE_LINUX=quiet; . " + (folder / "etc/default/grub.d/punctum.cfg").string() +
                "; printf %s \"$GRUB_CMDLINE_LINUX\"");
  for (const char* word : {"quiet ", "isolcpus=managed_irq,domain,3", "nohz_full=3", "rcu_nocbs=3",
                           "irqaffinity=0-2", "nosmt", "cpufreq.default_governor=performance"}) {
    EXPECT_NE(boot.find(word), std::string::npos) << word;
  }
  EXPECT_EQ(boot.find("irqaffinity"), boot.rfind("irqaffinity")) << "once is enough";
  EXPECT_EQ(output_of("sh -n " + (folder / "etc/punctum/machine").string() + " 2>&1"), "");
  const std::string& machine = files.at("etc/punctum/machine");
  for (const char* word :
       {"swapoff -a", "ethtool -C eth0", "chrt -f -p 85", "xhci_hcd", "kernel.sched_rt_runtime_us=-1"}) {
    EXPECT_NE(machine.find(word), std::string::npos) << word;
  }
  const std::string& unit = files.at("etc/systemd/system/punctum-machine.service");
  EXPECT_NE(unit.find("After=network.target punctum-bus@can0.service"), std::string::npos)
      << "an interface that is down has no interrupt";
  EXPECT_EQ(unit.find("RemainAfterExit"), std::string::npos) << "again with each run";
  const std::string& limits = files.at("etc/security/limits.d/punctum.conf");
  EXPECT_NE(limits.find("rtprio 95"), std::string::npos);
  EXPECT_NE(limits.find("memlock unlimited"), std::string::npos);
  EXPECT_NE(files.at("etc/udev/rules.d/61-punctum-machine.rules").find("cpu_dma_latency"), std::string::npos);
  EXPECT_NE(files.at("README").find("- PREEMPT_RT kernel: install it"), std::string::npos);
  const std::string done = (root_ / "done").string();
  for (const bool fails : {false, true}) {
    const std::string first = fails ? "no-such-command-here 2>/dev/null" : "true";
    const fs::path other = root_ / (fails ? "fails" : "works");
    Finding finding;
    finding.remedy = "by a command";
    finding.mend.command = first + "\necho 1 >> " + done;
    ASSERT_TRUE(write_plan(plan({finding}), other.string()));
    EXPECT_EQ(std::system(("sh " + (other / "etc/punctum/machine").string()).c_str()) != 0, fails);
  }
  EXPECT_EQ(output_of("cat " + done), "1\n1\n") << "what fails stops nothing else";
  EXPECT_TRUE(plan({}).size() == 1 && plan({}).contains("README")) << "nothing is missing";
}

TEST(Picture, shows_every_tick_once_and_what_each_slot_took) {
  Result r = measured(3);
  r.wake = of({1.5, 1.6, 20, 900});
  r.tick = of({0.5});
  r.seconds = 60;
  r.slots = {{"plant", of({2})}, {"servo", of({3})}};
  r.answered = "edge to edge";
  r.answer = of({400, 500}, 1000);
  const punctum::tools::Figure figure = picture_of(r);
  ASSERT_EQ(figure.panels.size(), 4U);
  const punctum::tools::Series& wake = figure.panels[0].series[0];
  ASSERT_EQ(wake.x.size(), wake.y.size());
  EXPECT_EQ(*std::max_element(wake.y.begin(), wake.y.end()), 2);
  EXPECT_EQ(wake.x.back(), 900) << "the longest, beyond the bins";
  EXPECT_EQ(*std::min_element(wake.x.begin(), wake.x.end()), 1);
  EXPECT_EQ(figure.panels[1].series[1].name, "slot servo");
  EXPECT_EQ(figure.panels[3].series[2].x.size(), 60U);
  for (const punctum::tools::Panel& panel : figure.panels) {
    for (const punctum::tools::Series& s : panel.series) {
      EXPECT_TRUE(std::all_of(s.y.begin(), s.y.end(), [](double y) { return y > 0; })) << panel.title;
    }
  }
}

// A wire: what the loop reads is what was asked; its answer is seen at once. It notes how long the loop took.
class Wire final : public Outside {
 public:
  void ask(bool high) override {
    asked_ns = now_ns();
    ++asked;
    in = high;
  }
  std::optional<std::int64_t> answered_ns(bool high) override {
    return out == high ? std::optional(now_ns()) : std::nullopt;
  }
  [[nodiscard]] std::string what() const override { return "a wire"; }
  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }
  std::atomic<bool> in{false}, out{false};
  std::atomic<std::int64_t> asked_ns{0};
  std::atomic<std::uint64_t> asked{0};
};
struct Repeats {
  Wire& wire;
  bool deaf = false;
  std::uint64_t until_asked = 0;
  std::int64_t least_ns = INT64_MAX;
  punctum::rt::After tick(const punctum::rt::Tick&) noexcept {
    const bool in = wire.in;
    if (!deaf && in != wire.out) {
      least_ns = std::min(least_ns, Wire::now_ns() - wire.asked_ns);
      wire.out = in;
    }
    return wire.asked < until_asked ? punctum::rt::After::go_on : punctum::rt::After::end;
  }
};

TEST(Answers, come_with_the_next_tick_and_are_told_with_those_that_do_not_come) {
  Wanted wanted;
  wanted.rate_Hz = 200;
  wanted.seconds = 60;  // the loop ends when enough was asked
  for (const bool deaf : {false, true}) {
    Wire wire;
    Repeats repeats{wire, deaf, 12};
    const auto result =
        measure_answers(wanted, {.slots = {punctum::rt::slot<&Repeats::tick>("wire", repeats)}}, wire);
    ASSERT_TRUE(result) << result.error();
    EXPECT_EQ(result->answered, "a wire");
    // The last one may be cut off; after one that was not answered the next level is there before it is
    // asked.
    const std::uint64_t told = result->answer.entries() + result->unanswered;
    EXPECT_LE(told, wire.asked);
    EXPECT_GE(told + result->unanswered + 1, wire.asked);
    if (deaf) {
      EXPECT_EQ(result->answer.entries(), 0U);
      EXPECT_GE(result->unanswered, 5U);
      continue;
    }
    ASSERT_GE(result->answer.entries(), 1U);
    EXPECT_GE(result->answer_min_us, 1e-3 * static_cast<double>(repeats.least_ns));
    EXPECT_NE(summary(*result, 100).find("a wire"), std::string::npos);
    EXPECT_NE(json_of(*result).find("answer_us"), std::string::npos);
  }
}

TEST(Answers, are_refused_where_the_lines_make_no_sense) {
  for (const char* lines :
       {"", "/dev/gpiochip0", "/dev/gpiochip0:1,2,3", "/dev/gpiochip0:1,2,3,4,5", ":1,2,3,4",
        "/dev/gpiochip0:1,2,2,4", "/dev/gpiochip0:1,2,-3,4", "/nowhere:1,2,3,4"}) {
    const auto result = measure_gpio_answers({}, lines);
    ASSERT_FALSE(result) << lines;
    EXPECT_EQ(result.error().rfind("--gpio: ", 0), 0U) << result.error();
  }
}

TEST(ServoTick, is_the_core_s_on_the_simulated_devices_of_a_scene) {
  const auto tick = ServoTick::of("icsi", 1000);
  ASSERT_TRUE(tick) << tick.error();
  Wanted wanted;
  wanted.seconds = 0.6;
  const auto result = measure(wanted, (*tick)->work());
  ASSERT_TRUE(result) << result.error();
  ASSERT_EQ(result->slots.size(), 3U);
  double slowest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result->slots[i].first, (std::array{"plant", "servo", "empty"}[i]));
    EXPECT_EQ(result->slots[i].second.entries(), result->ticks);
    slowest = std::max(slowest, result->slots[i].second.max_us);
  }
  EXPECT_LE(slowest, result->tick.max_us);
  EXPECT_EQ(result->interval.entries(), result->ticks - 1);
  if (result->allocations_watched) {
    EXPECT_EQ(result->allocations, 0U);
  }
  EXPECT_NE((*tick)->did().find("icsi"), std::string::npos);
  if (result->missed == 0) {
    EXPECT_EQ((*tick)->did().find("fault"), std::string::npos) << (*tick)->did();
  }
}

TEST_F(FileMachine, has_a_scene_of_which_one_device_is_real_and_no_tick_for_it) {
  std::string text(punctum::tools::builtin_text("icsi").value());
  const std::string simulated = "[estop]\ndevice = \"simulated\"";
  ASSERT_NE(text.find(simulated), std::string::npos);
  text.replace(
      text.find(simulated), simulated.size(),
      "[gpiod]\ncontact_a = 0\ncontact_b = 1\nreset = 2\nheartbeat = 3\n[estop]\ndevice = \"gpiod\"");
  file("mixed.toml", text);
  const auto tick = ServoTick::of((root_ / "mixed.toml").string(), std::nullopt);
  ASSERT_FALSE(tick);
  EXPECT_NE(tick.error().find("not simulated"), std::string::npos) << tick.error();
}

TEST(ServoTick, is_refused_in_one_line_where_a_measurement_would_move_something) {
  for (const auto& [scene, rate, word] :
       std::vector<std::tuple<std::string, double, std::string>>{{"loopback", 1000, "not simulated"},
                                                                 {"nosuch", 1000, "unknown scene"},
                                                                 {"icsi", 1500, "--rate"}}) {
    const auto tick = ServoTick::of(scene, rate);
    ASSERT_FALSE(tick) << scene;
    EXPECT_NE(tick.error().find(word), std::string::npos) << tick.error();
    EXPECT_EQ(tick.error().find('\n'), std::string::npos) << tick.error();
  }
}

// A core that ticks every millisecond for a while and then no more.
TEST(Attached, tells_of_a_core_that_stops_ticking_and_does_not_count_its_silence) {
  const std::string station = "jitter-test-" + std::to_string(getpid());
  using punctum::hal::Shared, punctum::rt::CoreSegment, punctum::tools::kCoreSegment;
  const auto made = Shared<const CoreSegment>::create(kCoreSegment);
  ASSERT_TRUE(made) << made.error();
  auto segment = Shared<CoreSegment>::claim(kCoreSegment, made->segment().descriptor());
  ASSERT_TRUE(segment) << segment.error();
  auto rendezvous = punctum::hal::Rendezvous::open(station);
  ASSERT_TRUE(rendezvous) << rendezvous.error();
  rendezvous->offer(kCoreSegment, made->segment().read_only_descriptor().value());
  punctum::rt::CoreStatus& status = (*segment)->status;
  status.pid = static_cast<std::uint64_t>(getpid());
  status.period_ns = 1'000'000;
  status.started = 1;
  using Clock = std::chrono::steady_clock;
  const auto begun = Clock::now();
  std::jthread core([&](const std::stop_token& over) {
    while (!over.stop_requested()) {
      rendezvous->serve();
      if (status.ticks.load() < 300) {
        status.wake.add(20'000);
        status.ticks.store(status.ticks.load() + 1);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  Wanted wanted;
  wanted.seconds = 60;
  const auto result = attach(station, wanted);
  const double looked_s = 1e-9 * static_cast<double>((Clock::now() - begun).count());
  ASSERT_TRUE(result) << result.error();
  EXPECT_TRUE(result->stopped_ticking);
  EXPECT_LT(result->seconds, looked_s - 0.9);
  EXPECT_NE(summary(*result, 100).find("stopped ticking"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(json_of(*result))["stopped_ticking"].get<bool>());
}

TEST(Measurement, counts_every_tick_once) {
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 0.6;
  const auto result = measure(wanted);
  ASSERT_TRUE(result) << result.error();
  // The last release may lie beyond the end, if those before it were missed.
  EXPECT_GE(result->ticks + result->missed, 300U);
  EXPECT_EQ(static_cast<double>(result->ticks + result->missed), std::round(result->seconds * 500));
  EXPECT_EQ(result->wake.entries(), result->ticks);
  EXPECT_EQ(result->tick.entries(), result->ticks);
  EXPECT_EQ(result->interval.entries(), result->ticks - 1);
  ASSERT_FALSE(result->spikes.empty());
  EXPECT_EQ(result->spikes.front().t_s, 0);
  EXPECT_TRUE(std::is_sorted(result->spikes.begin(), result->spikes.end(), [](const auto& a, const auto& b) {
    return a.t_s < b.t_s && a.wake_us < b.wake_us;
  }));
  if (result->spikes.size() < 64) {
    EXPECT_NEAR(result->spikes.back().wake_us, result->wake.max_us, 1e-9);
  }
  std::uint64_t in_parts = 0;
  for (const Distribution& part : result->parts) {
    in_parts += part.entries();
  }
  EXPECT_EQ(in_parts, result->ticks);
  if (result->allocations_watched) {
    EXPECT_EQ(result->allocations, 0U);
  }
  const std::string text = summary(*result, 100);
  EXPECT_NE(text.find("wake-up"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

// Somebody stops this process again and again and lets it go on, from the first tick to the end of the
// object. The run ends after the first tick that slept through one of these pauses: on a busy machine a pause
// may come late, or within a tick.
class Paused {
 public:
  static constexpr int kPause_ms = 80;
  Paused() {
    const pid_t measured = getpid();
    int ends[2] = {-1, -1};
    EXPECT_EQ(pipe(ends), 0);
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      close(ends[1]);
      char begun = 0;
      while (read(ends[0], &begun, 1) == 1) {  // one byte for each pause; until this process ends
        (void)kill(measured, SIGSTOP);
        usleep(kPause_ms * 1000);
        (void)kill(measured, SIGCONT);
      }
      _exit(0);
    }
    EXPECT_GT(pid_, 0);
    close(ends[0]);
    ask_ = ends[1];
  }
  Paused(const Paused&) = delete;
  Paused& operator=(const Paused&) = delete;
  ~Paused() {
    close(ask_);
    EXPECT_EQ(waitpid(pid_, nullptr, 0), pid_);
  }
  punctum::rt::After tick(const punctum::rt::Tick& tick) noexcept {
    slept_ns = ticks++ == 0 ? 0 : tick.wake_ns - last_ns;
    slept_from_ns = last_ns;
    // A pause within a tick is not a late wake-up: then another one.
    if (ends_loop && tick.late_ns >= kPause_ms * 500'000LL) {
      return punctum::rt::After::end;
    }
    if (ticks % 50 == 25) {
      EXPECT_EQ(write(ask_, "p", 1), 1);
    }
    last_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    return punctum::rt::After::go_on;
  }
  std::int64_t slept_ns = 0, slept_from_ns = 0, last_ns = 0;
  std::uint64_t ticks = 0;
  bool ends_loop = true;  // the loop, with the first late wake-up

 private:
  pid_t pid_ = -1;
  int ask_ = -1;
};

TEST(Measurement, on_another_cpu_than_the_one_asked_for_is_refused) {
  const auto result = measure({.seconds = 0.1, .cpu = CPU_SETSIZE - 1});
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().find("--cpu"), std::string::npos);
  EXPECT_EQ(sched_getscheduler(0) & ~SCHED_RESET_ON_FORK, SCHED_OTHER);
}

TEST(Measurement, tells_a_wake_up_later_than_many_periods_from_the_release_it_slept_for) {
  Paused paused;
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 60;
  const auto result = measure(wanted, {.slots = {punctum::rt::slot<&Paused::tick>("paused", paused)}});
  ASSERT_TRUE(result) << result.error();
  constexpr double kPeriod_us = 2000;
  const double slept_us = 1e-3 * static_cast<double>(paused.slept_ns);
  ASSERT_GE(slept_us, 1e3 * Paused::kPause_ms);
  EXPECT_GE(result->wake.max_us, slept_us - kPeriod_us);
  EXPECT_GE(static_cast<double>(result->missed), slept_us / kPeriod_us - 2);
  EXPECT_EQ(static_cast<double>(result->ticks + result->missed), std::round(result->seconds * 500));
  EXPECT_GE(result->wake.longer, 1U);
  ASSERT_FALSE(result->spikes.empty());
  if (result->spikes.size() < 64) {
    const Spike& worst = result->spikes.back();
    EXPECT_NEAR(worst.wake_us, result->wake.max_us, 1e-6);
    // The release that it slept for came soon after it had gone to sleep.
    EXPECT_NEAR(static_cast<double>(result->first_release_ns) + 1e9 * worst.t_s,
                static_cast<double>(paused.slept_from_ns), 1e3 * kPeriod_us);
  }
}

// Traces as Documentation/trace/ftrace.rst shows them, of a loop with thread 70, released at 100 s.
Episode late(double wake_us, double end_us) {
  Episode tick;
  tick.release_ns = 100'000'000'000;
  tick.wake_ns = tick.release_ns + static_cast<std::int64_t>(wake_us * 1e3);
  tick.end_ns = tick.release_ns + static_cast<std::int64_t>(end_us * 1e3);
  tick.tid = 70;
  tick.slot = "servo";
  tick.slot_ns = tick.end_ns - tick.wake_ns;
  return tick;
}

Counters at(double s) {
  Counters c;
  c.t_ns = static_cast<std::int64_t>(s * 1e9);
  c.waited_ns = c.ran_ns = c.stolen_ms = c.smis = 0;
  return c;
}

Verdict cause_of(const Episode& tick, const std::string& trace, const Counters& before = at(99.99),
                 const Counters& after = at(100.01)) {
  return explain(tick, read_trace(trace), before, after, {.virtual_machine = true});
}

const std::string kAsleep =
    "          <idle>-0       [001] d..2.    99.999100: sched_switch: prev_comm=punctum-core prev_pid=70 "
    "prev_prio=19 "
    "prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120\n";
const std::string kWoken =
    "          <idle>-0       [001] d.h3.   100.000003: sched_waking: comm=punctum-core pid=70 prio=19 "
    "target_cpu=001\n";
std::string runs_from(const char* stamp, const std::string& who = "<idle>-0",
                      const std::string& prio = "120") {
  return "   " + who + "       [001] d..2.   100." + stamp +
         ": sched_switch: prev_comm=x prev_pid=" + who.substr(who.rfind('-') + 1) + " prev_prio=" + prio +
         " prev_state=R ==> next_comm=punctum-core next_pid=70 next_prio=19\n";
}

TEST(TraceText, is_read_whatever_a_thread_is_called) {
  const auto events = read_trace(
      "# tracer: nop\n#           TASK-PID     CPU#  |||||  TIMESTAMP  FUNCTION\n"
      " my [1] ta-sk-12      [003] d.h1.  2694.092014: irq_handler_entry: irq=24 name=eth 0\n"
      "          <idle>-0       [000] ..s..  2694.000001: softirq_exit: vec=9 [action=RCU]\n"
      "CPU:1 [LOST 12 EVENTS]\nnonsense\n");
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].t_ns, 2694'000'001'000);
  EXPECT_FALSE(events[0].in_hard_interrupt);
  EXPECT_EQ(events[1].comm, "my [1] ta-sk");
  EXPECT_EQ(events[1].pid, 12);
  EXPECT_EQ(events[1].cpu, 3);
  EXPECT_TRUE(events[1].in_hard_interrupt);
  EXPECT_EQ(events[1].args, "irq=24 name=eth 0");
}

TEST(CauseOfALateTick, is_the_interrupt_that_ran) {
  const Verdict v = cause_of(
      late(400, 405),
      kAsleep +
          "          <idle>-0       [001] d.h1.    99.999990: irq_handler_entry: irq=24 name=eth0-rx\n"
          "          <idle>-0       [001] d.h1.   100.000380: irq_handler_exit: irq=24 ret=handled\n"
          "          <idle>-0       [001] d.h3.   100.000385: sched_waking: comm=punctum-core pid=70 prio=19 "
          "target_cpu=001\n" +
          runs_from("000390"));
  EXPECT_EQ(v.cause, Cause::interrupt);
  EXPECT_EQ(v.what, "irq 24 eth0-rx");
  EXPECT_NEAR(v.us, 380, 1);
  EXPECT_EQ(v.proof, Proof::traced);
}

TEST(CauseOfALateTick, is_who_ran_instead_and_at_which_priority) {
  const std::string hog =
      "          <idle>-0       [001] d..2.    99.999900: sched_switch: prev_comm=swapper/1 prev_pid=0 "
      "prev_prio=120 "
      "prev_state=R ==> next_comm=a hog next_pid=81 next_prio=";
  const std::string woken =
      "           a hog-81      [001] d.h3.   100.000003: sched_waking: comm=punctum-core pid=70 prio=19 "
      "target_cpu=001\n";
  const Verdict above =
      cause_of(late(400, 405), kAsleep + hog + "4\n" + woken + runs_from("000390", "a hog-81", "4"));
  EXPECT_EQ(above.cause, Cause::preemption);
  EXPECT_EQ(above.what, "a hog-81, SCHED_FIFO 95");
  const Verdict below =
      cause_of(late(400, 405), kAsleep + hog + "120\n" + woken + runs_from("000390", "a hog-81"));
  EXPECT_EQ(below.what, "a hog-81, ordinary priority, in a section that is not preempted");
}

TEST(CauseOfALateTick, lies_within_the_tick) {
  const std::string begun = kAsleep + kWoken + runs_from("000008");
  EXPECT_EQ(cause_of(late(10, 900), begun).cause, Cause::own_computing);
  EXPECT_EQ(cause_of(late(10, 900), begun).what, "slot servo");
  std::string faults = begun;
  for (int us = 20; us < 900; us += 10) {
    faults += "   punctum-core-70      [001] .....   100.000" + std::to_string(1000 + us).substr(1) +
              ": page_fault_user: address=0x7f52040c5002 ip=0xd25a1e error_code=0x6\n";
  }
  EXPECT_EQ(cause_of(late(10, 900), faults).cause, Cause::page_fault);
  const std::string left =
      "   punctum-core-70      [001] d..2.   100.000050: sched_switch: prev_comm=punctum-core prev_pid=70 "
      "prev_prio=19 "
      "prev_state=";
  const std::string idle = " ==> next_comm=swapper/1 next_pid=0 next_prio=120\n";
  EXPECT_EQ(cause_of(late(10, 900), begun + left + "S" + idle + runs_from("000880")).cause,
            Cause::device_or_bus);
  EXPECT_EQ(cause_of(late(10, 900), begun + left + "T" + idle + runs_from("000880")).cause, Cause::stopped);
  EXPECT_EQ(cause_of(late(10, 900),
                     begun + "   punctum-core-70      [001] .....   100.000020: sys_enter: NR 1 (5, "
                             "55b0e55e3778, 1, 0, 0, 0)\n"
                             "   punctum-core-70      [001] .....   100.000890: sys_exit: NR 1 = 1\n")
                .cause,
            Cause::device_or_bus);
}

TEST(CauseOfALateTick, is_an_interrupt_that_nothing_masks) {
  const auto nmi = [](const std::string& who, const char* stamp, int lasted_us) {
    return "   " + who + "      [001] d.Z1.   100." + stamp +
           ": nmi_handler: perf_event_nmi_handler() delta_ns: " + std::to_string(1000 * lasted_us) +
           " handled: 1\n";
  };
  const std::string woken =
      "          <idle>-0       [001] d.h3.   100.000480: sched_waking: "
      "comm=punctum-core pid=70 prio=19 target_cpu=001\n" +
      runs_from("000485");
  const Verdict before_it_woke = cause_of(late(490, 495), kAsleep + nmi("  <idle>-0 ", "000200", 190) +
                                                              nmi("  <idle>-0 ", "000470", 260) + woken);
  EXPECT_EQ(before_it_woke.cause, Cause::interrupt);
  EXPECT_EQ(before_it_woke.what, "NMI perf_event_nmi_handler");
  EXPECT_NEAR(before_it_woke.us, 450, 1);
  const std::string begun = kAsleep + kWoken + runs_from("000008");
  EXPECT_EQ(cause_of(late(10, 900), begun + nmi("punctum-core-70", "000700", 600)).what,
            "NMI perf_event_nmi_handler");
  EXPECT_EQ(cause_of(late(10, 900), begun + nmi("punctum-core-70", "000700", 300)).cause,
            Cause::own_computing);
  EXPECT_EQ(cause_of(late(10, 900),
                     begun + "   punctum-core-70      [001] d.Z1.   100.000700: nmi_handler: of no length\n")
                .cause,
            Cause::own_computing);
}

TEST(CauseOfALateTick, is_silence_that_only_a_counter_names) {
  const std::string trace = kAsleep +
                            "          <idle>-0       [001] d.h3.   100.000480: sched_waking: "
                            "comm=punctum-core pid=70 prio=19 target_cpu=001\n" +
                            runs_from("000485");
  const Verdict nothing = cause_of(late(490, 495), trace);
  EXPECT_EQ(nothing.cause, Cause::unknown);
  EXPECT_EQ(nothing.proof, Proof::none);
  EXPECT_NE(nothing.what.find("took no interrupt"), std::string::npos) << nothing.what;
  Counters after = at(100.01);
  after.stolen_ms = 10;
  EXPECT_EQ(cause_of(late(490, 495), trace, at(99.99), after).cause, Cause::stolen_time);
  EXPECT_EQ(cause_of(late(490, 495), trace, at(99.8), after).cause, Cause::unknown)
      << "another tick's, perhaps";
  after.cpu = 1;
  EXPECT_EQ(cause_of(late(490, 495), trace, at(99.99), after).cause, Cause::unknown)
      << "another processor's, perhaps";
  after = at(100.01);
  Counters before = at(99.99);
  before.stolen_ns = 7'000;
  after.stolen_ns = 7'000 + 460'000;
  EXPECT_EQ(cause_of(late(490, 495), trace, before, after).cause, Cause::stolen_time) << "less than a step";
  after.stolen_ns = 7'000 + 160'000;
  after.stolen_ms = 10;
  EXPECT_EQ(cause_of(late(490, 495), trace, before, after).cause, Cause::unknown)
      << "a step of earlier ticks";
  after.smis = 1;
  EXPECT_EQ(cause_of(late(490, 495), trace, at(99.99), after).cause, Cause::smi);
  EXPECT_EQ(cause_of(late(490, 495), trace, at(99.8), after).cause, Cause::unknown)
      << "another tick's, perhaps";
}

// As Linux 7.3 with PREEMPT_RT traced it, while its own tracer hwlat kept interrupts off for 1 ms; timerlat's
// stack of the same showed hwlatd's kthread_fn.
TEST(CauseOfALateTick, is_silence_with_a_thread_that_is_named) {
  Episode tick;
  tick.release_ns = 4'576'568'858;
  tick.wake_ns = tick.release_ns + 470'305;
  tick.end_ns = tick.release_ns + 471'168;
  tick.tid = 289;
  const std::string before =
      "  punctum-jitter-289     [000] d..2.     4.575680: sched_switch: prev_comm=punctum-jitter "
      "prev_pid=289 "
      "prev_prio=19 prev_state=S ==> next_comm=swapper/0 next_pid=0 next_prio=120\n"
      "          <idle>-0       [000] d.h1.     4.576001: local_timer_entry: vector=236\n"
      "          <idle>-0       [000] dNh1.     4.576007: local_timer_exit: vector=236\n";
  const std::string to_hwlatd =
      "       ktimers/0-15      [000] d..2.     4.576024: sched_switch: prev_comm=ktimers/0 prev_pid=15 "
      "prev_prio=98 prev_state=S ==> next_comm=hwlatd next_pid=288 next_prio=120\n";
  const auto woken = [](const std::string& who) {
    return who + "     [000] d.h..     4.577027: local_timer_entry: vector=236\n" + who +
           "     [000] d.h..     4.577028: hrtimer_expire_entry: hrtimer=000000000306ec40 "
           "function=hrtimer_wakeup now=4577027819\n" +
           who +
           "     [000] d.h2.     4.577029: sched_waking: comm=punctum-jitter pid=289 prio=19 "
           "target_cpu=000\n" +
           who + "     [000] dNh..     4.577032: hrtimer_expire_exit: hrtimer=000000000306ec40\n" + who +
           "     [000] dNh..     4.577033: local_timer_exit: vector=236\n" + who +
           "     [000] d..2.     4.577036: sched_switch: prev_comm=x prev_pid=" +
           who.substr(who.rfind('-') + 1) +
           " prev_prio=120 prev_state=R+ ==> next_comm=punctum-jitter next_pid=289 next_prio=19\n";
  };
  const Verdict thread =
      cause_of(tick, before + to_hwlatd + woken("          hwlatd-288"), at(4.57), at(4.58));
  EXPECT_EQ(thread.cause, Cause::unknown) << "the firmware may have been there as well";
  EXPECT_NE(thread.what.find("with hwlatd-288 on it"), std::string::npos) << thread.what;
  const Verdict idle = cause_of(tick, before + woken("          <idle>-0"), at(4.57), at(4.58));
  EXPECT_EQ(idle.cause, Cause::unknown);
  EXPECT_EQ(idle.what.find("on it"), std::string::npos) << idle.what;
}

TEST(CauseOfALateTick, is_the_hypervisor_that_took_the_processor_during_an_interrupt) {
  const std::string trace =
      kAsleep +
      "          <idle>-0       [001] d.h1.    99.999990: local_timer_entry: vector=236\n"
      "          <idle>-0       [001] d.h1.   100.000380: local_timer_exit: vector=236\n"
      "          <idle>-0       [001] d.h3.   100.000385: sched_waking: comm=punctum-core pid=70 prio=19 "
      "target_cpu=001\n" +
      runs_from("000390");
  Counters before = at(99.99), after = at(100.01);
  EXPECT_EQ(cause_of(late(400, 405), trace, before, after).cause, Cause::interrupt);
  before.stolen_ns = 5'000;
  after.stolen_ns = 5'000 + 350'000;
  const Verdict taken = cause_of(late(400, 405), trace, before, after);
  EXPECT_EQ(taken.cause, Cause::stolen_time);
  EXPECT_NE(taken.what.find("during interrupt"), std::string::npos) << taken.what;
  after.stolen_ns = 5'000 + 30'000;
  EXPECT_EQ(cause_of(late(400, 405), trace, before, after).cause, Cause::interrupt);
  before.stolen_ns = after.stolen_ns = std::nullopt;
  after.stolen_ms = 10;
  EXPECT_EQ(cause_of(late(400, 405), trace, before, after).cause, Cause::interrupt)
      << "a step of 10 ms may be another tick's";
}

TEST(CauseOfALateTick, is_a_change_of_frequency_only_of_its_own_processor) {
  for (const int cpu : {0, 1}) {
    const Verdict v = cause_of(late(10, 900), kAsleep + kWoken + runs_from("000008") +
                                                  "          kworker-5      [000] .....   100.000100: "
                                                  "cpu_frequency: state=1200000 cpu_id=" +
                                                  std::to_string(cpu) + "\n");
    EXPECT_EQ(v.cause, cpu == 1 ? Cause::frequency : Cause::own_computing);
  }
}

TEST(CauseOfALateTick, is_unknown_where_the_trace_begins_after_it_or_nothing_took_half) {
  EXPECT_EQ(cause_of(late(400, 405), "").cause, Cause::unknown);
  EXPECT_EQ(cause_of(late(400, 405), runs_from("000390")).cause, Cause::unknown);
  const Verdict shared = cause_of(
      late(900, 905),
      kAsleep + kWoken +
          "          <idle>-0       [001] d.h1.   100.000010: irq_handler_entry: irq=24 name=eth0-rx\n"
          "          <idle>-0       [001] d.h1.   100.000310: irq_handler_exit: irq=24 ret=handled\n"
          "          <idle>-0       [001] d..2.   100.000310: sched_switch: prev_comm=swapper/1 prev_pid=0 "
          "prev_prio=120 "
          "prev_state=R ==> next_comm=hog next_pid=81 next_prio=4\n" +
          runs_from("000610", "hog-81", "4"));
  EXPECT_EQ(shared.cause, Cause::unknown);
  EXPECT_NE(shared.what.find("irq 24 eth0-rx"), std::string::npos) << shared.what;
}

TEST(CauseOfALateTick, by_counters_alone_is_told_only_where_they_suffice) {
  const auto by = [](const Episode& tick, const auto& change, double from = 99.99) {
    Counters after = at(100.01);
    change(after);
    return explain(tick, at(from), after).cause;
  };
  EXPECT_EQ(by(late(900, 905), [](Counters&) {}), Cause::unknown);
  EXPECT_EQ(by(late(900, 905), [](Counters& c) { c.waited_ns = 800'000; }), Cause::preemption);
  EXPECT_EQ(by(late(900, 905), [](Counters& c) { c.waited_ns = 100'000; }), Cause::unknown);
  EXPECT_EQ(by(late(900, 905), [](Counters& c) { c.waited_ns = 800'000; }, 99.0), Cause::unknown);
  EXPECT_EQ(by(late(10, 905), [](Counters& c) { c.ran_ns = 900'000; }), Cause::own_computing);
  EXPECT_EQ(by(late(10, 905), [](Counters& c) { c.ran_ns = 20'000; }), Cause::unknown) << "it waited";
  EXPECT_EQ(by(late(10, 905),
               [](Counters& c) {
                 c.ran_ns = 900'000;
                 c.major_faults = 1;
               }),
            Cause::page_fault);
  EXPECT_EQ(by(late(900, 905), [](Counters& c) { c.smis = 1; }), Cause::smi);
  EXPECT_EQ(by(late(900, 905),
               [](Counters& c) {
                 c.waited_ns = 800'000;
                 c.smis = 1;
               }),
            Cause::preemption)
      << "an SMI elsewhere in these 20 ms";
}

TEST(CauseOfALateTick, by_counters_alone_leaves_to_other_ticks_what_is_theirs) {
  const auto by = [](Episode tick, const auto& change, double share) {
    tick.usual_share = share;
    Counters after = at(100.01);
    change(after);
    return explain(tick, at(99.99), after).cause;
  };
  // Twenty other ticks of 40 us beside one that a bus kept waiting.
  const auto bus = [](Counters& c) { c.ran_ns = 820'000; };
  EXPECT_EQ(by(late(10, 485), bus, 0.04), Cause::unknown);
  EXPECT_EQ(by(late(10, 485), [](Counters& c) { c.ran_ns = 820'000 + 450'000; }, 0.04), Cause::own_computing);
  EXPECT_NE(by(
                late(10, 905),
                [](Counters& c) {
                  c.ran_ns = 900'000;
                  c.minor_faults = 1;
                },
                0),
            Cause::page_fault)
      << "one fault does not take so long";
  EXPECT_EQ(by(
                late(10, 905),
                [](Counters& c) {
                  c.ran_ns = 900'000;
                  c.minor_faults = 60;
                },
                0),
            Cause::page_fault);
}

TEST(CauseOfALateTick, may_be_longer_than_the_time_that_counters_hold) {
  Episode tick = late(10, 1'005'000);
  Counters after = at(101.02);
  after.ran_ns = 1'005'000'000;
  EXPECT_EQ(explain(tick, at(99.99), after).cause, Cause::own_computing);
  EXPECT_EQ(explain(tick, at(99.0), after).cause, Cause::unknown) << "nobody looked for a second before it";
  tick = late(1'000'000, 1'000'005);
  after.stolen_ms = 990;
  EXPECT_EQ(cause_of(tick,
                     kAsleep +
                         "          <idle>-0       [001] d.h3.   100.999980: sched_waking: "
                         "comm=punctum-core pid=70 prio=19 target_cpu=001\n" +
                         runs_from("999985"),
                     at(99.99), after)
                .cause,
            Cause::stolen_time);
}

TEST(CountersOfAThread, are_read_where_the_kernel_keeps_them) {
  const fs::path proc = fs::temp_directory_path() / ("punctum_jitter_counters_" + std::to_string(getpid()));
  fs::create_directories(proc / "7/task/8");
  std::ofstream(proc / "7/task/8/schedstat") << "500 40 3\n";
  std::ofstream(proc / "7/task/8/stat")
      << "8 (a) b) R 1 1 1 0 -1 4194304 11 12 13 14 0 0 17 18 19 20 21 22 23 24 "
         "25 26 27 28 29 30 31 32 33 34 35 36 37 38 17 1 40\n";
  std::ofstream(proc / "stat")
      << "cpu  1 2 3 4 5 6 7 80 0 0\ncpu0 1 2 3 4 5 6 7 70 0 0\ncpu1 1 2 3 4 5 6 7 10 0 0\n";
  std::ofstream(proc / "scheduler")
      << "Version\ncpu#10, 2596.1 MHz\n  .clock        : 9.000000\n  .clock_task   : 1.000000\n"
         "cpu#1, 2596.1 MHz\n  .clock        : 130.133713\n  .clock_task   : 90.991233\n";
  std::ofstream(proc / "interrupts")
      << "           CPU0       CPU1\n 24:          1          2  IO-APIC   5-edge      "
         "eth0\nLOC:         10         20   Local timer interrupts\nERR:          0\n";
  const Counters c = read_counters(7, 8, proc.string(), proc / "scheduler"),
                 unasked = read_counters(7, 8, proc.string());
  fs::remove_all(proc);
  EXPECT_EQ(c.waited_ns, 40U);
  EXPECT_EQ(c.ran_ns, 500U);
  EXPECT_EQ(c.minor_faults, 11U);
  EXPECT_EQ(c.major_faults, 13U);
  EXPECT_EQ(c.cpu, 1);
  EXPECT_EQ(c.stolen_ms, 10U * 1000U / static_cast<std::uint64_t>(sysconf(_SC_CLK_TCK)));
  EXPECT_EQ(c.stolen_ns, 39'142'480U);
  EXPECT_EQ(unasked.stolen_ns, std::nullopt);
  EXPECT_EQ(c.interrupts.at("irq 24: eth0"), 3U);
  EXPECT_EQ(c.interrupts.at("LOC:"), 30U);
}

// Computes for 30 ms in every 40th of its ticks, on a loop that has 2 ms.
struct SlowWork {
  static constexpr std::int64_t kSlow_ns = 30'000'000;
  std::array<std::uint64_t, 3> slow{};
  std::uint64_t ticks = 0;
  punctum::rt::After run(const punctum::rt::Tick& tick) noexcept {
    if (++ticks % 40 == 0) {
      slow[ticks / 40 - 1] = tick.index;
      const auto end = std::chrono::steady_clock::now() + std::chrono::nanoseconds(kSlow_ns);
      while (std::chrono::steady_clock::now() < end) {
      }
    }
    return ticks < 40 * slow.size() + 10 ? punctum::rt::After::go_on : punctum::rt::After::end;
  }
};

TEST(Measurement, keeps_every_tick_that_missed_a_release_and_names_its_slot) {
  SlowWork work;
  const std::vector<punctum::rt::Slot> slots{punctum::rt::slot<&SlowWork::run>("slow", work)};
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 60;
  const auto result = measure(wanted, {.slots = slots});
  ASSERT_TRUE(result) << result.error();
  std::uint64_t missed = 0, named = 0;
  std::size_t kept = 0;
  for (const Explained& e : result->explained) {
    missed += e.tick.missed;
    if (std::any_of(work.slow.begin(), work.slow.end(), [&](std::uint64_t index) {
          return e.tick.index <= index && index <= e.tick.index + e.tick.missed;
        })) {
      ++kept;
      EXPECT_GE(e.tick.longest_slot_ns, static_cast<std::uint64_t>(SlowWork::kSlow_ns));
      named += e.slot == "slow" ? 1 : 0;
    }
  }
  if (result->unexplained == 0) {  // whoever explains them may be kept from it
    EXPECT_EQ(kept, work.slow.size());
    EXPECT_GE(named, 1U);
    // What the last tick missed after its end is not counted any more.
    EXPECT_GE(missed, result->missed);
    EXPECT_LE(missed, result->missed + result->explained.back().tick.missed);
  }
  EXPECT_GE(result->explained.size() + result->unexplained, work.slow.size());
  ASSERT_FALSE(result->slots.empty());
  EXPECT_EQ(result->slots.front().first, "slow");
}

TEST(Summary, names_the_slot_of_a_late_tick) {
  Result r = measured(1);
  r.slots = {{"slow", of({30})}};
  Explained e;
  e.slot = "slow";
  e.tick.end_ns = 30'100'000;
  e.tick.longest_slot_ns = 30'000'000;
  r.explained.push_back(e);
  EXPECT_NE(summary(r, 100).find("slot slow took 30000.0 us"), std::string::npos) << summary(r, 100);
}

TEST(Summary, keeps_its_numbers_apart_however_long_a_machine_stood) {
  Result r = measured(1);
  r.wake = {};
  r.wake.longer = 2000;
  r.wake.max_us = 1504138.7;
  std::istringstream lines(summary(r, 100));
  std::string line, number;
  while (!line.starts_with("wake-up ")) {
    ASSERT_TRUE(std::getline(lines, line));
  }
  std::istringstream words(line.substr(7));
  int same = 0;
  while (words >> number && number != "-") {
    EXPECT_EQ(number, "1504138.7");
    ++same;
  }
  EXPECT_EQ(same, 4) << "p50, p90, p99 and p99.9 of 2000";
}

TEST(Measurement, ends_at_the_first_wake_up_that_is_too_late) {
  Paused paused;
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 60;
  wanted.break_us = 50'000;
  paused.ends_loop = false;
  const auto result = measure(wanted, {.slots = {punctum::rt::slot<&Paused::tick>("paused", paused)}});
  ASSERT_TRUE(result) << result.error();
  EXPECT_TRUE(result->broke);
  EXPECT_LT(result->seconds, 60);
  ASSERT_FALSE(result->explained.empty());
  EXPECT_GE(result->explained.back().tick.wake_ns - result->explained.back().tick.release_ns, 50'000'000);
}

}  // namespace
