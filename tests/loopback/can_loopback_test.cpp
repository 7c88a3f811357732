// The stage of CiA 402 drives over two CAN controllers and the kernel's drivers of them, at 1 kHz. The
// guest's time follows the instructions it executes (toolchain/rt-guest/run --deterministic), so ticks may be
// counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "hal/cia402/cia402_stage.hpp"
#include "hal/cia402/socket_can.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/alarm.hpp"
#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/force_sensor_on_bus.hpp"
#include "tests/loopback/histogram.hpp"
#include "tests/support/fake_devices.hpp"

namespace punctum::loopback {
namespace {

using cia402::Cia402Stage;
using emulator::Drive;
using emulator::DriveState;
using hal::Status;
using hal::Vec3;

class CanLoopback : public testing::Test {
 protected:
  CanLoopback() {
    const sched_param core{80};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &core);
  }
  ~CanLoopback() override {
    if (stage) {
      stage->safe_state();
      stage->close();
    }
    const sched_param ordinary{0};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  }
  void open(const cia402::CanStageParams& params = three_drives()) {
    stage = std::make_unique<Cia402Stage>(params, 1e-3, clock, std::make_unique<cia402::SocketCan>("can0"));
    const auto opened = stage->open();
    ASSERT_TRUE(opened) << opened.error();
    next_ns = clock.now_ns() + 200'000'000;  // as the core gives its devices
    const auto started = stage->start(next_ns);
    ASSERT_TRUE(started) << started.error();
    ASSERT_LT(clock.now_ns(), next_ns) << "or the first ticks come in one burst";
  }
  // One tick: reads, and sends the set-point while the drives follow.
  Status tick() {
    clock.sleep_until_ns(next_ns);
    next_ns += 1'000'000;
    ++ticks;
    status = stage->read(state);
    if (status == Status::ok && state.enabled && commanding) {
      command.axis = state.axis;
      EXPECT_EQ(stage->command(command), Status::ok);
    }
    return status;
  }
  void enable() {
    stage->enable(true);
    for (int i = 0; i < 100 && !(status == Status::ok && state.enabled); ++i) {
      (void)tick();
    }
    ASSERT_TRUE(state.enabled);
    command.tip_m = state.tip_m;
    commanding = true;
  }
  // Ticks until it holds, or -1.
  template <class Condition>
  int until(Condition holds, int at_most = 500) {
    for (int i = 1; i <= at_most; ++i) {
      (void)tick();
      if (holds()) {
        return i;
      }
    }
    return -1;
  }

  rt::MonotonicClock clock;
  CanInterface can0{"can0"}, can1{"can1"};
  DrivesOnBus drives{"can1", 3};
  std::unique_ptr<Cia402Stage> stage;
  hal::StageState state;
  hal::StageCommand command;
  Status status = Status::no_data;
  bool commanding = false;
  std::int64_t next_ns = 0;
  int ticks = 0;
};

TEST_F(CanLoopback, three_drives_follow_at_1_kHz_and_every_tick_has_its_answer) {
  open();
  enable();
  const Vec3 from_m = state.tip_m;
  int silent = 0;
  double behind_m = 0;
  std::vector<std::int64_t> age_ns;
  for (int i = 0; i < 1000; ++i) {
    command.tip_m = from_m + Vec3(0.1e-6, -0.05e-6, 0.02e-6) * std::min(i, 500);
    silent += tick() == Status::ok ? 0 : 1;
    behind_m = std::max(behind_m, state.following_error_m.cwiseAbs().maxCoeff());
    age_ns.push_back(clock.now_ns() - state.sample_ns);
  }
  EXPECT_EQ(silent, 0);
  std::printf("following error of a drive that goes 2.5 counts in a tick: at most %.1f counts\n",
              behind_m / kCount_m);
  EXPECT_LT(behind_m, 2 * kCount_m) << "of the set-point that it has had for a tick";
  EXPECT_LT((state.tip_m - command.tip_m).norm(), 3 * kCount_m);
  EXPECT_EQ(drives.with(0, [](Drive& d) { return d.position(); }), 50e-6 / kCount_m);
  EXPECT_EQ(drives.with(1, [](Drive& d) { return d.position(); }), -25e-6 / kCount_m);
  EXPECT_EQ(stage->health().not_sent, 0U);
  EXPECT_EQ(stage->health().bus_errors, 0U);
  EXPECT_EQ(stage->health().malformed, 0U);
  std::sort(age_ns.begin(), age_ns.end());
  std::printf("from SYNC to the tick that reads its answers: p50 %.0f us, largest %.0f us\n",
              1e-3 * static_cast<double>(age_ns[500]), 1e-3 * static_cast<double>(age_ns.back()));
}

// A question to a drive and its answer, from socket to socket: two controllers, their drivers and the drive's
// thread.
TEST_F(CanLoopback, a_question_and_its_answer_go_round_within_a_tick) {
  const int socket = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  ASSERT_GE(socket, 0);
  const can_filter answers{0x581, CAN_SFF_MASK};
  ASSERT_EQ(setsockopt(socket, SOL_CAN_RAW, CAN_RAW_FILTER, &answers, sizeof(answers)), 0);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex("can0"));
  ASSERT_EQ(bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  can_frame question{};
  question.can_id = 0x601;
  question.len = 8;
  question.data[0] = 0x40;  // read 1000:00, the device type
  question.data[2] = 0x10;
  std::vector<std::int64_t> round_ns;
  for (int i = 0; i < 500; ++i) {
    clock.sleep_until_ns(clock.now_ns() + 1'300'000);
    const std::int64_t asked_ns = clock.now_ns();
    ASSERT_EQ(write(socket, &question, sizeof(question)), static_cast<ssize_t>(sizeof(question)));
    pollfd in{socket, POLLIN, 0};
    ASSERT_EQ(poll(&in, 1, 1000), 1);
    can_frame answer{};
    ASSERT_EQ(read(socket, &answer, sizeof(answer)), static_cast<ssize_t>(sizeof(answer)));
    round_ns.push_back(clock.now_ns() - asked_ns);
    ASSERT_EQ(answer.data[0], 0x43) << "four bytes";
    ASSERT_EQ(answer.data[4] | answer.data[5] << 8, 402) << "a drive";
  }
  close(socket);
  print_histogram("CAN, a question to a drive and its answer", round_ns, 20'000);
  EXPECT_LE(*std::max_element(round_ns.begin(), round_ns.end()), 1'000'000);
}

TEST_F(CanLoopback, nothing_moves_when_the_drives_are_enabled) {
  open();
  const double before = drives.with(0, [](Drive& d) { return d.position(); });
  enable();
  for (int i = 0; i < 100; ++i) {
    (void)tick();
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(drives.with(i, [](Drive& d) { return d.state(); }), DriveState::operation_enabled);
    EXPECT_EQ(drives.with(i, [](Drive& d) { return d.largest_step(); }), 0);
  }
  EXPECT_EQ(drives.with(0, [](Drive& d) { return d.position(); }), before);
}

TEST_F(CanLoopback, a_quick_stop_is_in_the_drive_within_two_ticks_and_nothing_moves_afterwards) {
  open();
  enable();
  const Vec3 from_m = state.tip_m;
  for (int i = 0; i < 300; ++i) {
    command.tip_m = from_m + Vec3(0.1e-6, 0, 0) * i;
    (void)tick();
  }
  EXPECT_GT(drives.with(0, [](Drive& d) { return d.speed(); }), 1000);
  commanding = false;
  stage->quick_stop();
  const int after = until(
      [&] { return drives.with(0, [](Drive& d) { return d.state(); }) == DriveState::quick_stop_active; });
  std::printf("quick stop: in the drive after %d ticks\n", after);
  EXPECT_GE(after, 1);
  EXPECT_LE(after, 2);
  const int stands = until([&] { return state.at_standstill; });
  EXPECT_GT(stands, 0);
  const double at = drives.with(0, [](Drive& d) { return d.position(); });
  for (int i = 0; i < 100; ++i) {
    (void)tick();
  }
  EXPECT_EQ(drives.with(0, [](Drive& d) { return d.position(); }), at);
}

TEST_F(CanLoopback, drives_that_hear_no_heartbeat_of_their_master_stop_by_themselves) {
  open();
  enable();
  drives.lose(0x700U + static_cast<canid_t>(three_drives().master_node));
  const auto stopped = [&] {
    return drives.with(2, [](Drive& d) { return d.state(); }) != DriveState::operation_enabled;
  };
  const int after = until(stopped);
  std::printf("no heartbeat of the master: the drive stops after %d ticks\n", after);
  EXPECT_GT(after, 0);
  EXPECT_LE(after, 62);
}

TEST_F(CanLoopback, a_drive_with_a_fault_of_before_is_opened_without_it) {
  EXPECT_EQ(drives.with(1, [](Drive& d) { return d.command("fault 0x7300"); }), "");
  open();
  enable();
}

TEST_F(CanLoopback, closed_drives_have_no_power_and_take_no_set_points) {
  open();
  enable();
  stage->safe_state();
  stage->close();
  clock.sleep_until_ns(clock.now_ns() + 20'000'000);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(drives.with(i, [](Drive& d) { return d.nmt_state(); }), 0x7F) << i << ": pre-operational";
    EXPECT_FALSE(drives.with(i, [](Drive& d) { return d.motor_has_power(); }));
  }
  stage.reset();
}

TEST_F(CanLoopback, drives_without_supply_are_lost_within_their_heartbeats_time) {
  open();
  enable();
  drives.stop();
  const int lost = until([&] { return status == Status::disconnected; });
  std::printf("supply cut: no answer counts as lost after %d ticks\n", lost);
  EXPECT_GT(lost, 0);
  EXPECT_LE(lost, 62);
  EXPECT_EQ(tick(), Status::disconnected) << "until it is opened again";
}

TEST_F(CanLoopback, an_interface_that_is_taken_down_is_lost_and_does_not_come_back_by_itself) {
  open();
  enable();
  can0.down();
  const int lost = until([&] { return status == Status::disconnected; });
  EXPECT_GT(lost, 0);
  EXPECT_LE(lost, 3);
  const CanInterface again("can0");
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(tick(), Status::disconnected);
  }
  // The drives saw their master go and stopped by themselves.
  EXPECT_NE(drives.with(0, [](Drive& d) { return d.state(); }), DriveState::operation_enabled);
}

TEST_F(CanLoopback, a_fault_of_a_drive_is_a_fault_with_its_code_kept) {
  open();
  enable();
  EXPECT_EQ(drives.with(1, [](Drive& d) { return d.command("fault 0x7300"); }), "");
  const int seen = until([&] { return status == Status::fault; });
  EXPECT_GT(seen, 0);
  EXPECT_LE(seen, 3);
  EXPECT_NE(stage->report().find("7300"), std::string::npos) << stage->report();
}

// A force sensor beside the drives, and the part of the core that reads it. What it measures must reach the
// core with the time of its SYNC; what cannot be a measurement must not.
class ForceOnCan : public CanLoopback {
 protected:
  static constexpr double kCount_N = -2e-9;  // tension counts up
  static constexpr int kCounts = -1500;
  static constexpr double kForce_N = 3e-6;

  ForceOnCan() {
    sensor.counts = kCounts;
    cia402::CanStageParams params = three_drives();
    params.force_node = ForceSensorOnBus::kNode;
    params.force_count_N = kCount_N;
    open(params);
    enable();
    rt::ServoConfig config;
    config.force_sensor = true;
    rt::Devices devices{hand};
    devices.force_sensor = stage.get();
    inputs.emplace(config, devices);
  }
  void core_tick() {
    EXPECT_EQ(tick(), Status::ok) << "the drives go on, whatever the sensor does";
    const std::int64_t now_ns = clock.now_ns();
    hand.now_ns = now_ns;
    readings = &inputs->read({.now_ns = now_ns, .elapsed_s = 1e-3, .dt_s = 1e-3}, {});
  }
  void core_ticks(int n) {
    for (int i = 0; i < n; ++i) {
      core_tick();
    }
  }
  [[nodiscard]] bool alarmed() const { return (readings->alarms & rt::alarm_sensor) != 0; }
  // Values are given up 0.1 s after the last good one, and believed again with the first one.
  void expect_given_up_and_taken_up(const std::function<void()>& returns) {
    const auto until_given_up = [&] {
      for (int i = 1; i <= 200; ++i) {
        core_tick();
        if (!readings->sensor_fresh) {
          return i;
        }
      }
      return 0;
    };
    const int given_up = until_given_up();
    std::printf("force sensor: not believed after %d ticks\n", given_up);
    EXPECT_GE(given_up, 99);
    EXPECT_LE(given_up, 103) << "0.1 s, what was on its way, and the tick that notices it";
    EXPECT_TRUE(alarmed());
    EXPECT_EQ(readings->sensor_N, kForce_N) << "the last good one";
    returns();
    core_ticks(3);
    EXPECT_TRUE(readings->sensor_fresh);
    EXPECT_FALSE(alarmed());
    EXPECT_NEAR(readings->sensor_N, kForce_N, 1e-15);
  }

  ForceSensorOnBus sensor{"can1"};
  rt::test::FakeHand hand;
  std::optional<rt::DeviceInputs> inputs;
  const rt::Readings* readings = nullptr;
};

TEST_F(ForceOnCan, a_value_comes_with_every_tick_and_has_the_time_of_its_sync) {
  int values = 0;
  for (int i = 0; i < 200; ++i) {
    (void)tick();
    hal::ForceState force;
    if (stage->read(force) == Status::ok) {
      ++values;
      EXPECT_NEAR(force.axial_force_N, kForce_N, 1e-15);
      EXPECT_EQ(force.sample_ns, state.sample_ns) << "of the SYNC that the drives answered";
    }
    EXPECT_EQ(stage->read(force), Status::no_data) << "once";
  }
  EXPECT_EQ(values, 200);
  sensor.counts = 250'000;
  core_ticks(50);
  EXPECT_TRUE(readings->sensor_fresh);
  EXPECT_NEAR(readings->sensor_N, -0.5e-3, 1e-12);
  EXPECT_FALSE(alarmed());
}

TEST_F(ForceOnCan, a_sensor_that_falls_silent_is_given_up_and_counts_again_when_it_returns) {
  core_ticks(50);
  sensor.silent = true;
  expect_given_up_and_taken_up([&] { sensor.silent = false; });
  EXPECT_EQ(stage->health().malformed, 0U);
}

TEST_F(ForceOnCan, frames_of_another_length_are_no_values_and_are_counted) {
  core_ticks(50);
  for (const int bytes : {0, 3, 5, 8}) {
    const std::uint32_t before = stage->health().malformed;
    sensor.bytes = bytes;
    expect_given_up_and_taken_up([&] { sensor.bytes = 4; });
    EXPECT_GE(stage->health().malformed, before + 99) << bytes << " bytes";
  }
}

// 80000000h is what sensors send that cannot measure; the other is 2 N, more than any that tells
// micronewtons.
TEST_F(ForceOnCan, values_that_no_sensor_measures_are_not_believed) {
  core_ticks(50);
  for (const std::int32_t counts : {std::numeric_limits<std::int32_t>::min(), 1'000'000'000}) {
    sensor.counts = counts;
    expect_given_up_and_taken_up([&] { sensor.counts = kCounts; });
    EXPECT_NEAR(readings->sensor_filtered_N, kForce_N, 1e-9) << "nothing of it is left in the low-pass";
  }
}

// Remote frames are left out: after one of them the emulated controller hands on garbage.
TEST_F(CanLoopback, frames_of_strangers_and_with_long_identifiers_are_not_even_received) {
  open();
  enable();
  for (std::uint32_t i = 0; i < 200; ++i) {
    can_frame frame{};
    frame.can_id = i % 2 == 0 ? 0x181U | CAN_EFF_FLAG : 0x3A0U;
    frame.can_dlc = 8;
    drives.send(frame);
    EXPECT_EQ(tick(), Status::ok) << i;
  }
  EXPECT_EQ(stage->health().malformed, 0U);
  EXPECT_EQ(stage->health().bus_errors, 0U);
}

TEST_F(CanLoopback, an_interface_that_is_down_or_has_a_short_queue_is_refused_with_what_to_do) {
  can0.down();
  cia402::SocketCan down("can0");
  const auto opened = down.open({});
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().find("ip link set can0"), std::string::npos) << opened.error();
  const CanInterface short_queue("can0", 10);
  const auto again = down.open({});
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().find("queue of 10 frames"), std::string::npos) << again.error();
  cia402::SocketCan none("can7");
  EXPECT_FALSE(none.open({}));
  cia402::SocketCan loopback("lo");
  EXPECT_FALSE(loopback.open({}));
}

}  // namespace
}  // namespace punctum::loopback
