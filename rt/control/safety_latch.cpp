#include "rt/control/safety_latch.hpp"

#include <algorithm>

#include "rt/control/sample_clock.hpp"

namespace punctum::rt {
namespace {

[[nodiscard]] bool asks_for_reset(Fault cause) NONBLOCKING {
  return cause != Fault::none && safety_rule(cause).cleared_by != ClearedBy::release_and_press;
}

}  // namespace

LatchOutput SafetyLatch::step(const LatchInput& in, double dt_s) NONBLOCKING {
  State& s = state_;
  const double dt = std::max(dt_s, 0.0);
  const bool released = in.contacts_closed && in.causes.first == Fault::none && in.drive_obeys;
  if (in.reset_down || in.reset_pressed) {
    s.reset_spent = s.reset_spent || s.stage != StopStage::stopped || !released;
  } else {
    s.reset_spent = s.reset_spent && !in.chain_readable;
  }

  LatchOutput out;
  if (s.stage == StopStage::running) {
    if (in.causes.first == Fault::none) {
      return out;
    }
    s.stage = StopStage::stopping;
    s.cause = in.causes.first;  // the first; later ones do not replace it
    s.reset_needed = asks_for_reset(in.causes.first);
    s.since_s = 0;
    s.hand = 1;
  } else {
    s.reset_needed = s.reset_needed || asks_for_reset(in.causes.first);
    const bool reset = in.chain_readable && in.reset_pressed && !s.reset_spent;
    const bool asked = s.reset_needed ? reset : in.pressed_anew;
    if (s.stage == StopStage::stopped && released && asked &&
        safety_rule(s.cause).cleared_by != ClearedBy::never) {
      s.stage = StopStage::running;
      s.cause = Fault::none;
      s.reset_needed = false;
      s.distrusted = false;
      s.reset_spent = true;
      out.cleared = true;
      return out;
    }
    s.since_s = std::min(s.since_s + dt, params_.power_off_after_s);
  }

  s.distrusted = s.distrusted || (in.causes.all & kDistrusted) != 0 || !in.drive_obeys;

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
  if (at_rest && s.hand == 0) {
    s.stage = StopStage::stopped;
  }
  out.drive_power = s.stage != StopStage::stopped;
  out.heartbeat = out.drive_power || !s.distrusted;
  return out;
}

}  // namespace punctum::rt
