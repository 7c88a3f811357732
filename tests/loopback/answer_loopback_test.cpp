// From an input of the machine to its output through the loop of the core, behind real kernel drivers: a GPIO
// line to a GPIO line, the Falcon's encoders to its motors. And what the audit says of those drivers.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/falcon/falcon_handle.hpp"
#include "hal/falcon/libusb_link.hpp"
#include "hal/gpiod/lines.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/falcon_on_usb.hpp"
#include "tests/loopback/gpio_sim.hpp"
#include "tools/jitter/answer.hpp"
#include "tools/jitter/audit.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::loopback {
namespace {

using jitter::Result;

constexpr int kIn = 0, kOut = 1;

jitter::Wanted at_rate(double rate_Hz) {
  jitter::Wanted wanted;
  wanted.rate_Hz = rate_Hz;
  wanted.seconds = 3;
  return wanted;
}

// The wires of the simulated chip: the kernel's file in place of a voltage.
class SimulatedWires final : public jitter::Outside {
 public:
  explicit SimulatedWires(const GpioSim& board) : board_(board), seen_(board.value_file(kOut)) {}
  void ask(bool high) override { board_.drive(kIn, high); }
  std::optional<std::int64_t> answered_ns(bool high) override {
    return seen_.level() == high ? std::optional(clock_.now_ns()) : std::nullopt;
  }
  [[nodiscard]] std::string what() const override { return "GPIO edge in to edge out, wires of gpio-sim"; }

 private:
  const GpioSim& board_;
  emulator::WatchedLevel seen_;
  rt::MonotonicClock clock_;
};

Result gpio_answers(double rate_Hz) {
  const GpioSim board;
  const auto chip = gpiod::open_chip(board.path());
  EXPECT_TRUE(chip) << chip.error();
  const auto echo = jitter::GpioEcho::claim(**chip, kIn, kOut);
  EXPECT_TRUE(echo) << echo.error();
  SimulatedWires wires(board);
  auto result = jitter::measure_answers(at_rate(rate_Hz), (*echo)->work(), wires);
  EXPECT_TRUE(result) << result.error();
  std::printf("%s\n", jitter::summary(*result, 100).c_str());
  return std::move(*result);
}

// Asked at any moment of a period and answered by the next tick.
void expect_answer_by_the_next_tick(const Result& result) {
  const double period_us = 1e6 / result.rate_Hz;
  EXPECT_EQ(result.missed, 0U);
  EXPECT_EQ(result.unanswered, 0U);
  EXPECT_GE(result.answer.entries(), 400U);
  EXPECT_GT(result.answer_min_us, 0);
  EXPECT_LT(result.answer_min_us, 0.2 * period_us);
  EXPECT_NEAR(result.answer.quantile_us(0.5), 0.5 * period_us, 0.2 * period_us);
  EXPECT_LT(result.answer.max_us, period_us + 0.3 * period_us);
}

TEST(AnswerLoopback, goes_from_edge_to_edge_within_a_period_and_a_tick) {
  expect_answer_by_the_next_tick(gpio_answers(1000));
}

TEST(AnswerLoopback, comes_sooner_where_the_loop_is_faster) {
  expect_answer_by_the_next_tick(gpio_answers(4000));
}

// As on the command line: four lines, two of which are wires' ends; the wires are a thread that carries
// levels from line to line.
constexpr int kAsk = 2, kSeen = 3;

TEST(AnswerLoopback, goes_over_four_lines_of_a_chip) {
  const GpioSim board;
  std::jthread wires([&board](const std::stop_token& over) {
    const sched_param above_who_asks{.sched_priority = 2};
    EXPECT_EQ(pthread_setschedparam(pthread_self(), SCHED_FIFO, &above_who_asks), 0);
    emulator::WatchedLevel ask(board.value_file(kAsk)), out(board.value_file(kOut));
    bool at_in = false, at_seen = false;
    while (!over.stop_requested()) {
      if (ask.level() != at_in) {
        board.drive(kIn, at_in = !at_in);
      }
      if (out.level() != at_seen) {
        board.drive(kSeen, at_seen = !at_seen);
      }
      usleep(20);
    }
  });
  const auto result = jitter::measure_gpio_answers(
      at_rate(1000), fmt::format("{}:{},{},{},{}", board.path(), kIn, kOut, kAsk, kSeen));
  ASSERT_TRUE(result) << result.error();
  std::printf("%s\n", jitter::summary(*result, 100).c_str());
  expect_answer_by_the_next_tick(*result);
}

TEST(AnswerLoopback, comes_never_where_no_wire_is) {
  const GpioSim board;
  const auto result = jitter::measure_gpio_answers(
      at_rate(1000), fmt::format("{}:{},{},{},{}", board.path(), kIn, kOut, kAsk, kSeen));
  ASSERT_TRUE(result) << result.error();
  EXPECT_EQ(result->answer.entries(), 0U);
  EXPECT_GT(result->unanswered, 5U);
}

// The grip jumps from one side to the other; a spring of the loop pushes it back.
class JumpingGrip final : public jitter::Outside {
 public:
  explicit JumpingGrip(FalconOnUsb& usb) : usb_(usb) {}
  void ask(bool high) override {
    usb_.with([&](emulator::FalconEmulator&, WatchedHand& hand) {
      hand.at.position_m = {high ? kAside_m : -kAside_m, 0, 0.12};
    });
  }
  std::optional<std::int64_t> answered_ns(bool high) override {
    return usb_.with([&](emulator::FalconEmulator&, WatchedHand& hand) {
      const bool there = high ? hand.force[0] < -kSure_N : hand.force[0] > kSure_N;
      return there ? std::optional(hand.changed_ns) : std::nullopt;
    });
  }
  [[nodiscard]] std::int64_t wait_ns() const override { return 200'000; }
  [[nodiscard]] std::string what() const override {
    return "encoder to force, Falcon on the kernel's USB stack; device and its bus are emulated";
  }

 private:
  static constexpr double kAside_m = 0.005, kSure_N = 0.3;
  FalconOnUsb& usb_;
};

class Spring {
 public:
  explicit Spring(hal::HapticDevice& hand) : hand_(hand) {}
  rt::After tick(const rt::Tick&) noexcept {
    if (hand_.read(state_) == hal::Status::ok) {
      force_N_ = -kStiffness_N_m * state_.position_m;
    }
    (void)hand_.write_force(hal::Vec3(force_N_.x(), 0, 0));
    return rt::After::go_on;
  }

 private:
  static constexpr double kStiffness_N_m = 200;
  hal::HapticDevice& hand_;
  hal::HandState state_;
  hal::Vec3 force_N_ = hal::Vec3::Zero();
};

TEST(AnswerLoopback, goes_from_encoder_to_force_within_a_few_periods) {
  FalconOnUsb usb({.booted = true, .homed = true});
  rt::MonotonicClock clock;
  falcon::FalconHandle handle({}, falcon::ServoThread{80, -1}, clock, falcon::libusb_link(clock));
  tl::expected<void, std::string> opened = tl::unexpected(std::string{});
  for (int i = 0; i < 100 && !opened; ++i) {
    opened = handle.open();
    clock.sleep_until_ns(clock.now_ns() + 20'000'000);
  }
  ASSERT_TRUE(opened) << opened.error();
  Spring spring(handle);
  JumpingGrip grip(usb);
  const auto result = jitter::measure_answers(
      at_rate(1000),
      {.slots = {rt::slot<&Spring::tick>("spring", spring)},
       .start = [&](std::int64_t first_release_ns, bool) { return handle.start(first_release_ns); }},
      grip);
  handle.safe_state();
  handle.close();
  ASSERT_TRUE(result) << result.error();
  std::printf("%s\n", jitter::summary(*result, 100).c_str());
  EXPECT_EQ(result->missed, 0U);
  EXPECT_EQ(result->unanswered, 0U);
  EXPECT_GE(result->answer.entries(), 300U);
  EXPECT_GT(result->answer_min_us, 100) << "a frame of the device has to come and another one to go";
  EXPECT_LT(result->answer.max_us, 4000);
}

std::vector<jitter::Finding> audited(const GpioSim& board) {
  const auto scene = tools::load_scene("loopback", {"gpiod.chip=\"" + board.path() + "\""});
  EXPECT_TRUE(scene) << scene.error();
  return jitter::audit(0, 80, &*scene);
}

const jitter::Finding* named(const std::vector<jitter::Finding>& findings, const std::string& word) {
  const auto at = std::find_if(findings.begin(), findings.end(),
                               [&](const auto& f) { return f.name.find(word) != std::string::npos; });
  return at != findings.end() ? &*at : nullptr;
}

TEST(AuditLoopback, finds_the_interrupt_thread_of_the_can_card_too_low_and_what_mends_it_does) {
  const GpioSim board;
  {
    const auto before = audited(board);
    const jitter::Finding* stage = named(before, "cia402 can0");
    ASSERT_NE(stage, nullptr);
    EXPECT_NE(stage->remedy.find("again"), std::string::npos) << "the interface is down: " << stage->found;
    const jitter::Finding* handle = named(before, "falcon");
    ASSERT_NE(handle, nullptr);
    EXPECT_NE(handle->remedy, "") << "nothing is plugged in";
  }
  const FalconOnUsb usb({.booted = true, .homed = true});
  const CanInterface can("can0");
  rt::MonotonicClock clock;
  clock.sleep_until_ns(clock.now_ns() + 1'000'000'000);  // the kernel asks the Falcon what it is
  const auto findings = audited(board);
  std::printf("%s\n", jitter::audit_text(findings).c_str());
  const jitter::Finding* irq = named(findings, "can0");
  ASSERT_NE(irq, nullptr);
  EXPECT_EQ(irq->name.find("irq "), 0U) << irq->name;
  EXPECT_NE(irq->found.find("SCHED_FIFO 50"), std::string::npos) << irq->found;
  ASSERT_NE(irq->remedy.find("chrt -f -p 85"), std::string::npos) << irq->remedy;
  for (const char* known : {"falcon", "gpiod", "PREEMPT_RT"}) {
    const jitter::Finding* one = named(findings, known);
    ASSERT_NE(one, nullptr) << known;
    EXPECT_EQ(one->remedy, "") << known << ": " << one->found;
  }
  setenv("PATH", "/guest:/bin:/usr/bin", 1);
  ASSERT_EQ(std::system(irq->mend.command.c_str()), 0) << irq->mend.command;
  const auto mended = audited(board);
  const jitter::Finding* after = named(mended, "can0");
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->remedy, "") << after->found;
  EXPECT_NE(after->found.find("SCHED_FIFO 85"), std::string::npos) << after->found;
}

}  // namespace
}  // namespace punctum::loopback
