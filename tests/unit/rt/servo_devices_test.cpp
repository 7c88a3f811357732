// Devices that give no sample, stand still or run away while they report that all is well.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, survives_a_missing_sample_without_a_step) {
  Bench b(icsi());
  b.to_indentation();
  double before = b.force();
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, std::abs(b.force() - before));
    before = b.force();
    b.hand.status = b.ticks % 7 == 0 ? Status::no_data : Status::ok;
    b.stage.status = b.ticks % 11 == 0 ? Status::no_data : Status::ok;
    b.estop.status = b.ticks % 13 == 0 ? Status::no_data : Status::ok;
  };
  b.run(2);
  EXPECT_NE(b.servo->fault(), Fault::hand_lost);
  EXPECT_LT(steepest, 0.05);
}

TEST(Servo, stops_when_a_device_that_is_still_read_takes_no_commands) {
  for (const Status refused : {Status::disconnected, Status::fault}) {
    Bench hand(icsi());
    hand.run(1);
    hand.hand.write_status = refused;
    hand.tick();
    hand.tick();
    EXPECT_EQ(hand.servo->fault(), Fault::hand_lost);
    EXPECT_GE(hand.stage.quick_stops, 1);

    Bench stage(icsi());
    stage.run(1);
    stage.stage.command_status = refused;
    stage.tick();
    stage.tick();
    EXPECT_EQ(stage.servo->fault(), refused == Status::disconnected ? Fault::stage_lost : Fault::stage_fault);
    EXPECT_GE(stage.stage.quick_stops, 1);
  }
}

TEST(Servo, notices_a_stage_whose_readings_stand_still_or_run_away_while_its_drive_says_all_is_well) {
  for (const double rate : {1000.0, 8000.0}) {
    for (const int how : {0, 1, 2}) {
      ServoConfig config = icsi();
      config.rate_Hz = rate;
      Bench b(config);
      b.run(1);
      (how == 0 ? b.stage.frozen : how == 1 ? b.stage.deaf : b.stage.runaway) = true;
      const Vec3 told = b.stage.commanded.back();
      const Vec3 stood = b.stage.tip;
      for (int k = 0; k < 3 * rate && b.servo->fault() == Fault::none; ++k) {
        if (how != 2) {
          b.wanted_x -= 20e-6 * b.dt();
        }
        b.tick();
      }
      EXPECT_EQ(b.servo->fault(), Fault::stage_following) << how;
      EXPECT_GE(b.stage.quick_stops, 1);
      // No further than the limit and what a reading may be old.
      EXPECT_LT((b.stage.commanded.back() - told).norm(), 11e-6) << how;
      EXPECT_LT((b.stage.tip - stood).norm(), 13e-6) << how;
    }
  }
}

TEST(Servo, follows_a_stage_whose_readings_are_as_old_as_they_may_be_at_full_speed) {
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    config.mapping.tremor_cutoff_Hz = 0;
    Bench b(config);
    b.stage.delay = static_cast<std::size_t>(0.019 * rate);
    b.run(1);
    double fastest = 0;
    b.every_tick = [&] { fastest = std::max(fastest, b.stage.speed.norm()); };
    b.move(250e-6, 380e-6);
    b.move(60e-6, 380e-6);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_GT(fastest, 350e-6);
  }
}

TEST(Servo, does_not_follow_a_hand_whose_readings_stood_still_and_are_suddenly_elsewhere) {
  for (const bool one_axis : {false, true}) {
    Bench b(icsi());
    b.to_indentation();
    b.hand.frozen = true;
    b.hand.only_x = one_axis;
    int tick = 0;
    b.every_tick = [&] { b.hand.intention.y() = 0.5e-3 * std::sin(0.05 * ++tick); };
    b.move(b.wanted_x + 20e-6, 40e-6);  // 10 mm at the hand
    b.run(0.5);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    const Vec3 tip = b.stage.tip;
    b.hand.frozen = false;
    b.run(1);
    EXPECT_EQ(b.servo->fault(), Fault::hand_invalid);
    EXPECT_LT(std::abs(b.stage.tip.x() - tip.x()), 0.1e-6);
  }
}

// A hand that presses slowly on; what so many samples do that are off by jump_m, against a run without them.
struct Glitch {
  std::vector<Vec3> tip_m;
  double away_m = 0;        // largest distance between the tips of both runs
  double force_step_N = 0;  // largest change of the force from one tick to the next
  Fault fault = Fault::none;
  bool alarm = false;
};
Glitch glitch(double rate_Hz, double jump_m, int samples, const Glitch* without = nullptr) {
  ServoConfig config = icsi();
  config.rate_Hz = rate_Hz;
  Bench b(config);
  b.to_indentation();
  const auto presses_on = [&] { b.wanted_x -= 6e-6 * b.dt(); };
  b.every_tick = presses_on;
  b.run(0.3);
  Glitch seen;
  double before_N = b.force();
  b.every_tick = [&] {
    presses_on();
    seen.tip_m.push_back(b.stage.tip);
    if (without != nullptr) {
      seen.away_m = std::max(seen.away_m, (b.stage.tip - without->tip_m[seen.tip_m.size() - 1]).norm());
    }
    seen.force_step_N = std::max(seen.force_step_N, std::abs(b.force() - before_N));
    seen.alarm = seen.alarm || (b.sample().alarms & alarm_sensor) != 0;
    before_N = b.force();
  };
  b.hand.jump_m = jump_m;
  for (int k = 0; k < samples; ++k) {
    b.tick();
  }
  b.hand.jump_m = 0;
  b.run(0.5);
  seen.fault = b.servo->fault();
  return seen;
}

TEST(Servo, is_not_moved_by_one_sample_of_the_hand_that_no_hand_can_give) {
  for (const double rate_Hz : {1000.0, 8000.0}) {
    const Glitch without = glitch(rate_Hz, 0, 1);
    for (const double jump_m : {-5e-3, 5e-3, -10e-3, 10e-3, -19e-3, 19e-3, -0.3, 0.3, 1e9, 1.7e308,
                                std::numeric_limits<double>::quiet_NaN()}) {
      const Glitch seen = glitch(rate_Hz, jump_m, 1, &without);
      EXPECT_LT(seen.away_m, 0.1e-6) << jump_m;
      EXPECT_LT(seen.force_step_N, without.force_step_N + 0.02) << jump_m;
      EXPECT_EQ(seen.fault, Fault::none) << jump_m;
      EXPECT_TRUE(seen.alarm) << jump_m;
    }
  }
}

TEST(Servo, bounds_what_a_smaller_glitch_of_the_hand_does) {
  for (const double rate_Hz : {1000.0, 8000.0}) {
    const Glitch without = glitch(rate_Hz, 0, 1);
    for (const double size_m : {0.05e-3, 0.1e-3, 0.2e-3, 0.3e-3, 0.5e-3, 1e-3, 2e-3, 3e-3}) {
      for (const double jump_m : {size_m, -size_m}) {
        const Glitch seen = glitch(rate_Hz, jump_m, 1, &without);
        EXPECT_LT(seen.away_m, 0.1e-6) << jump_m;
        EXPECT_LT(seen.force_step_N, without.force_step_N + 0.05) << jump_m;
        EXPECT_EQ(seen.fault, Fault::none) << jump_m;
      }
    }
  }
}

TEST(Servo, stops_when_the_hand_gives_such_samples_again_and_again) {
  for (const double rate_Hz : {1000.0, 8000.0}) {
    const Glitch without = glitch(rate_Hz, 0, 20);
    for (const double jump_m : {-5e-3, 19e-3, 1e9}) {
      const Glitch seen = glitch(rate_Hz, jump_m, 20);
      EXPECT_EQ(seen.fault, Fault::hand_invalid) << jump_m;
      EXPECT_LT((seen.tip_m.back() - without.tip_m.front()).norm(), 0.3e-6) << jump_m;
    }
  }
}

TEST(Servo, begins_where_the_hand_is_after_a_first_sample_that_was_garbage) {
  for (const double garbage_m : {0.05, -0.3, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    Bench b(icsi());
    b.hand.jump_m = garbage_m;
    b.tick();
    b.hand.jump_m = 0;
    b.run(1);
    EXPECT_EQ(b.servo->fault(), Fault::none) << garbage_m;
    b.move(50e-6, 15e-6);
    b.run(0.5);
    EXPECT_NEAR(b.stage.tip.x(), 50e-6, 1e-6) << garbage_m;
  }
}

TEST(Servo, can_be_reset_after_the_origin_of_the_hand_has_moved) {
  Bench b(icsi());
  b.run(1);
  b.hand.jump_m = 0.05;
  b.run(1);
  EXPECT_EQ(b.servo->fault(), Fault::hand_invalid);
  const Vec3 tip = b.stage.tip;
  b.estop.state.reset_pressed = true;
  b.run(0.2);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  b.run(1);
  EXPECT_LT((b.stage.tip - tip).norm(), 0.3e-6);
}

TEST(Servo, fades_the_force_on_a_handle_that_a_changing_force_does_not_move) {
  ServoConfig config = icsi();
  config.membrane->E_Pa *= 12;
  Bench b(config);
  b.to_indentation();
  b.run(1);
  b.hand.frozen = true;
  b.run(1);
  // At rest under a steady force: an arm can do that.
  EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_GT(b.force(), 0.1);
  // Vision finds the cell nearer, as far as it may: the force rises, and nothing moves.
  b.centre.x() += 7e-6;
  b.puncture_at = 1;
  double most = 0;
  b.every_tick = [&] { most = std::max(most, b.force()); };
  b.run(2);
  EXPECT_GT(most, 0.6);
  EXPECT_NE(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_EQ(b.force(), 0);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  // The handle moves again: the force returns by a ramp, and the needle stays where it is meanwhile.
  const Vec3 tip = b.stage.tip;
  double before = 0;
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - before);
    before = b.force();
  };
  b.hand.x = b.hand.frozen_at;
  b.hand.v.setZero();
  b.hand.intention = b.hand.x + Vec3(0.1e-3, 0.1e-3, 0);
  b.hand.frozen = false;
  b.tip_start.x() = b.wanted_x - b.hand.x.x() / 500 - 0.2e-6;
  b.run(0.05);
  EXPECT_LT((b.stage.tip - tip).norm(), 0.3e-6);
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_GT(b.force(), 0.1);
  EXPECT_LT(steepest, 0.03);
}

TEST(Servo, lets_a_hand_rest_still_for_a_minute) {
  Bench b(icsi());
  b.to_indentation();
  b.run(1);
  b.hand.held = true;
  std::uint32_t alarms = 0;
  b.every_tick = [&] { alarms |= b.sample().alarms; };
  b.run(60);
  EXPECT_EQ(alarms & alarm_sensor, 0U);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_GT(b.force(), 0.05);
}

TEST(Servo, says_when_the_gauge_stands_still) {
  for (const double still_s : {1.0, 0.0}) {
    ServoConfig config = icsi();
    config.vacuum->still_s = still_s;
    Bench b(config);
    b.run(1);
    b.vacuum.hangs = true;
    b.run(0.99);
    EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
    b.run(0.05);
    EXPECT_EQ((b.sample().alarms & alarm_sensor) != 0, still_s > 0);
    b.vacuum.hangs = false;
    b.run(0.01);
    EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
    EXPECT_EQ(b.servo->fault(), Fault::none);
  }
}

}  // namespace
}  // namespace punctum::rt
