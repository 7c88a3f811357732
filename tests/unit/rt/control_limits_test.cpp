// No target, however wild, gets the needle or the hand past a limit.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/control/limits.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

class Wild {
 public:
  explicit Wild(unsigned seed) : random_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  int pick(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  double number() {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double inf = std::numeric_limits<double>::infinity();
    switch (pick(12)) {
      case 0:
        return nan;
      case 1:
        return inf;
      case 2:
        return -inf;
      case 3:
        return 1e300;
      case 4:
        return -1e300;
      case 5:
        return 0;
      case 6:
        return 1e-320;
      default:
        return uniform(-400e-6, 400e-6);
    }
  }
  Vec3 vector() { return {number(), number(), number()}; }
  Vec3 near() { return {uniform(-300e-6, 300e-6), uniform(-200e-6, 200e-6), uniform(-70e-6, 70e-6)}; }
  Vec3 unit() {
    std::normal_distribution<double> n;
    return Vec3(n(random_), n(random_), n(random_)).normalized();
  }

 private:
  std::mt19937_64 random_;
};

Membrane3D cell(Wild& wild) {
  Membrane3D m;
  m.known = true;
  m.entry_m = Vec3(20e-6, 1e-6, -1e-6);
  m.axis = (-Vec3::UnitX() + 0.1 * wild.unit()).normalized();
  m.R_m = 60e-6;
  return m;
}

TEST(StageLimits, hold_for_any_target_and_any_mix_of_constraints) {
  const LimitParams limits;
  const MappingParams mapping;
  for (unsigned seed = 0; seed < 60; ++seed) {
    Wild wild(seed);
    StageLimits stage(limits, mapping, 1000);
    stage.restart(wild.uniform(0, 1) < 0.5 ? Vec3(90e-6, 6e-6, 0) : Vec3(10e-6, 2e-6, 1e-6), -Vec3::UnitX());
    StageConstraint c;
    c.membrane = cell(wild);
    hal::StageCommand target{wild.near(), -Vec3::UnitX()};
    Vec3 here = stage.set_point().tip_m;
    Vec3 axis = stage.set_point().axis;
    for (int k = 0; k < 4000; ++k) {
      if (wild.pick(300) == 0) {
        c.membrane.known = !c.membrane.known;
      }
      if (wild.pick(300) == 0) {
        c.withdrawal_only = !c.withdrawal_only;
      }
      if (wild.pick(300) == 0) {
        c.no_deeper = !c.no_deeper;
      }
      if (wild.pick(900) == 0) {
        c.frozen = !c.frozen;
      }
      if (wild.pick(40) == 0) {
        target.tip_m = wild.pick(3) == 0 ? wild.vector() : wild.near();
      }
      if (wild.pick(40) == 0) {
        target.axis = wild.pick(4) == 0 ? wild.vector() : wild.unit();
      }
      constexpr double dt = 1e-3;
      const hal::StageCommand next = stage.step(target, c);

      ASSERT_TRUE(next.tip_m.allFinite() && next.axis.allFinite());
      ASSERT_NEAR(next.axis.norm(), 1, 1e-9);
      ASSERT_LE((next.axis - axis).norm(), 0.5 * dt * 1.001 + 1e-12);
      const Vec3 way = next.tip_m - here;
      ASSERT_LE(way.norm(), limits.stage_velocity_m_s * dt * (1 + 1e-6) + 1e-18);
      for (int i = 0; i < 3; ++i) {
        ASSERT_GE(next.tip_m[i], mapping.workspace_min_m[i] - 1e-15);
        ASSERT_LE(next.tip_m[i], mapping.workspace_max_m[i] + 1e-15);
      }
      if (c.frozen) {
        ASSERT_EQ(way.norm(), 0);
      }
      const double depth = c.membrane.depth_m(next.tip_m);
      const double depth_before = std::max(c.membrane.depth_m(here), 0.0);
      if (c.withdrawal_only) {
        const double outward = -way.dot(c.membrane.axis);
        ASSERT_GE(outward, 0);
        ASSERT_LE((way + outward * c.membrane.axis).norm(), 1e-18);
      } else if (c.membrane.known && !c.frozen) {
        const auto room = [&](const Vec3& p) {
          return std::max(std::min(limits.penetration_depth_m, c.membrane.chord_m(p) - limits.far_wall_m),
                          0.0);
        };
        // Beyond a limit at most as far as it was already (the constraint may appear under a needle).
        if (depth > 0) {
          ASSERT_LE(depth - room(next.tip_m), std::max(depth_before - room(here), 0.0) + 1e-12);
        }
        if (depth > 0 && c.no_deeper) {
          ASSERT_LE(depth, depth_before + 1e-12);
        }
      }
      here = next.tip_m;
      axis = next.axis;
    }
  }
}

// A stage that moves the needle along one line or in one plane, both oblique: the needle's axis lies there.
TEST(StageLimits, of_a_stage_of_one_or_two_axes_stay_on_the_line_or_plane_whatever_is_wanted) {
  const LimitParams limits;
  const MappingParams mapping;
  ForbiddenParams forbidden;
  forbidden.floor.emplace().z_m = 40e-6;
  for (unsigned seed = 0; seed < 60; ++seed) {
    Wild wild(seed);
    const Vec3 along = (-Vec3::UnitX() + 0.3 * wild.unit()).normalized();
    const Vec3 across = along.cross(wild.unit()).normalized();
    const Vec3 aside = along.cross(across);
    const bool plane = wild.pick(2) == 0;
    hal::Mat3 reach = along * along.transpose();
    reach += plane ? hal::Mat3(across * across.transpose()) : hal::Mat3::Zero();
    const bool floor = wild.pick(2) == 0;
    StageLimits stage(limits, mapping, 1000, floor ? std::optional(forbidden) : std::nullopt, reach);
    const Vec3 start = wild.pick(2) == 0 ? Vec3(90e-6, 6e-6, 0) : Vec3(10e-6, 190e-6, 1e-6);
    stage.restart(start, along);
    StageConstraint c;
    c.membrane = cell(wild);
    c.membrane.axis = along;
    hal::StageCommand target{wild.near(), along};
    Vec3 here = start;
    double way_m = 0, beside_m = 0;
    for (int k = 0; k < 4000; ++k) {
      c.membrane.known = c.membrane.known != (wild.pick(300) == 0);
      c.withdrawal_only = c.withdrawal_only != (wild.pick(300) == 0);
      c.no_deeper = c.no_deeper != (wild.pick(300) == 0);
      if (wild.pick(300) == 0) {
        c.insertion =
            wild.pick(2) == 0 ? std::optional(FixtureFrame{here + 3e-6 * wild.unit(), along}) : std::nullopt;
      }
      if (wild.pick(40) == 0) {
        target.tip_m = wild.pick(3) == 0 ? wild.vector() : wild.near();
      }
      const Vec3 next = stage.step(target, c).tip_m;
      const Vec3 checked = stage.check(target.tip_m, c).point_m;
      for (const Vec3& p : {next, checked}) {
        const Vec3 V = p - start;
        ASSERT_LE(std::abs(V.dot(aside)), 1e-15) << seed << " " << k;
        ASSERT_LE(plane ? 0 : std::abs(V.dot(across)), 1e-15) << seed << " " << k;
        for (int i = 0; i < 3; ++i) {
          ASSERT_GE(p[i], std::min(mapping.workspace_min_m[i], start[i]) - 1e-15);
          ASSERT_LE(p[i], std::max(mapping.workspace_max_m[i], start[i]) + 1e-15);
        }
      }
      if (c.withdrawal_only) {
        ASSERT_GE(-(next - here).dot(along), 0);
        ASSERT_LE(std::abs((next - here).dot(across)), 1e-18);
      }
      if (floor) {
        const double apart_m = forbidden.floor->z_m - forbidden.tip_radius_m - forbidden.clearance_m;
        ASSERT_LE(next.z(), std::max(apart_m, start.z()) + 1e-8) << seed << " " << k;
      }
      way_m += (next - here).norm();
      beside_m += std::abs((next - here).dot(across));
      here = next;
    }
    EXPECT_GT(way_m, 30e-6) << seed;
    if (plane) {
      EXPECT_GT(beside_m, 10e-6) << seed;
    }
  }
}

// Velocity, acceleration and jerk of set-points, by differences.
struct Derivatives {
  Derivatives(const Vec3& at, double dt_s) : x(at), dt(dt_s) {}
  void step(const Vec3& next) {
    const Vec3 v_next = (next - x) / dt;
    const Vec3 a_next = (v_next - v) / dt;
    j = (a_next - a) / dt;
    a = a_next;
    v = v_next;
    x = next;
  }
  Vec3 x, v = Vec3::Zero(), a = Vec3::Zero(), j = Vec3::Zero();
  double dt;
};

TEST(StageLimits, bound_velocity_acceleration_and_jerk_for_any_targets_and_pass_no_bound_that_stands_still) {
  constexpr double kRounding = 1 + 1e-6;
  Wild wild(11);
  double fastest = 0, hardest = 0, sharpest = 0;  // of what is allowed
  for (int sequence = 0; sequence < 100'000; ++sequence) {
    LimitParams limits;
    limits.stage_velocity_m_s = wild.uniform(50e-6, 2e-3);
    limits.stage_acceleration_m_s2 = wild.uniform(10e-3, 200e-3);
    limits.stage_jerk_m_s3 = wild.uniform(1, 40);
    limits.lateral_m = wild.uniform(1e-6, 10e-6);
    const double rate_Hz = wild.pick(4) == 0 ? 4000 : 1000;
    const MappingParams mapping;
    StageLimits stage(limits, mapping, rate_Hz);
    StageConstraint c;
    Vec3 start(wild.uniform(-270e-6, 270e-6), wild.uniform(-170e-6, 170e-6), wild.uniform(-50e-6, 50e-6));
    if (wild.pick(2) == 0) {
      c.insertion = FixtureFrame{.entry_m = Vec3(10e-6, 0, 0),
                                 .axis = (-Vec3::UnitX() + 0.1 * wild.unit()).normalized()};
      start = c.insertion->entry_m;
    }
    stage.restart(start, -Vec3::UnitX());
    Derivatives d(start, 1 / rate_Hz);
    Vec3 target = start;
    for (int k = 0; k < 60; ++k) {
      if (wild.pick(12) == 0) {
        target = wild.pick(4) == 0 ? wild.vector() : wild.near();
      }
      if (wild.pick(4) == 0) {
        target += 10e-6 * wild.unit();
      }
      d.step(stage.step({target, -Vec3::UnitX()}, c).tip_m);
      ASSERT_LE(d.v.norm(), limits.stage_velocity_m_s * kRounding);
      ASSERT_LE(d.a.norm(), limits.stage_acceleration_m_s2 * kRounding);
      ASSERT_LE(d.j.norm(), limits.stage_jerk_m_s3 * kRounding);
      fastest = std::max(fastest, d.v.norm() / limits.stage_velocity_m_s);
      hardest = std::max(hardest, d.a.norm() / limits.stage_acceleration_m_s2);
      sharpest = std::max(sharpest, d.j.norm() / limits.stage_jerk_m_s3);
      for (int i = 0; i < 3; ++i) {
        ASSERT_GE(d.x[i], mapping.workspace_min_m[i] - 1e-15);
        ASSERT_LE(d.x[i], mapping.workspace_max_m[i] + 1e-15);
      }
      if (c.insertion) {
        const Vec3 V = d.x - c.insertion->entry_m;
        ASSERT_LE((V - c.insertion->axis.dot(V) * c.insertion->axis).norm(), limits.lateral_m + 1e-14);
      }
    }
  }
  // The bounds are reached, not only kept.
  EXPECT_GT(fastest, 0.99);
  EXPECT_GT(hardest, 0.9);
  EXPECT_GT(sharpest, 0.9);
}

TEST(StageLimits, hold_no_point_that_is_nearer_than_their_clearance) {
  int clear = 0;
  for (unsigned seed = 0; seed < 20'000; ++seed) {
    Wild wild(seed);
    ForbiddenParams forbidden;
    forbidden.floor = DishFloorParams{.z_m = wild.uniform(20e-6, 70e-6)};
    StageLimits stage({}, {}, 1000, forbidden);
    StageConstraint c;
    c.membrane = cell(wild);
    c.membrane.known = wild.pick(4) != 0;
    const Vec3 from_entry =
        wild.uniform(-30e-6, 80e-6) * c.membrane.axis + wild.uniform(0, 58e-6) * wild.unit();
    const Vec3 here = c.membrane.entry_m + from_entry;
    stage.restart(here, -Vec3::UnitX());
    c.depth_limit_m = wild.uniform(0, 90e-6);
    c.inward_limit_m = c.membrane.axis.dot(here) + wild.uniform(-2e-6, 40e-6);
    if (wild.pick(2) == 0) {
      c.insertion = FixtureFrame{here + wild.uniform(0, 6e-6) * wild.unit(), c.membrane.axis};
    }
    const double clearance_m = stage.clearance_m(c);
    for (int k = 0; k < 20 && clearance_m > 0; ++k) {
      const Vec3 point_m = here + 0.9999 * clearance_m * wild.unit();
      const StageLimits::Checked checked = stage.check(point_m, c);
      ASSERT_EQ(checked.point_m, point_m) << "seed " << seed;
      ASSERT_EQ(checked.alarms, 0U) << "seed " << seed;
      ++clear;
    }
  }
  EXPECT_GT(clear, 100'000);
}

TEST(StageLimits, are_slower_near_the_membrane_and_slower_still_past_it) {
  const LimitParams limits;
  StageConstraint c;
  c.membrane.known = true;
  c.membrane.entry_m = Vec3(20e-6, 0, 0);
  c.membrane.R_m = 60e-6;
  for (const bool inward : {true, false}) {
    StageLimits stage(limits, MappingParams{}, 1000);
    const Vec3 start(inward ? 150e-6 : -40e-6, 0, 0);
    stage.restart(start, -Vec3::UnitX());
    Derivatives d(start, 1e-3);
    double outside = 0, near = 0, inside = 0;
    for (int k = 0; k < 3000; ++k) {
      d.step(stage.step({Vec3(inward ? -40e-6 : 150e-6, 0, 0), -Vec3::UnitX()}, c).tip_m);
      const double gap_m = d.x.x() - 20e-6;
      double& most = gap_m < 0 ? inside : gap_m < limits.near_m ? near : outside;
      most = std::max(most, d.v.norm());
      ASSERT_LE(d.a.norm(), limits.stage_acceleration_m_s2 * (1 + 1e-6));
      ASSERT_LE(d.j.norm(), limits.stage_jerk_m_s3 * (1 + 1e-6));
    }
    EXPECT_NEAR(d.x.x(), inward ? -40e-6 : 150e-6, 1e-9);
    EXPECT_LE(inside, limits.stage_velocity_inside_m_s * (1 + 1e-6));
    EXPECT_LE(near, limits.stage_velocity_near_m_s * (1 + 1e-6));
    EXPECT_NEAR(outside, limits.stage_velocity_m_s, 1e-9);
  }
}

TEST(StageLimits, stop_at_once_where_a_depth_limit_comes_towards_the_needle_and_do_not_drive_it_back) {
  const LimitParams limits;
  StageConstraint c;
  c.membrane.known = true;
  c.membrane.entry_m = Vec3(20e-6, 0, 0);
  c.membrane.R_m = 60e-6;
  StageLimits stage(limits, MappingParams{}, 1000);
  stage.restart(Vec3(-40e-6, 0, 0), -Vec3::UnitX());
  const hal::StageCommand deeper{Vec3(-100e-6, 0, 0), -Vec3::UnitX()};
  double x = -40e-6;
  for (int k = 0; k < 2000; ++k) {
    // Vision moves the membrane, and with it the limit, outwards by 30 um; later back.
    if (k > 100 && k <= 700) {
      c.membrane.entry_m.x() += 0.05e-6;
    }
    if (k > 1000 && k <= 1600) {
      c.membrane.entry_m.x() -= 0.05e-6;
    }
    const double limit_x = c.membrane.entry_m.x() - limits.penetration_depth_m;
    const double next = stage.step(deeper, c).tip_m.x();
    ASSERT_LE(next, x + 1e-15);                             // never driven outwards
    ASSERT_GE(next, std::min(limit_x, x) - 1e-15);          // never past the limit, or further past it
    ASSERT_LE(x - next, limits.stage_velocity_m_s * 1e-3);  // never faster than it may be
    x = next;
  }
  EXPECT_NEAR(x, 20e-6 - limits.penetration_depth_m, 1e-9);
}

TEST(StageLimits, begin_from_rest_after_a_way_that_was_closed_for_a_tick) {
  const LimitParams limits;
  StageLimits stage(limits, MappingParams{}, 1000);
  stage.restart(Vec3(90e-6, 0, 0), -Vec3::UnitX());
  const hal::StageCommand target{Vec3(90e-6, 100e-6, 0), -Vec3::UnitX()};
  StageConstraint c;
  Vec3 last = Vec3::Zero();
  for (int k = 0; k < 100; ++k) {
    last = stage.set_point().tip_m;
    (void)stage.step(target, c);
  }
  EXPECT_GT((stage.set_point().tip_m - last).norm() / 1e-3, 0.9 * limits.stage_velocity_m_s);
  c.withdrawal_only = true;
  last = stage.set_point().tip_m;
  (void)stage.step(target, c);
  EXPECT_EQ(stage.set_point().tip_m, last);
  c.withdrawal_only = false;
  Derivatives d(stage.set_point().tip_m, 1e-3);
  for (int k = 0; k < 500; ++k) {
    d.step(stage.step(target, c).tip_m);
    EXPECT_LE(d.a.norm(), limits.stage_acceleration_m_s2 * 1.001) << k;
    EXPECT_LE(d.j.norm(), limits.stage_jerk_m_s3 * 1.001) << k;
  }
  EXPECT_NEAR(stage.set_point().tip_m.y(), 100e-6, 1e-9);
}

TEST(StageLimits, give_a_slow_stage_less_speed_where_no_window_is_long_enough) {
  LimitParams limits;
  limits.stage_acceleration_m_s2 = 0.2e-3;
  limits.stage_jerk_m_s3 = 0.01;
  StageLimits stage(limits, MappingParams{}, 8000);
  stage.restart(Vec3::Zero(), -Vec3::UnitX());
  Derivatives d(Vec3::Zero(), 0.125e-3);
  for (int k = 0; k < 80000; ++k) {
    d.step(stage.step({Vec3(50e-6, 0, 0), -Vec3::UnitX()}, {}).tip_m);
    ASSERT_LE(d.a.norm(), limits.stage_acceleration_m_s2 * (1 + 1e-6));
    ASSERT_LE(d.j.norm(), limits.stage_jerk_m_s3 * (1 + 1e-4));
  }
  EXPECT_NEAR(d.x.x(), 50e-6, 1e-9);
}

TEST(StageLimits, reach_a_target_without_overshoot_at_the_speed_and_acceleration_allowed) {
  const LimitParams limits;
  for (const double dt : {1e-3, 0.125e-3}) {
    StageLimits stage(limits, MappingParams{}, 1 / dt);
    stage.restart(Vec3::Zero(), -Vec3::UnitX());
    const hal::StageCommand target{Vec3(100e-6, 0, 0), -Vec3::UnitX()};
    Vec3 velocity = Vec3::Zero();
    double arrived_s = 0;
    for (int k = 0; k * dt < 2; ++k) {
      const Vec3 last = stage.set_point().tip_m;
      stage.step(target, {});
      ASSERT_LE(stage.set_point().tip_m.x(), 100e-6 + 1e-12);
      const Vec3 now = (stage.set_point().tip_m - last) / dt;
      ASSERT_LE((now - velocity).norm(), limits.stage_acceleration_m_s2 * dt * (1 + 1e-6));
      velocity = now;
      if (arrived_s == 0 && stage.set_point().tip_m.x() > 99.9e-6) {
        arrived_s = k * dt;
      }
    }
    // 0.25 s at full speed, and two ramps of 20 ms and the window of 10 ms.
    EXPECT_NEAR(stage.set_point().tip_m.x(), 100e-6, 1e-10);
    EXPECT_GT(arrived_s, 0.25);
    EXPECT_LT(arrived_s, 0.32);
  }
}

TEST(StageLimits, hold_a_needle_that_is_beyond_a_limit_and_never_drive_it_back) {
  const LimitParams limits;
  StageLimits stage(limits, MappingParams{}, 1000);
  StageConstraint c;
  c.membrane.known = true;
  c.membrane.entry_m = Vec3(20e-6, 0, 0);
  c.membrane.R_m = 60e-6;
  const Vec3 deep(-90e-6, 0, 0);  // 110 um deep, limit 90
  stage.restart(deep, -Vec3::UnitX());
  for (int k = 0; k < 1000; ++k) {
    stage.step({deep - Vec3(10e-6, 0, 0), -Vec3::UnitX()}, c);
  }
  EXPECT_LT((stage.set_point().tip_m - deep).norm(), 1e-15);
  for (int k = 0; k < 1000; ++k) {
    stage.step({Vec3(-80e-6, 0, 0), -Vec3::UnitX()}, c);
  }
  EXPECT_NEAR(stage.set_point().tip_m.x(), -80e-6, 1e-9);
}

TEST(StageLimits, let_a_needle_beside_its_insertion_line_stay_or_come_straight_back) {
  StageLimits stage(LimitParams{}, MappingParams{}, 1000);
  StageConstraint c;
  c.insertion = FixtureFrame{.entry_m = Vec3(5e-6, 0, 0), .axis = -Vec3::UnitX()};
  const auto go = [&](const Vec3& to) {
    for (int k = 0; k < 1000; ++k) {
      stage.step({to, -Vec3::UnitX()}, c);
      EXPECT_LE(stage.set_point().tip_m.tail<2>().norm(), 8e-6 + 1e-15);
    }
    return stage.set_point().tip_m;
  };
  stage.restart(Vec3(0, 8e-6, 0), -Vec3::UnitX());
  EXPECT_LT((go({-20e-6, 8e-6, 0}) - Vec3(-20e-6, 8e-6, 0)).norm(),
            1e-12);  // not driven, free along the line
  EXPECT_EQ(stage.alarms() & alarm_lateral_limited, 0U);
  EXPECT_LT((go({-20e-6, 8e-6, 7e-6}) - Vec3(-20e-6, 8e-6, 0)).norm(), 1e-12);
  EXPECT_NE(stage.alarms() & alarm_lateral_limited, 0U);
  EXPECT_LT((go({-20e-6, 6e-6, 0}) - Vec3(-20e-6, 6e-6, 0)).norm(), 1e-12);
  EXPECT_LT((go({-20e-6, 0, 3e-6}) - Vec3(-20e-6, 0, 3e-6)).norm(), 1e-12);
  EXPECT_LT((go({-20e-6, -40e-6, -30e-6}) - Vec3(-20e-6, -4e-6, -3e-6)).norm(), 1e-12);
}

TEST(StageLimits, draw_a_needle_back_blind_no_further_than_the_workspace) {
  const MappingParams mapping;
  StageLimits stage(LimitParams{}, mapping, 1000);
  StageConstraint c;
  c.withdrawal_only = true;
  c.membrane.axis = Vec3(-1, -0.5, 0).normalized();
  stage.restart(Vec3(200e-6, 150e-6, 0), -Vec3::UnitX());
  for (int k = 0; k < 3000; ++k) {
    stage.step({Vec3(900e-6, 500e-6, 0), -Vec3::UnitX()}, c);
  }
  EXPECT_LT((stage.set_point().tip_m - Vec3(260e-6, mapping.workspace_max_m.y(), 0)).norm(), 1e-9);
  EXPECT_NE(stage.alarms() & alarm_travel_limited, 0U);
}

TEST(StageLimits, hold_a_needle_that_came_back_into_the_workspace) {
  const MappingParams mapping;
  const double end_m = mapping.workspace_max_m.y();
  StageLimits stage(LimitParams{}, mapping, 1000);
  stage.restart(Vec3(0, end_m + 20e-6, 0), -Vec3::UnitX());
  const auto go = [&stage](const Vec3& to_m) {
    for (int k = 0; k < 2000; ++k) {
      stage.step({to_m, -Vec3::UnitX()}, {});
    }
    return stage.set_point().tip_m.y();
  };
  EXPECT_NEAR(go(Vec3(0, end_m - 20e-6, 0)), end_m - 20e-6, 1e-9);
  EXPECT_NEAR(go(Vec3(0, end_m + 20e-6, 0)), end_m, 1e-9);
}

TEST(StageLimits, say_which_limit_holds_the_needle) {
  const LimitParams limits;
  StageLimits stage(limits, MappingParams{}, 1000);
  StageConstraint c;
  c.membrane.known = true;
  c.membrane.entry_m = Vec3(20e-6, 0, 0);
  c.membrane.R_m = 60e-6;
  stage.restart(Vec3(30e-6, 0, 0), -Vec3::UnitX());
  const auto alarms = [&](const Vec3& target) {
    for (int k = 0; k < 3000; ++k) {
      stage.step({target, -Vec3::UnitX()}, c);
    }
    return stage.alarms();
  };
  EXPECT_EQ(alarms(Vec3(25e-6, 0, 0)), 0U);
  EXPECT_EQ(alarms(Vec3(-200e-6, 0, 0)) & alarm_depth_limited, alarm_depth_limited);
  EXPECT_NEAR(c.membrane.depth_m(stage.set_point().tip_m), limits.penetration_depth_m, 1e-9);
  // Off the axis the far wall is nearer.
  EXPECT_EQ(alarms(Vec3(-200e-6, 45e-6, 0)) & alarm_depth_limited, alarm_depth_limited);
  const double chord = 2 * std::sqrt(60e-6 * 60e-6 - 45e-6 * 45e-6);
  EXPECT_LE(c.membrane.depth_m(stage.set_point().tip_m), chord - limits.far_wall_m + 1e-9);
  EXPECT_EQ(alarms(Vec3(500e-6, 0, 0)) & alarm_travel_limited, alarm_travel_limited);
  c.depth_limit_m = 30e-6;  // as commanded
  stage.restart(Vec3(30e-6, 0, 0), -Vec3::UnitX());
  EXPECT_EQ(alarms(Vec3(-200e-6, 0, 0)) & alarm_depth_limited, alarm_depth_limited);
  EXPECT_NEAR(c.membrane.depth_m(stage.set_point().tip_m), 30e-6, 1e-9);
}

TEST(StageLimits, let_the_needle_no_further_in_than_the_encoders_allow_whatever_vision_says_of_the_cell) {
  StageConstraint c;
  c.inward_limit_m = -40e-6;  // along the axis: at x = 40 um
  for (const double entry_x_m : {60e-6, -100e-6}) {
    for (const bool known : {false, true}) {
      StageLimits stage(LimitParams{}, MappingParams{}, 1000);
      stage.restart(Vec3(70e-6, 0, 0), -Vec3::UnitX());
      c.membrane.known = known;
      c.membrane.entry_m = Vec3(entry_x_m, 0, 0);
      c.membrane.R_m = 60e-6;
      for (int k = 0; k < 3000; ++k) {
        stage.step({Vec3(-200e-6, 0, 0), -Vec3::UnitX()}, c);
        ASSERT_GE(stage.set_point().tip_m.x(), 40e-6 - 1e-12);
      }
      EXPECT_NEAR(stage.set_point().tip_m.x(), 40e-6, 1e-9);
      EXPECT_NE(stage.alarms() & alarm_depth_limited, 0U);
    }
  }
}

TEST(Membrane3D, measures_depth_and_far_wall_on_the_line_through_the_point) {
  Membrane3D m;
  m.entry_m = Vec3(20e-6, 0, 0);
  m.axis = -Vec3::UnitX();
  m.R_m = 60e-6;
  const Vec3 centre(-40e-6, 0, 0);
  Wild wild(4);
  for (int i = 0; i < 1000; ++i) {
    // A point on the near and on the far wall, by the sphere's own equation.
    const double y = wild.uniform(-40e-6, 40e-6);
    const double z = wild.uniform(-40e-6, 40e-6);
    const double half = std::sqrt(60e-6 * 60e-6 - y * y - z * z);
    EXPECT_NEAR(m.depth_m(centre + Vec3(half, y, z)), 0, 1e-18);
    EXPECT_NEAR(m.depth_m(centre + Vec3(-half, y, z)), m.chord_m(centre + Vec3(0, y, z)), 1e-18);
    EXPECT_NEAR(m.chord_m(centre + Vec3(0, y, z)), 2 * half, 1e-18);
  }
}

TEST(HandForce, is_never_above_its_limit_never_nan_and_keeps_its_direction) {
  Wild wild(1);
  for (int i = 0; i < 100000; ++i) {
    const Vec3 wanted = wild.vector() * (wild.pick(2) == 0 ? 1 : 1e5);
    const LimitedForce out = limit_hand_force(wanted, 3.0);
    ASSERT_TRUE(out.force_N.allFinite());
    ASSERT_LE(out.force_N.norm(), 3.0 * (1 + 1e-12));
    ASSERT_EQ(out.finite, wanted.allFinite());
    if (!out.finite) {
      ASSERT_EQ(out.force_N.norm(), 0);
      continue;
    }
    if (!out.limited) {
      ASSERT_EQ(out.force_N, wanted);
    }
    if (out.limited) {
      ASSERT_NEAR(out.force_N.norm(), 3.0, 1e-9);
    }
    const double size = wanted.cwiseAbs().maxCoeff();
    if (size > 1e-200) {
      ASSERT_LT((out.force_N.normalized() - (wanted / size).normalized()).norm(), 1e-9);
    }
  }
}

}  // namespace
}  // namespace punctum::rt
