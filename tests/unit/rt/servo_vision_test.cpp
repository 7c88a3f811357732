// Observations that are late, missing, or do not agree with the stage.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, accepts_only_withdrawal_while_vision_is_silent_and_goes_on_when_it_is_back) {
  Bench b(icsi());
  b.to_indentation();
  EXPECT_GT(b.effect_N(effect_membrane), 0.02);
  b.seeing = false;
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.effect_N(effect_membrane), 0);
  EXPECT_EQ(b.effect_N(effect_cone), 0);
  EXPECT_GT(b.sample().obs_age_s, 1);
  EXPECT_GT(b.sample().stale_ticks, 500U);

  // Wherever the hand goes, set-points move only outward along the axis.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  Vec3 before = b.stage.commanded.back();
  b.every_tick = [&] {
    if (b.ticks % 100 == 0) {
      b.wanted_x += 8e-6 * u(random);
      b.hand.intention.y() = 0.01 * u(random);
      b.hand.intention.z() = 0.01 * u(random);
    }
    const Vec3 step = b.stage.commanded.back() - before;
    ASSERT_GE(step.x(), 0);
    ASSERT_EQ(step.y(), 0);
    ASSERT_EQ(step.z(), 0);
    before = b.stage.commanded.back();
  };
  b.run(5);
  b.every_tick = nullptr;
  const double silent_tip = b.stage.tip.x();

  // Back again: nothing jumps, the force returns by a ramp, the hand moves the needle in again.
  b.seeing = true;
  double force = b.force();
  double steepest = 0;
  double speed = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - force);
    force = b.force();
    speed = std::max(speed, b.stage.speed.norm());
  };
  b.run(1.5);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_NEAR(b.stage.tip.x(), silent_tip, 3e-6);
  EXPECT_LT(steepest, 0.02);
  EXPECT_LT(speed, 60e-6);
  b.every_tick = nullptr;
  b.move(b.wanted_x - 15e-6, 15e-6);
  b.run(0.3);
  EXPECT_LT(b.stage.tip.x(), silent_tip - 5e-6);
}

TEST(Servo, does_not_push_the_needle_on_by_a_picture_that_stands_still) {
  Bench b(icsi());
  b.puncture_at = 1;
  b.to_indentation();
  b.same_picture = true;
  const double tip = b.stage.tip.x();
  b.move(b.wanted_x - 40e-6, 10e-6);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.effect_N(effect_membrane), 0);
  EXPECT_LT(tip - b.stage.tip.x(), 8e-6 + 0.4 * 10e-6);
  // Pictures again: it goes on.
  b.same_picture = false;
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  const double again = b.stage.tip.x();
  b.move(b.wanted_x - 3e-6, 10e-6);
  b.run(0.3);
  EXPECT_LT(b.stage.tip.x(), again - 2e-6);
}

TEST(Servo, trusts_a_bumped_microscope_again_once_the_needle_has_moved_in_its_picture) {
  Bench b(icsi());
  b.to_indentation();
  b.picture_shift = Vec3(0, 30e-6, 0);
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  b.run(60);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  b.move(b.wanted_x + 30e-6, 20e-6);  // out is allowed
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

TEST(Servo, does_not_let_the_needle_approach_before_anything_was_seen) {
  Bench b(icsi());
  b.seeing = false;
  b.run(0.5);
  b.move(20e-6, 20e-6);
  EXPECT_NEAR(b.stage.tip.x(), 60e-6, 0.1e-6);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.sample().obs_age_s, -1);
}

// What a picture may claim of a cell that is touched, and where the needle is led by it.
struct Recession {
  const char* name;
  double entry_m_s, R_m_s, begins_s;  // begins_s: after contact; < 0: from the first frame on
};

TEST(Servo, lets_no_picture_lead_the_needle_past_the_cell_it_saw_first) {
  for (const Recession lie :
       {Recession{"entry recedes", 30e-6, 0, 0}, Recession{"entry recedes slowly", 3e-6, 0, 0},
        Recession{"entry recedes from the start", 5e-6, 0, -1},
        Recession{"entry recedes slowly from the start", 1.2e-6, 0, -1}, Recession{"R grows", 0, 30e-6, 0},
        Recession{"R grows slowly", 0, 1e-6, 0}, Recession{"both", 10e-6, 10e-6, 0},
        Recession{"entry comes nearer", -30e-6, 0, 0}}) {
    ServoConfig config = icsi();
    config.mapping.workspace_min_m.setConstant(-1e-3);
    config.mapping.workspace_max_m.setConstant(1e-3);
    Bench b(config);
    b.puncture_at = 1;
    std::int64_t since_ns = 0;
    double R_told = 0;
    b.lie = [&](Observation& o) {
      if (since_ns == 0 && (lie.begins_s < 0 || b.servo->phase() != free)) {
        since_ns = b.now;
      }
      const double t = since_ns == 0 ? 0 : static_cast<double>(b.now - since_ns) * 1e-9;
      o.centre_m[0] -= (lie.entry_m_s + lie.R_m_s) * t;
      o.gap_m += lie.entry_m_s * t;
      o.wd_m = std::max(-o.gap_m, 0.0);
      o.R_m += lie.R_m_s * t;
    };
    std::uint32_t alarms = 0;
    double deepest = -1, R_most = 0;
    b.every_tick = [&] {
      alarms |= b.sample().alarms;
      deepest = std::max(deepest, -b.gap());
      R_most = std::max(R_most, b.sample().R_m);
      R_told = std::max(R_told, b.shown.R_m);
    };
    b.run(1);
    b.move(-350e-6, 30e-6);
    b.run(1);
    std::printf("%s: true depth %.1f um in a cell of 120 um, R believed %.1f um of %.1f, wd shown %.1f um\n",
                lie.name, 1e6 * deepest, 1e6 * R_most, 1e6 * R_told, 1e6 * b.sample().wd_m);
    // A contact that is seen too late adds what vision says wrong until then, up to the far wall.
    const double most =
        lie.begins_s < 0 ? 2 * b.R - config.limits.far_wall_m : config.limits.penetration_depth_m;
    EXPECT_LT(deepest, most + 0.5e-6) << lie.name;
    EXPECT_LT(R_most, 1.11 * b.R) << lie.name;
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_NE(alarms & alarm_vision_implausible, 0U) << lie.name;
    // Out is always allowed.
    b.move(60e-6, 100e-6);
    b.run(0.5);
    EXPECT_GT(b.gap(), 0) << lie.name;
  }
}

TEST(Servo, bounds_the_depth_by_the_encoders_for_any_history_of_observations) {
  double deepest_of_all = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    ServoConfig config = icsi();
    config.mapping.workspace_min_m.setConstant(-1e-3);
    config.mapping.workspace_max_m.setConstant(1e-3);
    config.limits.tip_force_hard_N = 1;  // the depth is the matter here
    config.limits.tip_force_soft_N = 1;
    Bench b(config);
    b.puncture_at = 1;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> n(0, 1);
    double entry_v = 0, R_v = 0, entry = 0, R = 0;
    std::uint32_t flip = 0;
    b.lie = [&](Observation& o) {
      if (b.ticks < 1000) {
        return;
      }
      if (random() % 10 == 0) {  // another lie, mostly one that is not refused for long
        entry_v = 0.3e-6 * n(random);
        R_v = 0.2e-6 * n(random);
        entry *= random() % 2 == 0 ? 0.0 : 1.0;
        R *= random() % 2 == 0 ? 0.0 : 1.0;
      }
      entry = std::clamp(entry + entry_v, -12e-6, 12e-6);
      R = std::clamp(R + R_v, -8e-6, 8e-6);
      o.centre_m[0] -= entry + R;
      o.gap_m += entry;
      o.R_m += R;
      flip = random() % 8 == 0 ? static_cast<std::uint32_t>(random()) : flip;
      o.flags ^= flip & (Observation::contact | Observation::punctured | Observation::inner_punctured);
    };
    double deepest = -1;
    b.every_tick = [&] { deepest = std::max(deepest, -b.gap()); };
    b.run(1);
    for (int push = 0; push < 12; ++push) {  // in, as far as it goes; and a little back
      b.move(b.wanted_x - 40e-6, 40e-6);
      b.run(0.4);
      b.move(b.wanted_x + 10e-6, 40e-6);
    }
    EXPECT_LT(deepest, 2 * b.R - config.limits.far_wall_m + 0.5e-6) << seed;
    deepest_of_all = std::max(deepest_of_all, deepest);
  }
  std::printf("deepest: %.1f um\n", 1e6 * deepest_of_all);
  EXPECT_GT(deepest_of_all, 60e-6);
}

}  // namespace
}  // namespace punctum::rt
