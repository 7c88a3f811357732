#include "rt/control/cell_observer.hpp"

#include <algorithm>
#include <cmath>

#include "rt/forces/ramp.hpp"

namespace punctum::rt {
namespace {

// Low-pass of the tip's speed, 5 Hz: below the tremor of a hand (8 to 12 Hz), within the time of a picture.
constexpr double kOutwardTau_s = 0.03;

}  // namespace

CellObserver::CellObserver(const ServoConfig& config, Station& station) NONBLOCKING
    : station_(station),
      far_wall_m_(config.limits.far_wall_m),
      has_phases_(config.phases.has_value()),
      let_go_m_(config.phases.value_or(PhaseParams{}).clear_m) {
  if (config.vision && config.local_model) {
    const MembraneParams membrane = config.membrane.value_or(MembraneParams{});
    model_.emplace(*config.local_model, membrane.c_m, membrane.R_m);
    copy_from(*model_);
  }
}

const CellFacts& CellObserver::step(const TickTime& time, const Readings& readings,
                                    const hal::Vec3& hand_point_m, const LastPhase& last) NONBLOCKING {
  facts_.alarms = 0;
  if (!model_ || !readings.needle_known()) {
    return facts_;
  }
  LocalMembraneModel& model = *model_;
  const hal::Vec3& tip_m = readings.has_stage ? readings.stage.tip_m : hand_point_m;
  if (!readings.has_stage) {
    model.push_pose({time.now_ns, tip_m, readings.stage.axis});
  } else if (readings.stage_fresh) {
    model.push_pose({readings.stage.sample_ns, tip_m, readings.stage.axis});
  }
  take_newest_observation(model, last.inside_cell);

  if (last.outside && has_phases_) {  // without them, vision alone knows where the needle is
    model.is_outside();
  }
  if (last.outside && readings.has_stage) {
    facts_.approach_axis = readings.stage.axis.normalized();
  }
  const bool known = model.membrane().known;
  const double depth_before_correction_m = model.depth_m(tip_m);
  const bool moved = model.step(time.now_ns, facts_.approach_axis, time.dt_s);
  facts_.depth_m = moved ? model.depth_m(tip_m) : depth_before_correction_m;
  facts_.depth_correction_m = known ? facts_.depth_m - depth_before_correction_m : 0;

  if (model.implausible()) {
    facts_.alarms |= alarm_vision_implausible;
  }
  if (model.overdue()) {
    facts_.alarms |= alarm_vision_stale;
    ++facts_.stale_ticks;
  }
  measure_speed(time, tip_m);
  count_from_contact(model, tip_m, last.outside);
  copy_from(model);
  return facts_;
}

void CellObserver::count_from_contact(LocalMembraneModel& model, const hal::Vec3& tip_m, bool outside)
    NONBLOCKING {
  const hal::Vec3& axis = facts_.approach_axis;
  if (!outside && !touched_) {
    touched_ = true;
    contact_m_ = tip_m - facts_.depth_m * axis;
    model.touch();
  }
  facts_.contact_depth_m = touched_ ? axis.dot(tip_m - contact_m_) : facts_.depth_m;
  if (outside && touched_ && facts_.contact_depth_m < -let_go_m_) {
    touched_ = false;
    model.let_go();
  }

  facts_.inward_limit_m = std::numeric_limits<double>::infinity();
  const Membrane3D& first = model.first_seen();
  if (first.known) {
    const double room_m = std::max(first.chord_m(tip_m) - far_wall_m_, 0.0);
    facts_.inward_limit_m = facts_.inward_m - first.depth_m(tip_m) + room_m;
  }
  facts_.contact_inward_m = touched_ ? axis.dot(contact_m_) : std::numeric_limits<double>::infinity();
}

void CellObserver::take_newest_observation(LocalMembraneModel& model, bool inside_cell) NONBLOCKING {
  if (station_.observation == nullptr || station_.observation->head() == next_observation_) {
    return;
  }
  Observation seen;
  std::uint64_t index = 0;
  if (station_.observation->newest(seen, index) != hal::Read::ok) {
    return;
  }
  next_observation_ = index + 1;
  ++facts_.observations;
  const bool used = model.observe(seen, inside_cell);
  if (!used && model.membrane().known) {
    facts_.alarms |= alarm_sensor;
  }
}

void CellObserver::measure_speed(const TickTime& time, const hal::Vec3& tip_m) NONBLOCKING {
  const double outward_m_s = -facts_.approach_axis.dot(tip_m - last_tip_m_) / time.elapsed_s;
  last_tip_m_ = tip_m;
  if (!time.first) {
    const double part = low_pass_part(time.dt_s, kOutwardTau_s);
    facts_.outward_m_s += part * (outward_m_s - facts_.outward_m_s);
  }
  facts_.inward_m = facts_.approach_axis.dot(tip_m);
}

void CellObserver::restart(std::int64_t now_ns) NONBLOCKING {
  if (model_) {
    model_->restart(now_ns);
    touched_ = false;
    facts_.inward_limit_m = facts_.contact_inward_m = std::numeric_limits<double>::infinity();
    copy_from(*model_);
  }
}

void CellObserver::copy_from(const LocalMembraneModel& model) NONBLOCKING {
  facts_.vision_fresh = !model.stale();
  facts_.membrane = model.membrane();
  facts_.dimple_scale = model.dimple_scale();
  facts_.force_gain = model.force_gain();
  facts_.contact_seen = model.contact_seen();
  facts_.vision_implausible = model.implausible();
  facts_.puncture_seen = model.puncture_seen();
  facts_.inner_puncture_seen = model.inner_puncture_seen();
  facts_.observation_age_s = model.age_s();
  facts_.observed_gap_m = model.seen_gap_m();
  facts_.depth_sd_m = model.depth_sd_m();
  facts_.R_sd_m = model.R_sd_m();
  facts_.observed_a_m = model.seen_a_m();
  facts_.observed_a_sd_m = model.seen_a_sd_m();
}

}  // namespace punctum::rt
