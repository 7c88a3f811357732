// The whole tick of the core on the simulated devices of a scene: what measure() runs in place of nothing.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "hal/sim/bench.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tools/core/assembly.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::jitter {

class ServoTick {
 public:
  // A built-in name or a path; at this rate, or at the scene's own. It injects cell after cell until the
  // measurement ends. The error is one line: a bad scene, or one with devices that are not simulated.
  [[nodiscard]] static tl::expected<std::unique_ptr<ServoTick>, std::string> of(
      const std::string& scene, std::optional<double> rate_Hz);
  ServoTick(const ServoTick&) = delete;
  ServoTick& operator=(const ServoTick&) = delete;

  [[nodiscard]] const tools::Scene& scene() const { return scene_; }
  [[nodiscard]] Work work();
  // After the measurement: what the ticks have done.
  [[nodiscard]] std::string did() const;

 private:
  explicit ServoTick(tools::Scene scene) : scene_(std::move(scene)) {}
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_release_ns, bool degraded);
  rt::After step_plant(const rt::Tick& tick) NONBLOCKING;
  rt::After tick_servo(const rt::Tick& tick) NONBLOCKING;
  void see(const std::stop_token& over);

  const tools::Scene scene_;
  rt::MonotonicClock clock_;
  rt::LocalStation station_;
  sim::Bench bench_;
  std::unique_ptr<tools::Assembly> assembly_;
  std::optional<rt::Servo> servo_;
  std::jthread vision_;  // ends first
};

}  // namespace punctum::jitter
