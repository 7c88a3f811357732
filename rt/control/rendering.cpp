#include "rt/control/rendering.hpp"

#include "hal/frames.hpp"
#include "rt/control/force_limits.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

// When the clutch is pressed or the run ends: soon, and for 3 N a fifth of the rate at which a force may
// change.
constexpr double kFadeOut_s = 0.05;
// Of the commanded stiffness; less raises an alarm. A finger tells two springs apart by a tenth or more.
constexpr double kStiffnessKept = 0.9;

[[nodiscard]] EffectSetup setup_of(const ServoConfig& config) NONBLOCKING {
  return {.force_scale = config.mapping.force_scale,
          .force_delay_ticks = config.device.delay_ticks,
          .reach = config.stage_reach};
}

}  // namespace

Rendering::Rendering(const ServoConfig& config) NONBLOCKING : return_s_(config.mapping.coupling_s),
                                                              effects_(config, setup_of(config)) {
  if (config.guard) {
    guard_.emplace(*config.guard, config.device, config.velocity, config.rate_Hz, ForceLimits::kSlew_N_s);
  }
}

const EffectSum& Rendering::sum_effects(const RenderInput& in, const Readings& readings,
                                        const CellFacts& cell, const TaskFacts& task) NONBLOCKING {
  const bool holding = in.last_running && in.coupled && readings.stage_ready();
  const bool clutch = readings.button(hal::kButtonClutch);
  EffectInput e;
  e.last_force_fade = force_fade_.gain();
  force_fade_.step(holding && !in.ending && !readings.hand_stuck, return_s_, in.last_running ? kFadeOut_s : 0,
                   in.dt_s);
  needle_fade_.step(holding && !clutch, return_s_, kFadeOut_s, in.dt_s);
  e.force_fade = force_fade_.gain();
  e.coupling_gain = needle_fade_.gain();
  e.fixture_gain = e.coupling_gain * cell.force_gain;
  e.position_scale = in.position_scale;
  e.commanded_scale = in.commanded_scale;
  e.dt_s = in.dt_s;

  e.handle_m = world_from_hand(readings.hand.position_m);
  e.handle_velocity_m_s = world_from_hand(in.hand_velocity_m_s);
  e.fixture_point_m = in.hand_point_m;
  e.needle_tip_m = readings.has_stage ? readings.stage.tip_m : in.hand_point_m;
  e.needle_axis = in.needle_axis;
  e.approach_axis = cell.approach_axis;

  const Membrane3D& membrane = cell.membrane;
  e.cell_known = membrane.known;
  e.cell_radius_m = membrane.R_m;
  e.dimple_scale = cell.dimple_scale;
  if (membrane.known) {
    e.entry = {membrane.entry_m, membrane.axis};
    e.cell_centre_m = membrane.entry_m + membrane.R_m * membrane.axis;
    e.depth_m = cell.depth_m;
  }
  e.depth_correction_m = cell.depth_correction_m;

  e.inside_cell = task.inside_cell;
  e.punctured = task.punctured;
  e.withdrawing = task.phase == Phase::withdrawal;
  e.contact_or_puncture_begins = task.contact_or_puncture_begins;
  e.new_cell = task.new_cell;
  e.insertion = task.insertion;

  const EffectSum& sum = effects_.step(e, in.reduced_effects);
  const bool outside_the_law = effects_.membrane() && e.depth_m > 0 && !effects_.membrane()->state().shallow;
  alarms_ = outside_the_law ? alarm_model_invalid : 0U;
  return sum;
}

hal::Vec3 Rendering::keep_passive(const EffectSum& sum, const Readings& readings, double elapsed_s)
    NONBLOCKING {
  if (!guard_) {
    return left_of_force(readings.hand_age_s, kSlowestSample_s) * sum.force_N;
  }
  hal::Vec3 force_N = guard_->step(
      sum.parts, {world_from_hand(readings.hand.position_m), elapsed_s, readings.hand_fresh,
                  readings.between_hand_s, readings.hand_age_s, readings.hand_begins, readings.hand_leaps});
  if (faded()) {
    force_N.setZero();  // no effect is left that the guard could be needed for
  }
  guard_N_ = (force_N - sum.force_N).norm();
  if (guard_->gain() < kStiffnessKept) {
    alarms_ |= alarm_stiffness_reduced;
  }
  return force_N;
}

void Rendering::wrote(const hal::Vec3& force_N) NONBLOCKING {
  if (guard_) {
    guard_->wrote(world_from_hand(force_N));
  }
}

}  // namespace punctum::rt
