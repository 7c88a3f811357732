#include "rt/control/stage_set_point.hpp"

#include <algorithm>

#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

// Nobody has seen where the hand went in a longer gap: the needle does not catch it up. Twice the period of
// the slowest device that hand_watch.hpp allows for.
constexpr double kHandGap_s = 0.01;
// Of the hand, between pushing in vain and drawing back: more than it trembles by (0.7 mm from peak to peak),
// or every tremble would draw the needle back a little more.
constexpr double kSlack_m = 1e-3;
// By so much longer than the filters lag, the needle at full speed may need to the hand's point.
constexpr double kLead_s = 0.2;

}  // namespace

StageSetPoint::StageSetPoint(const ServoConfig& config) NONBLOCKING
    : mapping_(config.mapping),
      limits_(config.limits, config.mapping, config.rate_Hz, config.forbidden),
      lag_s_(limits_.lag_s() + mapping_.lag_s()) {}

std::uint32_t StageSetPoint::follow_hand(const Readings& readings, const FollowInput& in) NONBLOCKING {
  uncoupled_ = false;
  if (!readings.hand_seen || !readings.needle_known()) {
    return 0;
  }
  const bool holding = in.running && readings.stage_ready();
  // While a fixture is felt, another scale would be another force.
  if (in.nothing_felt && (!holding || !mapping_.anchored() || readings.button(hal::kButtonClutch))) {
    mapping_.set_position_scale(in.position_scale);
  }
  if (!holding || !mapping_.anchored() || readings.hand_begins) {
    anchor(readings.hand, readings.stage.tip_m, readings.stage.axis);
    uncoupled_ = true;
    return 0;
  }
  const bool hand_moves_again = last_hand_stuck_ && !readings.hand_stuck;
  const bool hand_had_a_gap = readings.hand_fresh && readings.between_hand_s > kHandGap_s;
  const bool way_closes_or_opens = in.constraint.withdrawal_only != last_withdrawal_only_;
  // What the hand did meanwhile is forgotten: the needle does not catch up by itself.
  if (in.elapsed_s > kHandGap_s) {
    anchor(readings.hand, limits_.set_point().tip_m, limits_.set_point().axis);
  } else if (hand_moves_again || hand_had_a_gap || readings.hand_leaps || way_closes_or_opens) {
    mapping_.anchor(readings.hand, limits_.stops_at_m(), limits_.set_point().axis);
  }
  last_withdrawal_only_ = in.constraint.withdrawal_only;
  last_hand_stuck_ = readings.hand_stuck;
  // Of what the hand did between two samples, nobody knows what was before the clutch was released.
  const bool clutched = in.clutched || last_clutched_;
  last_clutched_ = in.clutched;
  mapping_.step(readings.hand, !clutched, in.may_tilt && in.vision_fresh);
  // Without vision too: a hand that pushes in vain slips, and draws the needle back as soon as it turns.
  StageLimits::Checked allowed = limits_.check(mapping_.hand_point(), in.constraint);
  if (in.constraint.withdrawal_only) {
    const hal::Vec3& inward = in.constraint.membrane.axis;
    const double in_vain_m = inward.dot(mapping_.hand_point() - allowed.point_m);
    allowed.point_m += std::clamp(in_vain_m, 0.0, kSlack_m / mapping_.position_scale()) * inward;
  }
  mapping_.slip(allowed.point_m);
  if (readings.hand_leaps) {
    allowed.alarms |= alarm_travel_limited;
  }
  // A hand that was faster than the needle may be slips too: the needle does not go on for long after it.
  const double lead_m = limits_.allowed_speed_m_s(in.constraint) * (lag_s_ + kLead_s);
  const hal::Vec3 lead = allowed.point_m - limits_.set_point().tip_m;
  if (const double length_m = lead.norm(); length_m > lead_m) {
    allowed = limits_.check(limits_.set_point().tip_m + lead * (lead_m / length_m), in.constraint);
    allowed.alarms |= alarm_travel_limited;
    mapping_.slip(allowed.point_m);
  }
  return allowed.alarms;
}

std::uint32_t StageSetPoint::step(const StageConstraint& constraint, double dt_s) NONBLOCKING {
  if (!mapping_.anchored()) {
    return 0;
  }
  limits_.step(mapping_.filter(dt_s), constraint);
  return limits_.alarms();
}

void StageSetPoint::anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis)
    NONBLOCKING {
  mapping_.anchor(hand, tip_m, axis);
  limits_.restart(tip_m, axis);
}

}  // namespace punctum::rt
