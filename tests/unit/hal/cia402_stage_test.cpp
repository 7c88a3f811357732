// The stage of CiA 402 drives against three emulated drives, on a bus in memory and in virtual time.
#include "hal/cia402/cia402_stage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/cia402/configuration.hpp"
#include "tests/support/virtual_can.hpp"

namespace punctum::cia402 {
namespace {

using emulator::Drive;
using emulator::DriveState;
using hal::Status;
using hal::Vec3;
using tests::frame_of;

constexpr double kCount_m = 40e-9;
constexpr std::int64_t kTick_ns = 1'000'000;

CanStageParams three_axes() {
  CanStageParams params;
  params.axis_count = 3;
  for (int i = 0; i < 3; ++i) {
    AxisParams& axis = params.axes[static_cast<std::size_t>(i)];
    axis.node = i + 1;
    axis.count_m[i] = kCount_m;
  }
  params.tip_m = {5e-6, 0, 0};
  return params;
}

class Cia402StageTest : public testing::Test {
 protected:
  Cia402StageTest() {
    for (int node = 1; node <= 3; ++node) {
      can.add({.node = node, .start_counts = 1000.0 * node});
    }
    can.sleep_until_ns(can.now_ns() + kTick_ns);  // they boot
  }

  Cia402Stage& made(const CanStageParams& params = three_axes()) {
    stage.emplace(params, 1e-3, can, can.master());
    return *stage;
  }
  void begin(const CanStageParams& params = three_axes()) {
    Cia402Stage& it = made(params);
    const auto opened = it.open();
    ASSERT_TRUE(opened) << opened.error();
    const auto started = it.start(can.now_ns());
    ASSERT_TRUE(started) << started.error();
  }
  // A tick as the core's: read, then at most one of the commands. The drives see the rest of the millisecond.
  template <typename Write>
  Status tick(Write write) {
    hal::StageState read;
    const Status status = stage->read(read);
    if (status == Status::ok) {
      state = read;
      seen = true;
    }
    write();
    can.sleep_until_ns(can.now_ns() + kTick_ns);
    return status;
  }
  Status tick() {
    return tick([] {});
  }
  Status ticks(int n) {
    Status last = Status::no_data;
    for (int i = 0; i < n; ++i) {
      last = tick();
    }
    return last;
  }
  // Ticks that want the stage on, as the core does; how many it took.
  int enable(int most = 100) {
    int n = 0;
    while (n < most && !state.enabled) {
      ++n;
      tick([this] { stage->enable(true); });
    }
    EXPECT_TRUE(state.enabled);
    return n;
  }
  void go_to(const Vec3 tip_m, int n) {  // by value: it may be that of the newest reading
    for (int i = 0; i < n; ++i) {
      tick([&] { ASSERT_EQ(stage->command({tip_m, -Vec3::UnitX()}), Status::ok); });
    }
  }
  [[nodiscard]] Vec3 where_m() {
    return {5e-6 + kCount_m * can.drive(0).position(), kCount_m * can.drive(1).position(),
            kCount_m * can.drive(2).position()};
  }
  // Moves for the given ticks on a straight way at 500 um/s, well within what the drives can do.
  void move_along_x(int n) {
    const Vec3 from_m = state.tip_m;
    for (int i = 1; i <= n; ++i) {
      const Vec3 to_m = from_m + Vec3(0.5e-6 * i, 0, 0);
      tick([&] { ASSERT_EQ(stage->command({to_m, -Vec3::UnitX()}), Status::ok); });
    }
  }
  void expect_all(DriveState wanted) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(can.drive(i).state(), wanted) << "drive " << i + 1;
    }
  }
  // Nothing moves from here on: no drive goes a count further in the next tenth of a second.
  void expect_rest() {
    const Vec3 before_m = where_m();
    ticks(100);
    EXPECT_LT((where_m() - before_m).norm(), 1e-12);
  }

  tests::VirtualCan can;
  std::optional<Cia402Stage> stage;
  hal::StageState state;
  bool seen = false;
};

// ---- opening ----

TEST_F(Cia402StageTest, opens_drives_and_moves_nothing) {
  begin();
  const Vec3 before_m = where_m();
  ticks(50);
  EXPECT_EQ(where_m(), before_m);
  expect_all(DriveState::switch_on_disabled);
  EXPECT_FALSE(state.enabled);
  EXPECT_FALSE(state.powered);
  EXPECT_TRUE(state.at_standstill);
  EXPECT_LT((state.tip_m - before_m).norm(), 1e-12);
  EXPECT_EQ(state.axis, -Vec3::UnitX());
}

TEST_F(Cia402StageTest, writes_to_the_drives_what_the_scene_says) {
  CanStageParams params = three_axes();
  params.axes[1].following_counts = 777;
  params.axes[1].quick_stop_counts_s2 = 123456;
  params.axes[1].min_counts = -5000;
  begin(params);
  const Drive& drive = can.drive(1);
  EXPECT_EQ(drive.value(0x6065), 777);
  EXPECT_EQ(drive.value(0x6085), 123456);
  EXPECT_EQ(drive.value(0x607D, 1), -5000);
  EXPECT_EQ(drive.value(0x605A), 6);
  EXPECT_EQ(drive.value(0x6007), 3);
  EXPECT_EQ(drive.value(0x1400, 1), 0x202);
  EXPECT_EQ(drive.value(0x1A00, 0), 2);
  EXPECT_EQ(drive.value(0x1A00, 2), 0x60640020);
  EXPECT_EQ(drive.value(0x6061), 8);
  EXPECT_EQ(drive.value(0x1801, 1), 0x80000282);  // the vendor's second PDO is off
}

TEST_F(Cia402StageTest, names_node_object_reason_and_remedy_of_every_refused_step) {
  const CanStageParams params = three_axes();
  for (const auto& object : configuration(params, params.axes[1], 1e-3)) {
    const std::string name = hex(object.id.index, 4) + ":" + hex(object.id.sub, 2);
    EXPECT_EQ(can.drive(1).command("refuse " + name + " 0x06090030"), "");
    const auto opened = made(params).open();
    ASSERT_FALSE(opened) << name;
    EXPECT_TRUE(opened.error().starts_with("node 2: " + name + " (")) << opened.error();
    EXPECT_NE(opened.error().find("refused: the value is out of range (0x06090030): "), std::string::npos)
        << opened.error();
    EXPECT_EQ(opened.error().find('\n'), std::string::npos);
    EXPECT_FALSE(can.is_open()) << name;
    EXPECT_EQ(can.drive(1).command("refuse " + name + " 0"), "");
  }
  EXPECT_TRUE(made(params).open());
}

TEST_F(Cia402StageTest, names_a_node_that_does_not_answer) {
  CanStageParams params = three_axes();
  params.axes[2].node = 9;
  const auto opened = made(params).open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error(),
            "node 9: 1000:00 (device type): no answer within 200 ms: check its power, its node number and "
            "bitrate, cable and terminators");
}

TEST_F(Cia402StageTest, refuses_another_drive_than_the_scene_names) {
  CanStageParams params = three_axes();
  params.axes[1].product_code = 77;
  const auto opened = made(params).open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(
      opened.error(),
      "node 2: 1018:02 (product): 0x00000001, and the scene says 0x0000004D: look at product_code of its "
      "[[cia402.axis]]");
}

TEST_F(Cia402StageTest, says_when_the_interface_is_down_or_a_drive_sends_no_heartbeat) {
  can.down = true;
  const auto down = made().open();
  ASSERT_FALSE(down);
  EXPECT_EQ(down.error(), "vcan9: the interface is down");
  can.down = false;
  EXPECT_EQ(can.drive(2).command("mute heartbeat"), "");
  ASSERT_TRUE(made().open());
  const auto silent = stage->start(0);
  ASSERT_FALSE(silent);
  EXPECT_TRUE(silent.error().starts_with("node 3: no heartbeat that says operational")) << silent.error();
}

TEST_F(Cia402StageTest, takes_power_and_old_faults_from_drives_that_are_left_over) {
  begin();
  enable();
  EXPECT_EQ(can.drive(0).command("fault 0x7300"), "");
  // The program dies here, and another one opens the bus.
  begin();
  expect_all(DriveState::switch_on_disabled);
  state = {};
  enable();
}

TEST_F(Cia402StageTest, does_not_open_a_drive_that_keeps_its_power) {
  begin();
  enable();
  EXPECT_EQ(can.drive(1).command("ignore disable"), "");
  const auto opened = made().open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().find("node 2: the drive does not give up its power"), std::string::npos)
      << opened.error();
}

// ---- power and motion ----

TEST_F(Cia402StageTest, walks_to_operation_without_waiting_in_a_tick) {
  begin();
  can.record = true;
  ticks(5);
  can.sent.clear();
  EXPECT_LE(enable(), 16);
  std::vector<int> words;  // of the first drive
  for (const can_frame& frame : can.sent) {
    if (frame.can_id == 0x201 && (words.empty() || words.back() != frame.data[0])) {
      words.push_back(frame.data[0]);
    }
  }
  EXPECT_EQ(words, (std::vector<int>{0x00, 0x06, 0x07, 0x0F}));
  expect_all(DriveState::operation_enabled);
  EXPECT_TRUE(state.powered);
}

TEST_F(Cia402StageTest, operation_begins_where_the_drive_stands_and_without_a_step) {
  begin();
  const Vec3 before_m = where_m();
  enable();
  ticks(50);  // nobody commands yet
  go_to(state.tip_m, 50);
  EXPECT_LT((where_m() - before_m).norm(), 1e-12);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LE(can.drive(i).largest_step(), 0.5) << "drive " << i + 1;
    EXPECT_EQ(can.drive(i).value(0x607A), 1000 * static_cast<std::int64_t>(i + 1));
  }
}

TEST_F(Cia402StageTest, the_tip_goes_where_it_is_sent) {
  begin();
  enable();
  const Vec3 to_m = state.tip_m + Vec3(20e-6, -10e-6, 4e-6);
  const Vec3 from_m = state.tip_m;
  for (int i = 1; i <= 100; ++i) {
    go_to(from_m + (to_m - from_m) * (0.01 * i), 1);
  }
  go_to(to_m, 20);
  EXPECT_LT((where_m() - to_m).norm(), kCount_m);
  EXPECT_LT((state.tip_m - to_m).norm(), 2 * kCount_m);
  EXPECT_LT(state.following_error_m.norm(), 2 * kCount_m);
  EXPECT_TRUE(state.at_standstill);
}

TEST_F(Cia402StageTest, a_moving_stage_is_not_at_standstill_and_its_samples_are_of_the_sync) {
  begin();
  enable();
  move_along_x(20);
  EXPECT_FALSE(state.at_standstill);
  // Each sample is compared with the set-point that was due at its SYNC: these drives are there to a count,
  // and the set-points of two cycles, at 500 um/s, are 12 counts apart.
  EXPECT_LE(state.following_error_m.norm(), 1.5 * kCount_m);
  EXPECT_EQ(state.sample_ns, can.now_ns() - 2 * kTick_ns);  // the SYNC one tick before the reading
}

TEST_F(Cia402StageTest, set_points_stay_within_the_limits_of_the_axis) {
  CanStageParams params = three_axes();
  params.axes[0].max_counts = 1200;
  begin(params);
  enable();
  for (int i = 1; i <= 300; ++i) {
    go_to(state.tip_m + Vec3(0.3e-6, 0, 0), 1);
  }
  EXPECT_LE(can.drive(0).position(), 1200.5);
  EXPECT_GT(can.drive(0).position(), 1199);
  EXPECT_LE(can.drive(0).value(0x607A), 1200);
}

TEST_F(Cia402StageTest, a_set_point_that_is_no_number_moves_nothing) {
  begin();
  enable();
  const Vec3 before_m = where_m();
  for (int i = 0; i < 20; ++i) {
    tick([&] {
      EXPECT_EQ(stage->command({{std::numeric_limits<double>::quiet_NaN(), 0, 0}, -Vec3::UnitX()}),
                Status::fault);
    });
  }
  EXPECT_LT((where_m() - before_m).norm(), 1e-12);
}

TEST_F(Cia402StageTest, a_fourth_axis_stays_where_it_is_when_operation_begins) {
  CanStageParams params = three_axes();
  params.axis_count = 4;
  params.axes[3].node = 4;
  params.axes[3].count_m = {-30e-9, 0, 30e-9};
  params.sync_divisor = 2;
  can.add({.node = 4, .start_counts = 5000});
  can.sleep_until_ns(can.now_ns() + kTick_ns);
  begin(params);
  enable();
  go_to(state.tip_m, 40);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LE(can.drive(i).largest_step(), 0.5 + 1e-9) << "drive " << i + 1;
  }
  EXPECT_NEAR(can.drive(3).position(), 5000, 0.5);
}

TEST_F(Cia402StageTest, one_command_and_one_sync_go_out_in_each_cycle_in_this_order) {
  CanStageParams params = three_axes();
  params.sync_divisor = 4;
  begin(params);
  enable();
  go_to(state.tip_m, 8);
  can.record = true;
  can.sent.clear();
  go_to(state.tip_m, 40);
  int commands = 0, syncs = 0;
  for (const can_frame& frame : can.sent) {
    commands += frame.can_id > 0x200 && frame.can_id < 0x280 ? 1 : 0;
    if (frame.can_id == 0x080) {
      ++syncs;
      EXPECT_EQ(commands, 3 * syncs);
    }
  }
  EXPECT_EQ(syncs, 10);
}

// ---- stops ----

TEST_F(Cia402StageTest, a_quick_stop_is_on_the_bus_within_the_call_and_stops_on_the_drive_s_ramp) {
  begin();
  enable();
  move_along_x(30);
  can.record = true;
  can.sent.clear();
  stage->quick_stop();
  ASSERT_EQ(can.sent.size(), 3U);
  for (const can_frame& frame : can.sent) {
    EXPECT_EQ(frame.data[0], 0x02);
  }
  tick();
  expect_all(DriveState::quick_stop_active);
  ticks(2);
  EXPECT_FALSE(state.enabled);
  EXPECT_TRUE(state.powered);
  ticks(20);
  EXPECT_TRUE(state.at_standstill);
  expect_rest();
}

TEST_F(Cia402StageTest, nothing_moves_after_a_stop_whatever_is_commanded) {
  begin();
  enable();
  move_along_x(30);
  stage->quick_stop();
  ticks(20);
  const Vec3 before_m = where_m();
  go_to(before_m + Vec3(50e-6, 0, 0), 50);
  for (int i = 0; i < 50; ++i) {
    tick([this] { stage->enable(true); });  // without having been told off
  }
  EXPECT_LT((where_m() - before_m).norm(), 1e-12);
  for (int i = 0; i < 20; ++i) {
    tick([this] {
      stage->quick_stop();
      stage->enable(false);
    });
  }
  expect_all(DriveState::switch_on_disabled);
  EXPECT_FALSE(state.powered);
  expect_rest();
}

TEST_F(Cia402StageTest, is_on_again_after_off_and_on_from_where_it_stands) {
  begin();
  enable();
  move_along_x(30);
  stage->quick_stop();
  ticks(20);
  stage->enable(false);
  ticks(5);
  const Vec3 before_m = where_m();
  state.enabled = false;
  enable();
  ticks(20);
  EXPECT_LT((where_m() - before_m).norm(), 0.6 * kCount_m);  // onto the nearest whole count
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LE(can.drive(i).largest_step(), 0.5);
  }
}

TEST_F(Cia402StageTest, off_and_on_within_one_tick_still_takes_the_power_first) {
  begin();
  enable();
  move_along_x(10);
  tick([this] {
    stage->quick_stop();
    stage->enable(false);
    stage->enable(true);
  });
  ticks(2);
  expect_all(DriveState::switch_on_disabled);
  EXPECT_FALSE(state.enabled);
  enable();
}

TEST_F(Cia402StageTest, a_drive_that_ignores_the_quick_stop_is_shown_as_it_is) {
  begin();
  enable();
  EXPECT_EQ(can.drive(0).command("ignore quick-stop"), "");
  EXPECT_EQ(can.drive(0).command("ignore disable"), "");
  stage->quick_stop();
  ticks(20);
  stage->enable(false);
  ticks(20);
  EXPECT_FALSE(state.enabled);
  EXPECT_TRUE(state.powered);  // the core's judgement is built on this
  EXPECT_EQ(can.drive(1).state(), DriveState::switch_on_disabled);
  for (int i = 0; i < 20; ++i) {
    tick([this] { stage->enable(true); });
  }
  EXPECT_FALSE(state.enabled);  // it gets no set-points before it was seen without power
}

TEST_F(Cia402StageTest, a_drive_that_creeps_without_power_is_shown_as_moving) {
  begin();
  ticks(20);
  EXPECT_TRUE(state.at_standstill);
  EXPECT_EQ(can.drive(2).command("creep 500"), "");  // 20 um/s
  ticks(20);
  EXPECT_FALSE(state.at_standstill);
}

TEST_F(Cia402StageTest, safe_state_stops_and_takes_the_power_and_waits_no_longer_than_it_must) {
  begin();
  enable();
  move_along_x(30);
  stage->safe_state();
  expect_all(DriveState::switch_on_disabled);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(can.drive(i).speed(), 0);
  }
  const std::int64_t again = can.now_ns();
  stage->safe_state();
  EXPECT_LE(can.now_ns() - again, 5 * kTick_ns);
  stage->close();
  EXPECT_FALSE(can.is_open());
  EXPECT_EQ(can.drive(0).nmt_state(), 0x7F);
}

TEST_F(Cia402StageTest, safe_state_gives_up_on_a_drive_that_does_not_answer) {
  begin();
  enable();
  move_along_x(10);
  EXPECT_EQ(can.drive(1).command("freeze"), "");
  const std::int64_t before = can.now_ns();
  stage->safe_state();
  EXPECT_LE(can.now_ns() - before, 700 * kTick_ns);
  EXPECT_EQ(can.drive(0).state(), DriveState::switch_on_disabled);
  EXPECT_EQ(can.drive(2).state(), DriveState::switch_on_disabled);
}

TEST_F(Cia402StageTest, the_drives_stop_by_themselves_when_the_master_dies) {
  begin();
  enable();
  move_along_x(30);
  can.sleep_until_ns(can.now_ns() + 100 * kTick_ns);  // no tick any more
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NE(can.drive(i).state(), DriveState::operation_enabled);
    EXPECT_EQ(can.drive(i).speed(), 0);
  }
}

// ---- faults ----

TEST_F(Cia402StageTest, a_fault_in_motion_is_a_fault_and_keeps_its_emergency_code) {
  begin();
  enable();
  move_along_x(30);
  EXPECT_EQ(can.drive(1).command("fault 0x7305"), "");
  Status status = Status::ok;
  int n = 0;
  while (status != Status::fault && n < 5) {
    status = tick();
    ++n;
  }
  EXPECT_LE(n, 2);
  EXPECT_EQ(stage->axes()[1].last_emergency().code, 0x7305);
  EXPECT_NE(stage->report().find("node 2: 1 emergencies, the last 0x7305 (incremental encoder 1)"),
            std::string::npos)
      << stage->report();
  EXPECT_EQ(ticks(50), Status::fault);  // it does not go by itself
}

TEST_F(Cia402StageTest, a_fault_is_reset_by_whoever_tells_the_drive_off_and_on_again) {
  begin();
  enable();
  EXPECT_EQ(can.drive(1).command("fault 0x7305"), "");
  ticks(3);
  tick([this] { stage->quick_stop(); });
  EXPECT_EQ(tick([this] { stage->enable(false); }), Status::fault);
  EXPECT_EQ(ticks(5), Status::ok);
  EXPECT_FALSE(state.powered);
  EXPECT_EQ(can.drive(1).state(), DriveState::fault);  // nobody resets it unasked
  state.enabled = false;
  enable();
  expect_all(DriveState::operation_enabled);
}

TEST_F(Cia402StageTest, a_fault_that_comes_back_is_reset_once_only) {
  begin();
  enable();
  EXPECT_EQ(can.drive(1).command("fault 0x2310"), "");
  ticks(3);
  stage->enable(false);
  ticks(5);
  int resets = 0;
  can.lose_of_master = [&](const can_frame& frame) {
    const bool reset = frame.can_id == 0x202 && (frame.data[0] & 0x80) != 0;
    resets += reset ? 1 : 0;
    return reset;  // the drive does not hear it: its fault stays
  };
  Status status = Status::ok;
  for (int i = 0; i < 300; ++i) {
    status = tick([this] { stage->enable(true); });
  }
  EXPECT_EQ(status, Status::fault);
  EXPECT_EQ(resets, 1);
}

TEST_F(Cia402StageTest, a_following_error_of_the_drive_is_a_fault) {
  begin();
  enable();
  EXPECT_EQ(can.drive(0).command("stick"), "");  // its encoder shows the same from here on
  Status status = Status::ok;
  const Vec3 from_m = state.tip_m;
  for (int i = 1; i <= 250 && status != Status::fault; ++i) {
    const Vec3 to_m = from_m + Vec3(0.5e-6 * i, 0, 0);
    status = tick([&] { (void)stage->command({to_m, -Vec3::UnitX()}); });
  }
  EXPECT_EQ(status, Status::fault);
  ticks(20);
  EXPECT_EQ(stage->axes()[0].last_emergency().code, 0x8611);
}

TEST_F(Cia402StageTest, the_following_error_bit_is_a_fault_before_the_drive_gives_up) {
  CanStageParams params = three_axes();
  params.axes[0].following_counts = 20;
  params.axes[0].following_ms = 60'000;
  begin(params);
  enable();
  EXPECT_EQ(can.drive(0).command("stick"), "");
  const Vec3 to_m = state.tip_m + Vec3(2e-6, 0, 0);
  Status status = Status::ok;
  for (int i = 0; i < 10 && status != Status::fault; ++i) {
    status = tick([&] { (void)stage->command({to_m, -Vec3::UnitX()}); });
  }
  EXPECT_EQ(status, Status::fault);
  EXPECT_EQ(can.drive(0).state(), DriveState::operation_enabled);
}

TEST_F(Cia402StageTest, a_drive_that_leaves_operation_by_itself_is_not_switched_on_again) {
  begin();
  enable();
  EXPECT_EQ(can.drive(2).command("switch-off"), "");  // safe torque off by the relay
  Status status = Status::ok;
  for (int i = 0; i < 10; ++i) {
    status = tick([this] { stage->enable(true); });
  }
  EXPECT_EQ(status, Status::fault);
  EXPECT_EQ(can.drive(2).state(), DriveState::switch_on_disabled);
}

// ---- the bus ----

TEST_F(Cia402StageTest, a_lost_heartbeat_disconnects_and_stops_those_who_still_hear) {
  begin();
  enable();
  move_along_x(10);
  EXPECT_EQ(can.drive(1).command("mute heartbeat"), "");
  EXPECT_EQ(ticks(100), Status::disconnected);
  EXPECT_NE(can.drive(0).state(), DriveState::operation_enabled);
  EXPECT_EQ(can.drive(0).speed(), 0);
  EXPECT_EQ(can.drive(1).command("speak"), "");
  EXPECT_EQ(ticks(100), Status::disconnected);  // until it is opened again
  stage->safe_state();
  stage->close();
  begin();
  state = {};
  enable();
}

TEST_F(Cia402StageTest, a_drive_that_restarts_disconnects) {
  begin();
  enable();
  EXPECT_EQ(can.drive(1).command("reset"), "");
  EXPECT_EQ(ticks(3), Status::disconnected);
  EXPECT_NE(stage->report().find("node 2: was lost"), std::string::npos);
}

TEST_F(Cia402StageTest, a_drive_that_somebody_stops_over_the_network_disconnects) {
  begin();
  enable();
  can.drive(1).on_frame(frame_of(0x000, {0x80, 0x02}), can.now_ns());
  EXPECT_EQ(ticks(30), Status::disconnected);
}

TEST_F(Cia402StageTest, bus_off_is_final_until_a_person_opens_it_again) {
  begin();
  enable();
  move_along_x(10);
  can.bus_off = true;
  EXPECT_EQ(tick(), Status::disconnected);
  EXPECT_EQ(stage->command({state.tip_m, -Vec3::UnitX()}), Status::disconnected);
  can.bus_off = false;  // as after a restart by the kernel
  can.record = true;
  can.sent.clear();
  EXPECT_EQ(ticks(50), Status::disconnected);
  EXPECT_TRUE(can.sent.empty());
  EXPECT_TRUE(stage->health().bus_off);
  EXPECT_EQ(can.drive(0).speed(), 0);  // by its own link loss
  stage->safe_state();
  stage->close();
  begin();
  state = {};
  enable();
}

TEST_F(Cia402StageTest, an_interface_that_goes_away_disconnects) {
  begin();
  enable();
  can.down = true;
  EXPECT_EQ(tick(), Status::disconnected);
  can.down = false;
  EXPECT_EQ(tick(), Status::disconnected);
}

TEST_F(Cia402StageTest, error_frames_are_counted_and_stop_nothing) {
  begin();
  enable();
  can.inject_error();
  can.inject_error();
  EXPECT_EQ(tick(), Status::ok);
  EXPECT_EQ(stage->health().bus_errors, 2U);
}

TEST_F(Cia402StageTest, a_full_queue_is_counted_and_the_stop_goes_out_as_soon_as_it_can) {
  begin();
  enable();
  move_along_x(10);
  can.full = true;
  tick([this] { stage->quick_stop(); });
  tick();
  EXPECT_GE(stage->health().not_sent, 6U);
  EXPECT_EQ(can.drive(0).state(), DriveState::operation_enabled);
  can.full = false;
  tick();
  expect_all(DriveState::quick_stop_active);
}

TEST_F(Cia402StageTest, without_answers_there_is_no_data_and_not_the_old_value) {
  begin();
  enable();
  can.lose_of_drives = [](const can_frame& frame) { return frame.can_id == 0x182; };
  (void)tick();
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(tick(), Status::no_data);
  }
  can.lose_of_drives = nullptr;
  (void)tick();
  EXPECT_EQ(tick(), Status::ok);
}

TEST_F(Cia402StageTest, a_lost_sync_gives_no_answer_and_moves_nothing_twice) {
  begin();
  enable();
  const Vec3 from_m = state.tip_m;
  int lost = 0;
  can.lose_of_master = [&](const can_frame& frame) { return frame.can_id == 0x080 && ++lost % 3 == 0; };
  int no_data = 0;
  for (int i = 1; i <= 61; ++i) {
    const Vec3 to_m = from_m + Vec3(0.2e-6 * i, 0, 0);
    no_data += tick([&] { (void)stage->command({to_m, -Vec3::UnitX()}); }) == Status::no_data ? 1 : 0;
  }
  EXPECT_EQ(no_data, 20);
  can.lose_of_master = nullptr;
  go_to(from_m + Vec3(12.2e-6, 0, 0), 10);
  EXPECT_LT((where_m() - from_m - Vec3(12.2e-6, 0, 0)).norm(), kCount_m);
}

TEST_F(Cia402StageTest, without_any_sync_the_drives_stop_by_themselves) {
  begin();
  enable();
  move_along_x(10);
  can.lose_of_master = [](const can_frame& frame) { return frame.can_id == 0x080; };
  const Vec3 to_m = state.tip_m + Vec3(100e-6, 0, 0);
  for (int i = 0; i < 30; ++i) {
    tick([&] { (void)stage->command({to_m, -Vec3::UnitX()}); });
  }
  EXPECT_NE(can.drive(0).state(), DriveState::operation_enabled);
  EXPECT_EQ(can.drive(0).speed(), 0);
}

TEST_F(Cia402StageTest, doubled_answers_change_nothing) {
  begin();
  enable();
  can.copies_of_drives = 2;
  move_along_x(20);
  go_to(state.tip_m, 20);
  EXPECT_EQ(tick(), Status::ok);
  EXPECT_LT((state.tip_m - where_m()).norm(), kCount_m);
}

TEST_F(Cia402StageTest, late_answers_are_no_data_and_then_one_sample) {
  begin();
  enable();
  can.hold_drives = true;
  (void)tick();
  EXPECT_EQ(tick(), Status::no_data);
  can.hold_drives = false;
  (void)tick();
  EXPECT_EQ(tick(), Status::ok);
}

TEST_F(Cia402StageTest, a_flood_is_read_in_part_and_not_believed) {
  begin();
  enable();
  for (int i = 0; i < 1000; ++i) {
    can.inject(frame_of(0x181, {0x37, 0x16, 0xFF, 0xFF, 0xFF, 0x00}));
  }
  const Vec3 before_m = state.tip_m;
  for (int i = 0; i < 15; ++i) {
    EXPECT_EQ(tick(), Status::no_data) << i;
  }
  EXPECT_EQ(stage->health().floods, 15U);
  EXPECT_EQ(state.tip_m, before_m);
}

TEST_F(Cia402StageTest, frames_of_another_length_are_counted_and_not_read) {
  begin();
  enable();
  can.lose_of_drives = [](const can_frame& frame) { return frame.can_id == 0x181; };
  const Vec3 before_m = state.tip_m;
  (void)tick();
  for (int size = 0; size <= 8; ++size) {
    if (size != 6) {
      can_frame frame = frame_of(0x181, {0x37, 0x16, 1, 2, 3, 4, 5, 6});
      frame.can_dlc = static_cast<std::uint8_t>(size);
      can.inject(frame);
      EXPECT_EQ(tick(), Status::no_data) << size;
    }
  }
  EXPECT_EQ(stage->health().malformed, 8U);
  EXPECT_EQ(state.tip_m, before_m);
}

// ---- the master's connector ----

// Set-points in motion, 12.5 counts apart, then an open connector; the core asks for its stop 20 ms later, as
// by its time-out, and the contact returns after `open_ms`.
class Cia402ContactTest : public Cia402StageTest {
 protected:
  static constexpr double kPerCycle = 12.5;

  void configure_drives(int sync_us, int behaviour) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto id = 0x601U + static_cast<std::uint32_t>(i);
      can.drive(i).on_frame(frame_of(id, {0x23, 0x06, 0x10, 0, sync_us & 0xFF, sync_us >> 8, 0, 0}),
                            can.now_ns());
      can.drive(i).on_frame(frame_of(id, {0x2F, 0x29, 0x10, 1, behaviour, 0, 0, 0}), can.now_ns());
      ASSERT_EQ(can.drive(i).value(0x1006), sync_us);
      ASSERT_EQ(can.drive(i).value(0x1029, 1), behaviour);
    }
  }
  // What read() told until the contact returned.
  std::vector<Status> lose_contact(int open_ms) {
    move_along_x(50);
    const Vec3 from_m = state.tip_m;
    can.contact = false;
    std::vector<Status> told;
    for (int i = 1; i <= open_ms; ++i) {
      const Vec3 to_m = from_m + Vec3(0.5e-6 * i, 0, 0);
      told.push_back(tick([&] {
        if (i <= 20) {
          (void)stage->command({to_m, -Vec3::UnitX()});
        } else {
          stage->quick_stop();
        }
      }));
      most_waiting = std::max(most_waiting, can.waiting());
    }
    stood_at = can.drive(0).position();
    can.contact = true;
    return told;
  }
  // The furthest that the first drive gets from where it stood, in a tenth of a second after the contact.
  double furthest() {
    double most = 0;
    for (int i = 0; i < 100; ++i) {
      tick([this] { stage->quick_stop(); });
      most = std::max(most, std::abs(can.drive(0).position() - stood_at));
    }
    return most;
  }

  std::size_t most_waiting = 0;
  double stood_at = 0;
};

TEST_F(Cia402ContactTest, a_contact_that_returns_after_the_stop_plays_no_queue_of_old_set_points) {
  begin();
  configure_drives(0, 1);  // drives that watch no SYNC: they are in operation until the stop reaches them
  enable();
  const auto told = lose_contact(40);
  expect_all(DriveState::operation_enabled);
  EXPECT_LE(furthest(), 2 * kPerCycle + 1);  // the two cycles that were on their way
  expect_all(DriveState::quick_stop_active);
  expect_rest();
  EXPECT_EQ(std::count(told.begin() + 2, told.end(), Status::no_data), 38);
  EXPECT_EQ(stage->health().not_sent, 0U);
}

// As many cycles of set-points as the scene allows, and no more; one heard frame begins the count anew.
TEST_F(Cia402ContactTest, a_bus_may_be_silent_for_as_many_cycles_as_the_scene_says) {
  for (const int cycles : {2, 5, 10}) {
    CanStageParams params = three_axes();
    params.silence_cycles = cycles;
    begin(params);
    configure_drives(0, 1);
    enable();
    move_along_x(10);
    for (int i = 0; i < 3; ++i) {
      can.lose_of_drives = [](const can_frame&) { return true; };
      ticks(cycles - 1);
      can.lose_of_drives = nullptr;
      EXPECT_EQ(tick(), Status::no_data);
      EXPECT_EQ(tick(), Status::ok);
    }
    EXPECT_EQ(stage->health().silences, 0U) << cycles;
    expect_all(DriveState::operation_enabled);
    (void)lose_contact(40);
    EXPECT_EQ(stage->health().silences, 1U);
    // Three commands and a SYNC for each cycle, the stop in the same form, and perhaps a heartbeat.
    const auto cycles_and_stop = 4U * static_cast<std::size_t>(cycles + 1);
    EXPECT_GE(most_waiting, cycles_and_stop);
    EXPECT_LE(most_waiting, cycles_and_stop + 1);
    // The bus plays a cycle in 0.4 ms, and the drive brakes from that speed.
    const double played_s = kPerCycle / 0.4e-3;
    const double braking = played_s * played_s / (2.0 * params.axes[0].quick_stop_counts_s2);
    EXPECT_LE(furthest(), cycles * kPerCycle + braking) << cycles;
    expect_all(DriveState::quick_stop_active);
    expect_rest();
    EXPECT_NE(stage->report().find("no node was heard for " + std::to_string(cycles) + " SYNCs, 1 times"),
              std::string::npos)
        << stage->report();
    stage->safe_state();
    stage->close();
  }
}

TEST_F(Cia402ContactTest, drives_that_stand_in_quick_stop_stay_there_when_the_contact_returns) {
  begin();
  configure_drives(1000, 1);  // they stop by themselves, and stay operational in the network
  enable();
  (void)lose_contact(40);
  expect_all(DriveState::quick_stop_active);
  EXPECT_LE(furthest(), 2 * kPerCycle + 1);
  expect_all(DriveState::quick_stop_active);
  expect_rest();
}

TEST_F(Cia402ContactTest, drives_that_lost_their_link_are_left_pre_operational_and_take_nothing_old) {
  for (std::size_t i = 0; i < 3; ++i) {  // a vendor's default of no change
    can.drive(i).on_frame(frame_of(0x601U + static_cast<std::uint32_t>(i), {0x2F, 0x29, 0x10, 1, 1, 0, 0, 0}),
                          can.now_ns());
  }
  begin();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(can.drive(i).value(0x1029, 1), 0);
  }
  enable();
  (void)lose_contact(40);
  EXPECT_EQ(furthest(), 0);
  expect_all(DriveState::quick_stop_active);
  EXPECT_EQ(tick(), Status::disconnected);
}

TEST_F(Cia402ContactTest, a_drive_without_the_object_of_its_error_behaviour_is_opened) {
  can.lose_of_master = [this](const can_frame& frame) {  // played by hand: there is no such object
    const bool asks = frame.can_id == 0x601 && frame.data[0] == 0x40 && frame.data[1] == 0x29;
    if (asks) {
      can.inject(frame_of(0x581, {0x80, 0x29, 0x10, 1, 0, 0, 0x02, 0x06}));
    }
    return asks;
  };
  begin();
  enable();
}

TEST_F(Cia402ContactTest, a_drive_that_stays_operational_without_its_link_is_refused) {
  configure_drives(1000, 1);
  EXPECT_EQ(can.drive(1).command("refuse 1029:01 0x06010002"), "");
  const auto opened = made().open();
  ASSERT_FALSE(opened);
  EXPECT_TRUE(opened.error().starts_with("node 2: 1029:01 (")) << opened.error();
}

TEST_F(Cia402ContactTest, nothing_piles_up_however_long_the_contact_is_away) {
  begin();
  configure_drives(0, 1);
  enable();
  (void)lose_contact(2000);
  // Two cycles of three commands and a SYNC, the stop in the same form, and a heartbeat.
  EXPECT_LE(most_waiting, 13U);
  stage->enable(false);  // lower than the stop: it goes out as well
  const std::size_t with_off = can.waiting();
  EXPECT_GT(with_off, most_waiting);
  for (int i = 0; i < 50; ++i) {
    can.contact = false;
    tick([&] {
      stage->enable(true);
      stage->quick_stop();
      stage->enable(false);
    });
  }
  EXPECT_EQ(can.waiting(), with_off);
  can.contact = true;
  ticks(100);
  expect_all(DriveState::switch_on_disabled);
}

TEST_F(Cia402ContactTest,
       a_contact_that_returns_before_the_time_out_finds_the_drives_stopped_and_is_a_fault) {
  begin();
  configure_drives(0, 1);
  enable();
  const auto told = lose_contact(10);
  EXPECT_EQ(std::count(told.begin() + 2, told.end(), Status::no_data), 8);
  Status status = Status::no_data;
  int n = 0;
  for (; n < 10 && status != Status::fault; ++n) {
    status = tick([&] { (void)stage->command({state.tip_m + Vec3(10e-6, 0, 0), -Vec3::UnitX()}); });
  }
  EXPECT_EQ(status, Status::fault);
  ticks(5);
  expect_all(DriveState::quick_stop_active);
  EXPECT_LE(std::abs(can.drive(0).position() - stood_at), 2 * kPerCycle + 1);
  // Whoever resets the stop goes on.
  stage->quick_stop();
  ticks(30);
  stage->enable(false);
  ticks(10);
  state.enabled = false;
  enable();
}

TEST_F(Cia402ContactTest, a_stop_that_a_full_queue_refuses_goes_out_once_when_there_is_room) {
  begin();
  configure_drives(0, 1);
  enable();
  move_along_x(10);
  can.contact = false;
  ticks(2);                       // not yet silent
  can.queue = can.waiting() + 2;  // room for two of three commands
  ticks(10);
  EXPECT_EQ(can.waiting(), can.queue);
  can.queue = 128;
  can.record = true;
  can.sent.clear();
  ticks(10);
  ASSERT_EQ(can.sent.size(), 2U);  // the third, and the SYNC
  EXPECT_EQ(can.sent[0].can_id, 0x203U);
  EXPECT_EQ(can.sent[0].data[0], kQuickStop);
  EXPECT_EQ(can.sent[1].can_id, 0x080U);
  EXPECT_NE(stage->report().find("no node was heard for 2 SYNCs, 1 times"), std::string::npos)
      << stage->report();
}

TEST_F(Cia402ContactTest, heartbeats_without_answers_are_no_data_and_let_the_stop_be_repeated) {
  begin();
  enable();
  move_along_x(10);
  can.record = true;
  can.lose_of_drives = [](const can_frame& frame) { return frame.can_id < 0x200; };
  (void)tick();
  can.sent.clear();
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(tick(), Status::no_data) << i;
  }
  // One drive's heartbeat in 20 ms, two SYNCs for each, and one with each stop.
  const auto syncs = std::count_if(can.sent.begin(), can.sent.end(),
                                   [](const can_frame& frame) { return frame.can_id == 0x080; });
  EXPECT_GT(syncs, 2);
  EXPECT_LT(syncs, 15);
  expect_all(DriveState::quick_stop_active);
  can.lose_of_drives = nullptr;
  int n = 0;
  while (tick() != Status::fault && n < 30) {
    ++n;
  }
  EXPECT_LT(n, 25);  // a heartbeat away
}

TEST_F(Cia402ContactTest, answers_of_one_cycle_that_stay_away_stop_nothing) {
  begin();
  enable();
  move_along_x(10);
  for (int i = 0; i < 20; ++i) {
    can.lose_of_drives = [](const can_frame&) { return true; };
    (void)tick();
    can.lose_of_drives = nullptr;
    EXPECT_EQ(tick(), Status::no_data);
    EXPECT_EQ(tick(), Status::ok);
  }
  expect_all(DriveState::operation_enabled);
}

TEST_F(Cia402ContactTest, safe_state_without_contact_leaves_a_stop_and_power_off_in_the_queue) {
  begin();
  configure_drives(0, 1);
  enable();
  move_along_x(30);
  can.contact = false;
  stage->safe_state();
  EXPECT_LE(can.waiting(), 17U);
  stood_at = can.drive(0).position();
  can.contact = true;
  can.sleep_until_ns(can.now_ns() + 10 * kTick_ns);
  expect_all(DriveState::switch_on_disabled);
  EXPECT_LE(std::abs(can.drive(0).position() - stood_at), 2 * kPerCycle + 1);
}

// ---- homing ----

TEST_F(Cia402StageTest, homes_nothing_unless_the_scene_asks_for_it) {
  begin();
  enable();
  ticks(100);
  EXPECT_EQ(can.drive(0).value(0x6061), 8);
  EXPECT_EQ(can.drive(0).value(0x6064), 1000);
}

TEST_F(Cia402StageTest, homes_where_it_stands_and_then_takes_set_points_without_a_step) {
  CanStageParams params = three_axes();
  params.homing = true;
  begin(params);
  const double before = can.drive(0).speed();
  enable();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(can.drive(i).value(0x6064), 0) << "drive " << i + 1;
    EXPECT_EQ(can.drive(i).value(0x6061), 8);
  }
  EXPECT_EQ(before, 0);
  EXPECT_LT((state.tip_m - params.tip_m).norm(), 1e-12);
  go_to(state.tip_m, 20);
  EXPECT_NEAR(can.drive(0).position(), 0, 0.5);
  EXPECT_LE(can.drive(0).largest_step(), 0.5);
}

TEST_F(Cia402StageTest, homes_onto_a_switch_once_and_never_again_in_the_run) {
  CanStageParams params = three_axes();
  params.homing = true;
  params.axes[0].homing_method = 17;
  params.axes[0].homing_fast_counts_s = 100'000;
  params.axes[0].homing_counts_s2 = 20'000'000;
  begin(params);
  enable(2000);
  EXPECT_NEAR(can.drive(0).position(), 0, 600);  // it brakes behind the switch
  const double homed_at = can.drive(0).position();
  stage->quick_stop();
  ticks(20);
  stage->enable(false);
  ticks(10);
  state.enabled = false;
  enable();
  EXPECT_NEAR(can.drive(0).position(), homed_at, 1);
}

TEST_F(Cia402StageTest, a_stop_while_it_homes_stops_it) {
  CanStageParams params = three_axes();
  params.homing = true;
  params.axes[0].homing_method = 17;
  begin(params);
  for (int i = 0; i < 100; ++i) {
    tick([this] { stage->enable(true); });
  }
  EXPECT_LT(can.drive(0).speed(), -1000);
  EXPECT_FALSE(state.enabled);
  EXPECT_TRUE(state.powered);
  stage->quick_stop();
  ticks(30);
  EXPECT_EQ(can.drive(0).speed(), 0);
  EXPECT_EQ(can.drive(0).state(), DriveState::quick_stop_active);
}

TEST_F(Cia402StageTest, a_drive_that_does_not_change_its_mode_after_homing_is_a_fault) {
  CanStageParams params = three_axes();
  params.homing = true;
  begin(params);
  EXPECT_EQ(can.drive(1).command("refuse 6060:00 0x08000022"), "");
  Status status = Status::ok;
  for (int i = 0; i < 100 && status != Status::fault; ++i) {
    status = tick([this] { stage->enable(true); });
  }
  EXPECT_EQ(status, Status::fault);
}

// The drive has homed, and is in position mode: what is missing is that it said so.
TEST_F(Cia402StageTest, a_lost_answer_after_homing_costs_one_reset) {
  CanStageParams params = three_axes();
  params.homing = true;
  begin(params);
  int lost = 0;
  can.lose_of_drives = [&](const can_frame& frame) {
    const bool to_mode =
        frame.can_id == 0x582 && frame.data[0] == 0x60 && frame.data[1] == 0x60 && frame.data[2] == 0x60;
    lost += to_mode ? 1 : 0;
    return to_mode && lost == 1;
  };
  Status status = Status::ok;
  for (int i = 0; i < 1000 && status != Status::fault; ++i) {
    status = tick([this] { stage->enable(true); });
  }
  ASSERT_EQ(status, Status::fault);
  ASSERT_EQ(can.drive(1).value(0x6061), 8);
  stage->quick_stop();
  ticks(200);
  stage->enable(false);
  ticks(200);
  state.enabled = false;
  enable();
  EXPECT_TRUE(state.enabled);
  EXPECT_GT(lost, 1) << "its mode was asked for again";
}

TEST_F(Cia402StageTest, says_how_long_its_start_may_take) {
  CanStageParams params = three_axes();
  params.heartbeat_s = 1;
  params.heartbeat_timeout_s = 2.5;
  Cia402Stage& it = made(params);
  ASSERT_TRUE(it.open());
  const std::int64_t began_ns = can.now_ns();
  ASSERT_TRUE(it.start(began_ns));
  EXPECT_GT(can.now_ns() - began_ns, 200'000'000) << "the heartbeat comes once per second";
  EXPECT_LE(can.now_ns() - began_ns, it.longest_start_ns());
}

// ---- the force sensor ----

// The sensor, node 30, is played by hand: it confirms every download and answers each SYNC with -1500 counts.
TEST_F(Cia402StageTest, a_force_is_that_of_the_sensor_s_pdo) {
  CanStageParams params = three_axes();
  params.force_node = 30;
  params.force_count_N = -2e-9;
  int size = 4;
  can.lose_of_master = [&](const can_frame& frame) {
    if (frame.can_id == 0x61E) {
      can_frame answer = frame;
      answer.can_id = 0x59E;
      answer.data[0] = 0x60;
      can.inject(answer);
    }
    if (frame.can_id == 0x080 && size > 0) {
      can_frame force = frame_of(0x19E, {0x24, 0xFA, 0xFF, 0xFF, 0, 0});
      force.can_dlc = static_cast<std::uint8_t>(size);
      can.inject(force);
    }
    return false;
  };
  begin(params);
  hal::ForceState force;
  EXPECT_EQ(stage->read(force), Status::no_data);
  tick([&] { EXPECT_EQ(stage->read(force), Status::no_data); });
  const std::int64_t synced = can.now_ns() - kTick_ns;
  tick([&] { EXPECT_EQ(stage->read(force), Status::ok); });
  EXPECT_NEAR(force.axial_force_N, 3e-6, 1e-15);
  EXPECT_EQ(force.sample_ns, synced);
  size = 6;
  ticks(1);
  EXPECT_EQ(stage->read(force), Status::ok);  // of the SYNC before
  tick([&] { EXPECT_EQ(stage->read(force), Status::no_data); });
  can.bus_off = true;
  tick([&] { EXPECT_EQ(stage->read(force), Status::disconnected); });
}

TEST_F(Cia402StageTest, a_drive_at_the_node_of_the_force_sensor_is_refused) {
  CanStageParams params = three_axes();
  params.force_node = 30;
  can.add({.node = 30});
  can.sleep_until_ns(can.now_ns() + kTick_ns);
  const auto opened = made(params).open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().find("node 30: 1A00:01 (TPDO 1): 0x91300120 is refused: there is no such object"),
            std::string::npos)
      << opened.error();
}

}  // namespace
}  // namespace punctum::cia402
