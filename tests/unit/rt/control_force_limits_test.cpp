// The limits of forces: the needle's on the cell, the hand's on the operator.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "rt/control/force_limits.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

TEST(ForceLimits, passes_a_small_force_on_in_the_axes_of_the_device) {
  ForceLimits limits(LimitParams{}, 1000);
  const LimitedForces out = limits.step(Vec3(1, 0.5, -0.2), 0, Readings{}, Vec3(1, -0.5, 0.2), 1e-3);
  EXPECT_EQ(out.hand_force_N, Vec3(1, -0.5, 0.2));
  EXPECT_EQ(out.alarms, 0U);
  EXPECT_EQ(out.fault, Fault::none);
}

TEST(ForceLimits, bounds_the_hands_force_and_keeps_its_direction) {
  ForceLimits limits(LimitParams{}, 1000);
  const LimitedForces out = limits.step(Vec3(30, 40, 0), 0, Readings{}, Vec3(1.8, -2.4, 0), 1e-3);
  EXPECT_LT((out.hand_force_N - Vec3(1.8, -2.4, 0)).norm(), 1e-12);
  EXPECT_EQ(out.alarms, alarm_force_limited);
}

TEST(ForceLimits, takes_a_lower_commanded_limit_and_no_higher_one) {
  ForceLimits limits(LimitParams{}, 1000);
  const Vec3 lower_N(0.6, -0.8, 0), scenes_N(1.8, -2.4, 0), wanted_N(30, 40, 0);
  EXPECT_LT((limits.step(wanted_N, 0, Readings{}, lower_N, 1e-3, 1).hand_force_N - lower_N).norm(), 1e-12);
  EXPECT_LT((limits.step(wanted_N, 0, Readings{}, scenes_N, 1e-3, 99).hand_force_N - scenes_N).norm(), 1e-12);
}

TEST(ForceLimits, changes_the_hands_force_without_a_jolt_whatever_is_wanted_and_however_late_a_tick_is) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-20, 20);
  std::uniform_real_distribution<double> seconds(1e-4, 0.02);
  ForceLimits limits(LimitParams{}, 1000);
  Vec3 last_N = Vec3::Zero();
  for (int k = 0; k < 10'000; ++k) {
    const double dt_s = seconds(random);
    const Vec3 wanted_N(any(random), any(random), any(random));
    const Vec3 next_N = limits.step(wanted_N, 0, Readings{}, last_N, dt_s).hand_force_N;
    // Of a late tick: from what it may have let go to, straight towards zero.
    double least_N = (next_N - last_N).norm();
    const double lets_go_N = std::min(last_N.norm(), 300 * std::max(0.0, dt_s - 2e-3));
    for (int i = 0; i <= 1000 && lets_go_N > 0; ++i) {
      const Vec3 from_N = last_N * (1 - 1e-3 * i * lets_go_N / last_N.norm());
      least_N = std::min(least_N, (next_N - from_N).norm());
    }
    ASSERT_LE(least_N, 300 * std::min(dt_s, 2e-3) + (lets_go_N > 0 ? 5e-4 : 1e-9));
    ASSERT_LE(next_N.norm(), LimitParams{}.hand_force_N * (1 + 1e-12));
    last_N = next_N;
  }
  for (int k = 0; k < 40; ++k) {
    last_N = limits.step(Vec3(0.5, 0, 0), 0, Readings{}, last_N, 1e-3).hand_force_N;
  }
  EXPECT_EQ(last_N, Vec3(0.5, 0, 0));
}

TEST(ForceLimits, lets_go_on_a_late_tick_of_what_the_force_would_have_lost_by_then) {
  ForceLimits limits(LimitParams{}, 1000);
  const auto next_N = [&limits](const Vec3& last_N, const Vec3& wanted_N, double dt_s) {
    // Device axes against world axes: x alike.
    return limits.step(wanted_N, 0, Readings{}, last_N, dt_s).hand_force_N;
  };
  const Vec3 last_N(2, 0, 0);
  EXPECT_NEAR(next_N(last_N, Vec3::Zero(), 1e-3).x(), 1.7, 1e-12);
  EXPECT_NEAR(next_N(last_N, Vec3::Zero(), 2e-3).x(), 1.4, 1e-12);
  EXPECT_NEAR(next_N(last_N, Vec3::Zero(), 5e-3).x(), 0.5, 1e-12);
  EXPECT_NEAR(next_N(last_N, Vec3::Zero(), 20e-3).x(), 0, 1e-12);
  // Through zero and beyond it no faster than on time, to more force neither.
  EXPECT_NEAR(next_N(last_N, Vec3(-2, 0, 0), 20e-3).x(), -0.6, 1e-12);
  EXPECT_NEAR(next_N(last_N, Vec3(3, 0, 0), 20e-3).x(), 2.6, 1e-12);
  EXPECT_NEAR(next_N(last_N, Vec3(1.9, 0, 0), 20e-3).x(), 1.9, 1e-12);
  EXPECT_NEAR(next_N(Vec3::Zero(), Vec3(3, 0, 0), 20e-3).x(), 0.6, 1e-12);
}

TEST(ForceLimits, makes_a_force_that_is_no_number_a_fault_and_gives_none) {
  ForceLimits limits(LimitParams{}, 1000);
  const LimitedForces out =
      limits.step(Vec3(0, std::numeric_limits<double>::quiet_NaN(), 0), 0, Readings{}, Vec3(1, 0, 0), 1e-3);
  EXPECT_EQ(out.fault, Fault::not_finite);
  EXPECT_EQ(out.hand_force_N.norm(), 0);
}

TEST(ForceLimits, holds_the_needle_from_the_soft_limit_on_with_a_hysteresis) {
  ForceLimits limits(LimitParams{}, 1000);
  EXPECT_FALSE(limits.step(Vec3::Zero(), 29e-6, Readings{}, Vec3::Zero(), 1e-3).tip_force_soft);
  EXPECT_EQ(limits.step(Vec3::Zero(), 31e-6, Readings{}, Vec3::Zero(), 1e-3).alarms, alarm_tip_force);
  EXPECT_TRUE(limits.step(Vec3::Zero(), 28e-6, Readings{}, Vec3::Zero(), 1e-3).tip_force_soft);
  EXPECT_FALSE(limits.step(Vec3::Zero(), 26e-6, Readings{}, Vec3::Zero(), 1e-3).tip_force_soft);
}

TEST(ForceLimits, takes_the_larger_of_law_and_sensor_for_the_tip_force) {
  for (const bool law : {true, false}) {
    ForceLimits limits(LimitParams{}, 1000);
    Readings readings;
    readings.sensor_fresh = true;
    readings.sensor_filtered_N = law ? 0 : 61e-6;
    EXPECT_EQ(limits.step(Vec3::Zero(), law ? 61e-6 : 0, readings, Vec3::Zero(), 1e-3).fault,
              Fault::tip_force);
    readings.sensor_fresh = false;
    EXPECT_EQ(limits.step(Vec3::Zero(), 0, readings, Vec3::Zero(), 1e-3).fault, Fault::none);
  }
}

}  // namespace
}  // namespace punctum::rt
