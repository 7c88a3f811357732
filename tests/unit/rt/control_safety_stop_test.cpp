// The force to the hand round a stop, and which faults are remembered.
#include <gtest/gtest.h>

#include "rt/control/safety_stop.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

const Vec3 kForce(0, 1, 0);

Readings chain(bool reset = false) {
  Readings r;
  r.has_estop = r.estop_readable = true;
  r.estop.reset_pressed = reset;
  return r;
}

std::uint64_t bit(Fault fault) { return 1ULL << static_cast<unsigned>(fault); }

TEST(SafetyStop, passes_the_force_on_while_no_stop_is_latched) {
  SafetyStop stop{EstopParams{}};
  const SafetyOutput out = stop.step(Fault::none, kForce, chain(), 1e-3);
  EXPECT_TRUE(out.running);
  EXPECT_EQ(out.hand_force_N, kForce);
  EXPECT_EQ(out.faults_latched, 0U);
}

TEST(SafetyStop, fades_the_force_before_the_stop_whatever_is_asked_for_meanwhile) {
  SafetyStop stop{EstopParams{}};
  (void)stop.step(Fault::none, kForce, chain(), 1e-3);
  double last_N = kForce.norm();
  for (int k = 0; k < 20; ++k) {
    const SafetyOutput out = stop.step(Fault::estop, Vec3(3, 0, 0), chain(), 1e-3);
    EXPECT_FALSE(out.running);
    EXPECT_TRUE(out.latch.quick_stop && out.latch.gate_shut);
    EXPECT_EQ(out.hand_force_N.x(), 0);
    EXPECT_LE(out.hand_force_N.norm(), last_N);
    last_N = out.hand_force_N.norm();
  }
  EXPECT_EQ(last_N, 0);
}

TEST(SafetyStop, gives_no_force_on_the_tick_that_clears_it) {
  SafetyStop stop{EstopParams{}};
  (void)stop.step(Fault::hand_lost, kForce, chain(), 1e-3);
  for (int k = 0; k < 1000; ++k) {
    (void)stop.step(Fault::none, kForce, chain(), 1e-3);
  }
  ASSERT_EQ(stop.stage(), StopStage::stopped);
  const SafetyOutput out = stop.step(Fault::none, kForce, chain(true), 1e-3);
  EXPECT_TRUE(out.latch.cleared && out.running);
  EXPECT_EQ(out.hand_force_N.norm(), 0);
  EXPECT_EQ(out.faults_latched, bit(Fault::hand_lost));
}

TEST(SafetyStop, is_not_cleared_while_either_contact_is_open) {
  for (const bool a : {true, false}) {
    SafetyStop stop{EstopParams{}};
    Readings readings = chain();
    (a ? readings.estop.contact_a_closed : readings.estop.contact_b_closed) = false;
    (void)stop.step(Fault::estop, kForce, readings, 1e-3);
    for (int k = 0; k < 1000; ++k) {
      (void)stop.step(Fault::none, kForce, readings, 1e-3);
    }
    ASSERT_EQ(stop.stage(), StopStage::stopped);
    readings.estop.reset_pressed = true;
    EXPECT_FALSE(stop.step(Fault::none, kForce, readings, 1e-3).latch.cleared);
  }
}

TEST(SafetyStop, remembers_a_discrepancy_behind_an_open_contact) {
  SafetyStop stop{EstopParams{}};
  Readings readings = chain();
  readings.estop_discrepancy = true;
  const SafetyOutput out = stop.step(Fault::estop, kForce, readings, 1e-3);
  EXPECT_EQ(out.cause, Fault::estop);
  EXPECT_EQ(out.faults_latched, bit(Fault::estop) | bit(Fault::estop_discrepancy));
}

TEST(SafetyStop, remembers_contacts_that_disagree_behind_a_switch_that_was_let_go) {
  SafetyStop stop{EstopParams{}};
  (void)stop.step(Fault::enabling_released, kForce, chain(), 1e-3);
  const SafetyOutput out = stop.step(Fault::enabling_fault, kForce, chain(), 1e-3);
  EXPECT_EQ(out.cause, Fault::enabling_released);
  EXPECT_EQ(out.faults_latched, bit(Fault::enabling_released) | bit(Fault::enabling_fault));
}

TEST(SafetyStop, does_not_take_an_old_reading_for_a_standstill) {
  for (const bool fresh : {true, false}) {
    SafetyStop stop{EstopParams{}};
    Readings readings = chain();
    readings.has_stage = true;
    readings.stage.at_standstill = true;
    readings.stage_fresh = fresh;
    for (int k = 0; k < 100; ++k) {
      (void)stop.step(Fault::estop, kForce, readings, 1e-3);
    }
    EXPECT_EQ(stop.stage(), fresh ? StopStage::stopped : StopStage::stopping);
  }
}

TEST(SafetyStop, does_not_take_a_sample_from_before_the_stop_for_a_standstill) {
  for (const double age_s : {0.0, 0.019}) {
    SafetyStop stop{EstopParams{.hand_ramp_s = 0.001}};
    Readings readings = chain();
    readings.has_stage = readings.stage_fresh = readings.stage.at_standstill = true;
    readings.stage_age_s = age_s;
    for (int k = 0; k < 18; ++k) {
      (void)stop.step(Fault::estop, kForce, readings, 1e-3);
    }
    EXPECT_EQ(stop.stage(), age_s > 0 ? StopStage::stopping : StopStage::stopped);
  }
}

TEST(SafetyStop, finds_a_drive_that_creeps_away_without_power) {
  for (const double speed_m_s : {0.0, 2e-6, 20e-6}) {
    SafetyStop stop{EstopParams{}};
    Readings readings = chain();
    readings.has_stage = readings.stage_fresh = readings.stage.at_standstill = true;
    SafetyOutput out;
    for (int k = 0; k < 6000; ++k) {
      readings.stage.tip_m.x() += speed_m_s * 1e-3;
      out = stop.step(k == 0 ? Fault::estop : Fault::none, kForce, readings, 1e-3);
    }
    EXPECT_EQ(out.latch.heartbeat, speed_m_s == 0) << speed_m_s;
    EXPECT_EQ(out.faults_latched, bit(Fault::estop) | (speed_m_s == 0 ? 0 : bit(Fault::stage_not_stopping)));
  }
}

// A holding brake closes within 50 ms, and the motor has power until then.
TEST(SafetyStop, distrusts_a_drive_that_keeps_its_power_for_longer_than_its_brake_needs) {
  for (const int keeps_ms : {60, 130}) {
    SafetyStop stop{EstopParams{}};
    Readings readings = chain();
    readings.has_stage = readings.stage_fresh = readings.stage.at_standstill = true;
    SafetyOutput out;
    int without = 0;
    for (int k = 0; k < 1000; ++k) {
      without +=
          stop.step(k == 0 ? Fault::estop : Fault::none, kForce, readings, 1e-3).latch.drive_power ? 0 : 1;
      readings.stage.powered = without < keeps_ms;
      out = stop.step(Fault::none, kForce, readings, 0);
    }
    EXPECT_EQ(out.latch.heartbeat, keeps_ms == 60) << keeps_ms;
  }
}

}  // namespace
}  // namespace punctum::rt
