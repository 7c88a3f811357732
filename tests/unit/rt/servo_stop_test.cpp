// Stops: the e-stop chain, faults of the devices, reset, what a stop does to needle and hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, stops_within_the_tick_that_sees_the_contact_open_and_fades_the_hand_in_20_ms) {
  for (const bool a : {true, false}) {
    Bench b(icsi());
    b.to_inside();
    b.hand.buttons = hal::kButtonInject;
    b.run(0.2);
    ASSERT_TRUE(b.injector.open);
    const double force = b.force();
    ASSERT_GE(force, 0);
    (a ? b.estop.state.contact_a_closed : b.estop.state.contact_b_closed) = false;
    b.tick();
    EXPECT_GE(b.stage.quick_stops, 1);
    EXPECT_FALSE(b.injector.open);
    EXPECT_EQ(b.servo->fault(), Fault::estop);
    double before = b.force();
    for (int k = 1; k < 20; ++k) {
      b.tick();
      EXPECT_LE(b.force(), before + 1e-12);
      EXPECT_LE(before - b.force(), 2 * force / 20 + 1e-12);
      before = b.force();
    }
    EXPECT_EQ(b.force(), 0);
    b.run(0.6);
    EXPECT_FALSE(b.stage.on);
    EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
    EXPECT_FALSE(b.servo->finished());
  }
}

TEST(Servo, sees_a_pulse_shorter_than_a_tick) {
  Bench b(icsi());
  b.run(0.5);
  b.estop.state.pulse_seen = true;
  b.tick();
  EXPECT_EQ(b.servo->fault(), Fault::estop);
}

TEST(Servo, resumes_only_after_release_and_reset_and_moves_nothing_by_itself) {
  Bench b(icsi());
  b.to_indentation();
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  b.run(1);
  // Meanwhile the hand goes somewhere else.
  b.wanted_x = -20e-6;
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
  b.run(1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  EXPECT_FALSE(b.stage.on);
  const Vec3 tip = b.stage.tip;
  b.estop.state.reset_pressed = true;
  double before = b.force();
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - before);
    before = b.force();
  };
  b.run(0.2);
  b.estop.state.reset_pressed = false;
  b.run(2);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_TRUE(b.stage.on);
  EXPECT_LT((b.stage.tip - tip).norm(), 1.5e-6);  // only what the returning force pushes the hand back
  EXPECT_LT(steepest, 0.02);                      // N per ms
  EXPECT_EQ(b.station->core.status.faults_latched.load(), 1U << static_cast<int>(Fault::estop));
  // And the hand drives it again.
  b.move(b.wanted_x + 20e-6, 20e-6);
  EXPECT_GT(b.stage.tip.x() - tip.x(), 15e-6);
}

TEST(Servo, refuses_a_reset_while_one_contact_is_welded) {
  Bench b(icsi());
  b.run(0.5);
  b.estop.state.contact_a_closed = false;  // b stays shut
  b.run(0.2);
  EXPECT_EQ(b.servo->fault(), Fault::estop);  // first cause kept
  EXPECT_NE(b.station->core.status.faults_latched.load() & (1U << static_cast<int>(Fault::estop_discrepancy)),
            0U);
  b.estop.state.contact_a_closed = true;
  b.run(1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  // Both open once: they are seen to work.
  b.estop.state = {false, false, false, false};
  b.run(0.1);
  b.estop.state = {true, true, false, false};
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::running);
}

TEST(Servo, latches_each_device_fault_under_its_own_name) {
  struct Case {
    Fault expected;
    double within_s;
    std::function<void(Bench&)> break_it;
  };
  const std::vector<Case> cases{
      {Fault::hand_lost, 0.001, [](Bench& b) { b.hand.status = Status::disconnected; }},
      {Fault::hand_lost, 0.022, [](Bench& b) { b.hand.status = Status::no_data; }},
      {Fault::hand_invalid, 0.003, [](Bench& b) { b.hand.nan = true; }},
      {Fault::hand_invalid, 0.003, [](Bench& b) { b.hand.jump_m = 0.03; }},
      {Fault::stage_lost, 0.001, [](Bench& b) { b.stage.status = Status::disconnected; }},
      {Fault::stage_lost, 0.022, [](Bench& b) { b.stage.status = Status::no_data; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.status = Status::fault; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.nan = true; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.off_at_once = true; }},
      {Fault::stage_following, 0.001, [](Bench& b) { b.stage.extra_error_m = 20e-6; }},
      {Fault::estop_lost, 0.001, [](Bench& b) { b.estop.status = Status::disconnected; }},
      {Fault::estop_lost, 0.022, [](Bench& b) { b.estop.status = Status::no_data; }},
      {Fault::vacuum_lost, 0.102, [](Bench& b) { b.vacuum.pressure = 100; }},
      {Fault::command_stop, 0.001,
       [](Bench& b) { ASSERT_TRUE(b.station->parent.queue.try_push({Command::stop, 0})); }},
      {Fault::command_stop, 0.001, [](Bench& b) { b.servo->request_stop(); }},
  };
  for (const Case& c : cases) {
    Bench b(icsi());
    b.to_indentation();
    ASSERT_EQ(b.servo->fault(), Fault::none);
    c.break_it(b);
    b.run(c.within_s);
    EXPECT_EQ(b.servo->fault(), c.expected) << name(c.expected);
    EXPECT_FALSE(b.injector.open);
    b.run(1);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
    EXPECT_EQ(b.servo->fault(), c.expected);
    EXPECT_EQ(b.servo->finished(), c.expected == Fault::command_stop);
    EXPECT_EQ(b.vacuum.pressure, c.expected == Fault::vacuum_lost ? 100 : 600);
  }
}

TEST(Servo, treats_overruns_as_a_fault_with_real_actuators_and_as_an_alarm_without) {
  for (const bool real : {false, true}) {
    ServoConfig config = icsi();
    config.real_actuators = real;
    Bench b(config);
    b.run(0.5);
    b.missed = 20;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    b.missed = 21;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), real ? Fault::overrun : Fault::none);
    EXPECT_EQ((b.sample().alarms & alarm_overrun) != 0, !real);
    // A loop that is not to be trusted lets the relay open once it has stopped.
    b.run(1);
    const int toggles = b.estop.toggles;
    b.run(0.1);
    EXPECT_EQ(b.estop.toggles - toggles, real ? 0 : 100);
  }
}

TEST(Servo, lets_the_relay_open_when_it_cannot_stop_the_drive) {
  struct Case {
    const char* name;
    Fault cause;
    bool not_stopping;
    std::function<void(Bench&)> break_it, mend;
  };
  const auto press = [](Bench& b) {
    b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  };
  const std::vector<Case> cases{
      {"disconnected", Fault::stage_lost, true, [](Bench& b) { b.stage.status = Status::disconnected; },
       [](Bench& b) { b.stage.status = Status::ok; }},
      {"silent", Fault::stage_lost, true, [](Bench& b) { b.stage.repeats = true; },
       [](Bench& b) { b.stage.repeats = false; }},
      {"faulty", Fault::stage_fault, true, [](Bench& b) { b.stage.status = Status::fault; },
       [](Bench& b) { b.stage.status = Status::ok; }},
      {"not following", Fault::stage_following, false, [](Bench& b) { b.stage.extra_error_m = 20e-6; },
       [](Bench& b) { b.stage.extra_error_m = 0; }},
      {"runs on", Fault::estop, true,
       [&](Bench& b) {
         press(b);
         b.stage.ignores_stop = true;
       },
       [](Bench& b) { b.stage.ignores_stop = false; }},
      {"runs on and says that it stands", Fault::estop, true,
       [&](Bench& b) {
         press(b);
         b.stage.ignores_stop = b.stage.hides_motion = true;
       },
       [](Bench& b) { b.stage.ignores_stop = false; }},
      {"keeps its power", Fault::estop, true,
       [&](Bench& b) {
         press(b);
         b.stage.ignores_power = true;
       },
       [](Bench& b) { b.stage.ignores_power = b.stage.on = false; }},
      {"lost while stopped", Fault::estop, true,
       [&](Bench& b) {
         press(b);
         b.run(0.6);
         b.stage.status = Status::disconnected;
       },
       [](Bench& b) { b.stage.status = Status::ok; }},
      {"begins to move while stopped", Fault::estop, true,
       [&](Bench& b) {
         press(b);
         b.run(1);
         b.stage.ignores_stop = true;
       },
       [](Bench& b) { b.stage.ignores_stop = false; }},
  };
  for (const double rate_Hz : {1000.0, 8000.0}) {
    for (const Case& c : cases) {
      ServoConfig config = icsi();
      config.rate_Hz = rate_Hz;
      Bench b(config);
      b.run(0.5);
      c.break_it(b);
      b.run(0.8);
      EXPECT_GT(b.estop.toggles, 0.515 * rate_Hz) << c.name;  // the quick stop gets its chance
      const auto heartbeats = [&](double seconds) {
        const int before = b.estop.toggles;
        b.run(seconds);
        return b.estop.toggles - before;
      };
      EXPECT_EQ(heartbeats(0.2), 0) << c.name;
      EXPECT_EQ(b.servo->fault(), c.cause) << c.name;
      const std::uint64_t latched = b.station->core.status.faults_latched.load();
      EXPECT_EQ((latched >> static_cast<int>(Fault::stage_not_stopping) & 1) != 0, c.not_stopping) << c.name;
      // No reset as long as it lasts; and no heartbeat by itself when it is over.
      b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
      b.estop.state.reset_pressed = c.not_stopping;
      EXPECT_EQ(heartbeats(0.2), 0) << c.name;
      b.estop.state.reset_pressed = false;
      c.mend(b);
      EXPECT_EQ(heartbeats(1), 0) << c.name;
      b.estop.state.reset_pressed = true;
      EXPECT_GT(heartbeats(0.2), 0.7 * 0.2 * rate_Hz) << c.name;
      EXPECT_EQ(b.servo->fault(), Fault::none) << c.name;
    }
  }
}

TEST(Servo, lets_the_relay_open_when_a_drive_that_nobody_has_enabled_keeps_its_power_or_moves) {
  struct Case {
    const char* name;
    bool obeys;
    std::function<void(Bench&)> break_it;
  };
  const std::vector<Case> cases{
      {"came with power and gives it up", true, [](Bench& b) { b.stage.on = true; }},
      {"settles slowly without power", true,
       [](Bench& b) { b.every_tick = [&b] { b.stage.tip.y() += 2e-9; }; }},
      {"keeps its power", false, [](Bench& b) { b.stage.on = b.stage.ignores_power = true; }},
      {"keeps its power and moves", false,
       [](Bench& b) { b.stage.on = b.stage.ignores_power = b.stage.ignores_stop = true; }},
      {"moves and says that it has no power", false, [](Bench& b) { b.stage.ignores_stop = true; }},
      {"moves and says that it stands", false,
       [](Bench& b) { b.stage.ignores_stop = b.stage.hides_motion = true; }},
  };
  for (const bool after_a_reset : {false, true}) {
    for (const Case& c : cases) {
      ServoConfig config = icsi();
      config.enabling.emplace();
      Bench b(config);
      if (after_a_reset) {
        b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
        b.run(1);
        b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
        b.estop.state.reset_pressed = true;
        b.run(0.5);
        b.estop.state.reset_pressed = false;
        ASSERT_EQ(b.servo->fault(), Fault::none);
      }
      c.break_it(b);
      b.run(1.5);
      EXPECT_EQ(b.servo->fault(), c.obeys ? Fault::none : Fault::stage_not_stopping) << c.name;
      const int before = b.estop.toggles;
      b.run(5);
      EXPECT_EQ(b.estop.toggles - before, c.obeys ? 5000 : 0) << c.name;
      EXPECT_EQ(b.servo->fault(), c.obeys ? Fault::none : Fault::stage_not_stopping) << c.name;
    }
  }
}

TEST(Servo, keeps_the_relay_closed_in_a_stop_that_the_drive_obeys) {
  Bench b(icsi());
  b.to_indentation();
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  const int before = b.estop.toggles;
  b.run(5);
  EXPECT_EQ(b.estop.toggles - before, 5000);
  EXPECT_EQ(b.station->core.status.faults_latched.load(), 1U << static_cast<int>(Fault::estop));
}

TEST(Servo, stops_when_the_drive_is_never_enabled) {
  Bench b(icsi());
  b.stage.never_enables = true;
  b.run(2);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  b.run(3);
  EXPECT_EQ(b.servo->fault(), Fault::stage_not_enabled);
  b.stage.never_enables = false;
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  b.run(1);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_TRUE(b.stage.on);
  b.run(5);
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

// The way back is free, the way on is not.
TEST(Servo, pierces_no_cell_that_it_cannot_inject) {
  Bench b(icsi());
  b.to_indentation();
  b.injector.status = hal::Status::disconnected;
  b.run(0.2);
  const double at_m = b.stage.tip.x();
  b.move(-10e-6, 15e-6);
  b.run(0.5);
  EXPECT_FALSE(b.punctured);
  EXPECT_NEAR(b.stage.tip.x(), at_m, 1e-6);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_NE(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_EQ(b.sample().unusable, device_injector);
  b.move(30e-6, 15e-6);
  b.run(0.5);
  EXPECT_GT(b.stage.tip.x(), at_m + 5e-6);
}

TEST(Servo, stops_when_the_injector_stays_open_although_its_gate_is_shut) {
  Bench b(icsi());
  b.to_inside();
  b.hand.buttons = hal::kButtonInject;
  b.run(0.2);
  ASSERT_TRUE(b.injector.open);
  b.injector.jammed = true;
  b.run(0.2);
  b.hand.buttons = 0;
  b.run(0.2);
  EXPECT_EQ(b.servo->fault(), Fault::none);  // a valve takes its time
  b.run(0.1);
  EXPECT_EQ(b.servo->fault(), Fault::injector_open);
  // The relay takes the power that keeps it open.
  b.run(0.6);
  const int toggles = b.estop.toggles;
  b.run(0.1);
  EXPECT_EQ(b.estop.toggles, toggles);
  // No reset while it is open.
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  b.injector.jammed = false;
  b.estop.state.reset_pressed = false;
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::running);
}

TEST(Servo, a_commanded_stop_ends_a_run_that_has_stopped_already) {
  Bench b(icsi());
  b.run(0.5);
  b.hand.status = Status::disconnected;
  b.run(1);
  ASSERT_EQ(b.servo->stop_stage(), StopStage::stopped);
  EXPECT_FALSE(b.servo->finished());  // a reset could still clear it
  b.servo->request_stop();
  b.tick();
  EXPECT_EQ(b.servo->outcome(), RunEnd::fault);
  EXPECT_EQ(b.servo->fault(), Fault::hand_lost);  // the first cause
}

// The stop begins with what a new press would clear; the handle that falls silent in it asks for a reset.
TEST(Servo, a_run_without_a_reset_button_ends_where_only_that_would_clear_the_stop) {
  ServoConfig config = icsi();
  config.enabling.emplace();
  Bench b(config, false);
  b.run(0.2);
  b.hold(hal::kButtonEnable, 0.5);
  ASSERT_TRUE(b.stage.on);
  b.hold(0, 0.8);
  ASSERT_EQ(b.servo->fault(), Fault::enabling_released);
  EXPECT_EQ(b.servo->outcome(), RunEnd::running);
  b.hand.status = Status::no_data;
  b.run(0.05);
  b.hand.status = Status::ok;
  b.run(0.2);
  EXPECT_EQ(b.servo->outcome(), RunEnd::fault);
}

TEST(Servo, is_finished_only_where_no_force_acts) {
  ServoConfig config = icsi();
  config.guard.emplace();
  double most_N = -1;
  for (int start = 0; start < 40; ++start) {
    Bench b(config);
    b.to_indentation();
    b.servo->request_end_here();
    int k = start;
    b.every_tick = [&] {
      b.hand.intention.y() = 3e-3 * std::sin(0.06 * ++k);
      if (b.servo->finished()) {
        most_N = std::max(most_N, b.force());
      }
    };
    b.run(1);
  }
  EXPECT_EQ(most_N, 0);
}

TEST(Servo, takes_the_drive_power_away_in_time_however_late_its_ticks_are) {
  Bench b(icsi());
  b.run(0.5);
  b.stage.speed = Vec3(1, 0, 0);
  b.estop.state.contact_a_closed = false;
  b.tick();
  ASSERT_TRUE(b.stage.on);
  b.stage.speed = Vec3(1, 0, 0);  // it does not come to rest
  b.now += 600'000'000;
  b.tell_time();
  b.servo->tick({b.ticks++, b.now, b.now, 0.6, 0});
  EXPECT_FALSE(b.stage.on);
}

}  // namespace
}  // namespace punctum::rt
