// The force that the hand is to feel: its fades, and what the guard gets and changes.
#include <gtest/gtest.h>

#include "rt/control/rendering.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

struct Rendered {
  explicit Rendered(const ServoConfig& config) : rendering(config) {
    in = {.dt_s = 1e-3, .last_running = true, .coupled = true, .hand_velocity_m_s = Vec3(0.01, 0.02, 0)};
  }
  const EffectSum& step() { return rendering.sum_effects(in, readings, cell, task); }
  const EffectSum& step_for(double seconds) {
    for (int k = 1; k < static_cast<int>(seconds * 1000); ++k) {
      (void)step();
    }
    return step();
  }
  RenderInput in;
  Readings readings;
  CellFacts cell;
  TaskFacts task;
  Rendering rendering;
};

ServoConfig damped() {
  ServoConfig config;
  config.damping.emplace();
  return config;
}

// A needle 20 um deep in a cell that it has not punctured.
void press(Rendered& r) {
  r.cell.membrane = {.known = true, .entry_m = Vec3::Zero(), .R_m = 60e-6};
  r.cell.depth_m = 20e-6;
  r.cell.force_gain = 1;
}

TEST(Rendering, gives_forces_in_world_axes_from_a_velocity_in_hand_axes) {
  Rendered r(damped());
  const EffectSum& sum = r.step_for(1);
  EXPECT_NEAR(sum.force_N.x(), -0.01, 1e-12);
  EXPECT_NEAR(sum.force_N.y(), 0.02, 1e-12);
}

TEST(Rendering, fades_every_force_in_at_the_start_and_out_at_the_end) {
  Rendered r(damped());
  double last_fade = 0;
  EXPECT_TRUE(r.rendering.faded());
  for (int k = 0; k < 400; ++k) {
    const double fade = r.step().force_fade;
    EXPECT_GE(fade, last_fade);
    EXPECT_LE(fade - last_fade, 0.01);
    last_fade = fade;
  }
  EXPECT_EQ(last_fade, 1);
  r.in.ending = true;
  EXPECT_GT(r.step().force_fade, 0.9);
  EXPECT_EQ(r.step_for(0.06).force_fade, 0);
  EXPECT_TRUE(r.rendering.faded());
}

TEST(Rendering, begins_at_zero_again_after_a_reset) {
  Rendered r(damped());
  (void)r.step_for(1);
  r.rendering.restart();
  EXPECT_LT(r.step().force_N.norm(), 1e-4);
}

TEST(Rendering, fades_out_for_a_hand_that_is_stuck_and_at_once_during_a_stop) {
  Rendered r(damped());
  (void)r.step_for(1);
  r.readings.hand_stuck = true;
  EXPECT_GT(r.step().force_fade, 0);
  r.in.last_running = false;
  EXPECT_EQ(r.step().force_fade, 0);
}

TEST(Rendering, the_clutch_takes_away_the_needles_forces_and_leaves_the_damping) {
  ServoConfig config = damped();
  config.membrane.emplace();
  Rendered r(config);
  press(r);
  EXPECT_GT(r.step_for(1).effect_N[effect_membrane], 0.1);
  r.readings.hand.buttons = hal::kButtonClutch;
  const EffectSum& sum = r.step_for(0.06);
  EXPECT_EQ(sum.effect_N[effect_membrane], 0);
  EXPECT_NEAR(sum.force_N.norm(), r.in.hand_velocity_m_s.norm(), 1e-12);
  EXPECT_EQ(sum.force_fade, 1);
}

TEST(Rendering, the_needles_forces_fade_with_the_age_of_the_observation) {
  ServoConfig config;
  config.membrane.emplace();
  Rendered r(config);
  press(r);
  const double whole_N = r.step_for(1).force_N.norm();
  r.cell.force_gain = 0.25;
  EXPECT_NEAR(r.step().force_N.norm(), 0.25 * whole_N, 1e-12);
}

TEST(Rendering, raises_the_alarm_where_the_membrane_law_does_not_hold) {
  ServoConfig config;
  config.membrane.emplace();
  config.membrane->law = MembraneParams::Law::paper;
  Rendered r(config);
  (void)r.step();
  EXPECT_EQ(r.rendering.alarms(), 0U);
  press(r);
  (void)r.step();
  EXPECT_EQ(r.rendering.alarms(), alarm_model_invalid);
  EXPECT_GT(r.rendering.tip_force_N(), 0);
}

TEST(Rendering, without_a_guard_nothing_is_changed) {
  Rendered r(damped());
  const EffectSum& sum = r.step_for(1);
  EXPECT_EQ(r.rendering.keep_passive(sum, r.readings, 1e-3), sum.force_N);
  EXPECT_EQ(r.rendering.guard_N(), 0);
}

TEST(Rendering, the_guard_lowers_a_stiffness_that_the_device_cannot_keep_passive_and_says_so) {
  ServoConfig config;
  config.friction = FrictionParams{.F_c_N = 10, .K_N_m = 1000};  // the device keeps 200 N/m
  config.guard.emplace();
  Rendered r(config);
  (void)r.step_for(1);
  r.readings.hand.position_m.x() = 1e-3;
  const EffectSum& sum = r.step();
  EXPECT_NEAR(sum.force_N.x(), -1, 1e-9);
  const Vec3 force_N = r.rendering.keep_passive(sum, r.readings, 1e-3);
  EXPECT_LT(force_N.norm(), 0.25);
  EXPECT_NEAR(r.rendering.guard_N(), (force_N - sum.force_N).norm(), 1e-15);
  EXPECT_NE(r.rendering.alarms() & alarm_stiffness_reduced, 0U);
}

// Where the handle is now, nobody knows: what a damper holds against it would push it on.
TEST(Rendering, lets_the_force_of_a_silent_hand_go_with_a_guard_and_without) {
  for (const bool guarded : {false, true}) {
    ServoConfig config = damped();
    if (guarded) {
      config.guard.emplace();
    }
    Rendered r(config);
    const EffectSum& sum = r.step_for(1);
    ASSERT_GT(sum.force_N.norm(), 0);
    const auto at_age = [&](double age_s) {
      r.readings.hand_age_s = age_s;
      return r.rendering.keep_passive(sum, r.readings, 1e-3).norm();
    };
    if (!guarded) {
      EXPECT_EQ(at_age(0.001), sum.force_N.norm());
      EXPECT_EQ(at_age(0.008), sum.force_N.norm())
          << "the slowest hand that renders forces misses one sample";
    }
    EXPECT_EQ(at_age(0.016), 0);
    EXPECT_EQ(at_age(0.9), 0);
  }
}

}  // namespace
}  // namespace punctum::rt
