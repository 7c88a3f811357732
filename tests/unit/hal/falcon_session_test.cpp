// The dialogue with a Falcon against the emulated one, in virtual time.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/falcon/boot_stream.hpp"
#include "hal/falcon/session.hpp"
#include "tests/support/virtual_falcon.hpp"

namespace punctum::falcon {
namespace {

using emulator::FalconEmulator;
using hal::HandState;
using hal::Status;
using hal::Vec3;
using tests::VirtualFalcon;

constexpr std::int64_t kTick_ns = 1'000'000;

// Two blocks of the C2000 boot stream (TI SPRU963, table 2-5), `words` of them data.
std::vector<std::uint8_t> firmware(std::size_t words = 300) {
  std::vector<std::uint8_t> image = {0xAA, 0x08};
  image.resize(2 + 16);
  const auto word = [&image](unsigned value) {
    image.push_back(static_cast<std::uint8_t>(value));
    image.push_back(static_cast<std::uint8_t>(value >> 8U));
  };
  word(0x003F);
  word(0x8000);
  for (const std::size_t size : {words - 1, std::size_t{1}}) {
    word(static_cast<unsigned>(size));
    word(0x003F);
    word(0x9010);
    for (std::size_t i = 0; i < size; ++i) {
      word(static_cast<unsigned>(i * 2654435761U >> 7U));
    }
  }
  word(0);
  return image;
}

class FalconSessionTest : public testing::Test {
 protected:
  void plug_in(const emulator::FalconParams& params) {
    usb = std::make_unique<VirtualFalcon>(params);
    session.emplace(*usb, *usb);
  }
  void begin(const emulator::FalconParams& params = {.booted = true, .homed = true}) {
    plug_in(params);
    const auto opened = session->open({});
    ASSERT_TRUE(opened) << opened.error();
  }
  // A tick of a servo, and the rest of its millisecond for the thread.
  Status tick(const Vec3& force_N = Vec3::Zero()) {
    status = session->read(state);
    written = session->write_force(force_N);
    const std::int64_t until_ns = usb->now_ns() + kTick_ns;
    usb->wait_until_ns = until_ns;
    while (usb->now_ns() < until_ns && session->pass()) {
    }
    usb->wait_until_ns = VirtualFalcon::kNever_ns;
    usb->sleep_until_ns(until_ns);
    return status;
  }
  int ticks_with(Status wanted, int of, const Vec3& force_N = Vec3::Zero()) {
    int seen = 0;
    for (int i = 0; i < of; ++i) {
      seen += tick(force_N) == wanted ? 1 : 0;
    }
    return seen;
  }
  void grip_at(const Vec3& position_m) {
    usb->hand.at.position_m = {position_m.x(), position_m.y(), position_m.z() + 0.12};
  }
  Vec3 felt() const { return {usb->hand.force[0], usb->hand.force[1], usb->hand.force[2]}; }
  bool pushes() const {
    const auto motors = usb->falcon.motors();
    return motors[0] != 0 || motors[1] != 0 || motors[2] != 0;
  }
  void command(const char* line) { EXPECT_EQ(usb->falcon.command(line), ""); }

  std::unique_ptr<VirtualFalcon> usb;
  std::optional<Session> session;
  HandState state;
  Status status = Status::no_data, written = Status::no_data;
};

// ---- opening ----

TEST_F(FalconSessionTest, a_booted_and_homed_falcon_is_ready_at_once) {
  begin();
  EXPECT_TRUE(session->homed());
  EXPECT_LT(usb->now_ns(), 1'010'000'000);
  using R = VirtualFalcon::Request;
  const std::vector<R> expected = {{9, 1}, {3, 2}, {0, 1}, {0, 2}, {6, 0x013E}};
  EXPECT_EQ(usb->requests, expected);
}

TEST_F(FalconSessionTest, one_without_firmware_is_booted_and_homed) {
  plug_in({});
  const auto image = firmware();
  const auto opened = session->open(image);
  ASSERT_TRUE(opened) << opened.error();
  EXPECT_EQ(usb->falcon.processor(), FalconEmulator::Processor::running);
  EXPECT_EQ(usb->falcon.loaded_words(), 300U);
  EXPECT_TRUE(session->homed());
  using R = VirtualFalcon::Request;
  const std::vector<R> boot = {{0, 1},      {0, 2},      {9, 16},     {3, 0x4138}, {4, 0x0008}, {2, 0},
                               {1, 0x0200}, {1, 0x0100}, {1, 0x0101}, {1, 0x0100}, {3, 0x0015}};
  ASSERT_GE(usb->requests.size(), boot.size() + 5);
  EXPECT_TRUE(std::equal(boot.begin(), boot.end(), usb->requests.begin() + 5));
  for (const auto& packet : usb->packets_out) {
    EXPECT_LE(packet.size(), 62U);
  }
}

TEST_F(FalconSessionTest, echoes_that_are_wrong_are_tried_again) {
  plug_in({});
  command("bad-echo 1");
  const auto opened = session->open(firmware());
  ASSERT_TRUE(opened) << opened.error();
  EXPECT_EQ(usb->falcon.loaded_words(), 300U);
}

TEST_F(FalconSessionTest, one_that_never_repeats_its_firmware_is_refused_with_where_within_ten_seconds) {
  plug_in({});
  command("bad-echo 100000");
  const auto opened = session->open(firmware());
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error(), "the Falcon did not repeat its firmware from byte 0 on (tried 3 times)");
  EXPECT_FALSE(usb->is_open);
  EXPECT_LT(usb->now_ns(), 11'000'000'000);
}

TEST_F(FalconSessionTest, one_without_firmware_and_no_image_is_refused_with_what_to_do) {
  plug_in({});
  const auto opened = session->open({});
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().find("give falcon.firmware"), std::string::npos) << opened.error();
  EXPECT_EQ(opened.error().find('\n'), std::string::npos);
  EXPECT_FALSE(usb->is_open);
}

TEST_F(FalconSessionTest, one_that_is_mute_is_refused_and_its_processor_is_not_reset_without_an_image) {
  plug_in({.booted = true, .homed = true});
  command("mute");
  EXPECT_FALSE(session->open({}));
  for (const auto& request : usb->requests) {
    EXPECT_NE(request.request, 1) << "the lines that reset it";
  }
}

TEST_F(FalconSessionTest, one_that_is_not_plugged_in_is_refused) {
  plug_in({});
  usb->unplugged = true;
  EXPECT_FALSE(session->open({}));
}

TEST_F(FalconSessionTest, one_that_is_unplugged_while_it_boots_is_refused) {
  plug_in({});
  auto image = firmware(30'000);
  // The link is cut by the emulator's own clock: a hand that is asked is not there yet, so by a short buffer.
  usb->out_hangs = true;
  const auto opened = session->open(image);
  ASSERT_FALSE(opened);
  EXPECT_LT(usb->now_ns(), 11'000'000'000) << "it does not wait for ever";
}

TEST_F(FalconSessionTest, the_opening_does_not_wait_for_a_person_for_ever) {
  plug_in({.booted = true, .homes_after_ns = -1});
  const std::int64_t begun_ns = usb->now_ns();
  ASSERT_TRUE(session->open({}));
  EXPECT_FALSE(session->homed());
  EXPECT_NEAR(1e-9 * static_cast<double>(usb->now_ns() - begun_ns), 8, 0.1);
}

// ---- readings ----

TEST_F(FalconSessionTest, every_tick_has_a_reading_of_where_the_grip_is) {
  begin();
  (void)tick();
  for (int i = 0; i < 500; ++i) {
    const double turn = 0.01 * i;
    grip_at({0.03 * std::cos(turn), 0.03 * std::sin(turn), 0.01 * std::sin(2 * turn)});
    const auto meant = usb->hand.at.position_m;
    (void)tick();
    EXPECT_EQ(tick(), Status::ok) << i;
    // A count of an arm moves the grip by less than 0.1 mm.
    EXPECT_LT((state.position_m - Vec3(meant[0], meant[1], meant[2] - 0.12)).norm(), 1e-4);
    // Read at the beginning of the tick that is over, a tick old at the most.
    EXPECT_LE(usb->now_ns() - state.sample_ns, 2 * kTick_ns);
    EXPECT_GT(usb->now_ns() - state.sample_ns, kTick_ns);
  }
  EXPECT_EQ(session->report(), "");
}

TEST_F(FalconSessionTest, a_reading_is_given_once) {
  begin();
  (void)tick();
  EXPECT_EQ(session->read(state), Status::ok);
  HandState same;
  EXPECT_EQ(session->read(same), Status::no_data);
}

TEST_F(FalconSessionTest, axes_are_those_of_the_hand_and_buttons_keep_their_bits) {
  begin();
  grip_at({0.02, 0, 0});
  (void)tick();
  (void)tick();
  EXPECT_GT(state.position_m.x(), 0.0199);
  grip_at({0, 0.02, 0.015});
  usb->hand.at.buttons = 0b1010;
  (void)tick();
  (void)tick();
  EXPECT_GT(state.position_m.y(), 0.0199);
  EXPECT_GT(state.position_m.z(), 0.0149);
  EXPECT_EQ(state.buttons, hal::kButtonInject | hal::kButtonEnable);
}

TEST_F(FalconSessionTest, there_is_no_hand_and_no_force_until_it_is_homed) {
  plug_in({.booted = true, .homes_after_ns = -1});
  ASSERT_TRUE(session->open({}));
  EXPECT_EQ(ticks_with(Status::no_data, 50, {0, 0, 5}), 50);
  EXPECT_EQ(written, Status::no_data);
  EXPECT_FALSE(pushes());
  EXPECT_EQ(usb->falcon.lights(), 0x08U) << "red";
  command("home");
  (void)ticks_with(Status::ok, 2, {0, 0, 5});
  EXPECT_EQ(tick({0, 0, 5}), Status::ok);
  EXPECT_EQ(written, Status::ok);
  EXPECT_LT(state.position_m.norm(), 1e-4) << "from the mark, not from where it was switched on";
  EXPECT_TRUE(pushes());
  EXPECT_EQ(usb->falcon.lights(), 0x02U) << "green";
}

TEST_F(FalconSessionTest, an_arm_that_is_not_homed_is_enough_for_no_hand) {
  plug_in({.booted = true, .homes_after_ns = -1});
  // All three arms are above their marks here, and the first is below it there.
  usb->hand.at.position_m = {0, 0, 0.14};
  ASSERT_TRUE(session->open({}));
  usb->hand.at.position_m = {0, 0.03, 0.13};
  EXPECT_EQ(ticks_with(Status::ok, 20), 0);
  EXPECT_FALSE(usb->falcon.homed());
}

TEST_F(FalconSessionTest, a_homing_that_is_lost_is_a_fault_for_good_and_ends_the_force) {
  begin();
  (void)ticks_with(Status::ok, 10, {1, 0, 0});
  EXPECT_TRUE(pushes());
  command("lose-homing");
  (void)ticks_with(Status::ok, 2, {1, 0, 0});
  EXPECT_EQ(tick({1, 0, 0}), Status::fault);
  EXPECT_EQ(written, Status::fault);
  EXPECT_FALSE(pushes());
  command("home");
  EXPECT_EQ(ticks_with(Status::fault, 50, {1, 0, 0}), 50) << "its origin may be another one now";
  EXPECT_FALSE(pushes());
  EXPECT_NE(session->report().find("lost its homing"), std::string::npos);
}

TEST_F(FalconSessionTest, encoders_that_no_place_of_the_grip_has_are_a_fault_and_no_force) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  // Arms and rods would reach it, but for what stops the grip.
  usb->hand.at.position_m = {0, -0.08, 0.11};
  (void)ticks_with(Status::ok, 3, {0, 0, 2});
  EXPECT_EQ(tick({0, 0, 2}), Status::fault);
  EXPECT_FALSE(pushes());
  EXPECT_GT(session->counts().unreachable, 0U);
  grip_at(Vec3::Zero());
  (void)ticks_with(Status::ok, 3, {0, 0, 2});
  EXPECT_EQ(tick({0, 0, 2}), Status::ok) << "it is none of the faults that stay";
  EXPECT_TRUE(pushes());
}

// ---- force ----

TEST_F(FalconSessionTest, force_is_felt_in_newtons_wherever_the_grip_is) {
  begin();
  for (const Vec3& at :
       {Vec3(0, 0, 0), Vec3(0.03, 0.02, -0.02), Vec3(-0.04, 0.01, 0.02), Vec3(0, -0.04, 0)}) {
    grip_at(at);
    for (const Vec3& force_N : {Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, -3), Vec3(-1, 0.5, 2)}) {
      (void)ticks_with(Status::ok, 4, force_N);
      EXPECT_LT((felt() - force_N).norm(), 0.02) << at.transpose() << " " << force_N.transpose();
    }
  }
}

TEST_F(FalconSessionTest, a_force_is_in_the_device_before_the_next_tick) {
  begin();
  (void)ticks_with(Status::ok, 10);
  (void)tick({0, 0, 2});
  EXPECT_NEAR(felt().z(), 2, 0.02);
  (void)tick({0, 0, -2});
  EXPECT_NEAR(felt().z(), -2, 0.02);
}

TEST_F(FalconSessionTest, of_several_forces_the_newest_is_sent) {
  begin();
  (void)ticks_with(Status::ok, 10);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(session->write_force({0, 0, 0.01 * i}), Status::ok);
  }
  const std::size_t before = usb->packets_out.size();
  (void)tick({0, 0, 2});
  EXPECT_NEAR(felt().z(), 2, 0.02);
  EXPECT_LE(usb->packets_out.size() - before, 2U);
}

TEST_F(FalconSessionTest, a_force_that_nobody_renews_is_forgotten_after_ten_milliseconds) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  const std::int64_t written_ns = usb->now_ns() - kTick_ns;
  EXPECT_TRUE(pushes());
  while (pushes() && usb->now_ns() < written_ns + 100 * kTick_ns) {
    ASSERT_TRUE(session->pass());
  }
  EXPECT_GE(usb->now_ns() - written_ns, 10 * kTick_ns);
  EXPECT_LE(usb->now_ns() - written_ns, 13 * kTick_ns);
}

TEST_F(FalconSessionTest, what_is_no_number_is_refused_and_sent_as_zero) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  (void)tick({0, std::numeric_limits<double>::quiet_NaN(), 2});
  EXPECT_EQ(written, Status::fault);
  EXPECT_FALSE(pushes());
}

TEST_F(FalconSessionTest, after_the_release_nothing_but_zero_is_sent) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  session->release();
  EXPECT_FALSE(session->released());
  for (int i = 0; i < 20; ++i) {
    (void)tick({0, 0, 2});
    EXPECT_FALSE(i > 0 && pushes());
  }
  EXPECT_TRUE(session->released());
}

TEST_F(FalconSessionTest, a_zero_that_did_not_arrive_is_sent_again_after_the_release) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  usb->out_fails = 5;
  session->release();
  while (usb->out_fails > 0) {
    (void)tick({0, 0, 2});
    EXPECT_TRUE(pushes());
    EXPECT_FALSE(session->released()) << "nobody took it";
  }
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  EXPECT_TRUE(session->released());
  EXPECT_FALSE(pushes());
  EXPECT_EQ(session->report().find("zero"), std::string::npos);
}

TEST_F(FalconSessionTest, a_zero_that_never_arrives_is_told_at_the_end) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  usb->out_fails = 1000;
  session->release();
  const std::size_t before = usb->packets_out.size();
  (void)ticks_with(Status::ok, 100);
  EXPECT_FALSE(session->released());
  EXPECT_GE(usb->packets_out.size() - before, 20U) << "it is tried again and again";
  EXPECT_NE(session->report().find("did not take the zero"), std::string::npos) << session->report();
}

TEST_F(FalconSessionTest, a_force_meets_no_old_reading) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  command("mute");
  (void)ticks_with(Status::ok, 30, {0, 0, 2});
  EXPECT_FALSE(pushes()) << "nobody knows where the grip is";
}

// Whoever hangs keeps its torque: only the relay ends that, and it hears of it by the refusal.
TEST_F(FalconSessionTest, a_force_is_refused_once_the_newest_answer_is_older_than_ten_milliseconds) {
  for (const char* fault : {"hang", "mute", "short 1000", "out hangs", "out fails"}) {
    SCOPED_TRACE(fault);
    begin();
    EXPECT_EQ(ticks_with(Status::ok, 10, {0, 0, 2}), 10);
    EXPECT_EQ(written, Status::ok);
    const std::int64_t answered_ns = state.sample_ns + kTick_ns;  // of the tick that is over
    if (fault == std::string("out hangs")) {
      usb->out_hangs = true;
    } else if (fault == std::string("out fails")) {
      usb->out_fails = 1000;
    } else {
      command(fault);
    }
    int taken_late = 0;
    for (int i = 0; i < 60; ++i) {
      const std::int64_t silent_ns = usb->now_ns() - answered_ns;
      (void)tick({0, 0, 2});
      if (silent_ns <= 9 * kTick_ns) {
        EXPECT_EQ(written, Status::ok) << i << ": a hiccup";
      }
      taken_late += silent_ns > 11 * kTick_ns && written != Status::no_data ? 1 : 0;
    }
    EXPECT_EQ(taken_late, 0);
    const bool zero_arrives = fault == std::string("mute") || fault == std::string("short 1000");
    EXPECT_EQ(pushes(), !zero_arrives);
  }
}

TEST_F(FalconSessionTest, a_force_is_taken_again_as_soon_as_it_answers) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  command("mute");
  (void)ticks_with(Status::ok, 30, {0, 0, 2});
  EXPECT_EQ(written, Status::no_data);
  command("speak");
  (void)ticks_with(Status::ok, 6, {0, 0, 2});
  EXPECT_EQ(written, Status::ok);
  EXPECT_TRUE(pushes());
}

// ---- a bad line ----

TEST_F(FalconSessionTest, a_mute_device_gives_no_data_and_is_asked_again) {
  begin();
  (void)ticks_with(Status::ok, 10);
  command("mute");
  EXPECT_LE(ticks_with(Status::ok, 20), 1);
  EXPECT_EQ(status, Status::no_data);
  EXPECT_GT(session->counts().unanswered, 3U);
  command("speak");
  EXPECT_GE(ticks_with(Status::ok, 20), 14);
  EXPECT_NE(session->report().find("without an answer"), std::string::npos);
}

TEST_F(FalconSessionTest, short_corrupt_and_damaged_frames_are_dropped_and_counted) {
  for (const char* fault : {"short 5", "corrupt 5", "line-error 5", "oversized 5", "long 5"}) {
    SCOPED_TRACE(fault);
    begin();
    (void)ticks_with(Status::ok, 10);
    grip_at({0.01, 0.01, 0.01});
    (void)ticks_with(Status::ok, 2);
    command(fault);
    for (int i = 0; i < 60; ++i) {
      (void)tick();
      EXPECT_TRUE(status == Status::ok || status == Status::no_data);
      EXPECT_LT((state.position_m - Vec3(0.01, 0.01, 0.01)).norm(), 1e-4) << "no wrong position";
    }
    EXPECT_EQ(ticks_with(Status::ok, 20), 20) << "it recovers";
    const auto& frames = session->frames();
    EXPECT_GE(
        frames.malformed + frames.line_errors + session->counts().oversized + session->counts().unanswered,
        5U);
    EXPECT_NE(session->report(), "");
  }
}

TEST_F(FalconSessionTest, a_frame_in_two_packets_is_a_frame) {
  begin();
  (void)ticks_with(Status::ok, 10);
  command("split 50");
  EXPECT_EQ(ticks_with(Status::ok, 50), 50);
  EXPECT_EQ(session->report(), "");
}

TEST_F(FalconSessionTest, a_packet_out_that_never_ends_stops_nothing_else) {
  begin();
  (void)ticks_with(Status::ok, 10);
  usb->out_hangs = true;
  EXPECT_LE(ticks_with(Status::ok, 50), 2);
  usb->out_hangs = false;
  EXPECT_GE(ticks_with(Status::ok, 20), 18);
}

TEST_F(FalconSessionTest, frozen_encoders_repeat_their_place_with_new_times) {
  begin();
  (void)ticks_with(Status::ok, 10);
  command("freeze");
  grip_at({0.03, 0, 0});
  EXPECT_EQ(ticks_with(Status::ok, 10), 10);
  EXPECT_LT(state.position_m.norm(), 1e-4);
}

TEST_F(FalconSessionTest, unplugged_it_is_disconnected_on_the_next_tick_and_stays_so) {
  begin();
  (void)ticks_with(Status::ok, 10, {0, 0, 2});
  usb->unplugged = true;
  (void)tick({0, 0, 2});
  EXPECT_EQ(tick({0, 0, 2}), Status::disconnected);
  EXPECT_EQ(written, Status::disconnected);
  EXPECT_FALSE(session->pass());
  EXPECT_TRUE(session->released()) << "nobody waits for a zero";
  usb->unplugged = false;
  EXPECT_EQ(ticks_with(Status::disconnected, 20, {0, 0, 2}), 20);
  EXPECT_NE(session->report().find("unplugged"), std::string::npos);
}

}  // namespace
}  // namespace punctum::falcon
