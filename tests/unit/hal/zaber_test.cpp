// The queued positioner over the Zaber ASCII protocol: its parser, the driver on emulated devices in virtual
// time, and the serial line over a real pseudo-terminal with punctum-positioner behind it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <thread>

#include "hal/zaber/zaber_positioner.hpp"
#include "tests/support/positioner_process.hpp"
#include "tests/support/virtual_zaber.hpp"

namespace punctum::zaber {
namespace {

using hal::Status;
using hal::Vec3;

constexpr double kMicrostep_m = 0.05e-6;

ZaberParams three_devices() {
  ZaberParams params;
  params.port = "line";
  params.axis_count = kAxes;
  for (int i = 0; i < kAxes; ++i) {
    params.axes[static_cast<std::size_t>(i)] = {.device = i + 1, .axis = 1, .microstep_m = kMicrostep_m};
  }
  return params;
}

// ---- the parser; lines as the protocol's manual prints them ----

TEST(ZaberReply, reads_the_replies_of_the_manual) {
  const auto plain = parse_reply("@01 0 OK IDLE -- 0");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->device, 1);
  EXPECT_EQ(plain->axis, 0);
  EXPECT_EQ(plain->id, -1);
  EXPECT_TRUE(plain->ok);
  EXPECT_FALSE(plain->busy);
  EXPECT_EQ(plain->flag, (std::array{'-', '-'}));
  EXPECT_EQ(plain->data, "0");
  const auto rejected = parse_reply("@02 3 17 RJ BUSY WR BADDATA");
  ASSERT_TRUE(rejected);
  EXPECT_EQ(rejected->device, 2);
  EXPECT_EQ(rejected->axis, 3);
  EXPECT_EQ(rejected->id, 17);
  EXPECT_FALSE(rejected->ok);
  EXPECT_TRUE(rejected->busy);
  EXPECT_EQ(rejected->flag, (std::array{'W', 'R'}));
  EXPECT_EQ(rejected->data, "BADDATA");
}

// By python3: "%02X" % (-sum(map(ord, "01 0 OK IDLE -- 0")) & 255).
TEST(ZaberReply, checks_a_checksum_where_there_is_one) {
  const auto right = parse_reply("@01 0 OK IDLE -- 0:8D");
  ASSERT_TRUE(right);
  EXPECT_EQ(right->data, "0");
  EXPECT_FALSE(parse_reply("@01 1 OK IDLE -- 0:8D"));
  EXPECT_FALSE(parse_reply("@01 0 OK IDLE -- 0:00"));
  EXPECT_FALSE(parse_reply("@01 0 OK IDLE -- 0:zz"));
}

TEST(ZaberReply, takes_nothing_else_for_a_reply) {
  for (const char* line : {"",
                           "@",
                           "@01",
                           "@01 0",
                           "@01 0 OK",
                           "@01 0 OK IDLE",
                           "@01 0 OK IDLE --",
                           "@01 0 OK IDLE -- ",
                           "!01 1 IDLE --",
                           "#01 0 hello",
                           "/1 1 get pos",
                           "01 0 OK IDLE -- 0",
                           "@00 0 OK IDLE -- 0",
                           "@100 0 OK IDLE -- 0",
                           "@-1 0 OK IDLE -- 0",
                           "@01 x OK IDLE -- 0",
                           "@01 0 ok IDLE -- 0",
                           "@01 0 OK BUSYY -- 0",
                           "@01 0 OK IDLE -x 0",
                           "@01 0 OK IDLE W 0",
                           "@01 0 1 2 OK IDLE -- 0",
                           "@01  0 OK IDLE -- 0",
                           "@9999999999999 0 OK IDLE -- 0"}) {
    EXPECT_FALSE(parse_reply(line)) << line;
  }
}

TEST(ZaberReply, reads_whole_numbers_and_leaves_decimals_of_a_microstep_out) {
  EXPECT_EQ(number_of("10000"), 10000);
  EXPECT_EQ(number_of("-3"), -3);
  EXPECT_EQ(number_of("12.75"), 12);
  for (const char* none : {"", "x", "1x", "1 2", "1.x", "--1", "99999999999999999999", "."}) {
    EXPECT_FALSE(number_of(none)) << none;
  }
}

// ---- the driver, in virtual time ----

class ZaberTest : public testing::Test {
 protected:
  void open() {
    positioner.emplace(params, line, line.wire());
    const auto opened = positioner->open();
    ASSERT_TRUE(opened) << opened.error();
    ASSERT_TRUE(positioner->start(0));
  }
  std::string refusal() {
    ZaberPositioner other(params, line, line.wire());
    const auto opened = other.open();
    return opened ? "it opened" : opened.error();
  }
  hal::PositionerState read() {
    hal::PositionerState state;
    EXPECT_EQ(positioner->read(state), Status::ok);
    return state;
  }
  // Until nothing moves; the largest distance of two axes' ends is what the caller looks at.
  hal::PositionerState until_rest(double most_s = 60) {
    hal::PositionerState state = read();
    for (double t = 0; t < most_s && (state.moving || state.queued > 0) && !state.fault; t += 0.02) {
      line.pass(0.02);
      state = read();
    }
    return state;
  }
  [[nodiscard]] Vec3 truth_m() const {
    return kMicrostep_m * Vec3(line.devices.position(1), line.devices.position(2), line.devices.position(3));
  }
  [[nodiscard]] bool all_at_rest() const {
    return line.devices.speed(1) == 0 && line.devices.speed(2) == 0 && line.devices.speed(3) == 0;
  }

  ZaberParams params = three_devices();
  tests::VirtualZaber line;
  std::optional<ZaberPositioner> positioner;
};

TEST_F(ZaberTest, opening_tells_where_the_axes_are_and_moves_nothing) {
  const Vec3 before_m = truth_m();
  open();
  EXPECT_LT((read().position_m - Vec3::Constant(200'000 * kMicrostep_m)).norm(), 1e-12);
  EXPECT_FALSE(read().moving);
  EXPECT_NEAR(positioner->most_m().y(), 533'333 * kMicrostep_m, 1e-12);
  EXPECT_NEAR(positioner->least_m().y(), 0, 1e-12);
  line.pass(5);
  EXPECT_EQ(truth_m(), before_m);
  for (const std::string& sent : line.sent) {
    EXPECT_NE(sent.find(" get "), std::string::npos) << sent;
  }
}

TEST_F(ZaberTest, speaks_as_the_manual_says) {
  open();
  EXPECT_EQ(line.sent.at(0), "/1 1 1 get pos\r\n");
  line.sent.clear();
  ASSERT_TRUE(positioner->move_to(Vec3(5e-3, 6e-3, 7e-3)));
  ASSERT_EQ(line.sent.size(), 6U);  // where they are, then the three moves
  EXPECT_EQ(line.sent[3], "/1 1 13 move abs 100000\r\n");
  EXPECT_EQ(line.sent[4], "/2 1 14 move abs 120000\r\n");
  EXPECT_EQ(line.sent[5], "/3 1 15 move abs 140000\r\n");
  line.sent.clear();
  positioner->stop();
  EXPECT_EQ(line.sent.at(0), "/1 1 stop\r\n/2 1 stop\r\n/3 1 stop\r\n");
}

TEST_F(ZaberTest, goes_to_its_target_and_says_so_meanwhile) {
  open();
  const Vec3 target_m(12e-3, 8e-3, 10.0001e-3);
  ASSERT_TRUE(positioner->move_to(target_m));
  const hal::PositionerState under_way = read();
  EXPECT_TRUE(under_way.moving);
  EXPECT_EQ(under_way.queued, 0);
  EXPECT_LT(line.now_ns() - under_way.sample_ns, 10'000'000);
  const hal::PositionerState there = until_rest();
  EXPECT_FALSE(there.moving);
  EXPECT_LE((there.position_m - target_m).cwiseAbs().maxCoeff(), kMicrostep_m / 2 + 1e-12);
  EXPECT_LT((there.position_m - truth_m()).norm(), 1e-12);
}

TEST_F(ZaberTest, an_axis_that_counts_the_other_way_goes_the_right_way) {
  params.axes[1].microstep_m = -kMicrostep_m;
  open();
  EXPECT_NEAR(read().position_m.y(), -10e-3, 1e-12);
  EXPECT_NEAR(positioner->least_m().y(), -533'333 * kMicrostep_m, 1e-12);
  ASSERT_TRUE(positioner->move_to(Vec3(10e-3, -12e-3, 10e-3)));
  EXPECT_NEAR(until_rest().position_m.y(), -12e-3, 1e-12);
  EXPECT_EQ(line.devices.position(2), 240'000);
}

TEST_F(ZaberTest, axes_of_one_controller_are_told_apart) {
  tests::VirtualZaber controller({.devices = 1, .axes = 3});
  for (int i = 0; i < kAxes; ++i) {
    params.axes[static_cast<std::size_t>(i)] = {.device = 1, .axis = 3 - i, .microstep_m = kMicrostep_m};
  }
  ZaberPositioner other(params, controller, controller.wire());
  ASSERT_TRUE(other.open());
  ASSERT_TRUE(other.move_to(Vec3(1e-3, 2e-3, 3e-3)));
  controller.pass(10);
  EXPECT_EQ(controller.devices.position(1, 3), 20'000);
  EXPECT_EQ(controller.devices.position(1, 2), 40'000);
  EXPECT_EQ(controller.devices.position(1, 1), 60'000);
}

TEST_F(ZaberTest, queues_moves_and_begins_each_when_the_one_before_has_ended) {
  open();
  ASSERT_TRUE(positioner->move_to(Vec3(11e-3, 10e-3, 10e-3)));
  for (int i = 0; i < static_cast<int>(ZaberPositioner::kQueue); ++i) {
    ASSERT_TRUE(positioner->move_to(Vec3((i % 2 == 0 ? 12e-3 : 13e-3), 10e-3, (10 + i) * 1e-3)));
  }
  EXPECT_FALSE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
  EXPECT_EQ(read().queued, 4);
  double furthest_m = 0;
  bool was_at_first = false;
  hal::PositionerState state = read();
  for (int i = 0; i < 2000 && (state.moving || state.queued > 0); ++i) {
    line.pass(0.02);
    state = read();
    was_at_first = was_at_first || (state.queued == 4 && std::abs(truth_m().x() - 11e-3) < 0.2e-3);
    furthest_m = std::max(furthest_m, truth_m().x());
  }
  EXPECT_TRUE(was_at_first);
  EXPECT_NEAR(furthest_m, 13e-3, 10e-6);
  EXPECT_LT((truth_m() - Vec3(13e-3, 10e-3, 13e-3)).norm(), 1e-9);
  EXPECT_TRUE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
}

TEST_F(ZaberTest, a_stop_brakes_every_axis_and_empties_the_queue) {
  open();
  ASSERT_TRUE(positioner->move_to(Vec3(20e-3, 1e-3, 20e-3)));
  ASSERT_TRUE(positioner->move_to(Vec3(1e-3, 1e-3, 1e-3)));
  line.pass(0.5);
  ASSERT_FALSE(all_at_rest());
  positioner->stop();
  EXPECT_EQ(read().queued, 0);
  line.pass(0.3);
  ASSERT_TRUE(all_at_rest());
  const Vec3 rests_m = truth_m();
  EXPECT_FALSE(until_rest().moving);
  line.pass(10);
  EXPECT_EQ(truth_m(), rests_m);
  EXPECT_GT((rests_m - Vec3(20e-3, 1e-3, 20e-3)).norm(), 1e-3);
  EXPECT_FALSE(read().fault);
  EXPECT_TRUE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
}

TEST_F(ZaberTest, refuses_what_lies_outside_or_is_no_number_and_nothing_moves) {
  open();
  const Vec3 before_m = truth_m();
  for (const Vec3& target : {Vec3(-1e-9, 1e-3, 1e-3), Vec3(1e-3, 27e-3, 1e-3), Vec3(1e-3, 1e-3, 1),
                             Vec3(std::numeric_limits<double>::quiet_NaN(), 1e-3, 1e-3),
                             Vec3(1e-3, std::numeric_limits<double>::infinity(), 1e-3)}) {
    EXPECT_FALSE(positioner->move_to(target));
  }
  line.pass(5);
  EXPECT_EQ(truth_m(), before_m);
  EXPECT_FALSE(read().fault);
  EXPECT_TRUE(positioner->move_to(positioner->most_m()));
  EXPECT_TRUE(positioner->move_to(positioner->least_m()));
  EXPECT_LT((until_rest().position_m).norm(), 1e-12);
}

TEST_F(ZaberTest, a_fault_of_one_axis_stops_all_until_it_is_opened_again) {
  open();
  ASSERT_TRUE(positioner->move_to(Vec3(20e-3, 20e-3, 20e-3)));
  ASSERT_TRUE(positioner->move_to(Vec3(1e-3, 1e-3, 1e-3)));
  line.pass(0.3);
  ASSERT_EQ(line.devices.command("stall 2"), "");
  EXPECT_TRUE(read().fault);
  EXPECT_EQ(positioner->why(), "device 2 axis 1: warns FS");
  line.pass(0.5);
  EXPECT_TRUE(all_at_rest());
  EXPECT_EQ(read().queued, 0);
  const Vec3 rests_m = truth_m();
  EXPECT_FALSE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
  line.pass(5);
  EXPECT_EQ(truth_m(), rests_m);
  EXPECT_EQ(refusal(),
            "line: device 2 axis 1: warns FS: look it up in its manual, mend it, and send it \"/2 1 warnings "
            "clear\"");
  line.devices.receive("/2 1 warnings clear\n", line.now_ns());
  (void)line.devices.step(line.now_ns());
  EXPECT_TRUE(read().fault);  // still: nobody opened it
  open();
  EXPECT_TRUE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
}

TEST_F(ZaberTest, a_warning_is_a_fault_and_a_note_is_none) {
  open();
  ASSERT_EQ(line.devices.command("flag NI 1"), "");
  EXPECT_FALSE(read().fault);
  ASSERT_EQ(line.devices.command("flag WV 3"), "");
  EXPECT_TRUE(read().fault);
  EXPECT_EQ(positioner->why(), "device 3 axis 1: warns WV");
}

TEST_F(ZaberTest, an_axis_that_was_not_homed_is_told_in_one_line_and_not_homed) {
  ASSERT_EQ(line.devices.command("unhome 2"), "");
  const Vec3 before_m = truth_m();
  EXPECT_EQ(
      refusal(),
      "line: device 2 axis 1: has not been homed since it got power: move the needle out of the way and "
      "send it \"/2 1 home\"");
  line.pass(5);
  EXPECT_EQ(truth_m(), before_m);
}

TEST_F(ZaberTest, a_device_that_does_not_answer_is_named) {
  params.axes[2].device = 7;
  EXPECT_EQ(refusal(),
            "line: device 7 axis 1: no answer, allowed: a Zaber device with ASCII protocol at 115200 baud");
  params.axes[2] = {.device = 3, .axis = 2, .microstep_m = kMicrostep_m};
  EXPECT_EQ(refusal(), "line: device 3 axis 2: refuses \"get pos\": BADAXIS");
}

TEST_F(ZaberTest, silence_is_a_fault_after_a_second_try) {
  open();
  ASSERT_EQ(line.devices.command("mute 1"), "");
  EXPECT_FALSE(read().fault);
  ASSERT_EQ(line.devices.command("mute 2"), "");
  const std::int64_t before_ns = line.now_ns();
  EXPECT_TRUE(read().fault);
  EXPECT_GE(line.now_ns() - before_ns, 399'000'000);
  EXPECT_EQ(positioner->why(), "device 1 axis 1: no answer");
  EXPECT_FALSE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
}

TEST_F(ZaberTest, silence_under_way_stops_the_other_axes) {
  open();
  ASSERT_TRUE(positioner->move_to(Vec3(20e-3, 20e-3, 20e-3)));
  line.pass(0.3);
  ASSERT_EQ(line.devices.command("mute"), "");
  EXPECT_TRUE(read().fault);
  line.pass(0.5);
  EXPECT_TRUE(all_at_rest());
  EXPECT_GT((truth_m() - Vec3(20e-3, 20e-3, 20e-3)).norm(), 1e-3);
}

TEST_F(ZaberTest, garbage_and_lines_of_others_are_passed_over) {
  open();
  ASSERT_EQ(line.devices.command("garbage 99"), "");
  ASSERT_TRUE(positioner->move_to(Vec3(12e-3, 8e-3, 10e-3)));
  EXPECT_LT((until_rest().position_m - Vec3(12e-3, 8e-3, 10e-3)).norm(), 1e-9);
  ASSERT_EQ(line.devices.command("broken 1"), "");
  EXPECT_FALSE(read().fault);
  line.come += "@01 1 OK BUSY FF 5\r\n@01 1 98 OK BUSY FF 5\r\n@02 1 1 OK IDLE FF 5\r\n";
  EXPECT_FALSE(read().fault);
  EXPECT_LT((read().position_m - truth_m()).norm(), 1e-12);
}

TEST_F(ZaberTest, an_answer_of_another_axis_or_device_counts_for_nothing) {
  open();  // commands 1 to 9
  line.come += "@01 2 10 OK IDLE FS 5\r\n@02 1 10 OK IDLE FS 5\r\n@01 0 10 OK IDLE FS 5\r\n";
  EXPECT_FALSE(read().fault);
  EXPECT_LT((read().position_m - truth_m()).norm(), 1e-12);
}

TEST_F(ZaberTest, an_answer_that_comes_late_is_not_taken_for_the_next_one) {
  open();
  ASSERT_TRUE(positioner->move_to(Vec3(20e-3, 20e-3, 20e-3)));
  ASSERT_EQ(line.devices.command("late 150"), "");
  for (int i = 0; i < 20; ++i) {
    const hal::PositionerState state = read();
    ASSERT_FALSE(state.fault);
    // The three answers are some 150 ms old each: at 5 mm/s no further behind than this.
    EXPECT_LT((state.position_m - truth_m()).cwiseAbs().maxCoeff(), 5e-3 * 0.5);
  }
  ASSERT_EQ(line.devices.command("late 250"), "");  // later than it waits for: never an answer in time
  EXPECT_TRUE(read().fault);
}

TEST_F(ZaberTest, a_move_that_a_device_rejects_is_a_fault_and_stops_all) {
  open();
  ASSERT_EQ(line.devices.command("reject BADDATA"), "");
  EXPECT_FALSE(positioner->move_to(Vec3(12e-3, 8e-3, 10e-3)));
  EXPECT_TRUE(read().fault);
  EXPECT_EQ(positioner->why(), "device 1 axis 1: rejected: BADDATA");
  line.pass(2);
  EXPECT_TRUE(all_at_rest());
}

TEST_F(ZaberTest, a_command_that_the_wire_spoils_is_sent_again) {
  open();
  int left = 1;
  line.spoil = [&left](std::string& text) {
    if (left > 0 && text.find("move") != std::string::npos) {
      text.erase(0, 1);
      --left;
    }
  };
  ASSERT_TRUE(positioner->move_to(Vec3(12e-3, 8e-3, 10e-3)));
  EXPECT_EQ(left, 0);
  EXPECT_LT((until_rest().position_m - Vec3(12e-3, 8e-3, 10e-3)).norm(), 1e-9);
}

TEST_F(ZaberTest, a_line_that_is_gone_is_disconnected) {
  open();
  line.gone = true;
  hal::PositionerState state;
  EXPECT_EQ(positioner->read(state), Status::disconnected);
  EXPECT_FALSE(positioner->move_to(Vec3(10e-3, 10e-3, 10e-3)));
  positioner->stop();
  positioner->safe_state();
  positioner->close();
}

TEST_F(ZaberTest, the_safe_state_stops_what_moves) {
  open();
  EXPECT_EQ(positioner->served().positioner, &*positioner);
  ASSERT_TRUE(positioner->move_to(Vec3(20e-3, 20e-3, 20e-3)));
  line.pass(0.3);
  positioner->safe_state();
  line.pass(0.5);
  EXPECT_TRUE(all_at_rest());
  EXPECT_GT((truth_m() - Vec3(20e-3, 20e-3, 20e-3)).norm(), 1e-3);
}

// ---- over a pseudo-terminal, in real time ----

class WallClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch().count();
  }
  void sleep_until_ns(std::int64_t /*t_ns*/) noexcept override {}
};

TEST(ZaberLine, moves_emulated_devices_behind_a_pseudo_terminal) {
  tests::PositionerProcess process;
  ASSERT_TRUE(process.path().starts_with("/dev/pts/")) << process.path();
  const WallClock clock;
  ZaberParams params = three_devices();
  params.port = process.path();
  params.answer_s = 2;  // this machine may stall
  ZaberPositioner positioner(params, clock, std::make_unique<SerialLine>(params.port));
  const auto opened = positioner.open();
  ASSERT_TRUE(opened) << opened.error();
  SerialLine second(params.port);
  if (geteuid() != 0) {  // root may
    EXPECT_FALSE(second.open());
  }
  const Vec3 target_m(10.5e-3, 9.5e-3, 10e-3);
  process.tell("garbage 50");
  ASSERT_TRUE(positioner.move_to(target_m));
  hal::PositionerState state;
  do {
    ASSERT_EQ(positioner.read(state), Status::ok);
    ASSERT_FALSE(state.fault) << positioner.why();
  } while (state.moving);
  EXPECT_LT((state.position_m - target_m).norm(), 1e-9);
  process.tell("stall 3");
  do {
    ASSERT_EQ(positioner.read(state), Status::ok);
  } while (!state.fault);
  EXPECT_EQ(positioner.why(), "device 3 axis 1: warns FS");
  positioner.close();
}

TEST(ZaberLine, a_line_that_ends_is_disconnected) {
  tests::PositionerProcess process;
  const WallClock clock;
  ZaberParams params = three_devices();
  params.port = process.path();
  params.answer_s = 2;
  ZaberPositioner positioner(params, clock, std::make_unique<SerialLine>(params.port));
  ASSERT_TRUE(positioner.open());
  process.end();
  hal::PositionerState state;
  EXPECT_EQ(positioner.read(state), Status::disconnected);
  EXPECT_FALSE(positioner.move_to(Vec3(10e-3, 10e-3, 10e-3)));
  positioner.safe_state();
  positioner.close();
}

TEST(ZaberLine, says_in_one_line_what_is_no_serial_line) {
  for (const char* port : {"/nowhere/ttyUSB0", "/dev/null", "/tmp"}) {
    SerialLine line(port);
    const auto opened = line.open();
    ASSERT_FALSE(opened) << port;
    EXPECT_TRUE(opened.error().starts_with(std::string(port) + ": ")) << opened.error();
    EXPECT_TRUE(opened.error().ends_with(", allowed for zaber.port: a serial line")) << opened.error();
  }
}

}  // namespace
}  // namespace punctum::zaber
