#include "rt/control/servo.hpp"

#include <algorithm>

namespace punctum::rt {

Servo::Servo(const ServoConfig& config, const Devices& devices, Station& station, bool degraded) NONBLOCKING
    : timing_(config, degraded),
      inputs_(config, devices),
      requests_(config, station),
      stage_set_point_(config),
      cell_(config, station),
      velocity_(config.velocity, config.rate_Hz),
      task_(config),
      gate_(config),
      rendering_(config),
      force_limits_(config.limits, config.rate_Hz),
      safety_(config.estop),
      outputs_(config, devices),
      telemetry_(station) {
  if (config.force_sensor && config.membrane && config.vision) {
    modulus_fit_.emplace(config.membrane->E_Pa);
  }
}

// One tick of the servo. Each part takes values and returns values; a value of the last tick has `last` in
// its name.
void Servo::tick(const TickInfo& now) NONBLOCKING {
  const TickTime time = timing_.step(now);
  const Readings& readings = inputs_.read(time, last_.output);
  const Requested& requested = requests_.take(time.dt_s);
  const std::uint32_t hand_alarms = follow_hand(time, readings, requested);
  const CellFacts& cell = take_newest_observation(time, readings);
  const hal::Vec3& velocity_m_s = velocity_.step(readings, time.dt_s);
  const TaskFacts& task = advance_phase(time, readings, cell);
  const EffectSum& effects = sum_force_effects(time, readings, requested, cell, velocity_m_s, task);
  const ModulusEstimate modulus = fit_modulus(time, readings, cell, task);
  const hal::Vec3 passive_N = rendering_.keep_passive(effects, readings, time.elapsed_s);
  const LimitedForces limited =
      force_limits_.step(passive_N, rendering_.tip_force_N(), readings, last_.output.hand_force_N, time.dt_s,
                         requested.hand_force_N);
  const SafetyOutput safety = latch(time, readings, requested, limited);
  const std::uint32_t stage_alarms =
      choose_stage_set_point(time, readings, requested, cell, task, limited, safety);
  const bool gate_open = choose_gate(time, readings, requested, cell, task, safety);
  const Written written =
      outputs_.write(safety, readings, stage_set_point_.command(), gate_open, time.elapsed_s);
  rendering_.wrote(safety.hand_force_N);
  const std::uint32_t alarms = time.alarms | readings.alarms | hand_alarms | cell.alarms | task.alarms |
                               rendering_.alarms() | limited.alarms | stage_alarms;
  telemetry_.publish({now, alarms, readings, requested, velocity_m_s, cell, task, rendering_, modulus, safety,
                      stage_set_point_.set_point()});
  remember(safety, task, gate_open, written);
}

RunEnd Servo::outcome() const NONBLOCKING {
  const Requested& requested = requests_.requested();
  const Readings& readings = inputs_.readings();
  if (safety_.stage() == StopStage::stopped) {
    const bool no_button = safety_.reset_needed() && !readings.has_estop;
    const bool for_good =
        requested.stop || no_button || safety_rule(safety_.cause()).cleared_by == ClearedBy::never;
    return for_good ? RunEnd::fault : RunEnd::running;
  }
  const bool at_rest =
      rendering_.faded() && force_is_zero() && !last_.output.gate_open && readings.at_standstill();
  if (safety_.stage() == StopStage::running && task_.ending(requested) && at_rest) {
    return task_.facts().done ? RunEnd::done : RunEnd::stopped;
  }
  return RunEnd::running;
}

// The hand at needle scale. Phase, cell and tip force are those of the last tick: they follow from where the
// hand is.
std::uint32_t Servo::follow_hand(const TickTime& time, const Readings& readings, const Requested& requested)
    NONBLOCKING {
  const CellFacts& last_cell = cell_.facts();
  const TaskFacts& last_task = task_.facts();
  return stage_set_point_.follow_hand(
      readings,
      {.running = last_.output.running,
       .vision_fresh = last_cell.vision_fresh,
       .clutched = readings.button(hal::kButtonClutch) || task_.ending(requested),
       .may_tilt = last_task.phase == Phase::free && !last_task.inside_cell,  // there may be no phases
       .constraint =
           constraint(readings, last_cell, last_task, requested, force_limits_.last_tip_force_soft()),
       .elapsed_s = time.elapsed_s,
       .position_scale = requested.position_scale,
       .nothing_felt = rendering_.needle_faded()});
}

const CellFacts& Servo::take_newest_observation(const TickTime& time, const Readings& readings) NONBLOCKING {
  const TaskFacts& last_task = task_.facts();
  const LastPhase last{.outside = last_task.outside(), .inside_cell = last_task.inside_cell};
  return cell_.step(time, readings, stage_set_point_.hand_point_m(), last);
}

const TaskFacts& Servo::advance_phase(const TickTime& time, const Readings& readings, const CellFacts& cell)
    NONBLOCKING {
  const TaskFacts& task = task_.step(readings, cell, time.dt_s);
  if (task.new_cell) {
    cell_.restart(time.now_ns);
  }
  return task;
}

const EffectSum& Servo::sum_force_effects(const TickTime& time, const Readings& readings,
                                          const Requested& requested, const CellFacts& cell,
                                          const hal::Vec3& velocity_m_s, const TaskFacts& task) NONBLOCKING {
  return rendering_.sum_effects(
      {.dt_s = time.dt_s,
       .last_running = last_.output.running,
       .coupled = stage_set_point_.anchored(),
       .ending = task_.ending(requested),
       .hand_velocity_m_s = velocity_m_s,
       .hand_point_m = stage_set_point_.hand_point_m(),
       .needle_axis = stage_set_point_.set_point().axis,
       .position_scale = stage_set_point_.position_scale(),
       .commanded_scale = requested.force_scale,
       .reduced_effects = requested.reduces_effects ? &requested.effect_gain : nullptr},
      readings, cell, task);
}

ModulusEstimate Servo::fit_modulus(const TickTime& time, const Readings& readings, const CellFacts& cell,
                                   const TaskFacts& task) NONBLOCKING {
  if (!modulus_fit_) {
    return {};
  }
  constexpr double kClear_m = 10e-6;  // further from the membrane than it may be mistaken by
  const bool pressing = task.phase == Phase::contact || task.phase == Phase::indentation;
  return modulus_fit_->step({.dt_s = time.dt_s,
                             .sensor_N = readings.sensor_filtered_N,
                             .sensor_fresh = readings.sensor_fresh,
                             .clear = task.outside() && cell.depth_m < -kClear_m,
                             .pressing = pressing && cell.membrane.known && cell.vision_fresh,
                             .new_cell = task.new_cell,
                             .law = rendering_.membrane()->state(),
                             .depth_sd_m = cell.depth_sd_m});
}

SafetyOutput Servo::latch(const TickTime& time, const Readings& readings, const Requested& requested,
                          const LimitedForces& limited) NONBLOCKING {
  // The most urgent cause first.
  const Fault commanded = requested.stop ? Fault::command_stop : Fault::none;
  Causes causes = readings.estop_fault;
  causes.add(commanded);
  causes.add(readings.device_faults);
  causes.add(time.fault);
  causes.add(last_.write_fault);
  causes.add(limited.fault);
  const SafetyOutput safety = safety_.step(causes, limited.hand_force_N, readings, time.elapsed_s);
  if (safety.latch.cleared) {
    rendering_.restart();  // the needle's path began anew on this tick already, see follow_hand
  }
  return safety;
}

std::uint32_t Servo::choose_stage_set_point(const TickTime& time, const Readings& readings,
                                            const Requested& requested, const CellFacts& cell,
                                            const TaskFacts& task, const LimitedForces& limited,
                                            const SafetyOutput& safety) NONBLOCKING {
  if (!readings.has_stage || !readings.stage_ready() || !safety.running) {
    return 0;
  }
  return stage_set_point_.step(constraint(readings, cell, task, requested, limited.tip_force_soft),
                               time.dt_s);
}

bool Servo::choose_gate(const TickTime& time, const Readings& readings, const Requested& requested,
                        const CellFacts& cell, const TaskFacts& task, const SafetyOutput& safety)
    NONBLOCKING {
  return gate_.step(readings,
                    {.stopped = safety.latch.gate_shut,
                     .vision_fresh = cell.vision_fresh,
                     .ending = requested.end || task_.ending(requested),
                     .injection_phase = task.phase == Phase::injection,
                     .may_inject = task.may_inject,
                     .new_cell = task.new_cell},
                    time.elapsed_s);
}

StageConstraint Servo::constraint(const Readings& readings, const CellFacts& cell, const TaskFacts& task,
                                  const Requested& requested, bool tip_force_soft) NONBLOCKING {
  StageConstraint c;
  c.membrane = cell.membrane;
  c.membrane.axis = cell.approach_axis;
  // A cell that cannot be injected is not pierced.
  c.withdrawal_only = !cell.vision_fresh || requested.end || !readings.injector_known;
  c.no_deeper = tip_force_soft;
  c.inward_limit_m = std::min(cell.inward_limit_m, cell.contact_inward_m + requested.depth_limit_m);
  c.depth_limit_m = requested.depth_limit_m;
  if (task.inside_cell && !task.outside()) {  // without phases nobody knows where the needle went in
    c.insertion = task.insertion;
  }
  return c;
}

void Servo::remember(const SafetyOutput& safety, const TaskFacts& task, bool gate_open,
                     const Written& written) NONBLOCKING {
  last_.output = {.hand_force_N = safety.hand_force_N,
                  .running = safety.running,
                  .between_cells = task.phase == Phase::clear,
                  .gate_open = gate_open,
                  .uncoupled = stage_set_point_.uncoupled(),
                  .stage_commanded = written.stage_commanded,
                  .set_point_m = stage_set_point_.set_point().tip_m};
  last_.write_fault = written.fault;
}

}  // namespace punctum::rt
