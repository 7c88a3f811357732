#include "tools/report/tick_tape.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "rt/station/station.hpp"
#include "tools/shared/taped_devices.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum::report {
namespace {

using tools::TapedDevices;

constexpr std::uintmax_t kMostTicks = 1'000'000;  // of a tape: what is in memory at once

// The devices that a scene has, which only answer what was recorded. The injector obeys at once, since a
// scene may open the gate at other times than the recorded one.
rt::Devices devices_of(const tools::Scene& scene, TapedDevices& taped) {
  taped.injector.obeys = true;
  rt::Devices devices = taped.of(rt::InputSample::has_stage | rt::InputSample::has_estop);
  devices.injector = scene.servo.injector ? &taped.injector : nullptr;
  devices.vacuum = scene.servo.vacuum ? &taped.vacuum : nullptr;
  devices.force_sensor = scene.servo.force_sensor ? &taped.force_sensor : nullptr;
  return devices;
}

rt::TickInfo tick_info(const rt::InputSample& input, double period_s) {
  return {input.tick, input.release_ns, input.release_ns, period_s, 0};
}

std::int64_t nanoseconds(double s) { return std::llround(s * 1e9); }

struct OnItsWay {
  std::int64_t deliver_ns = 0;
  rt::Observation observation;
};

}  // namespace

// By name, and a call of its own: callgrind can write its counts after each tick.
[[gnu::noinline]] void replay_tick(rt::Servo& servo, const rt::TickInfo& now) {
  servo.tick(now);
  asm volatile("");
}

std::vector<TickTold> record_ticks(const tools::Scene& scene, double seconds) {
  if (!scene.sim) {
    throw std::runtime_error(scene.name + ": no device of it is simulated");
  }
  if (scene.recorded) {
    auto icsi = tools::load_scene("icsi");
    if (!icsi) {
      throw std::runtime_error(icsi.error());
    }
    icsi->sim->operator_params = scene.sim->operator_params;
    return record_ticks(*icsi, seconds);
  }
  const double period_s = 1 / scene.servo.rate_Hz;
  const std::int64_t period_ns = nanoseconds(period_s), start_ns = period_ns;
  sim::World world(*scene.sim, nullptr, start_ns);
  TapedDevices devices;
  const rt::Devices taped = devices.before({.hand = world.hand(),
                                            .stage = &world.stage(),
                                            .estop = &world.estop(),
                                            .injector = world.injector(),
                                            .vacuum = world.vacuum(),
                                            .force_sensor = world.force_sensor()});
  const auto station = std::make_unique<rt::LocalStation>();
  const auto servo = std::make_unique<rt::Servo>(scene.servo, taped, station->station);

  const bool seen = scene.vision && scene.simulated_camera();
  const std::int64_t frame_ns = seen ? nanoseconds(1 / scene.sim->microscope->fps) : 0;
  const std::int64_t latency_ns = seen ? nanoseconds(scene.sim->microscope->latency_s) : 0;
  std::int64_t next_frame_ns = start_ns;
  std::uint64_t frame = 0;
  std::deque<OnItsWay> on_its_way;
  std::optional<sim::Truth> before;

  const auto most = static_cast<std::size_t>(seconds * scene.servo.rate_Hz);
  std::vector<TickTold> tape;
  tape.reserve(most);
  while (tape.size() < most && !servo->finished()) {
    TickTold& told = tape.emplace_back();
    rt::InputSample& input = told.input;
    input.tick = input.number = tape.size() - 1;
    input.release_ns = input.start_ns = start_ns + static_cast<std::int64_t>(input.tick) * period_ns;
    devices.at(input);
    world.step(input.release_ns);
    if (frame_ns > 0 && input.release_ns >= next_frame_ns) {
      next_frame_ns += frame_ns;
      const sim::Truth truth = sim::truth_of(*scene.sim, world.snapshot());
      on_its_way.push_back(
          {input.release_ns + latency_ns, tools::observe_truth(truth, frame++, input.release_ns, before)});
      before = truth;
    }
    if (!on_its_way.empty() && on_its_way.front().deliver_ns <= input.release_ns) {
      told.observed = true;
      told.observation = on_its_way.front().observation;
      on_its_way.pop_front();
      station->observation.slot.push(told.observation);
    }
    servo->tick(tick_info(input, period_s));
  }
  return tape;
}

// tick: runs the servo for one.
template <class Tick>
rt::Fault play(const tools::Scene& scene, const std::vector<TickTold>& tape, Tick tick) {
  TapedDevices devices;
  const auto station = std::make_unique<rt::LocalStation>();
  const auto servo = std::make_unique<rt::Servo>(scene.servo, devices_of(scene, devices), station->station);
  for (TickTold told : tape) {
    devices.at(told.input);
    if (told.observed) {
      station->observation.slot.push(told.observation);
    }
    tick(*servo, tick_info(told.input, 1 / scene.servo.rate_Hz));
  }
  return servo->fault();
}

rt::Fault replay_ticks(const tools::Scene& scene, const std::vector<TickTold>& tape) {
  return play(scene, tape, replay_tick);
}

std::vector<std::int64_t> time_ticks(const tools::Scene& scene, const std::vector<TickTold>& tape) {
  std::vector<std::int64_t> took_ns;
  took_ns.reserve(tape.size());
  (void)play(scene, tape, [&](rt::Servo& servo, const rt::TickInfo& now) {
    const auto from = std::chrono::steady_clock::now();
    replay_tick(servo, now);
    took_ns.push_back(std::chrono::nanoseconds(std::chrono::steady_clock::now() - from).count());
  });
  return took_ns;
}

tl::expected<void, std::string> write_tape(const std::string& path, const std::vector<TickTold>& tape) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: cannot be written", path));
  }
  const bool all = std::fwrite(tape.data(), sizeof(TickTold), tape.size(), file) == tape.size();
  if (std::fclose(file) != 0 || !all) {
    return tl::unexpected(fmt::format("{}: cannot be written", path));
  }
  return {};
}

tl::expected<std::vector<TickTold>, std::string> read_tape(const std::string& path) {
  std::error_code ec;
  const std::uintmax_t bytes = std::filesystem::file_size(path, ec), ticks = bytes / sizeof(TickTold);
  if (ec || ticks == 0 || ticks > kMostTicks || bytes % sizeof(TickTold) != 0) {
    return tl::unexpected(fmt::format(
        "{}: no tape, allowed: what `punctum-tick-cost record` wrote, of 1 to {} ticks", path, kMostTicks));
  }
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: cannot be read", path));
  }
  std::vector<TickTold> tape(ticks);
  const bool all = std::fread(tape.data(), sizeof(TickTold), ticks, file) == ticks;
  (void)std::fclose(file);
  if (!all) {
    return tl::unexpected(fmt::format("{}: cannot be read", path));
  }
  return tape;
}

}  // namespace punctum::report
