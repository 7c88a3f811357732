// What the hand feels: the membrane law, the effects at rest and let go, the guard, the clutch.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, renders_the_papers_law_of_the_depth_it_reports_within_a_percent_at_rest) {
  ServoConfig config = icsi();
  config.membrane->law = MembraneParams::Law::paper;
  config.local_model->dimple_scale_rate_1_s = 0.5;
  Bench b(config);
  b.to_indentation();
  b.run(3);
  const TelemetrySample& s = b.sample();
  EXPECT_NEAR(s.wd_m, -b.gap(), 20e-9);
  EXPECT_NEAR(s.a_m, 3.8e-6 + 0.45 * std::sqrt(2 * 60e-6 * s.wd_m), 0.1e-6);
  const double force =
      membrane_force(35.3e3, 0.5, 4.6e-6, 3.8e-6, -b.gap(), 3.8e-6 + 0.45 * std::sqrt(-b.gap() * 2 * 60e-6));
  EXPECT_NEAR(s.effect_N[effect_membrane] / (1e5 * force), 1, 0.01);
  EXPECT_GT(s.force_N[0], 0);  // pushes the hand back, to the right
  EXPECT_NEAR(s.pressure_Pa, s.tip_force_N / (3.14159265 * s.a_m * s.a_m), 1e-6 * s.pressure_Pa);
  EXPECT_NE(s.alarms & alarm_model_invalid, 0U);  // too steep for it
}

TEST(Servo, renders_the_corrected_law_of_the_depth_it_reports_at_rest) {
  Bench b(icsi());
  b.to_indentation();
  b.run(3);
  const TelemetrySample& s = b.sample();
  EXPECT_NEAR(s.wd_m, -b.gap(), 20e-9);
  // F / (E h R w) = 0.715 at w/R = 0.125 and 0.720 at 0.375: membrane_truth_reference.py, of c/R = 0.0625.
  const double force = 0.717 * 35.3e3 * 4.6e-6 * -b.gap();
  EXPECT_NEAR(s.effect_N[effect_membrane] / (1e5 * force), 1, 0.05);
  EXPECT_GT(s.force_N[0], 0);
  EXPECT_EQ(s.alarms & alarm_model_invalid, 0U);
}

TEST(Servo, stops_when_the_membrane_law_gives_no_number) {
  ServoConfig config = icsi();
  config.membrane->E_Pa = std::numeric_limits<double>::quiet_NaN();
  Bench b(config);
  b.run(2);
  EXPECT_EQ(b.sample().fault, Fault::not_finite);
  for (const double f : b.sample().force_N) {
    EXPECT_EQ(f, 0);
  }
}

TEST(Servo, holds_still_in_contact_without_a_limit_cycle) {
  // Of a stiff membrane: at the hand k_f/k_p dF/dw of the order of the arm's own stiffness.
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.membrane->E_Pa *= 5;
    config.rate_Hz = rate;
    config.limits.tip_force_soft_N = 1;
    config.limits.tip_force_hard_N = 1;
    Bench b(config);
    b.puncture_at = 1;
    b.to_indentation();
    b.move(0, 15e-6);
    b.run(3);
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.x());
      high = std::max(high, b.hand.x.x());
    };
    b.run(2);
    EXPECT_LT(high - low, 0.06e-3) << "two encoder steps";
    std::printf("%.0f Hz: hand moves %.3f mm at %.2f N\n", rate, 1e3 * (high - low), b.force());
  }
}

TEST(Servo, leaves_the_membrane_its_force_under_a_hand_that_rests_although_the_guard_is_on) {
  ServoConfig config = icsi();
  config.guard.emplace();
  Bench b(config);
  b.puncture_at = 1;
  b.run(1);
  for (const double speed_m_s : {15e-6, 50e-6, 100e-6}) {
    b.move(8e-6, speed_m_s);
    b.run(0.5);
    double force_N = 0, membrane_N = 0;
    b.every_tick = [&] {
      force_N += b.hand.force.x();
      membrane_N += b.effect_N(effect_membrane);
    };
    b.run(3);
    b.every_tick = nullptr;
    EXPECT_GT(force_N, 0.9 * membrane_N) << speed_m_s;
    b.move(30e-6, speed_m_s);
    b.run(0.5);
  }
}

TEST(Servo, does_not_let_a_free_handle_ring_in_a_stiff_bristle_with_the_guard) {
  for (const bool guarded : {false, true}) {
    ServoConfig config;
    config.friction = FrictionParams{.F_c_N = 0.5, .K_N_m = 1000};
    if (guarded) {
      config.guard.emplace();
    }
    Bench b(config);
    b.hand.arm_k = b.hand.arm_c = 0;
    b.run(1);
    b.hand.v = {0.05, 0.02, 0};
    b.run(4);
    Vec3 low = b.hand.x, high = b.hand.x;
    b.every_tick = [&] {
      low = low.cwiseMin(b.hand.x);
      high = high.cwiseMax(b.hand.x);
    };
    b.run(1);
    if (guarded) {
      EXPECT_LT((high - low).maxCoeff(), 0.06e-3);
    } else {
      EXPECT_GT((high - low).maxCoeff(), 0.5e-3);
    }
  }
}

TEST(Servo, does_not_let_a_loosely_held_hand_swing_against_the_late_needle_with_the_guard) {
  for (const bool guarded : {false, true}) {
    ServoConfig config = icsi();
    config.damping.reset();
    config.cone.reset();
    if (guarded) {
      config.guard.emplace();
    }
    Bench b(config);
    b.puncture_at = 1;
    b.hand.arm_k = 8;
    b.hand.arm_c = 1;
    b.run(1);
    b.move(-20e-6, 200e-6);
    b.run(10);  // with the guard, what the move began has died out by then
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.x());
      high = std::max(high, b.hand.x.x());
    };
    b.run(2);
    if (guarded) {
      EXPECT_LT(high - low, 0.15e-3);
      EXPECT_GT(b.hand.force.x(), 0.9 * b.effect_N(effect_membrane));
    } else {
      EXPECT_GT(high - low, 10e-3);
    }
  }
}

TEST(Servo, pushes_a_handle_that_is_let_go_out_of_contact_and_no_further) {
  Bench b(icsi());
  b.to_indentation();
  b.hand.arm_k = b.hand.arm_c = 0;
  double fastest = 0;
  b.every_tick = [&] { fastest = std::max(fastest, b.hand.v.norm()); };
  b.run(5);
  EXPECT_GT(b.gap(), -1e-6);
  EXPECT_LT(b.gap(), 40e-6);
  EXPECT_LT(b.hand.v.norm(), 2e-3);
  EXPECT_LT(fastest, 0.3);
}

TEST(Servo, lets_a_handle_that_is_let_go_come_to_rest_in_the_guide) {
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    Bench b(config);
    b.tip_start = b.stage.tip = b.stage.target = Vec3(30e-6, 12e-6, 0);
    b.wanted_x = 30e-6;
    b.run(1);
    EXPECT_GT(b.effect_N(effect_cone), 0.2);
    b.hand.arm_k = b.hand.arm_c = 0;
    b.run(5);
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.y());
      high = std::max(high, b.hand.x.y());
    };
    b.run(1);
    EXPECT_LT(high - low, 0.1e-3);
    EXPECT_LT(std::abs(b.stage.tip.y()), 4e-6);  // inside the free core
    std::printf("%.0f Hz: handle moves %.3f mm, tip %.1f um beside the axis\n", rate, 1e3 * (high - low),
                1e6 * b.stage.tip.y());
  }
}

TEST(Servo, drops_the_force_at_the_puncture_without_a_bounce) {
  Bench b(icsi());
  b.to_indentation();
  double before = 1e9;
  bool falling = false;
  int ticks_to_zero = 0;
  b.every_tick = [&] {
    const double membrane = b.effect_N(effect_membrane);
    if (b.servo->phase() == puncture || falling) {
      falling = true;
      ASSERT_LE(membrane, before + 1e-12);
      if (membrane > 0) {
        ++ticks_to_zero;
      }
    }
    before = membrane;
  };
  b.move(0, 15e-6);
  b.run(3);
  EXPECT_TRUE(falling);
  EXPECT_EQ(before, 0);
  EXPECT_LE(ticks_to_zero, 31);
}

TEST(Servo, clutch_uncouples_the_needle_and_its_forces) {
  Bench b(icsi());
  b.to_indentation();
  const double gap = b.gap();
  b.hand.buttons = hal::kButtonClutch;
  b.run(0.5);
  EXPECT_EQ(b.effect_N(effect_membrane), 0);
  const Vec3 tip = b.stage.tip;
  b.hand_per_needle = 300;  // the hand goes elsewhere
  b.run(1);
  EXPECT_LT((b.stage.tip - tip).norm(), 0.1e-6);
  b.hand.buttons = 0;
  b.run(0.5);
  EXPECT_NEAR(b.gap(), gap, 3e-6);
  EXPECT_GT(b.effect_N(effect_membrane), 0);
}

}  // namespace
}  // namespace punctum::rt
