// No set-point enters a forbidden region, whatever the targets are. Distances are the test's own, ball by
// ball.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rt/control/limits.hpp"
#include "rt/station/alarm.hpp"
#include "tests/support/invariants.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using test::to_regions_m;

constexpr double kBalls_m = 0.05e-6;  // the test's balls are up to 10 um apart

ForbiddenParams floor_and_holder() {
  ForbiddenParams p;
  p.floor.emplace().z_m = 50e-6;
  p.holder = HolderBodyParams{{-100e-6, 0, 0}, {-1, 0, 0}, 45e-6};
  return p;
}

struct Driven {
  explicit Driven(const ForbiddenParams& p, const Vec3& from, double rate_Hz = 1000)
      : regions(p), limits(LimitParams{}, MappingParams{}, rate_Hz, p) {
    limits.restart(from, -Vec3::UnitX());
  }
  double to_regions() const {
    return to_regions_m(regions, limits.set_point().tip_m, limits.set_point().axis);
  }
  void go(const Vec3& to, int ticks, const StageConstraint& c = {}, const Vec3& axis = -Vec3::UnitX()) {
    for (int k = 0; k < ticks; ++k) {
      limits.step({to, axis}, c);
      alarms |= limits.alarms();
      nearest_m = std::min(nearest_m, to_regions());
    }
  }
  ForbiddenParams regions;
  StageLimits limits;
  std::uint32_t alarms = 0;
  double nearest_m = 1;
};

TEST(ForbiddenRegions, no_set_point_enters_one_whatever_the_targets_are) {
  std::mt19937 random(1);
  const auto within = [&](double a, double b) { return std::uniform_real_distribution<>(a, b)(random); };
  int held = 0;
  for (int run = 0; run < 25; ++run) {
    ForbiddenParams p = floor_and_holder();
    p.holder->mouth_m = Vec3(within(-150e-6, 0), within(-60e-6, 60e-6), within(-30e-6, 30e-6));
    p.holder->axis = Vec3(-1, within(-1, 1), within(-0.5, 0.5)).normalized();
    Driven needle(p, {200e-6, 0, 0}, run % 2 == 0 ? 1000 : 4000);
    if (needle.to_regions() < 0) {
      continue;
    }
    for (int leg = 0; leg < 12; ++leg) {
      // Beyond the holder as a rule: the straight way leads through it.
      const Vec3 to(within(-270e-6, 100e-6), within(-150e-6, 150e-6), within(-50e-6, 80e-6));
      needle.go(to, 400, {}, Vec3(-1, within(-0.1, 0.1), within(-0.1, 0.1)).normalized());
    }
    EXPECT_GT(needle.nearest_m, -kBalls_m) << run;
    held += (needle.alarms & alarm_forbidden_region) != 0 ? 1 : 0;
  }
  EXPECT_GT(held, 12);
}

TEST(ForbiddenRegions, let_the_needle_slide_along_them) {
  Driven needle(floor_and_holder(), {100e-6, 0, 0});
  needle.go({0, 40e-6, 90e-6}, 3000);
  const Vec3 tip = needle.limits.set_point().tip_m;
  EXPECT_NEAR(tip.x(), 0, 1e-7);
  EXPECT_NEAR(tip.y(), 40e-6, 1e-7);
  EXPECT_NEAR(tip.z(), (50 - 3.8 - 5) * 1e-6, 1e-8);
  EXPECT_NE(needle.alarms & alarm_forbidden_region, 0U);
  // Round the rim of the holder, until its side holds the needle where the target is behind it.
  Driven round(floor_and_holder(), {-60e-6, 30e-6, 0});
  round.go({-200e-6, 60e-6, 0}, 6000);
  EXPECT_GT(round.nearest_m, -kBalls_m);
  EXPECT_NEAR(round.limits.set_point().tip_m.y(), 60e-6, 5e-6);
  EXPECT_LT(round.limits.set_point().tip_m.x(), -120e-6);
}

TEST(ForbiddenRegions, leave_the_needle_alone_that_passes_at_a_distance) {
  Driven with(floor_and_holder(), {100e-6, 0, 0});
  StageLimits without(LimitParams{}, MappingParams{}, 1000);
  without.restart({100e-6, 0, 0}, -Vec3::UnitX());
  std::mt19937 random(3);
  for (int leg = 0; leg < 20; ++leg) {
    // Above the plane that touches the holder's side.
    const Vec3 to(std::uniform_real_distribution<>(-250e-6, 200e-6)(random),
                  std::uniform_real_distribution<>(62e-6, 150e-6)(random), 0);
    for (int k = 0; k < 500; ++k) {
      with.limits.step({to, -Vec3::UnitX()}, {});
      without.step({to, -Vec3::UnitX()}, {});
      ASSERT_EQ(with.limits.set_point().tip_m, without.set_point().tip_m);
    }
  }
}

TEST(ForbiddenRegions, let_a_needle_that_is_inside_only_out) {
  Driven needle(floor_and_holder(), {100e-6, 0, 45e-6});
  double deepest_m = needle.to_regions();
  ASSERT_LT(deepest_m, -3e-6);
  std::mt19937 random(4);
  for (int leg = 0; leg < 10; ++leg) {
    const Vec3 to(0, std::uniform_real_distribution<>(-50e-6, 50e-6)(random),
                  std::uniform_real_distribution<>(30e-6, 59e-6)(random));
    for (int k = 0; k < 300; ++k) {
      needle.limits.step({to, -Vec3::UnitX()}, {});
      const double now_m = needle.to_regions();
      ASSERT_GT(now_m, std::min(deepest_m, 0.0) - 1e-9);
      deepest_m = std::max(deepest_m, now_m);
    }
  }
  EXPECT_GT(deepest_m, 0);
}

TEST(ForbiddenRegions, stop_a_withdrawal_that_would_lead_into_one) {
  ForbiddenParams p = floor_and_holder();
  p.holder.reset();
  Driven needle(p, {0, 0, 20e-6});
  StageConstraint blind;
  blind.withdrawal_only = true;
  blind.membrane.axis = Vec3(-1, 0, -0.5).normalized();  // backwards is down to the floor
  needle.go({200e-6, 0, 120e-6}, 4000, blind);
  const Vec3 tip = needle.limits.set_point().tip_m;
  EXPECT_NEAR(tip.z(), (50 - 3.8 - 5) * 1e-6, 0.1e-6);
  EXPECT_NEAR(tip.x(), 2 * (tip.z() - 20e-6), 1e-9);  // on its line
  EXPECT_GT(needle.nearest_m, -1e-8);
}

TEST(ForbiddenRegions, keep_the_needle_from_turning_its_shaft_into_the_holder) {
  ForbiddenParams p = floor_and_holder();
  p.floor.reset();
  p.holder = HolderBodyParams{{150e-6, 40e-6, 0}, {0, 1, 0}, 20e-6};  // over the shaft, behind the tip
  Driven needle(p, {0, 0, 0});
  ASSERT_GT(needle.to_regions(), 20e-6);
  const Vec3 into = Vec3(-1, -0.3, 0).normalized();  // the shaft's far end goes to +y
  needle.go({0, 0, 0}, 3000, {}, into);
  EXPECT_GT(needle.nearest_m, -kBalls_m);
  EXPECT_GT(needle.limits.set_point().axis.dot(-Vec3::UnitX()), std::cos(0.25));
  EXPECT_LT(needle.to_regions(), 1e-6);  // as far as it may
}

}  // namespace
}  // namespace punctum::rt
