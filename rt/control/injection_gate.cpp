#include "rt/control/injection_gate.hpp"

#include "rt/control/sample_clock.hpp"

namespace punctum::rt {

bool InjectionGate::step(const Readings& readings, const GateInput& in, double elapsed_s) NONBLOCKING {
  if (in.new_cell) {
    open_s_ = 0;
  }
  // A hand that sends less often than the tick still presses between two of its samples.
  const bool hand_known = readings.hand_seen && readings.hand_age_s <= hand_timeout_s_;
  const bool pressed = readings.button(hal::kButtonInject);
  const bool allowed = !in.stopped && in.vision_fresh && readings.injector_known;
  const bool may_stay = allowed && in.injection_phase;
  armed_ = allowed && in.may_inject && hand_known && (armed_ || !(pressed || readings.inject_down));
  const bool wanted = !in.ending && armed_ && pressed;
  const bool too_short = open_ && this_time_s_ + kRounding_s < kShortest_s;
  const bool open = params_ && may_stay && (wanted || too_short) &&
                    open_s_ + elapsed_s <= params_->max_open_s + kRounding_s;
  if (open) {
    open_s_ += elapsed_s;
    this_time_s_ = open_ ? this_time_s_ + elapsed_s : elapsed_s;
  } else if (open_ && pressed) {
    armed_ = false;
  }
  open_ = open;
  return open;
}

}  // namespace punctum::rt
