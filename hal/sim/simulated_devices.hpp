// The simulated devices with their life: one plant serves them all. And what lets real devices stand beside
// them: a real handle or stage that reports its readings to the plant.
#pragma once

#include <optional>

#include "hal/device_life.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/plant/positioner.hpp"
#include "hal/sim/world.hpp"

namespace punctum::sim {

// Serves what `simulated` names. The plant's World exists from open() to close(); its owner steps it before
// every tick.
class SimulatedDevices final : public hal::Device {
 public:
  // bench may be null: nothing is published.
  SimulatedDevices(const SimConfig& config, const SimulatedParts& simulated, Bench* bench)
      : config_(config), simulated_(simulated), bench_(bench) {}

  [[nodiscard]] tl::expected<void, std::string> open() override;
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns) override;
  void safe_state() noexcept override;
  void close() noexcept override;

  [[nodiscard]] World* world() NONBLOCKING { return world_ ? &*world_ : nullptr; }

 private:
  SimConfig config_;
  SimulatedParts simulated_;
  Bench* bench_;
  std::optional<World> world_;
};

// The simulated positioner needs no plant.
class SimulatedPositioner final : public hal::Device {
 public:
  SimulatedPositioner(const PositionerParams& params, const hal::Clock& clock) : positioner_(params, clock) {}

  [[nodiscard]] tl::expected<void, std::string> open() override { return {}; }
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t) override { return {}; }
  void safe_state() noexcept override { positioner_.stop(); }
  void close() noexcept override {}

 private:
  SimPositioner positioner_;
};

// A real handle in a simulated world: the plant is told where it is and which buttons are pressed.
class FollowedHand final : public hal::HapticDevice {
 public:
  FollowedHand(hal::HapticDevice& real, World& world) NONBLOCKING : real_(real), world_(world) {}
  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING override;
  [[nodiscard]] hal::Status write_force(const Vec3& force_N) NONBLOCKING override {
    return real_.write_force(force_N);
  }

 private:
  hal::HapticDevice& real_;
  World& world_;
};

// A real stage in a simulated world: the plant is told where the needle is.
class FollowedStage final : public hal::Stage {
 public:
  FollowedStage(hal::Stage& real, World& world) NONBLOCKING : real_(real), world_(world) {}
  [[nodiscard]] hal::Status read(hal::StageState& out) NONBLOCKING override;
  [[nodiscard]] hal::Status command(const hal::StageCommand& set_point) NONBLOCKING override {
    return real_.command(set_point);
  }
  void quick_stop() NONBLOCKING override { real_.quick_stop(); }
  void enable(bool on) NONBLOCKING override { real_.enable(on); }

 private:
  hal::Stage& real_;
  World& world_;
};

}  // namespace punctum::sim
