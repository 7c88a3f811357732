// Forbidden regions: distances against balls laid along the needle one by one and against a search along it
// in long double, the walls' force against the difference quotient of their energy.
#include <gtest/gtest.h>

#include <algorithm>
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
  return ForbiddenRegions(params).widest_gap(region, needle).apart_m;
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

// Of double figures, for sums in long double.
constexpr long double wide(double x) { return static_cast<long double>(x); }

// The distance of a point of the needle's axis from the holder, less the needle's radius there and the
// clearance.
long double room_m(const ForbiddenParams& p, const NeedlePose& needle, long double behind_m) {
  long double along = 0, apart2 = 0, from_mouth[3];
  for (int k = 0; k < 3; ++k) {
    from_mouth[k] = wide(needle.tip_m[k]) - behind_m * wide(needle.axis[k]) - wide(p.holder->mouth_m[k]);
    along += from_mouth[k] * wide(p.holder->axis[k]);
  }
  for (int k = 0; k < 3; ++k) {
    const long double part = from_mouth[k] - along * wide(p.holder->axis[k]);
    apart2 += part * part;
  }
  const long double beside = std::sqrt(apart2) - wide(p.holder->radius_m);
  const long double in_shaft = std::min(behind_m / wide(p.taper_m), 1.0L);
  const long double thick = wide(p.tip_radius_m) + in_shaft * (wide(p.shaft_radius_m) - wide(p.tip_radius_m));
  const long double to = beside <= 0 && along >= 0
                             ? std::max(beside, -along)
                             : std::hypot(std::max(beside, 0.0L), std::max(-along, 0.0L));
  return to - thick - wide(p.clearance_m);
}

// The least of it. It is convex along the taper and along the shaft, so a search by thirds finds it in each.
double least_room_m(const ForbiddenParams& p, const NeedlePose& needle) {
  const long double ends[] = {0, wide(p.taper_m), 10e-3L};
  long double least = room_m(p, needle, ends[2]);
  for (int part = 0; part < 2; ++part) {
    long double from = ends[part], to = ends[part + 1];
    least = std::min(least, room_m(p, needle, from));
    for (int i = 0; i < 100; ++i) {
      const long double near = from + (to - from) / 3, far = to - (to - from) / 3;
      (room_m(p, needle, near) <= room_m(p, needle, far) ? to : from) =
          room_m(p, needle, near) <= room_m(p, needle, far) ? far : near;
    }
    least = std::min(least, room_m(p, needle, 0.5L * (from + to)));
  }
  return static_cast<double>(least);
}

// Needles beside each part of the holder, with each part of theirs: along its axis, across it, tangential to
// its rim and side, into the mouth and from behind, and any other way.
struct Beside {
  std::mt19937_64 random;

  double within(double a, double b) { return std::uniform_real_distribution<>(a, b)(random); }
  double scale(double a, double b) { return std::exp(within(std::log(a), std::log(b))); }
  Vec3 unit() { return Vec3(within(-1, 1), within(-1, 1), within(-1, 1) + 1e-9).normalized(); }

  NeedlePose pose(ForbiddenParams& p, int i) {
    HolderBodyParams& holder = *p.holder;
    holder.mouth_m = 1e-4 * unit();
    holder.axis = unit();
    const Vec3 outwards = holder.axis.cross(unit()).normalized();
    const Vec3 tangent = holder.axis.cross(outwards);
    const double oblique = i % 3 == 0 ? 0 : scale(1e-12, 0.1);
    NeedlePose needle;
    needle.axis = unit();
    switch (i % 8) {
      case 0:
        needle.axis = holder.axis + oblique * unit();
        break;
      case 1:
        needle.axis = -holder.axis + oblique * unit();
        break;
      case 2:
        needle.axis = tangent + oblique * unit();
        break;
      case 3:
        needle.axis = outwards + oblique * unit();
        break;
      case 4:
        needle.axis = -outwards + oblique * unit();
        break;
      default:
        break;
    }
    needle.axis.normalize();
    Vec3 place = holder.mouth_m;
    switch (i / 8 % 4) {
      case 0:
        place += holder.radius_m * outwards;
        break;
      case 1:
        place += within(0, 1) * holder.radius_m * outwards;
        break;
      case 2:
        place += holder.radius_m * outwards + scale(1e-7, 5e-3) * holder.axis;
        break;
      default:
        place += scale(0.8, 3) * holder.radius_m * outwards - scale(1e-7, 1e-3) * holder.axis;
        break;
    }
    const double along_needle[] = {0, p.taper_m, within(0, 1) * p.taper_m, scale(p.taper_m, 9e-3)};
    const double behind_m = along_needle[i / 32 % 4];
    const double thick_m =
        p.tip_radius_m + std::min(behind_m / p.taper_m, 1.0) * (p.shaft_radius_m - p.tip_radius_m);
    const Vec3 off = (within(0, 1) * outwards - within(0, 1) * holder.axis + 0.2 * unit()).normalized();
    needle.tip_m = place + (thick_m + p.clearance_m + scale(1e-9, 1e-4)) * off + behind_m * needle.axis;
    return needle;
  }
};

TEST(ForbiddenRegions, are_as_far_as_a_search_along_the_needle_finds) {
  Beside beside{std::mt19937_64(5)};
  ForbiddenParams p = both();
  int apart = 0;
  for (int i = 0; i < 6000; ++i) {
    const NeedlePose needle = beside.pose(p, i);
    const double least_m = least_room_m(p, needle);
    const double found_m = apart_m(p, Region::holder, needle);
    const Vec3 any = beside.unit();
    // In no direction are they further apart than in truth; inside they are apart in none.
    const double most_m = std::max(least_m, -p.clearance_m) + 1e-11;
    ASSERT_LT(found_m, most_m) << i;
    ASSERT_LT(ForbiddenRegions(p).apart_m(Region::holder, any, needle), most_m) << i;
    if (least_m > -p.clearance_m) {
      ++apart;
      ASSERT_GT(found_m, least_m - 1e-10) << i;
    }
  }
  EXPECT_GT(apart, 3000);
}

// As thin, thick, pointed, blunt and near as a scene may be.
TEST(ForbiddenRegions, are_as_far_as_a_search_finds_in_extreme_scenes) {
  Beside beside{std::mt19937_64(6)};
  int apart = 0;
  for (int i = 0; i < 6000; ++i) {
    ForbiddenParams p = both();
    p.holder->radius_m = beside.scale(1e-6, 5e-3);
    p.tip_radius_m = beside.scale(0.2e-6, 50e-6);
    p.shaft_radius_m = beside.scale(p.tip_radius_m, 500e-6);
    p.taper_m = beside.scale(1e-6, 5e-3);
    p.clearance_m = i % 2 == 0 ? 0 : beside.scale(1e-8, 1e-3);
    const NeedlePose needle = beside.pose(p, i);
    const double least_m = least_room_m(p, needle);
    const double found_m = apart_m(p, Region::holder, needle);
    ASSERT_LT(found_m, std::max(least_m, -p.clearance_m) + 1e-9) << i;
    if (least_m > -p.clearance_m) {
      ++apart;
      ASSERT_GT(found_m, least_m - 0.2e-6) << i;
    }
  }
  EXPECT_GT(apart, 2000);
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
