#include "rt/control/telemetry_writer.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>

#include "hal/frames.hpp"

namespace punctum::rt {
namespace {

void copy(double (&to)[3], const hal::Vec3& from) NONBLOCKING {
  for (Eigen::Index i = 0; i < 3; ++i) {
    to[i] = from[i];
  }
}

}  // namespace

void TelemetryWriter::publish(const TickRecord& tick) NONBLOCKING {
  if (!published_) {
    first_release_ns_ = tick.now.release_ns;
    published_ = true;
  }
  const Readings& readings = tick.readings;
  const hal::EstopState& estop = readings.estop;
  TelemetrySample& s = sample_;
  const Seen last{s.phase, s.fault, s.alarms, s.cell};
  s.tick = tick.now.tick;
  s.t_s = static_cast<double>(tick.now.release_ns - first_release_ns_) * 1e-9;
  s.phase = tick.task.phase;
  s.fault = tick.safety.cause;
  s.stop = tick.safety.stage;
  s.estop = static_cast<std::uint8_t>((estop.contact_a_closed ? 0U : 1U) |
                                      (estop.contact_b_closed ? 0U : 2U) | (estop.reset_pressed ? 4U : 0U));
  s.alarms = tick.alarms;
  s.buttons = readings.hand.buttons;
  s.cell = tick.task.cell;

  copy(s.x_m, readings.hand.position_m);
  copy(s.v_m_s, tick.hand_velocity_m_s);
  copy(s.tip_m, readings.stage.tip_m);
  copy(s.cmd_m, tick.set_point.tip_m);
  copy(s.force_N, tick.safety.hand_force_N);
  fill_forces(tick.rendering, tick.safety, tick.cell.depth_sd_m);
  fill_cell(tick.cell);
  s.sensor_N = readings.sensor_N;
  s.E_fit_Pa = tick.modulus.E_Pa;
  s.E_fit_sd_Pa = tick.modulus.sd_Pa;
  s.vacuum_Pa = readings.vacuum_Pa;
  s.injector_open = readings.injector_open ? 1 : 0;
  s.unusable = static_cast<std::uint8_t>(
      readings.unusable | ((tick.cell.alarms & alarm_sensor) != 0 ? unsigned{device_vision} : 0U));
  tell_events(last, tick.requested);
  station_.core.telemetry.push(s);

  CoreStatus& core = station_.core.status;
  core.fault.store(static_cast<std::uint64_t>(s.fault), std::memory_order_relaxed);
  core.faults_latched.store(tick.safety.faults_latched, std::memory_order_relaxed);
  core.phase.store(static_cast<std::uint64_t>(s.phase), std::memory_order_relaxed);
  core.task_finished.store(tick.task.done ? 1 : 0, std::memory_order_relaxed);
  core.commands_refused.store(tick.requested.refused, std::memory_order_relaxed);
}

// Before the sample: whoever has seen a sample finds its events.
void TelemetryWriter::tell_events(const Seen& last, const Requested& requested) NONBLOCKING {
  const TelemetrySample& s = sample_;
  // At most kCommandsPerTick * kCommandWriterCount rounds.
  for (std::size_t i = 0; i < requested.taken_count; ++i) {
    const TakenCommand& taken = requested.taken[i];
    tell({.kind = taken.obeyed ? Event::command : Event::command_refused,
          .what = taken.command.kind,
          .value = taken.command.value,
          .writer = taken.writer,
          .target = static_cast<std::uint32_t>(taken.command.target)});
  }
  if (s.fault != last.fault) {
    const bool latched = s.fault != Fault::none;
    tell({.kind = latched ? Event::fault : Event::fault_cleared,
          .what = static_cast<std::uint64_t>(latched ? s.fault : last.fault)});
  }
  if (s.alarms != last.alarms) {
    tell_alarms(last.alarms);
  }
  if (s.phase != last.phase || s.cell != last.cell) {
    tell({.kind = Event::phase,
          .what = static_cast<std::uint64_t>(s.phase),
          .value = static_cast<double>(s.cell)});
  }
}

void TelemetryWriter::tell_alarms(std::uint32_t last) NONBLOCKING {
  const std::uint32_t now = sample_.alarms;
  for (std::uint32_t bit = 0; bit < std::size(kAlarmNames); ++bit) {
    if (((now ^ last) >> bit & 1U) != 0) {
      tell({.kind = (now >> bit & 1U) != 0 ? Event::alarm_on : Event::alarm_off, .what = bit});
    }
  }
}

void TelemetryWriter::tell(Event event) NONBLOCKING {
  event.tick = sample_.tick;
  event.t_s = sample_.t_s;
  station_.core.events.push(event);
}

void TelemetryWriter::fill_forces(const Rendering& rendering, const SafetyOutput& safety, double depth_sd_m)
    NONBLOCKING {
  TelemetrySample& s = sample_;
  const EffectSum& sum = rendering.sum();
  const double fade = safety.running && !safety.latch.cleared ? sum.force_fade : 0;
  for (std::size_t i = 0; i < effect_count; ++i) {
    s.effect_N[i] = fade * sum.effect_N[i];
  }
  s.guard_N = rendering.guard_N();
  s.stored_energy_J = sum.stored_J;
  s.injected_energy_J = sum.injected_J;
  if (!rendering.membrane()) {
    return;
  }
  const MembraneState& state = rendering.membrane()->state();
  s.a_m = state.a_m;
  s.tip_force_N = state.force_N;
  s.tip_force_sd_N = state.stiffness_N_m * depth_sd_m;
  s.sigma_d_Pa = state.sigma_d_Pa;
  s.pressure_Pa = state.pressure_Pa;
  const RimForces& rim = rendering.membrane()->rim();
  for (std::size_t i = 0; i < rim.size(); ++i) {
    copy(s.contact_force_N[i], fade * hand_from_world(rim[i]));
  }
}

void TelemetryWriter::fill_cell(const CellFacts& cell) NONBLOCKING {
  TelemetrySample& s = sample_;
  if (cell.membrane.known) {
    s.wd_m = std::max(cell.depth_m, 0.0);
    s.R_m = cell.membrane.R_m;
    copy(s.entry_m, cell.membrane.entry_m);
  } else {
    s.wd_m = 0;
    s.R_m = 0;
    copy(s.entry_m, hal::Vec3::Zero());
  }
  copy(s.axis, cell.approach_axis);
  s.obs_age_s = cell.observation_age_s;
  s.obs_gap_m = cell.observed_gap_m;
  s.wd_sd_m = cell.depth_sd_m;
  s.R_sd_m = cell.R_sd_m;
  s.obs_a_m = cell.observed_a_m;
  s.obs_a_sd_m = cell.observed_a_sd_m;
  s.observations = cell.observations;
  s.stale_ticks = cell.stale_ticks;
}

}  // namespace punctum::rt
