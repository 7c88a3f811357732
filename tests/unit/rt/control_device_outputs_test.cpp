// What is written to the devices.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstring>

#include "rt/control/device_outputs.hpp"
#include "tests/support/fake_devices.hpp"

namespace punctum::rt {
namespace {

using namespace test;

struct FailingHand final : hal::HapticDevice {
  Status status = Status::ok;
  Status read(hal::HandState& /*out*/) noexcept override { return Status::ok; }
  Status write_force(const Vec3& /*force_N*/) noexcept override { return status; }
};

struct Outputs {
  explicit Outputs(int divisor = 1) : outputs(config_of(divisor), {hand, &stage, &estop, &injector}) {
    stage.on = true;
    readings.has_stage = readings.stage_seen = true;
    readings.stage.enabled = true;
  }
  static ServoConfig config_of(int divisor) {
    ServoConfig config;
    config.stage_divisor = divisor;
    return config;
  }
  Written write(const hal::StageCommand* to, bool gate_open = false) {
    return outputs.write(safety, readings, to, gate_open, 1e-3);
  }
  FakeHand hand;
  FakeStage stage{Vec3(60e-6, 0, 0)};
  FakeEstop estop;
  FakeInjector injector;
  Readings readings;
  SafetyOutput safety;
  hal::StageCommand set_point{.tip_m = Vec3(50e-6, 0, 0)};
  DeviceOutputs outputs;
};

TEST(DeviceOutputs, writes_force_set_point_gate_and_heartbeat_on_every_tick) {
  Outputs o;
  o.safety.hand_force_N = Vec3(1, 2, 0);
  for (int k = 1; k <= 5; ++k) {
    EXPECT_TRUE(o.write(&o.set_point, true).stage_commanded);
    EXPECT_EQ(o.stage.commands, k);
    EXPECT_EQ(o.estop.toggles, k);
  }
  EXPECT_EQ(o.hand.force, Vec3(1, 2, 0));
  EXPECT_EQ(o.stage.commanded.back(), o.set_point.tip_m);
  EXPECT_TRUE(o.injector.open);
}

TEST(DeviceOutputs, sends_set_points_on_every_nth_tick_as_the_scene_says) {
  Outputs o(4);
  for (int k = 0; k < 40; ++k) {
    (void)o.write(&o.set_point);
  }
  EXPECT_EQ(o.stage.commands, 10);
}

TEST(DeviceOutputs, sends_no_set_point_before_hand_and_needle_are_coupled) {
  Outputs o;
  EXPECT_FALSE(o.write(nullptr).stage_commanded);
  EXPECT_EQ(o.stage.commands, 0);
}

TEST(DeviceOutputs, switches_a_stage_on_that_was_seen_and_has_no_power) {
  for (const bool seen : {false, true}) {
    Outputs o;
    o.stage.on = false;
    o.readings.stage.enabled = false;
    o.readings.stage_seen = seen;
    EXPECT_FALSE(o.write(&o.set_point).stage_commanded);
    EXPECT_EQ(o.stage.on, seen);
  }
}

TEST(DeviceOutputs, brakes_during_a_stop_and_takes_the_power_when_the_latch_does) {
  Outputs o;
  o.safety.latch.quick_stop = true;
  EXPECT_FALSE(o.write(&o.set_point).stage_commanded);
  EXPECT_TRUE(o.stage.stopped && o.stage.on);
  o.safety.latch.drive_power = false;
  (void)o.write(&o.set_point);
  EXPECT_FALSE(o.stage.on);
  EXPECT_EQ(o.stage.commands, 0);
}

TEST(DeviceOutputs, tells_the_enable_line_what_it_tells_the_stage_of_its_power) {
  Outputs o;
  o.stage.on = false;
  o.readings.stage.enabled = false;
  (void)o.write(&o.set_point);
  EXPECT_TRUE(o.stage.on && o.estop.enable_line);
  o.readings.stage.enabled = true;
  (void)o.write(&o.set_point);
  EXPECT_TRUE(o.estop.enable_line);
  o.safety.latch.quick_stop = true;
  (void)o.write(&o.set_point);
  EXPECT_TRUE(o.estop.enable_line) << "it brakes under power";
  o.safety.latch.drive_power = false;
  (void)o.write(&o.set_point);
  EXPECT_FALSE(o.estop.enable_line);
  o.estop.enable_line = o.stage.on = true;
  o.safety.latch = {};
  o.readings.enabled = false;  // nobody has pressed the enabling device
  o.readings.stage.at_standstill = false;
  (void)o.write(&o.set_point);
  EXPECT_TRUE(o.estop.enable_line);
  o.readings.stage.at_standstill = true;
  (void)o.write(&o.set_point);
  EXPECT_FALSE(o.stage.on || o.estop.enable_line);
}

TEST(DeviceOutputs, gives_the_enable_line_also_to_a_stage_that_came_with_power) {
  Outputs o;
  o.stage.on = true;
  EXPECT_TRUE(o.write(&o.set_point).stage_commanded);
  EXPECT_TRUE(o.estop.enable_line);
}

// A counter that goes on in a stop would overflow after days: nothing in it may have changed.
TEST(DeviceOutputs, counts_nothing_while_a_stop_lasts) {
  Outputs o(4);
  (void)o.write(&o.set_point);
  o.safety.latch.quick_stop = true;
  const auto bytes_after = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) {
      (void)o.write(&o.set_point);
    }
    std::array<std::byte, sizeof(DeviceOutputs)> bytes;
    std::memcpy(bytes.data(), static_cast<const void*>(&o.outputs), bytes.size());
    return bytes;
  };
  EXPECT_EQ(bytes_after(100), bytes_after(1000));
}

TEST(DeviceOutputs, gives_no_heartbeat_when_the_latch_takes_it_away_or_a_device_cannot_be_written) {
  Outputs o;
  o.safety.latch.heartbeat = false;
  (void)o.write(&o.set_point);
  EXPECT_EQ(o.estop.toggles, 0);
  for (const Status status : {Status::ok, Status::no_data, Status::fault, Status::disconnected}) {
    FailingHand hand;
    hand.status = status;
    FakeEstop estop;
    DeviceOutputs outputs(ServoConfig{}, {.hand = hand, .estop = &estop});
    const bool good = status == Status::ok || status == Status::no_data;
    EXPECT_EQ(outputs.write(SafetyOutput{}, Readings{}, nullptr, false, 1e-3).fault,
              good ? Fault::none : Fault::hand_lost);
    EXPECT_EQ(estop.toggles, good ? 1 : 0);
  }
}

TEST(DeviceOutputs, gives_no_heartbeat_after_a_force_that_could_not_be_written_until_the_reset) {
  FailingHand hand;
  FakeEstop estop;
  DeviceOutputs outputs(ServoConfig{}, {.hand = hand, .estop = &estop});
  SafetyOutput safety;
  hand.status = Status::fault;
  EXPECT_EQ(outputs.write(safety, Readings{}, nullptr, false, 1e-3).fault, Fault::hand_lost);
  hand.status = Status::ok;
  EXPECT_EQ(outputs.write(safety, Readings{}, nullptr, false, 1e-3).fault, Fault::none);
  EXPECT_EQ(estop.toggles, 0);
  safety.latch.cleared = true;
  (void)outputs.write(safety, Readings{}, nullptr, false, 1e-3);
  EXPECT_EQ(estop.toggles, 1);
}

TEST(DeviceOutputs, gives_no_heartbeat_after_a_hand_has_taken_no_force_for_as_long_as_it_may_be_silent) {
  FailingHand hand;
  FakeEstop estop;
  ServoConfig config;
  config.hand_timeout_s = 0.02;
  DeviceOutputs outputs(config, {.hand = hand, .estop = &estop});
  for (int k = 0; k < 100; ++k) {  // every tenth is taken
    hand.status = k % 10 == 9 ? Status::ok : Status::no_data;
    ASSERT_EQ(outputs.write(SafetyOutput{}, Readings{}, nullptr, false, 1e-3).fault, Fault::none) << k;
  }
  EXPECT_EQ(estop.toggles, 100);
  hand.status = Status::no_data;
  int ticks = 1;
  while (ticks < 100 &&
         outputs.write(SafetyOutput{}, Readings{}, nullptr, false, 1e-3).fault != Fault::hand_lost) {
    ++ticks;
  }
  EXPECT_NEAR(ticks, 21, 1);
  const int toggles = estop.toggles;
  (void)outputs.write(SafetyOutput{}, Readings{}, nullptr, false, 1e-3);
  EXPECT_EQ(estop.toggles, toggles);
}

}  // namespace
}  // namespace punctum::rt
