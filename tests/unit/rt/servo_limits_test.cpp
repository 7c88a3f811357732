// Limits of depth, tip force and set-points, whatever the devices do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, holds_the_needle_at_the_depth_limit_and_at_the_soft_tip_force) {
  ServoConfig config = icsi();
  config.limits.penetration_depth_m = 20e-6;
  Bench b(config);
  b.to_inside();
  b.move(-60e-6, 40e-6);
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_depth_limited, 0U);
  EXPECT_LT(-b.gap(), 20.1e-6);
  EXPECT_GT(-b.gap(), 19e-6);

  ServoConfig soft = icsi();
  soft.limits.tip_force_soft_N = 2e-6;
  Bench s(soft);
  s.puncture_at = 1;
  s.to_indentation();
  s.move(-20e-6, 10e-6);
  s.run(0.5);
  EXPECT_NE(s.sample().alarms & alarm_tip_force, 0U);
  EXPECT_LT(s.sample().tip_force_N, 2.4e-6);
  EXPECT_EQ(s.servo->fault(), Fault::none);
}

// Lowered under the needle, raised again while the hand pushes: neither moves it.
TEST(Servo, lets_the_operator_lower_the_depth_limit_and_moves_the_needle_for_none_of_it) {
  Bench b(icsi());
  b.to_inside();
  b.move(-10e-6, 40e-6);
  b.run(0.5);
  const double depth_m = -b.gap();
  ASSERT_GT(depth_m, 20e-6);
  const auto ask = [&](double limit_m) {
    ASSERT_TRUE(b.station->console.queue.try_push({Command::depth_limit, limit_m}));
    b.run(0.7);
  };
  ask(12e-6);
  EXPECT_NEAR(-b.gap(), depth_m, 0.1e-6);
  b.move(b.wanted_x - 15e-6, 40e-6);
  b.run(0.5);
  EXPECT_NEAR(-b.gap(), depth_m, 0.1e-6);
  EXPECT_NE(b.sample().alarms & alarm_depth_limited, 0U);
  ask(b.config_.limits.penetration_depth_m);
  EXPECT_NEAR(-b.gap(), depth_m, 0.1e-6);
  b.move(b.wanted_x - 10e-6, 40e-6);
  b.run(0.5);
  EXPECT_GT(-b.gap(), depth_m + 5e-6);
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

// The membrane is said to recede with the needle: past the first contact the encoders know better.
TEST(Servo, keeps_a_commanded_depth_whatever_vision_says_of_the_membrane) {
  Bench b(icsi());
  b.to_inside();
  ASSERT_TRUE(b.station->console.queue.try_push({Command::depth_limit, 25e-6}));
  b.run(0.7);
  const double entry_x = b.stage.tip.x() + -b.gap();
  b.centre.x() -= 6e-6;  // the cell as it is seen from now on
  b.move(b.wanted_x - 40e-6, 40e-6);
  b.run(1);
  EXPECT_LT(entry_x - b.stage.tip.x(), 26e-6);
  EXPECT_GT(entry_x - b.stage.tip.x(), 20e-6);
}

TEST(Servo, stops_at_the_hard_tip_force_as_measured) {
  ServoConfig config = icsi();
  config.force_sensor = true;
  Bench b(config);
  b.to_indentation();
  b.sensor.force = 70e-6;
  b.run(0.05);
  EXPECT_EQ(b.servo->fault(), Fault::tip_force);
}

TEST(Servo, is_not_fooled_about_the_tip_force_by_a_sensor_that_says_zero) {
  ServoConfig config = icsi();
  config.force_sensor = true;
  config.limits.tip_force_soft_N = 2e-6;
  Bench b(config);
  b.puncture_at = 1;
  b.to_indentation();
  b.move(-20e-6, 10e-6);
  b.run(0.5);
  EXPECT_NE(b.sample().alarms & alarm_tip_force, 0U);
  EXPECT_LT(b.sample().tip_force_N, 2.4e-6);
}

TEST(Servo, moves_the_set_point_by_no_leap_after_a_late_tick) {
  const ServoConfig config = icsi();
  Bench b(config);
  b.run(0.5);
  Vec3 before = b.stage.commanded.back();
  double most = 0;
  b.every_tick = [&] {
    most = std::max(most, (b.stage.commanded.back() - before).norm());
    before = b.stage.commanded.back();
  };
  b.move(40e-6, 100e-6);
  b.hand.step(0.05);
  b.stage.step(0.05);
  b.now += 49'000'000;
  b.tell_time();
  b.servo->tick({b.ticks += 49, b.now, b.now, 0.05, 49});
  b.every_tick();
  b.move(20e-6, 100e-6);
  EXPECT_LE(most, 2 * config.limits.stage_velocity_m_s * 1e-3 * (1 + 1e-9));
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

TEST(Servo, withdraws_at_once_when_the_hand_pulls_back_blind_whatever_it_pushed_before) {
  ServoConfig config = icsi();
  config.cells = 2;
  Bench b(config);
  b.to_inside();
  b.seeing = false;
  b.run(1);
  const double blind_x = b.stage.tip.x();
  b.move(b.wanted_x - 60e-6, 60e-6);
  b.run(0.3);
  EXPECT_NEAR(b.stage.tip.x(), blind_x, 1e-6);
  const double pull_from_x = b.stage.tip.x();
  b.move(b.wanted_x + 55e-6, 60e-6);
  b.run(1);
  EXPECT_GT(b.stage.tip.x() - pull_from_x, 45e-6);
  const double back_x = b.stage.tip.x();
  b.seeing = true;
  b.run(1);
  EXPECT_NEAR(b.stage.tip.x(), back_x, 1e-6);
}

TEST(Servo, does_not_catch_up_what_the_hand_did_during_a_stall) {
  ServoConfig config;
  config.vision = false;
  config.phases.reset();
  config.local_model.reset();
  Bench b(config);
  b.run(0.5);
  const Vec3 before = b.stage.tip;
  b.hand.intention.x() -= 80e-6 * b.hand_per_needle;
  b.wanted_x -= 80e-6;
  for (int k = 0; k < 10000; ++k) {
    b.hand.step(1e-3);
  }
  b.now += 9'999'000'000;
  b.stage.step(10);
  b.tell_time();
  b.servo->tick({b.ticks += 9999, b.now, b.now, 10, 9999});
  b.run(1);
  EXPECT_LT((b.stage.tip - before).norm(), 1e-6);
  // Coupled as before.
  b.move(b.wanted_x - 20e-6, 50e-6);
  b.run(0.5);
  EXPECT_NEAR(b.stage.tip.x(), before.x() - 20e-6, 1e-6);
}

TEST(Servo, gives_the_hand_no_jolt) {
  ServoConfig config = icsi();
  config.damping->B1_Ns_m = 40;
  Bench b(config);
  b.run(0.5);
  Vec3 last_N = b.hand.force;
  double most_N_s = 0;
  b.every_tick = [&] {
    most_N_s = std::max(most_N_s, (b.hand.force - last_N).norm() / b.dt());
    last_N = b.hand.force;
  };
  b.hand.intention.y() = 0.1;  // a blow
  b.run(0.5);
  EXPECT_LT(most_N_s, 301);
  EXPECT_GT(most_N_s, 200);
}

TEST(Servo, does_not_slice_the_cell_sideways) {
  Bench b(icsi());
  b.to_inside();
  b.run(0.2);
  const Vec3 entered = b.stage.tip;
  double most_m = 0;
  bool said = false;
  b.every_tick = [&] {
    most_m = std::max(most_m, std::abs(b.stage.tip.y() - entered.y()));
    said = said || (b.sample().alarms & alarm_lateral_limited) != 0;
  };
  b.hand.intention.y() = 25e-6 * b.hand_per_needle;
  b.run(2);
  EXPECT_TRUE(said);
  EXPECT_LT(most_m, 6e-6);
  EXPECT_GT(most_m, 4e-6);
}

TEST(Servo, turns_the_needle_with_the_handle_outside_the_cell_and_not_inside) {
  for (const bool with_phases : {true, false}) {
    SCOPED_TRACE(with_phases);
    ServoConfig config = icsi();
    config.injector.reset();
    if (with_phases) {
      config.phases.emplace();
    } else {
      config.phases.reset();
    }
    Bench b(config);
    const auto turn = [&b] {
      const Vec3 before = b.stage.commanded_axis;
      const double from = b.hand.turn_rad;
      for (int k = 1; k <= 500; ++k) {
        b.hand.turn_rad = from + 0.03 * k / 500;
        b.tick();
      }
      b.run(0.5);
      return (b.stage.commanded_axis - before).norm();
    };
    b.run(1);
    EXPECT_GT(turn(), 0.01);
    b.move(10e-6, 15e-6);
    while (!b.punctured && b.ticks < 60000) {
      b.wanted_x -= 5e-9;
      b.tick();
    }
    ASSERT_TRUE(b.punctured);
    b.run(0.3);  // until vision has told it twice
    EXPECT_EQ(turn(), 0);
    EXPECT_EQ(b.servo->fault(), Fault::none);
  }
}

TEST(Servo, moves_nothing_and_powers_no_drive_before_the_enabling_device_is_pressed) {
  ServoConfig config = icsi();
  config.enabling.emplace();
  Bench b(config);
  b.hand.buttons = hal::kButtonEnable;  // from the start on: no act
  b.stage.on = true;                    // as another program left it
  const Vec3 start = b.stage.tip;
  const auto nothing_moves = [&] {
    b.move(b.wanted_x - 20e-6, 40e-6);
    EXPECT_FALSE(b.stage.on);
    EXPECT_EQ(b.hand.force.norm(), 0);
    EXPECT_TRUE(b.stage.commanded.empty());
    EXPECT_EQ(b.stage.tip, start);
    EXPECT_NE(b.sample().alarms & alarm_not_enabled, 0U);
  };
  nothing_moves();
  b.hand.buttons = 0;
  nothing_moves();
  EXPECT_EQ(b.servo->fault(), Fault::none);
  b.hand.buttons = hal::kButtonEnable;
  b.run(0.5);
  EXPECT_EQ(b.sample().alarms & alarm_not_enabled, 0U);
  EXPECT_TRUE(b.stage.on);
  EXPECT_NEAR(b.stage.tip.x(), start.x(), 1e-6);  // not where the hand went meanwhile
  b.move(b.wanted_x - 20e-6, 40e-6);
  b.run(0.5);
  EXPECT_NEAR(b.stage.tip.x(), start.x() - 20e-6, 1e-6);
}

TEST(Servo, stops_when_the_enabling_device_is_let_go_or_squeezed_and_goes_on_by_a_new_press) {
  for (const std::uint32_t leaves : {0U, hal::kButtonEnable | hal::kButtonPanic}) {
    ServoConfig config = icsi();
    config.enabling.emplace();
    Bench b(config);
    b.run(0.1);
    b.hand.buttons = hal::kButtonEnable;
    b.run(1);
    const int stops = b.stage.quick_stops;
    b.hand.buttons = leaves;
    b.run(0.03);
    EXPECT_GT(b.stage.quick_stops, stops);
    EXPECT_EQ(b.servo->fault(), Fault::enabling_released);
    b.run(1);
    EXPECT_EQ(b.hand.force.norm(), 0);
    EXPECT_FALSE(b.stage.on);
    EXPECT_FALSE(b.servo->finished());
    const double x = b.stage.tip.x();
    b.move(b.wanted_x - 20e-6, 40e-6);
    b.hand.buttons = 0;
    b.run(0.1);
    // The reset button is not enough.
    b.estop.state.reset_pressed = true;
    b.run(0.1);
    b.estop.state.reset_pressed = false;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), Fault::enabling_released);
    b.hand.buttons = hal::kButtonEnable;
    b.run(1);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_TRUE(b.stage.on);
    EXPECT_NEAR(b.stage.tip.x(), x, 1e-6);
    b.move(b.wanted_x - 10e-6, 40e-6);
    b.run(0.5);
    EXPECT_NEAR(b.stage.tip.x(), x - 10e-6, 1e-6);
  }
}

TEST(Servo, holds_when_a_switch_of_its_own_is_let_go_and_takes_the_reset_button_when_a_contact_stays_closed) {
  for (const bool welded : {false, true}) {
    ServoConfig config = icsi();
    config.enabling.emplace();
    Bench b(config, true, true);
    b.run(0.1);
    b.enabling.hold(true);
    b.run(1);
    EXPECT_TRUE(b.stage.on);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    const int stops = b.stage.quick_stops;
    b.enabling.state = {.contact_a_closed = welded};
    b.run(0.03);
    EXPECT_GT(b.stage.quick_stops, stops);
    EXPECT_EQ(b.servo->fault(), Fault::enabling_released);
    b.run(1);
    EXPECT_FALSE(b.stage.on);
    EXPECT_EQ(b.hand.force.norm(), 0);
    b.enabling.hold(true);
    b.run(1);
    EXPECT_EQ(b.servo->fault(), welded ? Fault::enabling_released : Fault::none);
    EXPECT_EQ(b.stage.on, !welded);
    const std::uint64_t latched = b.station->core.status.faults_latched.load();
    EXPECT_EQ((latched >> static_cast<int>(Fault::enabling_fault) & 1U) != 0, welded);
    if (!welded) {
      continue;
    }
    // Mended: both open, the reset button, and a new press.
    b.enabling.hold(false);
    b.run(0.1);
    b.enabling.hold(true);
    b.run(0.1);
    EXPECT_FALSE(b.stage.on) << "no press ends this stop";
    b.enabling.hold(false);
    b.estop.state.reset_pressed = true;
    b.run(0.1);
    b.estop.state.reset_pressed = false;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_FALSE(b.stage.on);
    b.enabling.hold(true);
    b.run(0.5);
    EXPECT_TRUE(b.stage.on);
  }
}

TEST(Servo, never_sends_anything_beyond_a_limit_whatever_the_devices_say) {
  // Everything fails at random, all the time; resets are pressed at random too.
  for (unsigned seed = 0; seed < 8; ++seed) {
    ServoConfig config = icsi();
    config.force_sensor = true;
    Bench b(config);
    std::mt19937_64 random(seed);
    const auto one_in = [&](int n) { return std::uniform_int_distribution<int>(1, n)(random) == 1; };
    const auto any = [&] { return static_cast<Status>(std::uniform_int_distribution<int>(0, 3)(random)); };
    Vec3 force = Vec3::Zero();
    std::size_t commanded = 0;
    std::uint64_t stops = 0, clears = 0;
    bool running = true;
    b.every_tick = [&] {
      b.hand.status = one_in(400) ? any() : Status::ok;
      b.hand.nan = one_in(900);
      b.hand.jump_m = one_in(900) ? 1e3 : 0;
      b.stage.status = one_in(900) ? any() : Status::ok;
      b.stage.nan = one_in(2000);
      b.estop.status = one_in(900) ? any() : Status::ok;
      if (one_in(800)) {
        b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = one_in(2);
      }
      if (one_in(100)) {
        b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
      }
      if (one_in(100)) {
        b.estop.state.reset_pressed = one_in(2);
      }
      if (one_in(50)) {
        b.hand.buttons = static_cast<std::uint32_t>(std::uniform_int_distribution<int>(0, 7)(random));
      }
      if (one_in(100)) {
        b.wanted_x = std::uniform_real_distribution<double>(-100e-6, 100e-6)(random);
      }
      if (one_in(500)) {
        b.seeing = one_in(2);
      }
      b.sensor.force = one_in(500) ? std::nan("") : (one_in(2000) ? 1.0 : 5e-6);
      b.missed = one_in(1000) ? 1000 : 0;
      for (; commanded < b.stage.commanded.size(); ++commanded) {
        const Vec3& p = b.stage.commanded[commanded];
        ASSERT_TRUE(p.allFinite());
        for (int i = 0; i < 3; ++i) {
          ASSERT_GE(p[i], config.mapping.workspace_min_m[i] - 1e-9);
          ASSERT_LE(p[i], config.mapping.workspace_max_m[i] + 1e-9);
        }
      }
      const bool now_running = b.servo->stop_stage() == StopStage::running;
      if (running && !now_running) {
        ++stops;
      }
      if (!running && now_running) {
        ++clears;
      }
      if (!now_running) {
        ASSERT_FALSE(b.injector.open);
        // No command reaches the stage, and the force only falls.
        ASSERT_LE(b.hand.force.norm(), force.norm() + 1e-12);
      }
      running = now_running;
      force = b.hand.force;
    };
    b.run(20);
    EXPECT_GT(stops, 3U);
    EXPECT_GT(clears, 3U);
  }
}

TEST(Servo, moves_nothing_when_the_position_scale_is_changed_and_moves_at_it_from_the_next_clutch_on) {
  ServoConfig config = icsi();
  config.mapping.position_scale_min = 250;
  config.mapping.position_scale_max = 1000;
  Bench b(config);
  b.run(1);
  b.move(40e-6, 20e-6);
  b.run(2);
  const auto rests = [&](double seconds) {
    const Vec3 before = b.stage.target;
    b.run(seconds);
    return (b.stage.target - before).norm() < 0.1e-6;
  };
  ASSERT_TRUE(rests(0.5));
  ASSERT_TRUE(b.station->console.queue.try_push({Command::position_scale, 250}));
  EXPECT_TRUE(rests(1));
  const double at_x = b.stage.target.x();
  b.move(35e-6, 20e-6);  // 2.5 mm at the hand, at the old scale still
  b.run(2);
  EXPECT_NEAR(b.stage.target.x() - at_x, -5e-6, 0.3e-6);
  b.hand.buttons = hal::kButtonClutch;
  EXPECT_TRUE(rests(0.5));
  b.hand.buttons = 0;
  EXPECT_TRUE(rests(1));
  const double now_x = b.stage.target.x();
  b.move(32.5e-6, 20e-6);  // 1.25 mm
  b.run(2);
  EXPECT_NEAR(b.stage.target.x() - now_x, -5e-6, 0.3e-6);
}

}  // namespace
}  // namespace punctum::rt
