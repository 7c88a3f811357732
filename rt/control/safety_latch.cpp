#include "rt/control/safety_latch.hpp"

#include <algorithm>

namespace punctum::rt {

LatchOutput SafetyLatch::step(const LatchInput& in, double dt_s) noexcept {
  const double dt = std::max(dt_s, 0.0);
  const bool reset_edge = in.reset_pressed && !reset_was_ && in.chain_readable;
  if (in.chain_readable) reset_was_ = in.reset_pressed;

  LatchOutput out;
  if (stage_ == StopStage::running) {
    if (in.cause == Fault::none) return out;
    cause_ = in.cause;  // the first; later ones do not replace it
    stage_ = StopStage::stopping;
    since_s_ = 0;
    hand_.set(1);
  } else if (stage_ == StopStage::stopped) {
    const bool released = in.chain_readable && in.contacts_closed && in.cause == Fault::none;
    if (reset_edge && released && safety_rule(cause_).cleared_by == ClearedBy::release_and_reset) {
      stage_ = StopStage::running;
      cause_ = Fault::none;
      out.cleared = true;
      return out;
    }
    since_s_ += dt;
  } else {
    since_s_ += dt;
  }

  // The hand's ramp begins on the tick of the stop and is over within hand_ramp_s of it.
  hand_.step(false, 0, params_.hand_ramp_s, dt);
  out.quick_stop = true;
  out.gate_shut = true;
  out.hand_gain = hand_.gain();
  // The drive brakes for at least a tick before it counts as standing still.
  const bool at_rest = (in.at_standstill && since_s_ > 0) || since_s_ >= params_.power_off_after_s;
  if (stage_ == StopStage::stopping && at_rest && hand_.at() == 0) stage_ = StopStage::stopped;
  out.drive_power = stage_ != StopStage::stopped;
  out.heartbeat = !(stage_ == StopStage::stopped && asks_for(cause_, SafetyAction::heartbeat_off));
  return out;
}

}  // namespace punctum::rt
