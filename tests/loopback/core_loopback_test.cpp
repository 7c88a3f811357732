// The whole core at 1 kHz, on the simulated handle and stage and a real GPIO chip. The guest's time follows
// the instructions it executes (toolchain/rt-guest/run --deterministic), so ticks may be counted.
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tests/loopback/gpiod_wiring.hpp"
#include "tools/core/assembly.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::loopback {
namespace {

using rt::Fault;
using rt::StopStage;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr int kCorePriority = 80, kOutsidePriority = 90;

void become(int priority) {
  const sched_param param{priority};
  ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_FIFO, &param), 0);
}

// What one tick left.
struct Seen {
  std::uint64_t tick;
  std::int64_t wake_ns;
  Fault fault;
  StopStage stage;
  std::uint8_t contacts;  // TelemetrySample::estop
};

class CoreLoopback : public testing::Test {
 protected:
  CoreLoopback() {
    const std::vector<std::pair<const char*, std::string>> keys = {{"chip", "\"" + board->path() + "\""},
                                                                   {"contact_a", "0"},
                                                                   {"contact_b", "1"},
                                                                   {"reset", "2"},
                                                                   {"heartbeat", "3"}};
    std::vector<std::string> overrides = {"estop.device=gpiod", "gpiod=on"};
    for (const auto& [key, value] : keys) {
      overrides.push_back(std::string("gpiod.") + key + "=" + value);
    }
    auto loaded = tools::load_scene("free", overrides);
    EXPECT_TRUE(loaded) << loaded.error();
    scene = std::move(*loaded);
    auto opened = tools::Assembly::open({scene, clock, nullptr});
    EXPECT_TRUE(opened) << opened.error();
    assembly = std::move(*opened);
    board->drive(kContactA, true);
    board->drive(kContactB, true);
  }

  // Runs so many ticks; meanwhile `outside` acts on the wires, on a thread of its own that waits for the
  // times it is given (from the release of the first tick on).
  void run(std::uint64_t ticks, const std::function<void()>& outside) {
    last_tick = ticks - 1;
    seen.reserve(ticks);
    first_ns = clock.now_ns() + 20 * kPeriod_ns;
    ASSERT_TRUE(assembly->start(first_ns));
    servo = std::make_unique<rt::Servo>(scene.servo, assembly->devices(), station->station);
    const std::vector<rt::Slot> slots = {rt::slot<&CoreLoopback::step_plant>("plant", *this),
                                         rt::slot<&CoreLoopback::tick_servo>("servo", *this)};
    rt::ExecutiveConfig config;
    config.start_ns = first_ns;
    rt::Executive executive(clock, clock, config, slots, station->core.status);
    std::thread wires([&] {
      become(kOutsidePriority);
      outside();
    });
    become(kCorePriority);
    std::atomic<bool> stop{false};
    EXPECT_EQ(executive.run(stop), rt::Executive::Ended::by_slot);
    const sched_param ordinary{0};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
    wires.join();
  }
  void at(double t_ms) { clock.sleep_until_ns(first_ns + static_cast<std::int64_t>(t_ms * 1e6)); }

  rt::After step_plant(const rt::Tick& tick) noexcept {
    assembly->world()->step(tick.wake_ns);
    return rt::After::go_on;
  }
  rt::After tick_servo(const rt::Tick& tick) noexcept {
    rt::TickInfo now;
    now.tick = tick.index;
    now.release_ns = tick.release_ns;
    now.start_ns = tick.wake_ns;
    now.period_s = static_cast<double>(tick.period_ns) * 1e-9;
    now.missed_in_window = tick.missed_in_window;
    servo->tick(now);
    missed = tick.missed;
    seen.push_back({tick.index, tick.wake_ns, servo->fault(), servo->stop_stage(), servo->sample().estop});
    return tick.index >= last_tick ? rt::After::end : rt::After::go_on;
  }

  // The first tick from `from_ns` on whose latch is as asked for; the last one if there is none.
  [[nodiscard]] std::uint64_t first_tick(std::int64_t from_ns, bool stopped) const {
    for (const Seen& s : seen) {
      if (s.wake_ns >= from_ns && (s.stage != StopStage::running) == stopped) {
        return s.tick;
      }
    }
    return last_tick;
  }
  [[nodiscard]] const Seen& at_ms(double t_ms) const { return seen.at(static_cast<std::size_t>(t_ms)); }
  // Ticks from a moment to the one that stops: 1 is the very next one.
  [[nodiscard]] std::uint64_t ticks_to_stop(std::int64_t from_ns) const {
    const auto before = static_cast<std::uint64_t>((from_ns - first_ns) / kPeriod_ns);
    return first_tick(from_ns, true) - before;
  }
  void press_reset(double from_ms, double to_ms) {
    at(from_ms);
    board->drive(kReset, true);
    at(to_ms);
    board->drive(kReset, false);
  }

  rt::MonotonicClock clock;
  std::unique_ptr<GpioSim> board = std::make_unique<GpioSim>();
  tools::Scene scene;
  std::unique_ptr<tools::Assembly> assembly;
  std::unique_ptr<rt::LocalStation> station = std::make_unique<rt::LocalStation>();
  std::unique_ptr<rt::Servo> servo;
  std::vector<Seen> seen;
  std::int64_t first_ns = 0;
  std::uint64_t last_tick = 0, missed = 0;
};

TEST_F(CoreLoopback, misses_no_tick_and_beats_on_each) {
  int same = 0, samples = 0;
  run(1000, [&] {
    bool before = false;
    for (int i = 0; i < 500; ++i) {
      at(100.9 + i);
      const bool level = board->level(kHeartbeat);
      same += i > 0 && level == before ? 1 : 0;
      before = level;
      ++samples;
    }
  });
  EXPECT_EQ(missed, 0U);
  ASSERT_EQ(seen.size(), 1000U);
  EXPECT_EQ(seen.back().fault, Fault::none);
  EXPECT_EQ(samples, 500);
  EXPECT_EQ(same, 0);
}

TEST_F(CoreLoopback, stops_within_two_ticks_of_an_opened_contact_wherever_in_the_tick_it_opens) {
  const std::vector<double> openings_ms = {50.02, 250.15, 450.5, 650.85, 850.98};
  std::vector<std::int64_t> opened_ns;
  run(1050, [&] {
    int turn = 0;
    for (const double t_ms : openings_ms) {
      const int contact = turn++ % 2 == 0 ? kContactA : kContactB;
      at(t_ms);
      board->drive(contact, false);
      opened_ns.push_back(clock.now_ns());
      at(t_ms + 20);
      board->drive(contact, true);
      press_reset(t_ms + 60, t_ms + 120);
    }
  });
  ASSERT_EQ(opened_ns.size(), openings_ms.size());
  for (std::size_t i = 0; i < opened_ns.size(); ++i) {
    EXPECT_EQ(at_ms(openings_ms[i] - 5).stage, StopStage::running) << i;
    EXPECT_LE(ticks_to_stop(opened_ns[i]), 2U) << i;
    EXPECT_EQ(at_ms(openings_ms[i] + 5).fault, Fault::estop) << i;
  }
  EXPECT_EQ(missed, 0U);
}

TEST_F(CoreLoopback, stops_for_a_pulse_that_no_tick_sees_as_a_level) {
  std::int64_t pulse_ns = 0;
  run(150, [&] {
    at(50.6);
    board->drive(kContactA, false);
    board->drive(kContactA, true);
    pulse_ns = clock.now_ns();
  });
  for (const Seen& s : seen) {
    EXPECT_EQ(s.contacts & 3, 0) << s.tick;
  }
  EXPECT_LE(ticks_to_stop(pulse_ns), 2U);
  EXPECT_EQ(seen.back().fault, Fault::estop);
  EXPECT_NE(seen.back().stage, StopStage::running);
}

TEST_F(CoreLoopback, goes_on_only_after_contacts_are_closed_and_reset_is_pressed) {
  run(800, [&] {
    at(50);
    board->drive(kContactA, false);
    board->drive(kContactB, false);
    press_reset(150, 250);  // while the contacts are open
    at(300);
    board->drive(kContactA, true);
    board->drive(kContactB, true);
    press_reset(450.3, 455.3);  // too short for a finger
    press_reset(600, 700);
  });
  EXPECT_EQ(at_ms(260).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(440).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(590).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(799).stage, StopStage::running);
  EXPECT_EQ(at_ms(799).fault, Fault::none);
  EXPECT_EQ(missed, 0U);
}

TEST_F(CoreLoopback, is_not_reset_while_one_contact_has_not_shown_that_it_opens) {
  run(900, [&] {
    at(50);
    board->drive(kContactB, false);  // contact a is welded
    at(150);
    board->drive(kContactB, true);
    press_reset(250, 350);
    at(450);
    board->drive(kContactA, false);
    board->drive(kContactB, false);
    at(500);
    board->drive(kContactA, true);
    board->drive(kContactB, true);
    press_reset(600, 700);
  });
  EXPECT_EQ(at_ms(60).stage == StopStage::running, false);
  EXPECT_EQ(at_ms(440).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(899).stage, StopStage::running);
}

TEST_F(CoreLoopback, stops_within_two_ticks_of_a_chip_that_is_gone_and_stays_stopped) {
  std::int64_t gone_ns = 0;
  run(700, [&] {
    at(50.4);
    board->unplug();
    gone_ns = clock.now_ns();
  });
  EXPECT_LE(ticks_to_stop(gone_ns), 2U);
  EXPECT_EQ(at_ms(50).fault, Fault::none);
  EXPECT_EQ(seen.back().fault, Fault::estop_lost);
  EXPECT_EQ(seen.back().stage, StopStage::stopped);
}

}  // namespace
}  // namespace punctum::loopback
