// The simulated cell and operator behind emulated devices: the drives carry the needle, the operator's hand
// holds the handle. A station with real drivers finds one world behind its wires.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/bench.hpp"
#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "tools/emulators/drive/drive_bus.hpp"
#include "tools/emulators/falcon/falcon.hpp"

namespace punctum::emulator {

struct WorldEvent {
  std::int64_t t_ns;
  std::string what;
};

class WiredWorld {
 public:
  static constexpr int kAxes = 3;            // the first three drives carry the needle along x, y and z
  static constexpr double kCount_m = 40e-9;  // of each drive; all at zero: the needle is where it starts

  // The bench gets the exposures of the camera. May take a second: the cell's tables are solved.
  WiredWorld(const sim::SimConfig& config, sim::Bench* bench);

  void begin(std::int64_t now_ns) { world_.begin(now_ns); }
  // Up to now, with the needle where the drives are. Call it every millisecond, from the thread that serves
  // them.
  void step(DriveBus& drives, std::int64_t now_ns);
  // What the drives have become, from the same thread.
  void look_at(DriveBus& drives, std::int64_t now_ns);

  // The operator's hand on the grip, whose workspace is around grip_middle_m; from any thread.
  [[nodiscard]] Grip grip() const;
  void push_hand(const Triple& force_N, std::int64_t now_ns);  // from now on

  // From any thread.
  struct Now {
    sim::Truth truth;
    double force_N = 0, largest_force_N = 0;  // on the hand
    bool powered = false;                     // any drive
  };
  [[nodiscard]] Now now() const;
  void tell(std::int64_t now_ns, std::string what);  // of what else belongs to this world
  // So far, as they were told: that the handle is without force when that has lasted, with its beginning.
  [[nodiscard]] std::vector<WorldEvent> events(std::size_t from = 0) const;

 private:
  void note(std::int64_t now_ns, bool now, bool before, const char* what);

  sim::SimConfig config_;
  sim::World world_;
  hal::StageState needle_;
  std::array<std::optional<DriveState>, kAxes> drive_states_;  // as told last

  mutable std::mutex mutex_;  // of what follows
  Now now_;
  hal::Vec3 hand_m_ = hal::Vec3::Zero(), force_N_ = hal::Vec3::Zero();
  std::uint32_t buttons_ = 0;
  std::int64_t no_force_since_ns_ = -1;  // not told yet
  std::vector<WorldEvent> events_;
};

// The operator's hand on the grip of an emulated handle.
class HandOnGrip final : public Hand {
 public:
  explicit HandOnGrip(WiredWorld& world) : world_(world) {}
  Grip grip(std::int64_t /*now_ns*/) override { return world_.grip(); }
  void push(const Triple& force_N, std::int64_t now_ns) override {
    world_.push_hand(amplifier_on_ ? force_N : Triple{}, now_ns);
  }
  // Off: the hand is without force at once. On: it is until the next frame.
  void power(bool on, std::int64_t now_ns) {
    amplifier_on_ = on;
    if (!on) {
      world_.push_hand({}, now_ns);
    }
  }

 private:
  WiredWorld& world_;
  bool amplifier_on_ = true;
};

}  // namespace punctum::emulator
