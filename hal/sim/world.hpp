// The plant: everything simulated, stepped by one owner once per tick.
//
//   World world(config, &bench, start_ns);
//   each tick:  world.step(now_ns);  servo: read devices ... write devices
//
// step() advances exactly to now_ns with what was written last held over the interval (zero-order hold),
// publishes a Snapshot, and an Exposure at the first tick of each frame's time. After construction nothing
// here allocates, throws or makes a system call.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/cell.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/estop.hpp"
#include "hal/sim/force_sensor.hpp"
#include "hal/sim/hand.hpp"
#include "hal/sim/injector.hpp"
#include "hal/sim/operator.hpp"
#include "hal/sim/stage.hpp"
#include "hal/sim/vacuum.hpp"

namespace punctum::sim {

class World {
 public:
  // bench may be null: nothing is published. May take a second or so: the membrane is solved and tabled here.
  World(const SimConfig& config, Bench* bench, std::int64_t start_ns);
  ~World();  // tells everybody on the bench that the plant has stopped
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void step(std::int64_t to_ns) noexcept;

  [[nodiscard]] SimHand& hand() noexcept { return hand_; }
  [[nodiscard]] SimStage& stage() noexcept { return stage_; }
  [[nodiscard]] SimEstop& estop() noexcept { return estop_; }
  // Null when the scene has none.
  [[nodiscard]] SimInjector* injector() noexcept { return injector_ ? &*injector_ : nullptr; }
  [[nodiscard]] SimVacuum* vacuum() noexcept { return vacuum_ ? &*vacuum_ : nullptr; }
  [[nodiscard]] SimForceSensor* force_sensor() noexcept { return force_sensor_ ? &*force_sensor_ : nullptr; }

  [[nodiscard]] const Snapshot& snapshot() const noexcept { return snapshot_; }  // of the last step

  // Goes on from a snapshot as if it had never stopped (inputs as they were written before that tick). The
  // readings that failing devices repeat or delay start afresh.
  void restore(const Snapshot& from) noexcept;

 private:
  static constexpr std::int64_t kPiece_ns = 1'000'000;  // longest piece the plant is stepped by
  static constexpr std::int64_t kMostPieces = 2000;     // per step

  void step_piece(std::int64_t to_ns) noexcept;
  void put_next_cell(bool button) noexcept;
  void touch(const StagePlantState& before, double dt_s) noexcept;
  [[nodiscard]] PersonView view() const noexcept;
  void take_snapshot() noexcept;
  void expose() noexcept;
  [[nodiscard]] double seconds(std::int64_t t_ns) const noexcept;

  SimConfig config_;
  Bench* bench_;
  std::int64_t start_ns_;
  std::int64_t t_ns_;
  std::uint64_t next_frame_ = 0;
  Person person_;
  SimHand hand_;
  SimStage stage_;
  SimEstop estop_;
  std::optional<Cell> cell_;
  std::optional<SimInjector> injector_;
  std::optional<SimVacuum> vacuum_;
  std::optional<SimForceSensor> force_sensor_;
  Snapshot snapshot_;  // cell, cell_reading and what counts live here; the rest is copied in after a step
  Exposure exposure_;
};

// What the plant came to after the core had died at `last`: nobody reads or writes any more.
struct UnattendedEnd {
  bool safe = false;           // relay open, stage at rest, gate shut, no force on the hand, vacuum kept
  double relay_opened_s = -1;  // after the core's last tick; -1 = not
  double stage_at_rest_s = -1;
  double gate_shut_s = -1;
  double hand_force_off_s = -1;
  double stage_moved_m = 0;  // from the last tick to rest
  bool vacuum_kept = true;
  bool cell_held = true;
  Snapshot last;
};

// Continues the plant from the bench's newest snapshot for for_s in steps of 1 ms, publishing to the bench.
// Only when the process that stepped it is dead. Allocates.
[[nodiscard]] UnattendedEnd run_unattended(const SimConfig& config, Bench& bench, double for_s = 1.0);
[[nodiscard]] UnattendedEnd run_unattended(const SimConfig& config, const Snapshot& from, Bench* bench,
                                           double for_s = 1.0);

}  // namespace punctum::sim
