// Results of punctum-jitter: distributions by hand, differences between random measurements whose truth is
// known, machines made of files, and the loop itself for a moment.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tools/jitter/audit.hpp"
#include "tools/jitter/comparison.hpp"
#include "tools/jitter/difference.hpp"
#include "tools/jitter/load.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/jitter/result.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum::jitter;

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

bool differs(const Result& a, const Result& b, double part) {
  const auto found = difference(a, b);
  EXPECT_TRUE(found) << found.error();
  return std::any_of(found->begin(), found->end(),
                     [part](const auto& q) { return q.differs && (part == 0 || q.part == part); });
}

TEST(Difference, is_rarely_seen_between_measurements_of_one_machine) {
  int wrong = 0;
  constexpr unsigned kPairs = 60;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    wrong += differs(measured(2 * pair + 1), measured(2 * pair + 2), 0) ? 1 : 0;
  }
  // 5 % are 3; more than 7 come by chance in one of 80.
  EXPECT_LE(wrong, 7);
}

TEST(Difference, is_rarely_seen_where_the_machine_has_its_moods) {
  int wrong = 0;
  constexpr unsigned kPairs = 60;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    wrong += differs(measured(2 * pair + 1, 0, 0, 0.7), measured(2 * pair + 2, 0, 0, 0.7), 0) ? 1 : 0;
  }
  EXPECT_LE(wrong, 7);
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

TEST(Difference, lies_in_its_interval) {
  const auto found = difference(measured(31), measured(32, 0, 5));
  ASSERT_TRUE(found);
  for (const QuantileDifference& q : *found) {
    EXPECT_LE(q.low_us, 5) << q.part;
    EXPECT_GE(q.high_us, 5) << q.part;
    EXPECT_TRUE(q.differs) << q.part;
  }
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

TEST(ResultFile, is_refused_with_one_line_that_says_where) {
  const nlohmann::json good = nlohmann::json::parse(json_of(measured(9)));
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return changed.dump();
  };
  for (const auto& [text, word] : std::vector<std::pair<std::string, std::string>>{
           {"", "parse"},
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
    for (const Finding& f : audit(cpu, 80, root_.string())) {
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
  EXPECT_NE(finding("no swap").remedy.find("swapoff"), std::string::npos);
  EXPECT_NE(finding("clock source").remedy.find("tsc"), std::string::npos);
  EXPECT_NE(finding("interrupts elsewhere", 3).remedy.find("without CPU 3"), std::string::npos);
  EXPECT_NE(finding("interrupts elsewhere", 32).remedy, "");
  EXPECT_EQ(finding("interrupts elsewhere", 4).remedy, "");
  EXPECT_EQ(finding("interrupts elsewhere", 64).remedy, "");
  EXPECT_NE(finding("interrupts elsewhere", -1).remedy, "");
}

TEST_F(FileMachine, that_is_ready_needs_nothing) {
  file("proc/swaps", "Filename Type Size Used Priority\n");
  file("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  file("proc/irq/default_smp_affinity", "07\n");
  for (const char* name : {"no swap", "clock source", "interrupts elsewhere"}) {
    EXPECT_EQ(finding(name).remedy, "") << name;
  }
}

TEST(Measurement, counts_every_tick_once) {
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 0.6;
  const auto result = measure(wanted);
  ASSERT_TRUE(result) << result.error();
  EXPECT_GE(result->ticks + result->missed, 300U);
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
  EXPECT_LE(in_parts, result->ticks);
  EXPECT_GT(in_parts, result->ticks / 2);
  if (result->allocations_watched) {
    EXPECT_EQ(result->allocations, 0U);
  }
  const std::string text = summary(*result, 100);
  EXPECT_NE(text.find("wake-up"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

// Somebody stops the process for a while and lets it go on.
void pause_this_process(int after_ms, int for_ms) {
  const pid_t measured = getpid(), pid = fork();
  if (pid == 0) {
    usleep(static_cast<useconds_t>(after_ms) * 1000);
    (void)kill(measured, SIGSTOP);
    usleep(static_cast<useconds_t>(for_ms) * 1000);
    (void)kill(measured, SIGCONT);
    _exit(0);
  }
  ASSERT_GT(pid, 0);
}

TEST(Measurement, tells_a_wake_up_later_than_many_periods_from_the_release_it_slept_for) {
  constexpr int kPause_ms = 80;
  pause_this_process(250, kPause_ms);
  Wanted wanted;
  wanted.rate_Hz = 500;
  wanted.seconds = 0.8;
  const auto result = measure(wanted);
  while (wait(nullptr) > 0) {
  }
  ASSERT_TRUE(result) << result.error();
  EXPECT_GE(result->wake.max_us, (kPause_ms - 10) * 1e3);
  EXPECT_GE(result->missed, 30U);
  EXPECT_EQ(result->ticks + result->missed, 400U);
  EXPECT_GE(result->wake.longer, 1U);
  ASSERT_FALSE(result->spikes.empty());
  EXPECT_NEAR(result->spikes.back().wake_us, result->wake.max_us, 1e-6);
  EXPECT_NEAR(result->spikes.back().t_s, 0.25, 0.2);
}

}  // namespace
