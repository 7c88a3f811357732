// The simulated cell and operator behind emulated devices: the drives carry the needle, the operator's hand
// holds the handle. A station with real drivers finds one world behind its wires.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "hal/sim/bench.hpp"
#include "hal/sim/world.hpp"
#include "tools/emulators/drive/drive_bus.hpp"

namespace punctum::loopback {

// What happened, for whoever looks on.
struct WorldEvent {
  std::int64_t t_ns;
  std::string what;
};

// How it stands.
struct WorldSummary {
  bool contact = false, zona_punctured = false, punctured = false;
  bool cell_held = true, cell_lost = false;
  double deepest_m = 0;        // of the tip past the cell's outer face
  double depth_m = 0;          // now; < 0 outside
  double moved_m = 0;          // way of the tip
  double largest_force_N = 0;  // on the hand
  double force_N = 0;          // now
};

class WiredWorld {
 public:
  static constexpr int kAxes = 3;            // nodes 1, 2 and 3 carry the needle along x, y and z
  static constexpr double kCount_m = 40e-9;  // of each drive; all at zero: the needle is where it starts

  // The bench gets the exposures of the camera. May take a second: the cell's tables are solved.
  WiredWorld(const sim::SimConfig& config, sim::Bench* bench);

  void begin(std::int64_t now_ns);
  // Up to now, with the needle where the drives are. Call it every millisecond, from the thread that serves
  // them.
  void step(emulator::DriveBus& drives, std::int64_t now_ns);

  // The operator's hand, from any thread.
  [[nodiscard]] hal::Vec3 hand_m() const;
  [[nodiscard]] std::uint32_t buttons() const;
  void push_hand(const hal::Vec3& force_N);  // from now on

  [[nodiscard]] WorldSummary summary() const;
  [[nodiscard]] std::vector<WorldEvent> take_events();

 private:
  void look(const emulator::DriveBus& drives, std::int64_t now_ns);
  void note(std::int64_t now_ns, bool now, bool& before, const char* what);

  sim::SimConfig config_;
  sim::World world_;
  hal::StageState needle_;
  std::array<DriveState, kAxes> drive_states_{};

  mutable std::mutex mutex_;  // of what follows
  hal::Vec3 hand_m_ = hal::Vec3::Zero(), force_N_ = hal::Vec3::Zero();
  std::uint32_t buttons_ = 0;
  WorldSummary summary_;
  std::vector<WorldEvent> events_;
};

}  // namespace punctum::loopback
