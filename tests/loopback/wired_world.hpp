// The simulated cell and operator behind emulated devices: the drives carry the needle, the operator's hand
// holds the handle. A station with real drivers finds one world behind its wires.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "hal/sim/bench.hpp"
#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "tools/emulators/drive/drive_bus.hpp"
#include "tools/emulators/falcon/falcon.hpp"

namespace punctum::loopback {

struct WorldEvent {
  std::int64_t t_ns;
  std::string what;
};

class WiredWorld {
 public:
  static constexpr int kAxes = 3;            // nodes 1, 2 and 3 carry the needle along x, y and z
  static constexpr double kCount_m = 40e-9;  // of each drive; all at zero: the needle is where it starts

  // The bench gets the exposures of the camera. May take a second: the cell's tables are solved.
  WiredWorld(const sim::SimConfig& config, sim::Bench* bench);

  void begin(std::int64_t now_ns) { world_.begin(now_ns); }
  // Up to now, with the needle where the drives are. Call it every millisecond, from the thread that serves
  // them.
  void step(emulator::DriveBus& drives, std::int64_t now_ns);
  // What the drives have become, from the same thread.
  void look_at(emulator::DriveBus& drives, std::int64_t now_ns);

  // The operator's hand on the grip, whose workspace is around grip_middle_m; from any thread.
  [[nodiscard]] emulator::Grip grip() const;
  void push_hand(const emulator::Triple& force_N, std::int64_t now_ns);  // from now on

  // From any thread.
  struct Now {
    sim::Truth truth;
    double force_N = 0, largest_force_N = 0;  // on the hand
    bool powered = false;                     // any drive
  };
  [[nodiscard]] Now now() const;
  [[nodiscard]] std::vector<WorldEvent> events() const;  // all so far, in order

 private:
  void note(std::int64_t now_ns, bool now, bool before, const char* what);

  sim::SimConfig config_;
  sim::World world_;
  hal::StageState needle_;
  std::array<emulator::DriveState, kAxes> drive_states_{};

  mutable std::mutex mutex_;  // of what follows
  Now now_;
  hal::Vec3 hand_m_ = hal::Vec3::Zero(), force_N_ = hal::Vec3::Zero();
  std::uint32_t buttons_ = 0;
  std::vector<WorldEvent> events_;
};

}  // namespace punctum::loopback
