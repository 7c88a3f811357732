// How much time a tick counts.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/control/tick_timing.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

TickInfo after(double period_s, std::uint64_t missed = 0) {
  TickInfo now;
  now.period_s = period_s;
  now.missed_in_window = missed;
  return now;
}

// A grid of 1 kHz.
struct Timing {
  explicit Timing(const ServoConfig& config = {}, bool degraded = false) : timing(config, degraded) {}
  TickTime step(TickInfo now) {
    now.tick = tick++;
    return timing.step(now);
  }
  TickTiming timing;
  std::uint64_t tick = 0;
};

TEST(TickTiming, tells_the_first_tick_from_the_others) {
  Timing timing;
  EXPECT_TRUE(timing.step(after(1e-3)).first);
  EXPECT_FALSE(timing.step(after(1e-3)).first);
}

TEST(TickTiming, counts_all_of_a_late_tick_but_bounds_what_ramps_advance_by) {
  Timing timing;
  const TickTime time = timing.step(after(0.5));
  EXPECT_EQ(time.elapsed_s, 0.5);
  EXPECT_EQ(time.dt_s, 0.02);
}

TEST(TickTiming, replaces_a_period_that_no_clock_can_mean) {
  Timing timing;
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(timing.step(after(bad)).elapsed_s, 1e-3) << bad;
  }
  EXPECT_EQ(timing.step(after(1e-9)).elapsed_s, 1e-4);  // no two ticks are nearer than a tenth of a period
}

TEST(TickTiming, counts_the_true_period_whichever_of_its_three_clocks_is_wrong) {
  for (const int which : {0, 1, 2}) {
    for (const double wrong_s : {-0.5, -1e-4, 1e-9, 2e-4, 5e-3, 40.0}) {
      TickTiming timing(ServoConfig{}, false);
      TickInfo now{.tick = 1000, .start_ns = 100'000'000'000, .period_s = 1e-3};
      (void)timing.step(now);
      now.tick += which == 0 && wrong_s > 1 ? 5000 : 1;
      now.start_ns += which == 1 ? std::llround(1e9 * wrong_s) : 1'000'000;
      now.period_s = which == 2 ? wrong_s : 1e-3;
      EXPECT_NEAR(timing.step(now).elapsed_s, 1e-3, 1e-15) << which << ", " << wrong_s;
    }
  }
}

TEST(TickTiming, stands_still_until_a_clock_that_went_back_has_caught_up) {
  Timing timing;
  TickInfo now = after(1e-3);
  std::int64_t last_ns = 999'999'999;
  for (const std::int64_t start_ns : {1'000'000'000, 500'000'000, 501'000'000, 999'000'000}) {
    now.start_ns = start_ns;
    const TickTime time = timing.step(now);
    EXPECT_EQ(time.now_ns, last_ns + 1);
    EXPECT_EQ(time.elapsed_s, 1e-3);  // the tick counts as any other
    last_ns = time.now_ns;
  }
  now.start_ns = 1'001'000'000;
  EXPECT_EQ(timing.step(now).now_ns, 1'001'000'000);
}

TEST(TickTiming, is_not_carried_away_by_one_reading_of_the_clock_far_ahead) {
  Timing timing;
  TickInfo now = after(1e-3);
  now.start_ns = 1'000'000'000;
  EXPECT_EQ(timing.step(now).now_ns, 1'000'000'000);
  now.start_ns = 2'001'000'000;
  EXPECT_LE(timing.step(now).now_ns, 1'011'000'000);
  now.start_ns = 1'020'000'000;
  EXPECT_EQ(timing.step(now).now_ns, 1'020'000'000);
  // A second that the executive has measured is one.
  now = after(1);
  now.start_ns = 2'020'000'000;
  EXPECT_EQ(timing.step(now).now_ns, 2'020'000'000);
}

TEST(TickTiming, makes_missed_ticks_a_fault_with_real_actuators_and_an_alarm_without) {
  for (const bool real : {false, true}) {
    ServoConfig config;
    config.real_actuators = real;
    Timing timing(config);
    TickTime time = timing.step(after(1e-3, 20));
    EXPECT_EQ(time.fault, Fault::none);
    EXPECT_EQ(time.alarms, 0U);
    time = timing.step(after(1e-3, 21));
    EXPECT_EQ(time.fault, real ? Fault::overrun : Fault::none);
    EXPECT_EQ(time.alarms, real ? 0U : alarm_overrun);
  }
}

TEST(TickTiming, raises_the_alarm_of_missing_real_time_rights_on_every_tick) {
  Timing timing(ServoConfig{}, true);
  EXPECT_EQ(timing.step(after(1e-3)).alarms, alarm_degraded);
  EXPECT_EQ(timing.step(after(1e-3)).alarms, alarm_degraded);
}

}  // namespace
}  // namespace punctum::rt
