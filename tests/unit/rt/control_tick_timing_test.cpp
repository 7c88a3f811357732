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

TEST(TickTiming, tells_the_first_tick_from_the_others) {
  TickTiming timing(ServoConfig{}, false);
  EXPECT_TRUE(timing.step(after(1e-3)).first);
  EXPECT_FALSE(timing.step(after(1e-3)).first);
}

TEST(TickTiming, counts_all_of_a_late_tick_but_bounds_what_ramps_advance_by) {
  TickTiming timing(ServoConfig{}, false);
  const TickTime time = timing.step(after(0.5));
  EXPECT_EQ(time.elapsed_s, 0.5);
  EXPECT_EQ(time.dt_s, 0.02);
}

TEST(TickTiming, replaces_a_period_that_no_clock_can_mean) {
  TickTiming timing(ServoConfig{}, false);
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(timing.step(after(bad)).elapsed_s, 1e-3) << bad;
  }
  EXPECT_EQ(timing.step(after(1e-9)).elapsed_s, 1e-4);  // no two ticks are nearer than a tenth of a period
}

TEST(TickTiming, stands_still_until_a_clock_that_went_back_has_caught_up) {
  TickTiming timing(ServoConfig{}, false);
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
  TickTiming timing(ServoConfig{}, false);
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
    TickTiming timing(config, false);
    TickTime time = timing.step(after(1e-3, 20));
    EXPECT_EQ(time.fault, Fault::none);
    EXPECT_EQ(time.alarms, 0U);
    time = timing.step(after(1e-3, 21));
    EXPECT_EQ(time.fault, real ? Fault::overrun : Fault::none);
    EXPECT_EQ(time.alarms, real ? 0U : alarm_overrun);
  }
}

TEST(TickTiming, raises_the_alarm_of_missing_real_time_rights_on_every_tick) {
  TickTiming timing(ServoConfig{}, true);
  EXPECT_EQ(timing.step(after(1e-3)).alarms, alarm_degraded);
  EXPECT_EQ(timing.step(after(1e-3)).alarms, alarm_degraded);
}

}  // namespace
}  // namespace punctum::rt
