// Forbidden regions: distances against balls laid along the needle one by one, the walls' force against the
// difference quotient of their energy.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rt/forces/effects.hpp"
#include "rt/forces/forbidden_walls.hpp"
#include "tests/support/invariants.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

ForbiddenParams both() {
  ForbiddenParams p;
  p.floor.emplace().z_m = 65e-6;
  p.holder = HolderBodyParams{{-100e-6, 0, 0}, {-1, 0, 0}, 45e-6};
  return p;
}

double apart_m(const ForbiddenParams& params, Region region, const NeedlePose& needle) {
  const ForbiddenRegions regions(params);
  return regions.apart_m(region, regions.away(region, needle), needle);
}

TEST(ForbiddenRegions, are_as_far_as_geometry_says) {
  const ForbiddenParams p = both();
  // Tip radius 3.8, clearance 5.
  EXPECT_NEAR(apart_m(p, Region::floor, {{0, 0, 20e-6}, {-1, 0, 0}}), (65 - 20 - 3.8 - 5) * 1e-6, 1e-12);
  EXPECT_NEAR(apart_m(p, Region::holder, {{-40e-6, 0, 0}, {-1, 0, 0}}), (60 - 3.8 - 5) * 1e-6, 1e-10);
  // Beside the holder and 60 um past its mouth: where the mouth is, the taper is 3.8 + 60/160 * 5.2 thick.
  EXPECT_NEAR(apart_m(p, Region::holder, {{-160e-6, 70e-6, 0}, {-1, 0, 0}}),
              (70 - 45 - (3.8 + 60 * 5.2 / 160) - 5) * 1e-6, 0.1e-6);
  // Far past it, the shaft runs along it.
  EXPECT_NEAR(apart_m(p, Region::holder, {{-600e-6, 0, -80e-6}, {-1, 0, 0}}), (80 - 45 - 9 - 5) * 1e-6, 1e-9);
  ForbiddenParams above = p;
  above.floor->z_m = -65e-6;  // an inverted microscope
  EXPECT_NEAR(apart_m(above, Region::floor, {{0, 0, -50e-6}, {-1, 0, 0}}), (65 - 50 - 3.8 - 5) * 1e-6, 1e-12);
}

TEST(ForbiddenRegions, are_as_far_as_the_nearest_of_the_needles_balls) {
  std::mt19937 random(1);
  const auto within = [&](double a, double b) { return std::uniform_real_distribution<>(a, b)(random); };
  ForbiddenParams p = both();
  p.floor.reset();
  int near = 0;
  for (int i = 0; i < 6000; ++i) {
    p.holder->mouth_m = Vec3(within(-1, 1), within(-1, 1), within(-1, 1)) * 100e-6;
    p.holder->axis = Vec3(within(-1, 1), within(-1, 1), within(-1, 1)).normalized();
    const NeedlePose needle{Vec3(within(-1, 1), within(-1, 1), within(-1, 1)) * 200e-6,
                            Vec3(-1, within(-0.3, 0.3), within(-0.3, 0.3)).normalized()};
    const double found_m = apart_m(p, Region::holder, needle);
    const double balls_m = test::to_regions_m(p, needle.tip_m, needle.axis, 4000, 10e-3);
    if (balls_m > 0) {
      ++near;
      ASSERT_NEAR(found_m, balls_m, 0.2e-6) << i;
    } else {
      ASSERT_LT(std::min(found_m, 0.0), 1e-9) << i;
    }
    ASSERT_LT(found_m, std::max(balls_m, 0.0) + 1e-9) << i;  // never further than in truth
  }
  EXPECT_GT(near, 2000);
}

EffectInput at(const Vec3& point_m) {
  EffectInput in;
  in.dt_s = 1e-3;
  in.fixture_point_m = point_m;
  in.handle_m = in.position_scale * point_m;
  in.coupling_gain = 1;
  return in;
}

TEST(ForbiddenWalls, push_away_with_the_force_of_their_energy) {
  const ForbiddenParams p = both();
  std::mt19937 random(2);
  const auto within = [&](double a, double b) { return std::uniform_real_distribution<>(a, b)(random); };
  int felt = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 tip(within(-200e-6, -60e-6), within(-90e-6, 90e-6), within(-60e-6, 60e-6));
    EffectInput in = at(tip);
    in.needle_axis = Vec3(-1, within(-0.1, 0.1), within(-0.1, 0.1)).normalized();
    const auto energy_J = [&](const Vec3& point_m) {
      EffectInput there = in;
      there.fixture_point_m = point_m;
      return ForbiddenWalls(p, {}).step(there).stored_J;
    };
    ForbiddenWalls walls(p, {});
    const EffectOutput out = walls.step(in);
    if (test::to_regions_m(p, tip, in.needle_axis) < 0.2e-6) {
      continue;  // the hand's point does not come here
    }
    const double h = 1e-8;
    Vec3 slope;
    for (int k = 0; k < 3; ++k) {
      slope[k] = (energy_J(tip + h * Vec3::Unit(k)) - energy_J(tip - h * Vec3::Unit(k))) / (2 * h) /
                 in.position_scale;
    }
    EXPECT_LT((out.storing_N + slope).norm(), 2e-3) << i;
    felt += out.storing_N.norm() > 0.01 ? 1 : 0;
    EXPECT_EQ(ForbiddenWalls::kGives.point, EnergyPoint::handle);
    EXPECT_LE(out.storing_N.norm(), 2 * p.K_N_m * in.position_scale * p.felt_m);
    EXPECT_EQ(out.stiffness_N_m > 0, out.stored_J > 0);
  }
  EXPECT_GT(felt, 100);
}

// A stage that moves the needle along x only: the floor cannot be left upwards, and the holder's mouth can.
TEST(ForbiddenWalls, push_only_along_the_ways_that_the_stage_can_make) {
  EffectSetup along_x;
  along_x.reach = Vec3::UnitX().asDiagonal();
  EXPECT_GT(ForbiddenWalls(both(), {}).step(at({0, 0, 55e-6})).storing_N.norm(), 0.05);
  EXPECT_EQ(ForbiddenWalls(both(), along_x).step(at({0, 0, 55e-6})).storing_N.norm(), 0);
  const Vec3 at_the_mouth(-88e-6, 30e-6, 0);
  const Vec3 whole_N = ForbiddenWalls(both(), {}).step(at(at_the_mouth)).storing_N;
  const Vec3 felt_N = ForbiddenWalls(both(), along_x).step(at(at_the_mouth)).storing_N;
  EXPECT_GT(felt_N.x(), 0.05);
  EXPECT_EQ(felt_N, Vec3(whole_N.x(), 0, 0));
}

TEST(ForbiddenWalls, are_felt_without_vision_and_not_with_the_clutch_pressed) {
  ForbiddenWalls walls(both(), {});
  EffectInput in = at({0, 0, 55e-6});
  in.fixture_gain = 0;
  EXPECT_LT(walls.step(in).storing_N.z(), -0.1);  // away from the floor beneath, z
  in.coupling_gain = 0;
  EXPECT_EQ(walls.step(in).storing_N, Vec3::Zero());
  in = at({0, 0, 0});
  EXPECT_EQ(walls.step(in).storing_N, Vec3::Zero());
}

TEST(ForbiddenWalls, give_back_no_more_than_was_put_in_but_what_they_count) {
  ForbiddenWalls walls(both(), {});
  double stored_J = 0, by_hand_J = 0, injected_J = 0;
  Vec3 last_handle_m = Vec3::Zero(), last_N = Vec3::Zero();
  for (int k = 0; k < 5000; ++k) {
    const double t = k * 1e-3;
    EffectInput in =
        at(Vec3(-75e-6 - 12e-6 * std::sin(6 * t), 20e-6 * std::sin(5 * t), 45e-6 + 11e-6 * std::sin(4 * t)));
    in.needle_axis = Vec3(-1, 0.1 * std::sin(3 * t), 0).normalized();
    in.coupling_gain = 0.5 + 0.5 * std::cos(2 * t);
    const EffectOutput out = walls.step(in);
    if (k > 0) {
      by_hand_J -= 0.5 * (out.storing_N + last_N).dot(in.handle_m - last_handle_m);
      injected_J += out.injected_J;
    } else {
      stored_J = out.stored_J;
    }
    last_handle_m = in.handle_m;
    last_N = out.storing_N;
    if (k == 4999) {
      EXPECT_NEAR(out.stored_J - stored_J, by_hand_J + injected_J, 1e-12);
    }
  }
}

}  // namespace
}  // namespace punctum::rt
