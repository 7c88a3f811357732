// The servo: everything one tick of the control core does.
//
// Built once at start from a scene's ServoConfig and the devices that exist; statically allocated (about
// 0.5 MB, mostly the pose history). tick() is real-time safe: no heap, lock, system call, exception.
// One thread calls it.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/cell_observer.hpp"
#include "rt/control/config.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/device_outputs.hpp"
#include "rt/control/devices.hpp"
#include "rt/control/force_limits.hpp"
#include "rt/control/hand_velocity.hpp"
#include "rt/control/injection_gate.hpp"
#include "rt/control/modulus_fit.hpp"
#include "rt/control/rendering.hpp"
#include "rt/control/requests.hpp"
#include "rt/control/safety_stop.hpp"
#include "rt/control/stage_set_point.hpp"
#include "rt/control/task.hpp"
#include "rt/control/telemetry_writer.hpp"
#include "rt/control/tick_timing.hpp"

namespace punctum::rt {

class Servo {
 public:
  // t = 0 of telemetry is the first tick's release. `degraded` raises the alarm "without real-time rights".
  Servo(const ServoConfig& config, const Devices& devices, Station& station, bool degraded = false)
      NONBLOCKING;
  Servo(const Servo&) = delete;
  Servo& operator=(const Servo&) = delete;

  void tick(const TickInfo& now) NONBLOCKING;

  // A stop (latched fault command_stop) or an orderly end, as by the command queue; for signals of the
  // process and its time limit. An end that finds the needle in the cell waits until it is drawn back, the
  // only way that is open then; request_end_here waits no longer: the force fades, the needle stays.
  void request_stop() NONBLOCKING { requests_.stop(); }
  void request_end() NONBLOCKING { requests_.end(); }
  void request_end_here() NONBLOCKING { requests_.end_here(); }

  // The run is over and everything is at rest: leave the loop. A latched fault that a reset could still
  // clear does not finish the run.
  [[nodiscard]] bool finished() const NONBLOCKING { return outcome() != RunEnd::running; }
  // running, done, stopped (by command `end`, at rest) or fault (latched, and nothing can clear it: a stop
  // was commanded, or there is no reset button).
  [[nodiscard]] RunEnd outcome() const NONBLOCKING;
  [[nodiscard]] Fault fault() const NONBLOCKING { return safety_.cause(); }
  [[nodiscard]] StopStage stop_stage() const NONBLOCKING { return safety_.stage(); }
  [[nodiscard]] Phase phase() const NONBLOCKING { return task_.facts().phase; }
  [[nodiscard]] std::uint32_t cells_done() const NONBLOCKING { return task_.cells_done(); }
  [[nodiscard]] bool force_is_zero() const NONBLOCKING {
    return last_.output.hand_force_N == hal::Vec3::Zero();
  }
  [[nodiscard]] const TelemetrySample& sample() const NONBLOCKING { return telemetry_.sample(); }

 private:
  // The steps of the tick that more than one part takes part in.
  [[nodiscard]] std::uint32_t follow_hand(const TickTime& time, const Readings& readings,
                                          const Requested& requested) NONBLOCKING;
  const CellFacts& take_newest_observation(const TickTime& time, const Readings& readings) NONBLOCKING;
  const TaskFacts& advance_phase(const TickTime& time, const Readings& readings, const CellFacts& cell)
      NONBLOCKING;
  const EffectSum& sum_force_effects(const TickTime& time, const Readings& readings,
                                     const Requested& requested, const CellFacts& cell,
                                     const hal::Vec3& velocity_m_s, const TaskFacts& task) NONBLOCKING;
  [[nodiscard]] ModulusEstimate fit_modulus(const TickTime& time, const Readings& readings,
                                            const CellFacts& cell, const TaskFacts& task) NONBLOCKING;
  [[nodiscard]] SafetyOutput latch(const TickTime& time, const Readings& readings, const Requested& requested,
                                   const LimitedForces& limited) NONBLOCKING;
  [[nodiscard]] std::uint32_t choose_stage_set_point(const TickTime& time, const Readings& readings,
                                                     const Requested& requested, const CellFacts& cell,
                                                     const TaskFacts& task, const LimitedForces& limited,
                                                     const SafetyOutput& safety) NONBLOCKING;
  [[nodiscard]] bool choose_gate(const TickTime& time, const Readings& readings, const Requested& requested,
                                 const CellFacts& cell, const TaskFacts& task, const SafetyOutput& safety)
      NONBLOCKING;
  void remember(const SafetyOutput& safety, const TaskFacts& task, bool gate_open, const Written& written)
      NONBLOCKING;
  [[nodiscard]] static StageConstraint constraint(const Readings& readings, const CellFacts& cell,
                                                  const TaskFacts& task, const Requested& requested,
                                                  bool tip_force_soft) NONBLOCKING;

  // What the last tick leaves to this one, besides what each part remembers for itself.
  struct LastTick {
    LastOutput output;
    Fault write_fault = Fault::none;
  };

  TickTiming timing_;
  DeviceInputs inputs_;
  Requests requests_;
  StageSetPoint stage_set_point_;
  CellObserver cell_;
  HandVelocity velocity_;
  Task task_;
  InjectionGate gate_;
  Rendering rendering_;
  std::optional<ModulusFit> modulus_fit_;  // where a scene has both a force sensor and a membrane
  ForceLimits force_limits_;
  SafetyStop safety_;
  DeviceOutputs outputs_;
  TelemetryWriter telemetry_;
  LastTick last_;
};

}  // namespace punctum::rt
