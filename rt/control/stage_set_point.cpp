#include "rt/control/stage_set_point.hpp"

#include <algorithm>

#include "hal/frames.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

// Nobody has seen where the hand went in a longer gap of its samples: three times the period of a device of
// 200 Hz, or one and a half of one of 100 Hz, whose periods vary.
constexpr double kHandGap_s = 0.016;
constexpr double kStall_s = 0.01;  // nor in a longer one of the ticks
// One false sample of the tip is nothing to begin from: the next one agrees with it. More than an encoder's
// last digit flickers by, and no more than may be seen of a needle that moves by itself.
constexpr double kTipAgrees_m = 1e-6;
// Of the hand, between pushing in vain and drawing back: more than it trembles by (0.7 mm from peak to peak),
// or every tremble would draw the needle back a little more.
constexpr double kSlack_m = 1e-3;
// By so much longer than the filters lag, the needle at full speed may need to the hand's point.
constexpr double kLead_s = 0.2;

}  // namespace

StageSetPoint::StageSetPoint(const ServoConfig& config) NONBLOCKING
    : mapping_(config.mapping),
      limits_(config.limits, config.mapping, config.rate_Hz, config.forbidden, config.stage_reach),
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
  const bool begins = last_uncoupled_ && mapping_.anchored() && readings.has_stage;
  const bool contradicted =
      begins && (readings.stage.tip_m - limits_.set_point().tip_m).norm() > kTipAgrees_m;
  const bool unconfirmed = contradicted || (begins && !readings.stage_fresh);
  last_uncoupled_ = !holding || !mapping_.anchored() || readings.hand_begins || unconfirmed;
  if (last_uncoupled_) {
    anchor(readings.hand, readings.stage.tip_m, readings.stage.axis);
    uncoupled_ = true;
    return holding && contradicted ? alarm_travel_limited : 0U;
  }
  const bool hand_moves_again = last_hand_stuck_ && !readings.hand_stuck;
  const bool way_closes_or_opens = in.constraint.withdrawal_only != last_withdrawal_only_;
  // What the hand did meanwhile is forgotten: the needle does not catch up by itself.
  if (in.elapsed_s > kStall_s) {
    anchor(readings.hand, limits_.set_point().tip_m, limits_.set_point().axis);
  } else if (hand_moves_again || way_closes_or_opens) {
    mapping_.anchor(readings.hand, limits_.stops_at_m(), limits_.set_point().axis);
  }
  last_withdrawal_only_ = in.constraint.withdrawal_only;
  last_hand_stuck_ = readings.hand_stuck;
  // Of what the hand did between two samples, nobody knows what was before the clutch was released.
  const bool clutched = in.clutched || last_clutched_;
  last_clutched_ = in.clutched;
  const hal::Vec3 believed_m = mapping_.hand_point();
  mapping_.step(readings.hand, !clutched, in.may_tilt && in.vision_fresh);
  if (readings.hand_fresh) {
    catch_up(readings, believed_m, clutched, in.constraint.membrane.axis);
  }
  // Without vision too: a hand that pushes in vain slips, and draws the needle back as soon as it turns.
  StageLimits::Checked allowed = limits_.check(mapping_.hand_point(), in.constraint);
  if (in.constraint.withdrawal_only) {
    const hal::Vec3& inward = in.constraint.membrane.axis;
    const double in_vain_m = inward.dot(mapping_.hand_point() - allowed.point_m);
    allowed.point_m += std::clamp(in_vain_m, 0.0, kSlack_m / mapping_.position_scale()) * inward;
  }
  mapping_.slip(allowed.point_m);
  if (out_of_sight_) {
    allowed.alarms |= alarm_travel_limited;
  }
  // A hand that was faster than the needle may be slips too: the needle does not go on for long after it.
  const hal::Vec3 lead = allowed.point_m - limits_.set_point().tip_m;
  const double length_m = lead.norm();
  if (length_m > limits_.slowest_m_s() * (lag_s_ + kLead_s)) {
    const double lead_m = limits_.allowed_speed_m_s(in.constraint) * (lag_s_ + kLead_s);
    if (length_m > lead_m) {
      allowed = limits_.check(limits_.set_point().tip_m + lead * (lead_m / length_m), in.constraint);
      allowed.alarms |= alarm_travel_limited;
      mapping_.slip(allowed.point_m);
    }
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

void StageSetPoint::catch_up(const Readings& readings, const hal::Vec3& believed_m, bool clutched,
                             const hal::Vec3& inward) NONBLOCKING {
  const bool lost = readings.hand_leaps || readings.between_hand_s > kHandGap_s;
  if (lost) {
    mapping_.slip(believed_m);
  } else {
    if (out_of_sight_ && !clutched) {
      const hal::Vec3 way_m = world_from_hand(readings.hand.position_m - last_seen_m_);
      const double drew_back_m = std::max(0.0, -inward.dot(way_m)) / mapping_.position_scale();
      mapping_.slip(mapping_.hand_point() - drew_back_m * inward);
    }
  }
  if (!lost || clutched) {
    last_seen_m_ = readings.hand.position_m;
  }
  out_of_sight_ = lost;
}

void StageSetPoint::anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis)
    NONBLOCKING {
  mapping_.anchor(hand, tip_m, axis);
  limits_.restart(tip_m, axis);
  last_seen_m_ = hand.position_m;
  out_of_sight_ = false;
}

}  // namespace punctum::rt
