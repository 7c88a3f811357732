// What the devices say, and how it is judged.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <utility>

#include "rt/control/device_inputs.hpp"
#include "rt/station/alarm.hpp"
#include "tests/support/fake_devices.hpp"

namespace punctum::rt {
namespace {

using namespace test;

struct Inputs {
  explicit Inputs(const ServoConfig& with = all_devices(), bool with_switch = false)
      : config(with),
        inputs(config,
               {hand, &stage, &estop, &injector, &vacuum, &sensor, with_switch ? &enabling : nullptr}) {
    stage.on = true;
  }
  static ServoConfig all_devices() {
    ServoConfig config;
    config.injector.emplace();
    config.vacuum.emplace();
    config.force_sensor = true;
    return config;
  }
  const Readings& read(double elapsed_s = 1e-3) {
    now_ns += std::llround(1e9 * elapsed_s);
    hand.now_ns = stage.now_ns = estop.now_ns = injector.now_ns = vacuum.now_ns = sensor.now_ns = now_ns;
    enabling.now_ns = now_ns - enabling_late_ns;
    return inputs.read({.now_ns = now_ns, .elapsed_s = elapsed_s, .dt_s = elapsed_s}, last);
  }
  void settle() {
    for (int k = 0; k < 100; ++k) {
      (void)read();
    }
  }

  ServoConfig config;
  FakeHand hand;
  FakeStage stage{Vec3(60e-6, 2e-6, 0)};
  FakeEstop estop;
  FakeEnabling enabling;
  FakeInjector injector;
  FakeVacuum vacuum;
  FakeSensor sensor;
  LastOutput last;
  std::int64_t now_ns = 5'000'000'000;
  std::int64_t enabling_late_ns = 0;
  DeviceInputs inputs;
};

TEST(DeviceInputs, passes_good_values_on_without_fault_or_alarm) {
  Inputs in;
  in.sensor.force = 3e-6;
  in.settle();
  in.hand.buttons = hal::kButtonInject;
  in.settle();
  const Readings& r = in.inputs.readings();
  EXPECT_EQ(r.estop_fault, Fault::none);
  EXPECT_EQ(r.device_faults.first, Fault::none);
  EXPECT_EQ(r.alarms, 0U);
  EXPECT_TRUE(r.hand_fresh && r.stage_fresh && r.estop_readable && r.sensor_fresh);
  EXPECT_TRUE(r.button(hal::kButtonInject));
  EXPECT_EQ(r.stage.tip_m, in.stage.tip + in.stage.registration);
  EXPECT_EQ(r.sensor_filtered_N, 3e-6);
  EXPECT_NEAR(r.vacuum_Pa, 600, 0.1 + 1e-9);
}

TEST(DeviceInputs, a_hand_that_rests_under_a_changing_force_hangs_unless_it_feels_none) {
  for (const double force_max_N : {8.5, 0.0}) {
    ServoConfig config = Inputs::all_devices();
    config.device.force_max_N = force_max_N;
    Inputs in(config);
    in.settle();
    for (int k = 0; k < 300; ++k) {
      in.last.hand_force_N = Vec3(0.01 * k, 0, 0);
      (void)in.read();
    }
    EXPECT_EQ(in.inputs.readings().hand_stuck, force_max_N > 0);
  }
}

TEST(DeviceInputs, keeps_the_last_good_value_of_a_silent_device_until_its_time_is_over) {
  Inputs in;
  in.hand.x = Vec3(0.03, 0, 0);
  in.settle();
  in.hand.status = in.stage.status = Status::no_data;
  for (int k = 0; k < 19; ++k) {
    const Readings& r = in.read();
    EXPECT_EQ(r.device_faults.first, Fault::none) << k;
    EXPECT_FALSE(r.hand_fresh || r.stage_fresh);
    EXPECT_NEAR(r.hand.position_m.x(), 0.03, 1e-15);
    EXPECT_EQ(r.alarms, alarm_sensor);
  }
  (void)in.read();
  EXPECT_EQ(in.read().device_faults.first, Fault::hand_lost);  // the limit of both is 20 ms
  in.hand.status = Status::ok;
  EXPECT_EQ(in.read().device_faults.first, Fault::stage_lost);
  EXPECT_NEAR(in.read().between_hand_s, 1e-3, 1e-12);
}

TEST(DeviceInputs, tells_which_of_the_devices_gives_nothing) {
  Inputs in;
  in.settle();
  const auto told = [&in](auto& value, auto silent, unsigned device) {
    const auto before = std::exchange(value, silent);
    EXPECT_EQ(in.read().unusable, device);
    EXPECT_NE(in.inputs.readings().alarms & alarm_sensor, 0U) << device;
    value = before;
    in.settle();
    EXPECT_EQ(in.inputs.readings().unusable, 0U) << device;
  };
  told(in.hand.status, Status::no_data, device_haptic);
  told(in.stage.status, Status::no_data, device_stage);
  told(in.estop.status, Status::no_data, device_estop);
  told(in.vacuum.pressure, 1e6, device_vacuum);
  told(in.injector.status, Status::no_data, device_injector);
  told(in.sensor.force, 1e6, device_force_sensor);
  in.hand.status = in.stage.status = Status::no_data;
  EXPECT_EQ(in.read().unusable, device_haptic | device_stage);
}

TEST(DeviceInputs, takes_each_sample_of_a_slow_hand_once_and_measures_time_by_the_samples) {
  Inputs in;
  in.settle();
  in.hand.sample_every_ns = 4'000'000;
  int fresh = 0;
  for (int k = 1; k <= 400; ++k) {
    in.hand.x.x() = 1e-5 * k;
    const Readings& r = in.read();
    EXPECT_EQ(r.alarms, 0U);
    EXPECT_EQ(r.device_faults.first, Fault::none);
    EXPECT_EQ(r.hand_fresh, k % 4 == 0) << k;
    EXPECT_NEAR(r.hand_age_s, 1e-3 * (k % 4), 1e-12);
    if (r.hand_fresh) {
      ++fresh;
      EXPECT_NEAR(r.between_hand_s, 4e-3, 1e-12);
    }
  }
  EXPECT_EQ(fresh, 100);
}

TEST(DeviceInputs, calls_devices_lost_that_repeat_their_newest_sample_for_longer_than_their_limit) {
  for (const bool hand : {true, false}) {
    Inputs in;
    in.settle();
    (hand ? in.hand.sample_every_ns = 1'000'000'000 : in.stage.repeats = true);
    for (int k = 0; k < 20; ++k) {
      EXPECT_EQ(in.read().device_faults.first, Fault::none) << k;
      EXPECT_EQ(in.inputs.readings().alarms, 0U);
      EXPECT_NE(hand ? in.inputs.readings().hand_fresh : in.inputs.readings().stage_fresh, true);
    }
    EXPECT_EQ(in.read().device_faults.first, hand ? Fault::hand_lost : Fault::stage_lost);
    EXPECT_EQ(in.inputs.readings().alarms, alarm_sensor);
    // With the next sample all is well.
    in.hand.sample_every_ns = 0;
    in.stage.repeats = false;
    EXPECT_EQ(in.read().device_faults.first, Fault::none);
  }
}

TEST(DeviceInputs, does_not_believe_sample_times_ahead_of_the_clock_going_back_or_standing_still) {
  struct Case {
    std::int64_t first_ahead_ns, then_ahead_ns, step_ns;
    bool trusted;
  };
  for (const Case& c :
       {Case{0, 500'000, 0, true}, Case{0, 2'000'000, 0, false}, Case{0, std::int64_t{1} << 60, 0, false},
        Case{0, -2'000'000, 0, false}, Case{0, -std::int64_t{1} << 60, 0, false},
        Case{0, 0, -1'000'000, false}, Case{0, 0, -900'000, true}}) {
    Inputs in;
    in.hand.ahead_ns = c.first_ahead_ns;
    in.settle();
    in.hand.ahead_ns = c.then_ahead_ns;
    in.hand.x.x() = 0.1e-3;
    in.hand.ahead_ns += c.step_ns;
    const Readings& r = in.read();
    EXPECT_EQ(r.hand_fresh, c.trusted);
    EXPECT_EQ(r.alarms, c.trusted ? 0U : alarm_sensor);
    EXPECT_EQ(r.hand.position_m.x() > 0, c.trusted);
    EXPECT_EQ(r.device_faults.first, Fault::none);
  }
}

TEST(DeviceInputs, finds_a_device_whose_sample_times_never_move_and_takes_it_back_when_they_do) {
  Inputs in;
  for (int k = 0; k < 100; ++k) {
    in.hand.ahead_ns = -1'000'000 * k;  // always the same time
    in.hand.x.x() = 1e-5 * k;
    const Readings& r = in.read();
    EXPECT_EQ(r.device_faults.first, k <= 20 ? Fault::none : Fault::hand_lost) << k;
  }
  in.hand.ahead_ns = 0;
  for (int k = 0; k < 30; ++k) {
    (void)in.read();
  }
  EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::none);
  EXPECT_TRUE(in.inputs.readings().hand_fresh);
}

TEST(DeviceInputs, ignores_one_sample_of_the_hand_that_cannot_be_true_and_refuses_several) {
  for (const double jump_m : {5e-3, -19e-3, 0.3, 1e9, 1.7e308, std::nan("")}) {
    Inputs in;
    in.settle();
    in.hand.jump_m = jump_m;
    const Readings& r = in.read();
    EXPECT_EQ(r.device_faults.first, Fault::none) << jump_m;
    EXPECT_EQ(r.alarms, alarm_sensor);
    EXPECT_EQ(r.hand.position_m.x(), 0);
    EXPECT_FALSE(r.hand_fresh);
    EXPECT_GT(r.hand_age_s, 0);
    in.hand.jump_m = 0;
    (void)in.read();
    EXPECT_EQ(r.device_faults.first, Fault::none) << jump_m;
    EXPECT_EQ(r.alarms, 0U);
    EXPECT_TRUE(r.hand_fresh);
    EXPECT_NEAR(r.between_hand_s, 2e-3, 1e-12);
    // Every second sample is too many.
    Fault fault = Fault::none;
    for (int k = 0; k < 20 && fault == Fault::none; ++k) {
      in.hand.jump_m = k % 2 == 0 ? jump_m : 0;
      fault = in.read().device_faults.first;
      EXPECT_EQ(r.hand.position_m.x(), 0);
    }
    EXPECT_EQ(fault, Fault::hand_invalid) << jump_m;
  }
}

TEST(DeviceInputs, bears_bad_samples_of_a_slow_hand_no_longer_than_its_time) {
  Inputs in;
  in.hand.sample_every_ns = 10'000'000;
  in.settle();
  in.hand.nan = true;
  for (int k = 0; k < 40; ++k) {
    const Readings& r = in.read();
    const bool old = r.hand_age_s > in.config.hand_timeout_s + 1e-9;
    EXPECT_EQ(r.device_faults.first, old ? Fault::hand_invalid : Fault::none) << k;
  }
}

TEST(DeviceInputs, takes_no_button_of_a_sample_that_cannot_be_true) {
  for (const bool pressed : {false, true}) {
    Inputs in;
    in.settle();
    in.hand.buttons = pressed ? hal::kButtonInject : 0;
    in.settle();
    EXPECT_EQ(in.inputs.readings().button(hal::kButtonInject), pressed);
    in.hand.jump_m = 0.03;
    in.hand.buttons = pressed ? 0 : hal::kButtonInject;
    EXPECT_EQ(in.read().button(hal::kButtonInject), pressed);
    EXPECT_EQ(in.inputs.readings().inject_down, pressed);
    in.hand.jump_m = 0;
    (void)in.read();
    EXPECT_EQ(in.inputs.readings().inject_down, !pressed);
    in.settle();
    EXPECT_EQ(in.inputs.readings().button(hal::kButtonInject), !pressed);
  }
}

TEST(DeviceInputs, releases_the_buttons_of_an_invalid_hand_until_they_are_pressed_anew) {
  Inputs in;
  in.settle();
  in.hand.buttons = hal::kButtonInject | hal::kButtonNextCell | hal::kButtonClutch;
  in.settle();
  EXPECT_TRUE(in.inputs.readings().button(hal::kButtonInject));
  in.hand.jump_m = std::nan("");
  for (int k = 0; k < 5; ++k) {
    (void)in.read();
  }
  EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::hand_invalid);
  EXPECT_EQ(in.inputs.readings().hand.buttons, 0U);
  in.hand.jump_m = 0;
  in.settle();
  EXPECT_EQ(in.inputs.readings().hand.buttons, hal::kButtonClutch);  // the clutch only holds the needle
  in.hand.buttons = 0;
  in.settle();
  in.hand.buttons = hal::kButtonInject;
  in.settle();
  EXPECT_TRUE(in.inputs.readings().button(hal::kButtonInject));
}

TEST(DeviceInputs, takes_a_button_that_begins_something_once_it_has_lasted) {
  for (const std::uint32_t button : {hal::kButtonInject, hal::kButtonNextCell}) {
    Inputs in;
    const auto pressed_after_ms = [&](std::uint32_t buttons, bool pressed) {
      in.hand.buttons = buttons;
      for (int ms = 0; ms < 100; ++ms) {
        if (in.read().button(button) == pressed) {
          return ms;
        }
      }
      return -1;
    };
    in.settle();
    for (int k = 0; k < 50; ++k) {  // a line that is disturbed
      in.hand.buttons = k % 20 == 0 ? 0 : button;
      EXPECT_FALSE(in.read().button(button)) << k;
    }
    EXPECT_EQ(pressed_after_ms(0, false), 0);
    in.settle();
    EXPECT_NEAR(pressed_after_ms(button, true), 21, 1);
    EXPECT_NEAR(pressed_after_ms(0, false), 21, 1);
  }
}

TEST(DeviceInputs, refuses_an_orientation_that_is_none_or_turns_faster_than_a_hand) {
  Inputs in;
  in.settle();
  in.hand.turn_rad = 1;
  EXPECT_EQ(in.read().alarms, alarm_sensor);
  EXPECT_EQ(in.inputs.readings().hand.orientation.w(), 1);
  in.hand.turn_rad = 0.02;
  EXPECT_EQ(in.read().alarms, 0U);
  EXPECT_NEAR(in.inputs.readings().hand.orientation.norm(), 1, 1e-15);
  for (const double length : {0.0, 1e-300, 0.9, 1.1, 1e160, 1e308}) {
    Inputs other;
    other.settle();
    other.hand.length = length;
    EXPECT_EQ(other.read().alarms, alarm_sensor) << length;
  }
  in.hand.length = 1 + 1e-4;
  EXPECT_EQ(in.read().alarms, 0U);
  EXPECT_NEAR(in.inputs.readings().hand.orientation.norm(), 1, 1e-15);
}

TEST(DeviceInputs, follows_the_fastest_hand_at_every_rate_of_samples) {
  for (const double rate_Hz : {1000.0, 8000.0}) {
    for (const std::int64_t every_ns : {0, 1'000'000, 5'000'000}) {
      Inputs in;
      in.settle();
      // 5 m/s over 0.4 m and back, sped up and braked at 250 m/s^2.
      const double T = 0.4 / 5 + 5.0 / 250;
      for (double t = 0; t < 2 * T; t += 1 / rate_Hz) {
        const double u = t < T ? t : 2 * T - t;
        const double x = u < 0.02       ? 125 * u * u
                         : u > T - 0.02 ? 0.4 - 125 * (T - u) * (T - u)
                                        : 0.05 + 5 * (u - 0.02);
        in.hand.x.x() = x;
        in.hand.sample_every_ns = every_ns;
        EXPECT_EQ(in.read(1 / rate_Hz).alarms, 0U) << rate_Hz << ' ' << every_ns << ' ' << t;
      }
    }
  }
}

TEST(DeviceInputs, tells_a_leap_between_two_samples_of_a_slow_hand_from_a_fast_motion) {
  Inputs in;
  in.settle();
  in.hand.sample_every_ns = 4'000'000;
  // 40 m/s^2, as a hand starts back, to 2 m/s, and as quickly to rest.
  int fresh = 0;
  for (int k = 0; k < 200; ++k) {
    const double t = std::min(1e-3 * k, 0.1);
    in.hand.x.x() = t < 0.05 ? 20 * t * t : 0.1 - 20 * (0.1 - t) * (0.1 - t);
    const Readings& r = in.read();
    fresh += r.hand_fresh ? 1 : 0;
    EXPECT_FALSE(r.hand_leaps) << k;
  }
  EXPECT_EQ(fresh, 50);
  // A false sample that a thrown handle could have given, the true one after it, one that does not go on as
  // those two, and four more within 20 ms.
  int leaps = 0;
  for (int k = 0; k < 40; ++k) {
    in.hand.jump_m = k >= 12 && k < 16 ? 4e-3 : 0;
    const Readings& r = in.read();
    EXPECT_EQ(r.device_faults.first, Fault::none) << k;
    EXPECT_TRUE(!r.hand_leaps || r.hand_fresh) << k;
    EXPECT_FALSE(r.hand_begins);
    leaps += r.hand_leaps ? 1 : 0;
  }
  EXPECT_EQ(leaps, 7);
}

TEST(DeviceInputs, sees_no_leap_in_what_a_hand_of_1_kHz_does) {
  Inputs in;
  in.settle();
  // Thrown at 250 m/s^2 to 5 m/s, and into a stop.
  for (int k = 0; k < 60; ++k) {
    const double t = std::min(1e-3 * k, 0.04);
    in.hand.x.x() = t < 0.02 ? 125 * t * t : 0.05 + 5 * (t - 0.02);
    EXPECT_FALSE(in.read().hand_leaps) << k;
  }
}

TEST(DeviceInputs, refuses_readings_of_the_stage_that_no_stage_gives) {
  const double nan = std::nan("");
  for (const double absurd : {1e308, 1e160, -1e200, 2.0, nan}) {
    Inputs in;
    in.settle();
    const Vec3 tip = in.inputs.readings().stage.tip_m;
    in.stage.tip.y() = absurd;
    EXPECT_EQ(in.read().device_faults.first, Fault::stage_fault) << absurd;
    EXPECT_EQ(in.inputs.readings().stage.tip_m, tip);
    in.stage.tip.y() = 2e-6;
    in.stage.extra_error_m = absurd;
    const Fault fault = in.read().device_faults.first;
    EXPECT_TRUE(fault == Fault::stage_fault || fault == Fault::stage_following) << absurd;
    in.stage.extra_error_m = 0;
    in.stage.axis = Vec3(absurd, 0, 0);
    EXPECT_EQ(in.read().device_faults.first, Fault::stage_fault) << absurd;
  }
  for (const double length : {0.0, 0.5, 0.998}) {
    Inputs in;
    in.settle();
    in.stage.axis = Vec3(-length, 0, 0);
    EXPECT_EQ(in.read().device_faults.first, Fault::stage_fault) << length;
  }
  Inputs in;
  in.settle();
  in.stage.axis = Vec3(-1.0004, 0, 0);
  EXPECT_EQ(in.read().device_faults.first, Fault::none);
  EXPECT_NEAR(in.inputs.readings().stage.axis.norm(), 1, 1e-15);
}

TEST(DeviceInputs, keeps_watching_the_tip_force_after_one_absurd_sample) {
  for (const double absurd : {1.7e308, -1.7e308, 1e-310, 1e200, -0.5, 0.5}) {
    Inputs in;
    in.sensor.force = 10e-6;
    in.settle();
    in.sensor.force = absurd;
    const Readings& r = in.read();
    EXPECT_LT(r.sensor_filtered_N, in.config.limits.tip_force_hard_N) << absurd;  // one sample stops nothing
    in.sensor.force = 500e-6;
    for (int k = 0; k < 20; ++k) {
      (void)in.read();
    }
    EXPECT_GT(r.sensor_filtered_N, in.config.limits.tip_force_hard_N) << absurd;
    EXPECT_TRUE(r.sensor_fresh);
    EXPECT_TRUE(std::isfinite(r.sensor_N));
  }
}

TEST(DeviceInputs, takes_no_pressure_that_no_pump_makes_for_a_vacuum) {
  for (const double absurd : {1e6, 1e308, -1e308}) {
    Inputs in;
    in.settle();
    in.vacuum.pressure = absurd;
    Fault fault = Fault::none;
    for (int k = 0; k < 110; ++k) {
      fault = in.read().device_faults.first;
      EXPECT_EQ(in.inputs.readings().alarms, alarm_sensor);
    }
    EXPECT_EQ(fault, Fault::vacuum_lost) << absurd;
    EXPECT_NEAR(in.inputs.readings().vacuum_Pa, 600, 1);
  }
}

TEST(DeviceInputs, is_not_deceived_about_a_lost_vacuum_by_single_good_samples) {
  Inputs in;
  in.settle();
  Fault fault = Fault::none;
  for (int k = 0; k < 400 && fault == Fault::none; ++k) {
    in.vacuum.pressure = k % 20 == 0 ? 600 : 100;
    fault = in.read().device_faults.first;
  }
  EXPECT_EQ(fault, Fault::vacuum_lost);
  // And it comes back within the window.
  in.vacuum.pressure = 600;
  for (int k = 0; k < 110; ++k) {
    fault = in.read().device_faults.first;
  }
  EXPECT_EQ(fault, Fault::none);
}

TEST(DeviceInputs, takes_a_reset_only_from_a_button_that_is_held_for_as_long_as_a_finger_does) {
  Inputs in;
  in.settle();
  for (int k = 0; k < 100; ++k) {  // a line that picks up interference
    in.estop.state.reset_pressed = k % 3 != 0;
    EXPECT_FALSE(in.read().estop.reset_pressed);
  }
  in.estop.state.reset_pressed = true;
  for (int k = 0; k < 25; ++k) {
    (void)in.read();
  }
  EXPECT_TRUE(in.inputs.readings().estop.reset_pressed);
}

TEST(DeviceInputs, takes_no_reset_from_one_sample_after_a_late_tick) {
  Inputs in;
  in.settle();
  in.estop.state.reset_pressed = true;
  EXPECT_FALSE(in.read(0.025).estop.reset_pressed);
  in.estop.state.reset_pressed = false;
  EXPECT_FALSE(in.read().estop.reset_pressed);
}

TEST(DeviceInputs, finds_a_contact_that_chatters_while_the_other_never_opens) {
  Inputs in;
  in.settle();
  for (int k = 0; k < 200; ++k) {
    in.estop.state.contact_a_closed = k % 3 != 0;
    const Fault fault = in.read().estop_fault;
    if (!in.estop.state.contact_a_closed) {
      EXPECT_EQ(fault, Fault::estop);
    }
  }
  in.estop.state.contact_a_closed = true;
  EXPECT_EQ(in.read().estop_fault, Fault::estop_discrepancy);
}

TEST(DeviceInputs, tells_an_open_contact_and_whether_the_two_had_disagreed_before) {
  Inputs in;
  in.estop.state.contact_a_closed = false;
  for (int k = 0; k < 49; ++k) {
    EXPECT_EQ(in.read().estop_fault, Fault::estop);
    EXPECT_FALSE(in.inputs.readings().estop_discrepancy);
  }
  for (int k = 0; k < 3; ++k) {
    (void)in.read();
  }
  EXPECT_TRUE(in.inputs.readings().estop_discrepancy);
  in.estop.state.contact_a_closed = true;
  EXPECT_EQ(in.read().estop_fault, Fault::estop_discrepancy);  // the other one never opened
  in.estop.state.contact_a_closed = in.estop.state.contact_b_closed = false;
  EXPECT_EQ(in.read().estop_fault, Fault::estop);
  in.estop.state.contact_a_closed = in.estop.state.contact_b_closed = true;
  EXPECT_EQ(in.read().estop_fault, Fault::none);
}

TEST(DeviceInputs, stops_for_a_contact_that_opened_between_two_readings) {
  Inputs in;
  in.settle();
  in.estop.state.pulse_seen = true;
  EXPECT_EQ(in.read().estop_fault, Fault::estop);
  in.estop.state.pulse_seen = false;
  EXPECT_EQ(in.read().estop_fault, Fault::none);
}

TEST(DeviceInputs, stops_for_an_open_contact_whatever_the_time_of_its_sample) {
  for (const bool a : {true, false}) {
    for (const std::int64_t wrong_by_ns : {-1'000'000'000, 1'000'000'000}) {
      Inputs in;
      in.settle();
      (a ? in.estop.state.contact_a_closed : in.estop.state.contact_b_closed) = false;
      in.estop.now_ns = in.now_ns + wrong_by_ns;
      const TickTime tick{.now_ns = in.now_ns + 1'000'000, .elapsed_s = 1e-3, .dt_s = 1e-3};
      EXPECT_EQ(in.inputs.read(tick, in.last).estop_fault, Fault::estop);
      EXPECT_FALSE(in.inputs.readings().estop_readable);
    }
  }
}

TEST(DeviceInputs, without_an_estop_chain_there_is_nothing_readable_and_nothing_wrong) {
  FakeHand hand;
  DeviceInputs inputs(ServoConfig{}, {hand});
  const Readings& r = inputs.read({.elapsed_s = 1e-3, .dt_s = 1e-3}, LastOutput{});
  EXPECT_FALSE(r.has_estop || r.estop_readable || r.has_stage);
  EXPECT_TRUE(r.needle_known() && r.stage_ready() && r.at_standstill());
  EXPECT_EQ(r.estop_fault, Fault::none);
}

TEST(DeviceInputs, compares_the_stage_with_the_set_points_that_were_sent) {
  for (const bool same_place : {true, false}) {
    Inputs in;
    (void)in.read();
    in.last.stage_commanded = true;
    in.last.set_point_m = in.stage.tip + in.stage.registration;
    if (!same_place) {
      in.last.set_point_m.x() += 11e-6;
    }
    EXPECT_EQ(in.read().device_faults.first, same_place ? Fault::none : Fault::stage_following);
    // From where the path begins anew nothing was sent yet.
    in.last.stage_commanded = false;
    in.last.uncoupled = true;
    EXPECT_EQ(in.read().device_faults.first, Fault::none);
  }
}

TEST(DeviceInputs, calls_power_that_went_away_unasked_a_fault_unless_a_stop_took_it) {
  for (const bool running : {true, false}) {
    Inputs in;
    (void)in.read();
    in.stage.on = false;
    in.last.running = running;
    EXPECT_EQ(in.read().device_faults.first, running ? Fault::stage_fault : Fault::none);
  }
}

TEST(DeviceInputs, believes_a_drive_without_power_whose_clock_is_ahead_and_none_that_tells_of_before) {
  for (const bool ahead : {true, false}) {
    Inputs in;
    in.settle();
    in.stage.on = false;
    in.now_ns += 1'000'000;
    in.hand.now_ns = in.estop.now_ns = in.now_ns;
    in.stage.now_ns = in.now_ns + (ahead ? 400'000'000 : -15'000'000);
    const TickTime time{.now_ns = in.now_ns, .elapsed_s = 1e-3, .dt_s = 1e-3};
    EXPECT_EQ(in.inputs.read(time, in.last).device_faults.first, ahead ? Fault::stage_fault : Fault::none);
  }
}

TEST(DeviceInputs, turns_the_needles_axis_no_faster_than_drives_do) {
  Inputs in;
  in.settle();
  const Vec3 before = in.inputs.readings().stage.axis;
  const auto turned_rad = [&] { return (in.inputs.readings().stage.axis - before).norm(); };
  in.stage.axis = Vec3(-1, 0.06, 0).normalized();
  EXPECT_EQ(in.read().device_faults.first, Fault::none);
  EXPECT_LE(turned_rad(), 1.001e-3) << "by one false sample";
  EXPECT_GT(turned_rad(), 0.9e-3);
  in.stage.axis = before;
  (void)in.read();
  EXPECT_EQ(turned_rad(), 0);
  // 0.5 rad/s is as fast as set-points turn it.
  for (int k = 1; k <= 80; ++k) {
    in.stage.axis = Vec3(-std::cos(0.5e-3 * k), std::sin(0.5e-3 * k), 0);
    (void)in.read();
    EXPECT_LT((in.inputs.readings().stage.axis - in.stage.axis).norm(), 1e-15) << k;
  }
  // In a stop a needle may be mounted anew.
  in.last.running = false;
  in.stage.axis = Vec3(0, -1, 0);
  (void)in.read();
  (void)in.read();
  EXPECT_EQ(in.inputs.readings().stage.axis, in.stage.axis);
}

// It arrived while the clock was slow, and seemed to be new.
TEST(SampleClock, counts_the_age_of_a_sample_by_its_own_time_once_the_clock_has_told_it_twice) {
  constexpr std::int64_t kMs = 1'000'000;
  SampleClock clock(0.02);
  clock.step(1e-3);
  EXPECT_EQ(clock.take(100 * kMs, 100 * kMs), SampleIs::fresh);
  EXPECT_EQ(clock.age_s(), 0);
  clock.step(1e-3);
  EXPECT_EQ(clock.take(100 * kMs, 105 * kMs), SampleIs::repeated);
  EXPECT_NEAR(clock.age_s(), 1e-3, 1e-12) << "the clock has said so once";
  clock.step(1e-3);
  EXPECT_EQ(clock.take(100 * kMs, 106 * kMs), SampleIs::repeated);
  EXPECT_NEAR(clock.age_s(), 6e-3, 1e-12);
  for (int k = 7; k <= 20; ++k) {
    clock.step(1e-3);
    (void)clock.take(100 * kMs, (100 + k) * kMs);
    EXPECT_FALSE(clock.timed_out()) << k;
  }
  clock.step(1e-3);
  EXPECT_TRUE(clock.timed_out());
}

TEST(DeviceInputs, bears_a_low_vacuum_for_its_window_and_between_cells) {
  Inputs in;
  in.vacuum.pressure = 100;
  Fault fault = Fault::none;
  int ticks = 0;
  while (fault == Fault::none && ticks < 200) {
    fault = in.read().device_faults.first;
    ++ticks;
  }
  EXPECT_EQ(fault, Fault::vacuum_lost);
  EXPECT_NEAR(ticks, 101, 1);
  in.last.between_cells = true;
  EXPECT_EQ(in.read().device_faults.first, Fault::none);
}

TEST(DeviceInputs, counts_an_injection_only_while_gate_and_injector_are_both_open) {
  Inputs in;
  in.last.gate_open = true;
  EXPECT_FALSE(in.read().injected);  // a valve that does not follow
  in.injector.open = true;
  EXPECT_TRUE(in.read().injected);
  in.last.gate_open = false;
  EXPECT_FALSE(in.read().injected);
  Fault fault = Fault::none;
  for (int k = 0; k < 260; ++k) {
    fault = in.read().device_faults.first;
  }
  EXPECT_EQ(fault, Fault::injector_open);
}

// The valve follows its gate late: what it said last, that it is shut, is from before it opened.
TEST(DeviceInputs, an_injector_that_fell_silent_with_its_gate_open_counts_as_open) {
  Inputs in;
  in.last.gate_open = true;
  (void)in.read();
  in.injector.status = hal::Status::fault;
  Fault fault = Fault::none;
  int ticks = 0;
  for (; fault == Fault::none && ticks < 1000; ++ticks) {
    const Readings& r = in.read();
    fault = r.device_faults.first;
    EXPECT_EQ(r.injector_known, ticks < 100);
    in.last.gate_open = in.last.gate_open && r.injector_known;
  }
  EXPECT_EQ(fault, Fault::injector_open);
  EXPECT_NEAR(ticks, 100 + 250, 3);
}

TEST(DeviceInputs, an_injector_that_fell_silent_after_it_was_shut_is_no_fault) {
  Inputs in;
  in.last.gate_open = true;
  (void)in.read();
  in.last.gate_open = false;
  (void)in.read();
  in.injector.status = hal::Status::disconnected;
  for (int k = 0; k < 1000; ++k) {
    EXPECT_EQ(in.read().device_faults.first, Fault::none);
  }
  EXPECT_FALSE(in.inputs.readings().injector_known);
}

TEST(DeviceInputs, forgets_a_force_sensor_that_gives_no_number_for_longer_than_its_limit) {
  Inputs in;
  in.sensor.force = 5e-6;
  (void)in.read();
  in.sensor.force = std::nan("");
  EXPECT_TRUE(in.read().sensor_fresh);
  EXPECT_EQ(in.inputs.readings().sensor_N, 5e-6);
  for (int k = 0; k < 100; ++k) {
    (void)in.read();
  }
  EXPECT_FALSE(in.inputs.readings().sensor_fresh);
}

// A switch of its own as the enabling device, on a station that runs.
struct Enabled : Inputs {
  explicit Enabled(double release_s = 0.02) : Inputs(with_enabling(release_s), true) {
    (void)read();
    hold(true);
  }
  static ServoConfig with_enabling(double release_s) {
    ServoConfig config = all_devices();
    config.enabling.emplace().release_s = release_s;
    return config;
  }
  void hold(bool held) {  // for as long as a finger
    enabling.hold(held);
    for (int k = 0; k < 25; ++k) {
      (void)read();
    }
  }
  [[nodiscard]] bool enabled() const { return inputs.readings().enabled; }
  // Ticks until the fault, at most so many.
  int ticks_to(Fault fault, int most = 200) {
    for (int k = 1; k <= most; ++k) {
      if (read().device_faults.first == fault) {
        return k;
      }
    }
    return -1;
  }
};

TEST(DeviceInputs, takes_a_switch_for_held_while_both_contacts_are_closed_and_were_seen_open_before) {
  Enabled in;
  EXPECT_FALSE(in.enabled()) << "held from the start";
  in.hold(false);
  in.hold(true);
  EXPECT_TRUE(in.enabled());
  EXPECT_EQ(in.inputs.readings().alarms, 0U);
  EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::none);
  in.hand.buttons = hal::kButtonPanic;  // the button of the handle says nothing beside a switch
  EXPECT_EQ(in.ticks_to(Fault::enabling_released, 50), -1);
  in.enabling.hold(false);
  EXPECT_NEAR(in.ticks_to(Fault::enabling_released), 20.5, 0.5) << "release_ms, and no more";
}

TEST(DeviceInputs, takes_either_contact_of_the_switch_that_opens_for_let_go) {
  for (const bool a : {true, false}) {
    Enabled in;
    in.hold(false);
    in.hold(true);
    (a ? in.enabling.state.contact_a_closed : in.enabling.state.contact_b_closed) = false;
    EXPECT_NEAR(in.ticks_to(Fault::enabling_released), 20.5, 0.5);
  }
}

TEST(DeviceInputs, takes_a_pulse_of_the_switch_for_let_go) {
  Enabled in;
  in.hold(false);
  in.enabling.hold(true);
  in.enabling.state.pulse_seen = true;
  for (int k = 0; k < 100; ++k) {
    (void)in.read();
  }
  EXPECT_FALSE(in.enabled());
  in.enabling.state.pulse_seen = false;
  in.hold(true);
  EXPECT_TRUE(in.enabled());
  in.enabling.state.pulse_seen = true;
  EXPECT_NEAR(in.ticks_to(Fault::enabling_released), 20.5, 0.5);
}

TEST(DeviceInputs, calls_a_switch_that_is_lost_or_silent_a_fault_and_takes_no_press_that_it_had_before) {
  const struct {
    Status status;
    int within;
  } cases[] = {{Status::disconnected, 1}, {Status::fault, 1}, {Status::no_data, 21}};
  for (const auto& c : cases) {
    Enabled in;
    in.hold(false);
    in.hold(true);
    in.enabling.status = c.status;
    EXPECT_EQ(in.ticks_to(Fault::enabling_fault), c.within);
    EXPECT_NE(in.inputs.readings().alarms & alarm_sensor, 0U);
    EXPECT_EQ(in.inputs.readings().unusable, device_enabling);
    EXPECT_FALSE(in.enabled());
    in.enabling.status = Status::ok;
    in.hold(true);
    EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::none);
    EXPECT_FALSE(in.enabled());
    in.hold(false);
    in.hold(true);
    EXPECT_TRUE(in.enabled());
  }
}

TEST(DeviceInputs, calls_a_switch_whose_clock_is_wrong_silent_and_believes_its_open_contact) {
  for (const bool open : {false, true}) {
    Enabled in(0.005);
    in.hold(false);
    in.hold(true);
    in.enabling.state.contact_b_closed = !open;
    in.enabling_late_ns = 1'000'000'000;
    EXPECT_EQ(in.ticks_to(open ? Fault::enabling_released : Fault::enabling_fault), open ? 6 : 21);
    EXPECT_FALSE(in.enabled());
  }
}

TEST(DeviceInputs, calls_contacts_of_the_switch_that_disagree_for_too_long_a_fault_until_both_were_open) {
  Enabled in;
  in.hold(false);
  in.enabling.state.contact_a_closed = true;
  for (int k = 0; k < 49; ++k) {
    EXPECT_EQ(in.read().device_faults.first, Fault::none);
  }
  EXPECT_LE(in.ticks_to(Fault::enabling_fault), 2) << "discrepancy_ms";
  EXPECT_NE(in.inputs.readings().alarms & alarm_sensor, 0U);
  in.hold(true);
  EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::enabling_fault) << "contact a never opened";
  EXPECT_FALSE(in.enabled());
  in.hold(false);
  EXPECT_EQ(in.inputs.readings().device_faults.first, Fault::none);
  in.hold(true);
  EXPECT_TRUE(in.enabled());
}

}  // namespace
}  // namespace punctum::rt
