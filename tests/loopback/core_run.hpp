// The whole core on the simulated handle and real GPIO lines, tick by tick, with somebody outside who acts on
// the wires. The guest's time follows the instructions it executes (toolchain/rt-guest/run --deterministic),
// so ticks may be counted.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tests/loopback/beside.hpp"
#include "tests/loopback/gpiod_wiring.hpp"
#include "tools/core/assembly.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::loopback {

inline constexpr std::int64_t kPeriod_ns = 1'000'000;

// What one tick left.
struct Seen {
  std::uint64_t tick;
  std::int64_t wake_ns;
  rt::Fault fault;
  rt::StopStage stage;
  std::uint8_t contacts;  // TelemetrySample::estop
};

class CoreRun : public testing::Test {
 protected:
  // Scene `free` with its emergency stop on the chip, and what else is changed of it.
  explicit CoreRun(const std::function<void(tools::Scene&)>& change = [](tools::Scene&) {}) {
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
    change(scene);
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
    const std::vector<rt::Slot> slots = {rt::slot<&CoreRun::step_plant>("plant", *this),
                                         rt::slot<&CoreRun::tick_servo>("servo", *this)};
    rt::ExecutiveConfig config;
    config.start_ns = first_ns;
    rt::Executive executive(clock, clock, config, slots, station->core.status);
    run_beside(executive, outside);
  }
  void at(double t_ms) { clock.sleep_until_ns(first_ns + static_cast<std::int64_t>(t_ms * 1e6)); }

  rt::After step_plant(const rt::Tick& tick) noexcept {
    assembly->world()->step(tick.wake_ns);
    return rt::After::go_on;
  }
  rt::After tick_servo(const rt::Tick& tick) noexcept {
    servo->tick(tick.info());
    missed = tick.missed;
    seen.push_back({tick.index, tick.wake_ns, servo->fault(), servo->stop_stage(), servo->sample().estop});
    return tick.index >= last_tick ? rt::After::end : rt::After::go_on;
  }

  // The first tick from `from_ns` on whose latch is as asked for; the last one if there is none.
  [[nodiscard]] std::uint64_t first_tick(std::int64_t from_ns, bool stopped) const {
    for (const Seen& s : seen) {
      if (s.wake_ns >= from_ns && (s.stage != rt::StopStage::running) == stopped) {
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

}  // namespace punctum::loopback
