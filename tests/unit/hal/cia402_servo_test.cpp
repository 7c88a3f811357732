// The servo with a stage of three emulated drives in place of a simulated one, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "hal/cia402/cia402_stage.hpp"
#include "rt/control/servo.hpp"
#include "rt/station/station.hpp"
#include "tests/support/fake_devices.hpp"
#include "tests/support/virtual_can.hpp"

namespace punctum::cia402 {
namespace {

using emulator::DriveState;
using hal::Vec3;
using rt::Fault;

constexpr std::int64_t kPeriod_ns = 1'000'000;

class Cia402ServoTest : public testing::Test {
 protected:
  Cia402ServoTest() {
    CanStageParams params;
    params.axis_count = 3;
    for (int i = 0; i < 3; ++i) {
      params.axes[static_cast<std::size_t>(i)].node = i + 1;
      params.axes[static_cast<std::size_t>(i)].count_m[i] = 40e-9;
      can.add({.node = i + 1});
    }
    can.sleep_until_ns(can.now_ns() + kPeriod_ns);
    stage.emplace(params, 1e-3, can, can.master());
    const auto opened = stage->open();
    EXPECT_TRUE(opened) << opened.error();
    EXPECT_TRUE(stage->start(can.now_ns()));
    rt::ServoConfig config;
    config.vision = false;
    config.damping.emplace();
    config.mapping.max_tilt_rad = 0;
    config.real_actuators = true;
    rt::Devices devices{hand};
    devices.stage = &*stage;
    devices.estop = &estop;
    servo.emplace(config, devices, station->station);
  }
  void ticks(int n) {
    for (int i = 0; i < n; ++i) {
      hand.step(1e-3);
      hand.now_ns = estop.now_ns = can.now_ns();
      servo->tick({tick_++, can.now_ns(), can.now_ns(), 1e-3, 0});
      can.sleep_until_ns(can.now_ns() + kPeriod_ns);
    }
  }
  // The hand's intention walks for n ticks, at 0.05 m/s: 100 um/s at the needle.
  void push_along_x(int n) {
    for (int i = 0; i < n; ++i) {
      hand.intention.x() += 0.05e-3;
      ticks(1);
    }
  }
  [[nodiscard]] double x_m() { return 40e-9 * can.drive(0).position(); }
  [[nodiscard]] Fault fault() const { return servo->sample().fault; }

  tests::VirtualCan can;
  std::optional<Cia402Stage> stage;
  rt::test::FakeHand hand;
  rt::test::FakeEstop estop;
  std::unique_ptr<rt::LocalStation> station = std::make_unique<rt::LocalStation>();
  std::optional<rt::Servo> servo;
  std::uint64_t tick_ = 0;
};

TEST_F(Cia402ServoTest, the_needle_follows_the_hand_without_a_fault) {
  ticks(100);
  EXPECT_EQ(can.drive(0).state(), DriveState::operation_enabled);
  EXPECT_EQ(x_m(), 0);
  push_along_x(600);
  ticks(1000);
  EXPECT_EQ(fault(), Fault::none);
  EXPECT_NEAR(x_m(), hand.x.x() / 500, 1e-6);
  EXPECT_GT(x_m(), 30e-6);
}

TEST_F(Cia402ServoTest, an_emergency_stop_in_motion_stops_the_drives_and_takes_their_power) {
  ticks(100);
  push_along_x(400);
  const double before_m = x_m();
  push_along_x(20);
  EXPECT_GT(x_m(), before_m + 1e-6);
  estop.state.contact_a_closed = estop.state.contact_b_closed = false;
  ticks(2);  // sent in the first, acts at the SYNC of the second
  EXPECT_EQ(can.drive(0).state(), DriveState::quick_stop_active);
  ticks(700);
  EXPECT_EQ(can.drive(0).state(), DriveState::switch_on_disabled);
  EXPECT_EQ(can.drive(0).speed(), 0);
  EXPECT_EQ(fault(), Fault::estop);
  const double stood_m = x_m();
  push_along_x(200);
  EXPECT_EQ(x_m(), stood_m);
}

TEST_F(Cia402ServoTest, a_reset_after_a_drive_s_fault_lets_the_hand_go_on_from_where_the_needle_stands) {
  ticks(100);
  push_along_x(400);
  EXPECT_EQ(can.drive(1).command("fault 0x7305"), "");
  ticks(5);
  EXPECT_EQ(fault(), Fault::stage_fault);
  ticks(1000);
  const double stood_m = x_m();
  estop.state.reset_pressed = true;
  ticks(50);
  estop.state.reset_pressed = false;
  ticks(100);
  EXPECT_EQ(fault(), Fault::none);
  EXPECT_EQ(can.drive(1).state(), DriveState::operation_enabled);
  EXPECT_NEAR(x_m(), stood_m, 1e-7);
}

TEST_F(Cia402ServoTest, a_drive_that_neither_stops_nor_gives_up_its_power_is_found_and_the_heartbeat_ends) {
  ticks(100);
  push_along_x(400);
  EXPECT_EQ(can.drive(0).command("ignore quick-stop"), "");
  EXPECT_EQ(can.drive(0).command("ignore disable"), "");
  estop.state.contact_a_closed = estop.state.contact_b_closed = false;
  ticks(1500);
  const int toggles = estop.toggles;
  ticks(200);
  EXPECT_EQ(estop.toggles, toggles);
}

TEST_F(Cia402ServoTest, a_drive_that_falls_silent_is_a_lost_stage_within_its_time_out) {
  ticks(100);
  push_along_x(400);
  EXPECT_EQ(can.drive(2).command("freeze"), "");
  ticks(25);  // 20 ms, and the cycles between
  EXPECT_EQ(fault(), Fault::stage_lost);
  EXPECT_NE(can.drive(0).state(), DriveState::operation_enabled);
}

TEST_F(Cia402ServoTest, a_connector_that_opens_for_40_ms_is_a_lost_stage_and_its_drives_stay_stopped) {
  for (int i = 0; i < 3; ++i) {  // drives that watch no SYNC: only the queue decides
    can.drive(static_cast<std::size_t>(i))
        .on_frame(tests::frame_of(0x601U + static_cast<std::uint32_t>(i), {0x23, 0x06, 0x10, 0, 0, 0, 0, 0}),
                  can.now_ns());
  }
  ticks(100);
  push_along_x(400);
  const double before_m = x_m();
  push_along_x(10);
  const double per_tick_m = (x_m() - before_m) / 10;
  EXPECT_GT(per_tick_m, 50e-9);
  can.contact = false;
  push_along_x(40);
  EXPECT_EQ(fault(), Fault::stage_lost);
  const double stood_m = x_m();
  can.contact = true;
  double furthest_m = 0;
  for (int i = 0; i < 300; ++i) {
    push_along_x(1);
    furthest_m = std::max(furthest_m, std::abs(x_m() - stood_m));
    if (i > 2) {
      EXPECT_NE(can.drive(0).state(), DriveState::operation_enabled);
    }
  }
  EXPECT_LE(furthest_m, 3 * per_tick_m);  // two set-points that were on their way, and rounding
  EXPECT_EQ(can.drive(0).speed(), 0);
}

}  // namespace
}  // namespace punctum::cia402
