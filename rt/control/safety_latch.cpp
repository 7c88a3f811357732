#include "rt/control/safety_latch.hpp"

#include <algorithm>

namespace punctum::rt {
namespace {

constexpr double kRounding_s = 1e-9;

}  // namespace

LatchOutput SafetyLatch::step(const LatchInput& in, double dt_s) noexcept {
  State& s = state_;
  const double dt = std::max(dt_s, 0.0);
  const bool reset_edge = in.chain_readable && in.reset_pressed && !s.reset_was;
  if (in.chain_readable) s.reset_was = in.reset_pressed;

  LatchOutput out;
  if (s.stage == StopStage::running) {
    if (in.cause == Fault::none) return out;
    s.stage = StopStage::stopping;
    s.cause = in.cause;  // the first; later ones do not replace it
    s.since_s = 0;
    s.hand = 1;
  } else {
    const bool released = in.chain_readable && in.contacts_closed && in.cause == Fault::none;
    if (s.stage == StopStage::stopped && released && reset_edge &&
        safety_rule(s.cause).cleared_by == ClearedBy::release_and_reset) {
      s.stage = StopStage::running;
      s.cause = Fault::none;
      out.cleared = true;
      return out;
    }
    s.since_s = std::min(s.since_s + dt, params_.power_off_after_s);
  }

  // The hand's ramp begins on the tick of the stop and is over within hand_ramp_s of it.
  Ramp hand(s.hand);
  hand.step(false, 0, params_.hand_ramp_s, dt);
  s.hand = hand.at();
  out.quick_stop = true;
  out.gate_shut = true;
  out.hand_gain = hand.gain();

  // The drive brakes for at least a tick before its standstill is believed.
  const bool at_rest =
      (in.at_standstill && s.since_s > 0) || s.since_s >= params_.power_off_after_s - kRounding_s;
  if (at_rest && s.hand == 0) s.stage = StopStage::stopped;
  out.drive_power = s.stage != StopStage::stopped;
  out.heartbeat = out.drive_power || !asks_for(s.cause, SafetyAction::heartbeat_off);
  return out;
}

}  // namespace punctum::rt
