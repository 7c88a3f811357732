// The plant: everything simulated, stepped by one owner once per tick.
//
//   World world(config, &bench, start_ns);
//   each tick:  world.step(now_ns);  servo: read devices ... write devices
//
// step() advances exactly to now_ns with what was written last held over the interval (zero-order hold),
// publishes a Snapshot, and an Exposure at the first tick of each frame's time. After construction nothing
// here allocates, throws or makes a system call.
//
// Some devices may be real (SimulatedParts): their part of the plant is not stepped. A real handle and a real
// stage stand where they were last read (follow_hand, follow_stage).
#pragma once

#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/operator/operator.hpp"
#include "hal/sim/plant/cell.hpp"
#include "hal/sim/plant/estop.hpp"
#include "hal/sim/plant/force_sensor.hpp"
#include "hal/sim/plant/hand.hpp"
#include "hal/sim/plant/injector.hpp"
#include "hal/sim/plant/stage.hpp"
#include "hal/sim/plant/vacuum.hpp"

namespace punctum::sim {

// Which devices are simulated; the others are real or absent.
struct SimulatedParts {
  bool hand = true;   // with the operator and the arm
  bool stage = true;  // real: the cell is untouched until the stage was read
  bool estop = true;  // with the relay; real: the simulated drives have power
  bool injector = true;
  bool vacuum = true;  // real: the simulated cell is held by its nominal vacuum
  bool force_sensor = true;
};

class World {
 public:
  // bench may be null: nothing is published. May take a second or so: the membrane is solved and tabled here.
  World(const SimConfig& config, Bench* bench, const SimulatedParts& simulated = {});
  World(const SimConfig& config, Bench* bench, std::int64_t start_ns) : World(config, bench) {
    begin(start_ns);
  }
  ~World();  // tells everybody on the bench that the plant has stopped
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // Once, before the first step: the plant's time starts here and every device has a first reading.
  void begin(std::int64_t start_ns) NONBLOCKING;
  void step(std::int64_t to_ns) NONBLOCKING;

  // The newest reading of a real handle or stage, at any time.
  void follow_hand(const hal::HandState& real) NONBLOCKING { real_hand_ = real; }
  void follow_stage(const hal::StageState& real) NONBLOCKING { real_stage_ = real; }

  // A part that is not simulated must not be handed out as a device.
  [[nodiscard]] SimHand& hand() NONBLOCKING { return hand_; }
  [[nodiscard]] SimStage& stage() NONBLOCKING { return stage_; }
  [[nodiscard]] SimEstop& estop() NONBLOCKING { return estop_; }
  // Null where the scene has none, or a real one.
  [[nodiscard]] SimInjector* injector() NONBLOCKING { return injector_ ? &*injector_ : nullptr; }
  [[nodiscard]] SimVacuum* vacuum() NONBLOCKING { return vacuum_ ? &*vacuum_ : nullptr; }
  [[nodiscard]] SimForceSensor* force_sensor() NONBLOCKING {
    return force_sensor_ ? &*force_sensor_ : nullptr;
  }

  [[nodiscard]] const Snapshot& snapshot() const NONBLOCKING { return snapshot_; }  // of the last step

  // Goes on from a snapshot as if it had never stopped (inputs as they were written before that tick). The
  // readings that failing devices repeat or delay start afresh.
  void restore(const Snapshot& from) NONBLOCKING;

 private:
  static constexpr std::int64_t kPiece_ns = 1'000'000;  // the plant is stepped in pieces no longer than this
  static constexpr std::int64_t kRest_ns = 100'000;  // the last one takes a rest along: a tick a little late
  static constexpr std::int64_t kMostPieces = 2000;  // per step

  void step_piece(std::int64_t to_ns) NONBLOCKING;
  void move_hand(std::int64_t to_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING;
  void move_stage(std::int64_t to_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING;
  void put_next_cell(bool button) NONBLOCKING;
  void touch(const StagePlantState& before, double dt_s) NONBLOCKING;
  [[nodiscard]] OperatorView view() const NONBLOCKING;
  void take_snapshot() NONBLOCKING;
  void expose() NONBLOCKING;
  [[nodiscard]] double seconds(std::int64_t t_ns) const NONBLOCKING;

  SimConfig config_;
  SimulatedParts simulated_;
  Bench* bench_;
  std::int64_t start_ns_ = 0;
  std::int64_t t_ns_ = 0;
  std::uint64_t next_frame_ = 0;
  Operator operator_;
  SimHand hand_;
  SimStage stage_;
  SimEstop estop_;
  std::optional<Cell> cell_;
  std::optional<SimInjector> injector_;
  std::optional<SimVacuum> vacuum_;
  std::optional<SimForceSensor> force_sensor_;
  std::optional<hal::HandState> real_hand_;
  std::optional<hal::StageState> real_stage_;
  bool stage_placed_ = false;  // the plant knows where the stage is
  Snapshot snapshot_;  // cell, cell_reading and what counts live here; the rest is copied in after a step
  Exposure exposure_;
};

// How the plant ended after the core had died: nobody reads or writes any more.
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
// Only when the process that stepped it is dead. All devices are taken as simulated; where the e-stop was
// real, its simulated relay counts as open from the beginning. Allocates.
[[nodiscard]] UnattendedEnd run_unattended(const SimConfig& config, Bench& bench, double for_s = 1.0);
[[nodiscard]] UnattendedEnd run_unattended(const SimConfig& config, const Snapshot& from, Bench* bench,
                                           double for_s = 1.0);

}  // namespace punctum::sim
