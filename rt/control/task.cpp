#include "rt/control/task.hpp"

#include "rt/station/alarm.hpp"

namespace punctum::rt {

Task::Task(const ServoConfig& config) NONBLOCKING
    : cells_wanted_(static_cast<std::uint32_t>(config.cells > 0 ? config.cells : 0)),
      has_injector_(config.injector.has_value()),
      has_inner_membrane_(config.inner_membrane) {
  if (config.phases) {
    phases_.emplace(*config.phases);
  }
}

const TaskFacts& Task::step(const Readings& readings, const CellFacts& cell, double dt_s) NONBLOCKING {
  injected_ = injected_ || readings.injected;
  if (!phases_) {
    facts_.inside_cell = facts_.punctured = cell.puncture_seen;
    return facts_;
  }
  Phases& phases = *phases_;
  PhaseInput in;
  in.membrane_known = cell.membrane.known;
  in.depth_m = cell.depth_m;
  in.contact_depth_m = cell.contact_depth_m;
  in.inward_m = cell.inward_m;
  in.outward_m_s = cell.outward_m_s;
  in.vision_contact = cell.contact_seen;
  in.vision_punctured = cell.puncture_seen;
  in.vision_contradicts = cell.vision_implausible;
  in.may_inject = cell.vision_fresh && cell.puncture_seen && cell.contact_depth_m > 0 &&
                  (!has_inner_membrane_ || cell.inner_puncture_seen);
  const bool pressed = readings.button(hal::kButtonInject);
  in.inject = pressed && press_begins_here_;
  in.next_cell = readings.button(hal::kButtonNextCell);
  facts_.phase = phases.step(in, dt_s);
  const bool may_begin = facts_.phase == Phase::puncture || facts_.phase == Phase::injection;
  press_begins_here_ = may_begin && (press_begins_here_ || !(pressed || readings.inject_down));
  facts_.cell = phases.cell();
  facts_.inside_cell = phases.inside();
  facts_.punctured = facts_.inside_cell || facts_.phase == Phase::clear;
  facts_.contact_or_puncture_begins = phases.entered(Phase::contact) || phases.entered(Phase::puncture);
  facts_.may_inject = in.may_inject && (facts_.phase == Phase::puncture || facts_.phase == Phase::injection);
  facts_.alarms = phases.timed_out() ? alarm_phase_timeout : 0U;
  if (has_injector_ && pressed && facts_.phase == Phase::puncture) {
    facts_.alarms |= alarm_injection_refused;
  }
  if (phases.entered(Phase::puncture)) {
    facts_.insertion = {readings.stage.tip_m, cell.approach_axis};
  }
  count_cells(phases);
  return facts_;
}

void Task::count_cells(const Phases& phases) NONBLOCKING {
  if (phases.entered(Phase::clear)) {
    ++cells_done_;
    if (!has_injector_ || injected_) {
      ++cells_injected_;
    }
    over_ = over_ || (cells_wanted_ > 0 && cells_done_ >= cells_wanted_);
    facts_.done = over_ && cells_injected_ == cells_done_;
  }
  facts_.new_cell =
      phases.entered(Phase::free) && phases.cell() == cells_done_ && cells_begun_ != cells_done_;
  if (facts_.new_cell) {
    cells_begun_ = cells_done_;
    injected_ = false;
  }
}

}  // namespace punctum::rt
