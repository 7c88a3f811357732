#include "tools/jitter/servo_tick.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <string_view>
#include <vector>

#include "hal/sim/truth.hpp"
#include "tools/jitter/ordinary_thread.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum::jitter {

tl::expected<std::unique_ptr<ServoTick>, std::string> ServoTick::of(const std::string& name,
                                                                    std::optional<double> rate_Hz) {
  std::vector<std::string> overrides;
  if (rate_Hz) {
    overrides.push_back(fmt::format("servo.rate_hz={}", *rate_Hz));
  }
  auto scene = tools::load_scene(name, overrides);
  if (!scene) {
    return tl::unexpected(tools::said_of_option(scene.error(), "servo.rate_hz", "--rate"));
  }
  if (!scene->sim || tools::any_real(scene->devices)) {
    return tl::unexpected(fmt::format(
        "--tick servo {}: it has devices that are not simulated, which a measurement must not move; allowed: "
        "a scene whose devices are all simulated (a running core: --attach)",
        name));
  }
  scene->seconds = 0;
  if (scene->has_task()) {
    scene->servo.cells = scene->sim->cells = 1'000'000;
  }
  std::unique_ptr<ServoTick> tick(new ServoTick(std::move(*scene)));
  auto assembly = tools::Assembly::open({tick->scene_, tick->clock_, &tick->bench_});
  if (!assembly) {
    return tl::unexpected(assembly.error());
  }
  tick->assembly_ = std::move(*assembly);
  return tick;
}

Work ServoTick::work() {
  return {.slots = {rt::slot<&ServoTick::step_plant>("plant", *this),
                    rt::slot<&ServoTick::tick_servo>("servo", *this)},
          .start = [this](std::int64_t first_release_ns, bool degraded) {
            return start(first_release_ns, degraded);
          }};
}

tl::expected<void, std::string> ServoTick::start(std::int64_t first_release_ns, bool degraded) {
  if (auto started = assembly_->start(first_release_ns); !started) {
    return started;
  }
  if (!scene_.vision) {
    station_.station.observation = nullptr;
  }
  servo_.emplace(scene_.servo, assembly_->devices(), station_.station, degraded);
  if (scene_.vision) {
    vision_ = ordinary_thread([this](const std::stop_token& over) { see(over); });
  }
  return {};
}

rt::After ServoTick::step_plant(const rt::Tick& tick) NONBLOCKING {
  assembly_->world()->step(tick.wake_ns);
  return rt::After::go_on;
}

rt::After ServoTick::tick_servo(const rt::Tick& tick) NONBLOCKING {
  servo_->tick(tick.info());
  return rt::After::go_on;
}

// What the vision program would tell, as late as it would.
void ServoTick::see(const std::stop_token& over) {
  constexpr std::chrono::milliseconds kLookAgain(1);
  const auto latency_ns = static_cast<std::int64_t>(
      1e9 * (scene_.sim->microscope ? scene_.sim->microscope->latency_s : sim::MicroscopeParams{}.latency_s));
  hal::Follower<decltype(bench_.exposures)> exposures(bench_.exposures);
  std::optional<sim::Truth> before;
  sim::Exposure seen;
  while (!over.stop_requested()) {
    if (exposures.next(seen) != hal::Read::ok) {
      std::this_thread::sleep_for(kLookAgain);
      continue;
    }
    while (!over.stop_requested() && clock_.now_ns() < seen.exposure_ns + latency_ns) {
      std::this_thread::sleep_for(kLookAgain);
    }
    const sim::Truth truth = sim::truth_of(*scene_.sim, seen.world);
    station_.observation.slot.push(tools::observe_truth(truth, seen.frame, seen.exposure_ns, before));
    before = truth;
  }
}

std::string ServoTick::did() const {
  std::string out = "the servo tick of " + scene_.name;
  if (servo_ && scene_.has_task()) {
    out += fmt::format(", {} cell{} injected", servo_->cells_done(), servo_->cells_done() == 1 ? "" : "s");
  }
  if (servo_ && servo_->fault() != rt::Fault::none) {
    out += fmt::format(", stopped by the fault {}", rt::name(servo_->fault()));
  }
  return out;
}

}  // namespace punctum::jitter
