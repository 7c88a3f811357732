// The Falcon through libusb, the kernel's USB stack and its virtual host controller, at 1 kHz, with an
// emulated device. The guest's time follows the instructions it executes (toolchain/rt-guest/run
// --deterministic), so ticks may be counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "hal/falcon/falcon_handle.hpp"
#include "hal/falcon/libusb_link.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/falcon_on_usb.hpp"
#include "tests/loopback/histogram.hpp"

namespace punctum::loopback {
namespace {

using emulator::FalconEmulator;
using falcon::FalconHandle;
using hal::Status;
using hal::Vec3;

constexpr const char* kFirmware = "/tmp/falcon.firmware";

// A boot stream of `words`, in two blocks.
void write_firmware(std::size_t words) {
  std::ofstream file(kFirmware, std::ios::binary);
  const auto word = [&file](unsigned value) {
    file.put(static_cast<char>(value & 0xFFU));
    file.put(static_cast<char>(value >> 8U & 0xFFU));
  };
  word(0x08AA);
  for (int i = 0; i < 8; ++i) {
    word(0);
  }
  word(0x3F);
  word(0x8000);
  for (const std::size_t size : {words / 2, words - words / 2}) {
    word(static_cast<unsigned>(size));
    word(0x3F);
    word(0x8000);
    for (std::size_t i = 0; i < size; ++i) {
      word(static_cast<unsigned>(i * 40503U));
    }
  }
  word(0);
}

void print(const char* what, std::vector<std::int64_t> ns) {
  std::sort(ns.begin(), ns.end());
  std::printf("%s: p50 %.0f us, largest %.0f us of %zu\n", what,
              1e-3 * static_cast<double>(ns[ns.size() / 2]), 1e-3 * static_cast<double>(ns.back()),
              ns.size());
}

class UsbLoopback : public testing::Test {
 protected:
  UsbLoopback() {
    const sched_param core{80};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &core);
  }
  ~UsbLoopback() override {
    if (handle) {
      handle->safe_state();
      handle->close();
    }
    const sched_param ordinary{0};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  }
  void plug_in(const emulator::FalconParams& params = {.booted = true, .homed = true}) {
    usb = std::make_unique<FalconOnUsb>(params);
    handle = std::make_unique<FalconHandle>(falcon::FalconParams{kFirmware, -1}, falcon::ServoThread{80, -1},
                                            clock, falcon::libusb_link(clock));
  }
  // The kernel asks the device what it is before a program may open it, and knows the one before it for a
  // while.
  void begin() {
    tl::expected<void, std::string> opened = tl::unexpected(std::string{});
    for (int i = 0; i < 100 && !opened; ++i) {
      opened = handle->open();
      clock.sleep_until_ns(clock.now_ns() + 20'000'000);
    }
    ASSERT_TRUE(opened) << opened.error();
    start();
  }
  void start() {
    next_ns = clock.now_ns() + 200'000'000;  // as the core gives its devices
    const auto started = handle->start(next_ns);
    ASSERT_TRUE(started) << started.error();
    ASSERT_LT(clock.now_ns(), next_ns) << "or the first ticks come in one burst";
  }
  Status tick(const Vec3& force_N = Vec3::Zero()) {
    clock.sleep_until_ns(next_ns);
    next_ns += 1'000'000;
    status = handle->read(state);
    written = handle->write_force(force_N);
    return status;
  }
  int ticks_with(Status wanted, int of, const Vec3& force_N = Vec3::Zero()) {
    int seen = 0;
    for (int i = 0; i < of; ++i) {
      seen += tick(force_N) == wanted ? 1 : 0;
    }
    return seen;
  }
  // Ticks until it holds, or -1.
  template <class Condition>
  int until(Condition holds, const Vec3& force_N = Vec3::Zero(), int at_most = 500) {
    for (int i = 1; i <= at_most; ++i) {
      (void)tick(force_N);
      if (holds()) {
        return i;
      }
    }
    return -1;
  }
  void grip_at(const Vec3& p) {
    usb->with([&](FalconEmulator&, WatchedHand& hand) { hand.at.position_m = {p.x(), p.y(), p.z() + 0.12}; });
  }
  Vec3 felt() {
    return usb->with([](FalconEmulator& falcon, WatchedHand&) {
      const emulator::Triple force_N = falcon.force_N();
      return Vec3(force_N[0], force_N[1], force_N[2]);
    });
  }
  void command(const char* line) {
    usb->with([line](FalconEmulator& falcon, WatchedHand&) { EXPECT_EQ(falcon.command(line), ""); });
  }

  rt::MonotonicClock clock;
  std::unique_ptr<FalconOnUsb> usb;
  std::unique_ptr<FalconHandle> handle;
  hal::HandState state;
  Status status = Status::no_data, written = Status::no_data;
  std::int64_t next_ns = 0;
};

TEST_F(UsbLoopback, without_a_falcon_one_line_says_so) {
  FalconHandle none({}, {}, clock, falcon::libusb_link(clock));
  const auto opened = none.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error(), "no Falcon (USB 0403:cb48) is plugged in: lsusb shows what is");
}

TEST_F(UsbLoopback, firmware_homing_and_two_seconds_at_1_kHz_without_a_tick_that_has_no_reading) {
  write_firmware(3000);
  plug_in({});
  while (!std::filesystem::exists("/sys/bus/usb/devices/1-1/1-1:1.0/bInterfaceNumber")) {
    clock.sleep_until_ns(clock.now_ns() + 20'000'000);
  }
  const std::int64_t begun_ns = clock.now_ns();
  const auto opened = handle->open();
  ASSERT_TRUE(opened) << opened.error();
  ASSERT_NO_FATAL_FAILURE(start());
  std::printf("booted with %zu words and homed after %.2f s\n",
              usb->with([](FalconEmulator& f, WatchedHand&) { return f.loaded_words(); }),
              1e-9 * static_cast<double>(clock.now_ns() - begun_ns));
  EXPECT_EQ(usb->with([](FalconEmulator& f, WatchedHand&) { return f.loaded_words(); }), 3000U);
  EXPECT_TRUE(handle->session().homed());
  (void)ticks_with(Status::ok, 20);
  int silent = 0;
  std::vector<std::int64_t> age_ns;
  for (int i = 0; i < 2000; ++i) {
    const double turn = 0.005 * i;
    grip_at({0.03 * std::cos(turn), 0.03 * std::sin(turn), 0.01 * std::sin(3 * turn)});
    silent += tick({0, 0, std::sin(turn)}) == Status::ok ? 0 : 1;
    age_ns.push_back(clock.now_ns() - state.sample_ns);
    const Vec3 was(0.03 * std::cos(turn - 0.005), 0.03 * std::sin(turn - 0.005),
                   0.01 * std::sin(3 * turn - 0.015));
    EXPECT_LT((state.position_m - was).norm(), 4e-4) << i;
  }
  EXPECT_EQ(silent, 0);
  print("age of a reading when the servo takes it", age_ns);
  handle->safe_state();
  EXPECT_EQ(felt(), Vec3::Zero());
  handle->close();
  handle.reset();
}

TEST_F(UsbLoopback, round_trips_of_force_and_of_encoders) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  (void)ticks_with(Status::ok, 20);
  std::vector<std::int64_t> force_ns, encoder_ns, round_ns;
  for (int i = 0; i < 500; ++i) {
    clock.sleep_until_ns(next_ns);
    next_ns += 1'000'000;
    (void)handle->read(state);
    const std::int64_t written_ns = clock.now_ns();
    (void)handle->write_force({0, 0, i % 2 == 0 ? 1.0 : -1.0});
    clock.sleep_until_ns(written_ns + 900'000);
    force_ns.push_back(usb->with([](FalconEmulator&, WatchedHand& h) { return h.changed_ns; }) - written_ns);
    hal::HandState answer;
    EXPECT_EQ(handle->read(answer), Status::ok);
    round_ns.push_back(answer.sample_ns - written_ns);
  }
  for (int i = 0; i < 500; ++i) {
    (void)tick();
    const std::int64_t asked_ns = usb->with([](FalconEmulator&, WatchedHand& h) { return h.asked_ns; });
    clock.sleep_until_ns(next_ns - 50'000);
    const hal::HandState before = state;
    const std::int64_t measured_ns = usb->with([](FalconEmulator&, WatchedHand& h) { return h.asked_ns; });
    EXPECT_GT(measured_ns, asked_ns);
    (void)handle->read(state);
    EXPECT_GT(state.sample_ns, before.sample_ns);
    encoder_ns.push_back(state.sample_ns - measured_ns);
  }
  print("USB, force written -> in the device", force_ns);
  print("USB, encoders measured -> reading", encoder_ns);
  print_histogram("USB, a force and the reading that answers it", round_ns, 20'000);
  for (const std::int64_t ns : round_ns) {
    EXPECT_GT(ns, 0) << "of this force, not of the one before";
    EXPECT_LT(ns, 900'000);
  }
  for (const std::int64_t ns : force_ns) {
    EXPECT_GT(ns, 0);
    EXPECT_LT(ns, 900'000) << "before the next tick";
  }
}

TEST_F(UsbLoopback, force_is_right_in_newtons_wherever_the_grip_is) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  double worst_N = 0;
  for (const Vec3& at :
       {Vec3(0, 0, 0), Vec3(0.03, 0.02, -0.02), Vec3(-0.04, 0.01, 0.02), Vec3(0, -0.04, 0.01)}) {
    grip_at(at);
    for (const Vec3& force_N : {Vec3(2, 0, 0), Vec3(0, -2, 0), Vec3(0, 0, 4), Vec3(1, 1, -1)}) {
      (void)ticks_with(Status::ok, 5, force_N);
      clock.sleep_until_ns(next_ns - 100'000);
      worst_N = std::max(worst_N, (felt() - force_N).norm());
    }
  }
  std::printf("largest error of a force: %.4f N\n", worst_N);
  EXPECT_LT(worst_N, 0.02);
}

TEST_F(UsbLoopback, each_button_is_pressed_and_let_go) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  for (const std::uint8_t pressed : std::array<std::uint8_t, 6>{1, 2, 4, 8, 5, 0}) {
    usb->with([&](FalconEmulator&, WatchedHand& hand) { hand.at.buttons = pressed; });
    (void)ticks_with(Status::ok, 5);
    EXPECT_EQ(state.buttons, pressed);
  }
}

TEST_F(UsbLoopback, frames_that_are_short_corrupt_or_do_not_fit_cost_ticks_and_nothing_else) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  (void)ticks_with(Status::ok, 20);
  for (const char* fault : {"short 5", "corrupt 5", "oversized 5", "long 5", "line-error 5", "split 5"}) {
    command(fault);
    for (int i = 0; i < 60; ++i) {
      (void)tick();
      EXPECT_TRUE(status == Status::ok || status == Status::no_data) << fault;
      EXPECT_LT(state.position_m.norm(), 1e-4) << fault << ": no wrong position";
    }
    EXPECT_EQ(ticks_with(Status::ok, 20), 20) << fault << ": it recovers";
  }
  usb->unplug();
  (void)until([&] { return status == Status::disconnected; });
  handle->safe_state();
  EXPECT_GT(handle->session().frames().malformed, 10U);
  EXPECT_GE(handle->session().counts().oversized, 5U);
  EXPECT_GE(handle->session().frames().line_errors, 5U);
}

TEST_F(UsbLoopback,
       unplugged_in_the_middle_it_is_disconnected_within_ticks_and_a_deliberate_opening_brings_it_back) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  (void)ticks_with(Status::ok, 20, {0, 0, 2});
  usb->unplug();
  int readings = 0;
  const auto gone = [&] {
    readings += status == Status::ok ? 1 : 0;
    return status == Status::disconnected;
  };
  const int lost = until(gone, {0, 0, 2});
  std::printf("unplugged: disconnected after %d ticks\n", lost);
  EXPECT_GT(lost, 0);
  EXPECT_LE(readings, 2) << "a hand that is silent for 20 ticks is lost, whenever the kernel says so";
  EXPECT_LE(lost, 100);
  EXPECT_EQ(written, Status::disconnected);
  usb->plug_in();
  EXPECT_EQ(ticks_with(Status::disconnected, 200, {0, 0, 2}), 200) << "not by itself";
  EXPECT_EQ(felt(), Vec3::Zero());
  handle->safe_state();
  handle->close();
  ASSERT_NO_FATAL_FAILURE(begin());
  (void)ticks_with(Status::ok, 20);
  EXPECT_EQ(felt(), Vec3::Zero()) << "the old force is forgotten";
  EXPECT_EQ(ticks_with(Status::ok, 100, {0, 0, 2}), 100);
  EXPECT_NEAR(felt().z(), 2, 0.02);
}

TEST_F(UsbLoopback, a_falcon_that_another_program_holds_is_refused_until_it_is_closed_there) {
  plug_in();
  ASSERT_NO_FATAL_FAILURE(begin());
  FalconHandle other({}, {}, clock, falcon::libusb_link(clock));
  const auto opened = other.open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().find("another program"), std::string::npos) << opened.error();
  handle->safe_state();
  handle->close();
  const auto now = other.open();
  EXPECT_TRUE(now) << now.error();
  other.close();
}

}  // namespace
}  // namespace punctum::loopback
