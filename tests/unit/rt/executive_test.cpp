// The executive on a clock that a script moves.
#include "rt/executive/executive.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

namespace punctum::rt {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kUs = 1'000;

// Time stands still unless someone sleeps or the script says that it passed.
class ScriptedClock final : public hal::Clock {
 public:
  std::int64_t now_ns() const noexcept override { return now; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override {
    ++sleeps;
    if (t_ns > now) {
      now = t_ns;
    }
    const auto late = late_wakes.find(sleeps - 1);
    if (late != late_wakes.end()) {
      now += late->second;
    }
  }

  std::int64_t now = 5 * kMs;
  std::uint64_t sleeps = 0;
  std::map<std::uint64_t, std::int64_t> late_wakes;  // n-th sleep -> by how much it returns late
};

// Notes every tick it runs in, and may take its time.
struct Work {
  ScriptedClock* clock = nullptr;
  std::uint64_t end_at = 0;                          // grid index from which on it ends the loop
  std::map<std::uint64_t, std::int64_t> takes = {};  // grid index -> duration
  std::vector<Tick> ticks = {};

  After run(const Tick& tick) noexcept {
    ticks.push_back(tick);
    if (const auto t = takes.find(tick.index); t != takes.end()) {
      clock->now += t->second;
    }
    return tick.index >= end_at ? After::end : After::go_on;
  }
  [[nodiscard]] std::vector<std::uint64_t> indices() const {
    std::vector<std::uint64_t> all;
    for (const Tick& t : ticks) {
      all.push_back(t.index);
    }
    return all;
  }
};

class ExecutiveTest : public testing::Test {
 protected:
  Executive::Ended run(std::vector<Slot> slots, ExecutiveConfig config = {}) {
    return Executive(clock, clock, config, slots, *status).run(stop);
  }

  ScriptedClock clock;
  std::atomic<bool> stop{false};
  std::unique_ptr<CoreStatus> status = std::make_unique<CoreStatus>();
};

using Indices = std::vector<std::uint64_t>;

TEST_F(ExecutiveTest, ticks_are_released_on_the_grid_from_one_period_after_the_start) {
  Work work{.clock = &clock, .end_at = 3};
  EXPECT_EQ(run({slot<&Work::run>("servo", work)}), Executive::Ended::by_slot);
  EXPECT_EQ(work.indices(), (Indices{0, 1, 2, 3}));
  EXPECT_EQ(work.ticks[0].release_ns, 6 * kMs);
  EXPECT_EQ(work.ticks[3].release_ns, 9 * kMs);
  EXPECT_EQ(work.ticks[3].wake_ns, 9 * kMs);
  EXPECT_EQ(work.ticks[3].missed, 0U);
  EXPECT_EQ(status->ticks.load(), 4U);
  EXPECT_EQ(status->start_ns.load(), static_cast<std::uint64_t>(6 * kMs));
}

TEST_F(ExecutiveTest, the_grid_begins_where_it_is_told_to_even_if_that_has_passed) {
  Work work{.clock = &clock, .end_at = 3};
  run({slot<&Work::run>("servo", work)}, {.start_ns = 100 * kMs});
  EXPECT_EQ(work.ticks[0].release_ns, 100 * kMs);
  work = {.clock = &clock, .end_at = 5};
  run({slot<&Work::run>("servo", work)}, {.start_ns = clock.now - 3 * kMs - 1});
  EXPECT_EQ(work.indices(), (Indices{3, 4, 5})) << "what passed before the loop is missed, too";
}

TEST_F(ExecutiveTest, on_a_virtual_clock_the_wake_up_latency_is_zero) {
  Work work{.clock = &clock, .end_at = 99};
  run({slot<&Work::run>("servo", work)});
  EXPECT_EQ(status->wake.count(), 100U);
  EXPECT_EQ(status->wake.bin(0), 100U);
  EXPECT_EQ(status->wake.max_us(), 0.0);
  EXPECT_EQ(status->slots[0].wake.max_us(), 0.0);
}

TEST_F(ExecutiveTest, a_tick_that_takes_too_long_skips_the_releases_it_missed_and_stays_on_the_grid) {
  Work work{.clock = &clock, .end_at = 9, .takes = {{2, 3 * kMs + 200 * kUs}}};
  run({slot<&Work::run>("servo", work)});
  // Tick 2 ends 3.2 periods after its release: 3, 4 and 5 have passed, 6 is the next that lies ahead.
  EXPECT_EQ(work.indices(), (Indices{0, 1, 2, 6, 7, 8, 9}));
  EXPECT_EQ(work.ticks[3].wake_ns, work.ticks[3].release_ns);
  EXPECT_EQ(work.ticks[3].late_ns, 0);
  EXPECT_EQ(work.ticks[3].missed, 3U);
  EXPECT_EQ(work.ticks[3].period_ns, 4 * kMs) << "the real period, not the nominal one";
  EXPECT_EQ(work.ticks[4].period_ns, 1 * kMs);
  LateTick late;
  ASSERT_EQ(status->late.head(), 1U);
  ASSERT_EQ(status->late.read(0, late), hal::Read::ok);
  EXPECT_EQ(late.index, 2U);
  EXPECT_EQ(late.missed, 3U);
  EXPECT_EQ(late.end_ns - late.release_ns, 3 * kMs + 200 * kUs);
  EXPECT_EQ(late.wake_ns, late.release_ns);
  EXPECT_EQ(late.longest_slot_ns, 3 * kMs + 200 * kUs);
  EXPECT_EQ(status->missed.load(), 3U);
  EXPECT_EQ(status->ticks.load(), 7U);
  EXPECT_EQ(status->slots[0].skipped.load(), 3U);
}

TEST_F(ExecutiveTest, a_tick_that_ends_exactly_at_the_next_release_misses_nothing) {
  Work work{.clock = &clock, .end_at = 4, .takes = {{1, 1 * kMs}}};
  run({slot<&Work::run>("servo", work)});
  EXPECT_EQ(work.indices(), (Indices{0, 1, 2, 3, 4}));
  EXPECT_EQ(status->missed.load(), 0U);
}

TEST_F(ExecutiveTest, a_late_wake_up_runs_one_tick_for_the_newest_release_and_counts_the_others) {
  clock.late_wakes[2] = 2 * kMs + 700 * kUs;
  Work work{.clock = &clock, .end_at = 7};
  run({slot<&Work::run>("servo", work)});
  EXPECT_EQ(work.indices(), (Indices{0, 1, 4, 5, 6, 7}));
  EXPECT_EQ(work.ticks[2].wake_ns - work.ticks[2].release_ns, 700 * kUs);
  EXPECT_EQ(work.ticks[2].late_ns, 2 * kMs + 700 * kUs) << "after the release it slept for";
  EXPECT_EQ(work.ticks[2].period_ns, 3 * kMs + 700 * kUs);
  EXPECT_EQ(work.ticks[3].period_ns, 300 * kUs) << "back on the grid at once";
  EXPECT_EQ(status->missed.load(), 2U);
  EXPECT_EQ(status->worst_lateness_ns.load(), static_cast<std::uint64_t>(2 * kMs + 700 * kUs));
  EXPECT_EQ(status->wake.overflow(), 1U) << "2.7 ms lie beyond the bins, and are counted";
  EXPECT_EQ(status->wake.max_us(), 2700.0);
}

TEST_F(ExecutiveTest, a_small_lateness_is_a_latency_and_no_miss) {
  clock.late_wakes[1] = 130 * kUs;
  Work work{.clock = &clock, .end_at = 3};
  run({slot<&Work::run>("servo", work)});
  EXPECT_EQ(work.indices(), (Indices{0, 1, 2, 3}));
  EXPECT_EQ(work.ticks[1].period_ns, 1 * kMs + 130 * kUs);
  EXPECT_EQ(work.ticks[2].period_ns, 1 * kMs - 130 * kUs);
  EXPECT_EQ(status->wake.bin(130), 1U);
  EXPECT_EQ(status->missed.load(), 0U);
}

TEST_F(ExecutiveTest, no_release_ever_runs_twice_and_time_never_runs_back_whatever_the_delays) {
  std::uint64_t random = 12345;
  const auto next = [&random] { return random = random * 6364136223846793005ULL + 1442695040888963407ULL; };
  for (std::uint64_t n = 0; n < 20000; ++n) {
    if (next() >> 60 == 0) {
      clock.late_wakes[n] = static_cast<std::int64_t>((next() >> 33) % (5 * kMs));
    }
  }
  Work work{.clock = &clock, .end_at = 20000};
  for (std::uint64_t i = 0; i < 20000; ++i) {
    if (next() >> 60 == 0) {
      work.takes[i] = static_cast<std::int64_t>((next() >> 33) % (5 * kMs));
    }
  }
  run({slot<&Work::run>("servo", work)});
  for (std::size_t i = 1; i < work.ticks.size(); ++i) {
    const Tick& before = work.ticks[i - 1];
    const Tick& tick = work.ticks[i];
    ASSERT_GT(tick.index, before.index);
    ASSERT_EQ(tick.release_ns, 6 * kMs + static_cast<std::int64_t>(tick.index) * kMs);
    ASSERT_GE(tick.wake_ns, tick.release_ns);
    ASSERT_LT(tick.wake_ns, tick.release_ns + kMs) << "of several missed releases only the newest runs";
    ASSERT_EQ(tick.period_ns, tick.wake_ns - before.wake_ns);
    ASSERT_GT(tick.period_ns, 0);
    ASSERT_EQ(tick.missed, tick.index + 1 - (i + 1));
  }
  EXPECT_GT(status->missed.load(), 1000U);
}

TEST_F(ExecutiveTest, slots_run_on_their_divisors_and_offsets_in_the_order_of_the_table) {
  Work servo{.clock = &clock, .end_at = 20};
  Work stage{.clock = &clock, .end_at = 1000};
  Work heartbeat{.clock = &clock, .end_at = 1000};
  run({slot<&Work::run>("servo", servo), slot<&Work::run>("stage", stage, 4, 1),
       slot<&Work::run>("heartbeat", heartbeat, 10, 7)});
  EXPECT_EQ(servo.ticks.size(), 21U);
  EXPECT_EQ(stage.indices(), (Indices{1, 5, 9, 13, 17}));
  EXPECT_EQ(heartbeat.indices(), (Indices{7, 17}));
  EXPECT_EQ(stage.ticks[0].period_ns, 4 * kMs) << "nominal before there is a previous run";
  EXPECT_EQ(stage.ticks[1].period_ns, 4 * kMs);
  EXPECT_EQ(heartbeat.ticks[1].period_ns, 10 * kMs);
  EXPECT_STREQ(status->slots[2].name.text, "heartbeat");
  EXPECT_EQ(status->slot_count.load(), 3U);
  EXPECT_EQ(status->slots[1].runs.load(), 5U);
}

TEST_F(ExecutiveTest,
       a_slow_slot_whose_release_was_missed_runs_once_at_the_next_tick_and_then_on_its_grid_again) {
  Work servo{.clock = &clock, .end_at = 30, .takes = {{6, 2 * kMs}}};  // 7 is missed
  Work slow{.clock = &clock, .end_at = 1000};
  run({slot<&Work::run>("servo", servo), slot<&Work::run>("slow", slow, 10, 7)});
  EXPECT_EQ(slow.indices(), (Indices{8, 17, 27}));
  EXPECT_EQ(slow.ticks[1].period_ns, 9 * kMs);
  EXPECT_EQ(status->slots[1].skipped.load(), 0U);
}

TEST_F(ExecutiveTest, a_long_stall_runs_a_slow_slot_once_not_once_per_missed_release) {
  Work servo{.clock = &clock, .end_at = 100, .takes = {{6, 50 * kMs}}};
  Work slow{.clock = &clock, .end_at = 1000};
  run({slot<&Work::run>("servo", servo), slot<&Work::run>("slow", slow, 10, 7)});
  EXPECT_EQ(slow.indices(), (Indices{56, 57, 67, 77, 87, 97}));
  EXPECT_EQ(status->slots[1].skipped.load(), 4U) << "7, 17, 27, 37 lost; 47 ran late at 56";
}

TEST_F(ExecutiveTest, a_steady_overload_starves_no_slot) {
  Work servo{.clock = &clock, .end_at = 1000};
  for (std::uint64_t i = 0; i < 1000; ++i) {
    servo.takes[i] = 1 * kMs + 500 * kUs;  // every second tick is missed
  }
  Work odd{.clock = &clock, .end_at = 100000};
  run({slot<&Work::run>("servo", servo), slot<&Work::run>("odd", odd, 2, 1)});
  EXPECT_GE(odd.ticks.size(), 499U);
}

TEST_F(ExecutiveTest, the_wake_latency_of_a_later_slot_includes_the_slots_before_it) {
  Work first{.clock = &clock, .end_at = 0, .takes = {{0, 40 * kUs}}};
  Work second{.clock = &clock, .end_at = 0, .takes = {{0, 7 * kUs}}};
  run({slot<&Work::run>("first", first), slot<&Work::run>("second", second)});
  EXPECT_EQ(status->slots[0].wake.bin(0), 1U);
  EXPECT_EQ(status->slots[1].wake.bin(40), 1U);
  EXPECT_EQ(status->slots[0].execution.bin(40), 1U);
  EXPECT_EQ(status->slots[1].execution.bin(7), 1U);
  EXPECT_EQ(status->tick.bin(47), 1U);
}

TEST_F(ExecutiveTest, the_stop_flag_ends_the_loop_before_any_slot_of_the_next_tick_runs) {
  struct Stopper {
    std::atomic<bool>* stop;
    int runs = 0;
    After run(const Tick& tick) noexcept {
      ++runs;
      if (tick.index == 4) {
        stop->store(true);
      }
      return After::go_on;
    }
  } stopper{&stop};
  EXPECT_EQ(run({slot<&Stopper::run>("stopper", stopper)}), Executive::Ended::by_stop_flag);
  EXPECT_EQ(stopper.runs, 5);
}

TEST_F(ExecutiveTest, when_a_slot_ends_the_loop_the_later_slots_of_that_tick_still_run) {
  Work servo{.clock = &clock, .end_at = 2};
  Work heartbeat{.clock = &clock, .end_at = 1000};
  run({slot<&Work::run>("servo", servo), slot<&Work::run>("heartbeat", heartbeat)});
  EXPECT_EQ(heartbeat.indices(), (Indices{0, 1, 2}));
}

TEST_F(ExecutiveTest, refuses_tables_that_cannot_run) {
  Work work{.clock = &clock};
  const Slot good = slot<&Work::run>("good", work);
  EXPECT_EQ(run({}), Executive::Ended::invalid);
  EXPECT_EQ(run({slot<&Work::run>("divisor", work, 0)}), Executive::Ended::invalid);
  EXPECT_EQ(run({slot<&Work::run>("offset", work, 4, 4)}), Executive::Ended::invalid);
  EXPECT_EQ(run({Slot{.name = "nothing"}}), Executive::Ended::invalid);
  EXPECT_EQ(run(std::vector<Slot>(kMaxSlots + 1, good)), Executive::Ended::invalid);
  EXPECT_EQ(run({good}, {.period_ns = 0}), Executive::Ended::invalid);
  EXPECT_TRUE(work.ticks.empty());
}

TEST_F(ExecutiveTest, missed_releases_leave_the_sliding_window_exactly_when_it_has_passed) {
  Work work{.clock = &clock, .end_at = 40, .takes = {{5, 3 * kMs + 1}}};  // 6, 7, 8 are missed
  run({slot<&Work::run>("servo", work)}, {.overrun_window_ticks = 10});
  for (const Tick& tick : work.ticks) {
    std::uint64_t expected = 0;  // of 6, 7, 8 within (index - 10, index]
    for (std::uint64_t m = 6; m <= 8; ++m) {
      expected += m <= tick.index && m + 10 > tick.index ? 1U : 0U;
    }
    EXPECT_EQ(tick.missed_in_window, expected) << "tick " << tick.index;
  }
}

TEST(MissedWindow, agrees_with_counting_by_hand_for_random_gaps_and_windows) {
  std::uint64_t random = 99;
  const auto next = [&random] {
    return (random = random * 6364136223846793005ULL + 1442695040888963407ULL) >> 33;
  };
  for (const std::uint32_t ticks : {1U, 2U, 63U, 64U, 65U, 1000U}) {
    MissedWindow window(ticks);
    std::vector<char> missed;
    for (int i = 0; i < 3000; ++i) {
      const std::uint64_t gap = next() % 50 == 0 ? next() % (3 * ticks + 2) : next() % 3 == 0 ? 1 : 0;
      missed.insert(missed.end(), gap, 1);
      missed.push_back(0);
      std::uint32_t expected = 0;
      const std::size_t from = missed.size() > ticks ? missed.size() - ticks : 0;
      for (std::size_t k = from; k < missed.size(); ++k) {
        expected += missed[k] != 0 ? 1U : 0U;
      }
      ASSERT_EQ(window.advance(missed.size() - 1), expected) << "window " << ticks << " step " << i;
    }
  }
}

TEST(MissedWindow, survives_a_gap_of_years_at_once) {
  MissedWindow window(1000);
  window.advance(0);
  EXPECT_EQ(window.advance(std::uint64_t{1} << 45), 999U);
}

struct Counter {
  std::uint64_t end_at = 0;
  std::uint64_t ticks = 0;
  std::int64_t first_ns = 0;  // release of tick 0
  std::int64_t last_ns = 0;
  std::int64_t off_grid = 0;
  std::int64_t period_ns = 0;
  After run(const Tick& tick) noexcept {
    if (ticks++ == 0) {
      first_ns = tick.release_ns - static_cast<std::int64_t>(tick.index) * period_ns;
    }
    last_ns = tick.release_ns;
    if (tick.wake_ns != first_ns + static_cast<std::int64_t>(tick.index) * period_ns) {
      ++off_grid;
    }
    return tick.index >= end_at ? After::end : After::go_on;
  }
};

TEST_F(ExecutiveTest, keeps_the_grid_to_the_nanosecond_over_ten_million_ticks) {
  Counter servo{.end_at = 10'000'000, .period_ns = 125 * kUs};
  Counter slow{.end_at = ~std::uint64_t{0}, .period_ns = 125 * kUs};
  run({slot<&Counter::run>("servo", servo), slot<&Counter::run>("slow", slow, 8, 3)},
      {.period_ns = 125 * kUs, .overrun_window_ticks = 8000});
  EXPECT_EQ(servo.ticks, 10'000'001U);
  EXPECT_EQ(slow.ticks, 1'250'000U);
  EXPECT_EQ(servo.last_ns - servo.first_ns, 10'000'000 * 125 * kUs);
  EXPECT_EQ(servo.off_grid + slow.off_grid, 0);
  EXPECT_EQ(status->missed.load(), 0U);
  EXPECT_EQ(status->wake.bin(0), 10'000'001U);
}

TEST_F(ExecutiveTest, indices_and_times_do_not_wrap_within_a_century) {
  // One stall of a hundred years: index 3.2e12 at 1 kHz, 3.2e18 ns.
  const std::int64_t century = std::int64_t{36525} * 86400 * 1000 * kMs;
  Work work{.clock = &clock, .end_at = 3, .takes = {{1, century}}};
  Work slow{.clock = &clock, .end_at = ~std::uint64_t{0}};
  run({slot<&Work::run>("servo", work), slot<&Work::run>("slow", slow, 7, 2)});
  ASSERT_EQ(work.ticks.size(), 3U);
  EXPECT_EQ(work.ticks[2].index, static_cast<std::uint64_t>(century / kMs) + 1);
  EXPECT_EQ(work.ticks[2].release_ns, 6 * kMs + century + kMs);
  EXPECT_EQ(status->missed.load(), static_cast<std::uint64_t>(century / kMs) - 1);
  EXPECT_EQ(slow.ticks.size(), 1U);
}

TEST(Histogram, the_percentile_is_never_better_than_the_truth) {
  auto histogram = std::make_unique<TimeHistogram>();
  EXPECT_EQ(histogram->percentile_us(0.5), 0.0);
  for (int us = 0; us < 1000; ++us) {
    histogram->add(us * kUs + 300);  // 0.3 .. 999.3 us
  }
  EXPECT_EQ(histogram->percentile_us(0.5), 500.0);
  EXPECT_EQ(histogram->percentile_us(0.99), 990.0);
  EXPECT_DOUBLE_EQ(histogram->percentile_us(1.0), 999.3) << "the maximum is known more finely than its bin";
  histogram->add(5 * kMs);
  EXPECT_EQ(histogram->overflow(), 1U);
  EXPECT_EQ(histogram->percentile_us(1.0), 5000.0);
  histogram->add(-20);
  EXPECT_EQ(histogram->bin(0), 2U);
}

}  // namespace
}  // namespace punctum::rt
