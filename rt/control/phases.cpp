#include "rt/control/phases.hpp"

#include <algorithm>

namespace punctum::rt {

bool Phases::inside() const NONBLOCKING {
  return state_.phase == Phase::puncture || state_.phase == Phase::injection ||
         state_.phase == Phase::withdrawal;
}

bool Phases::timed_out() const NONBLOCKING {
  return state_.in_phase_s > params_.timeout_s[static_cast<std::size_t>(state_.phase)];
}

void Phases::go(Phase next) NONBLOCKING {
  state_.phase = next;
  state_.changed = true;
  state_.in_phase_s = 0;
}

Phase Phases::step(const PhaseInput& in, double dt_s) NONBLOCKING {
  state_.changed = false;
  state_.in_phase_s += std::max(dt_s, 0.0);
  const bool next_cell = in.next_cell && !state_.next_cell_was;
  state_.next_cell_was = in.next_cell;
  const bool inject = in.inject && !state_.inject_was;
  state_.inject_was = in.inject;

  if (state_.phase == Phase::clear) {
    if (next_cell) {
      ++state_.cell;
      go(Phase::free);
    }
    return state_.phase;
  }
  if (!in.membrane_known) {
    return state_.phase;
  }

  const double w = in.depth_m;
  // What vision sees may begin a contact a little early, but never against the local model's hysteresis.
  const bool touches = w > params_.contact_on_m || (in.vision_contact && w > -params_.contact_off_m / 2);
  const bool gone = w < -params_.contact_off_m && !in.vision_contact;
  const bool far_gone = w < -params_.clear_m;
  switch (state_.phase) {
    case Phase::free:
      if (touches) {
        go(Phase::contact);
      }
      break;
    case Phase::contact:
      if (gone || far_gone) {
        go(Phase::free);
      } else if (w > params_.indentation_on_m) {
        go(Phase::indentation);
      }
      break;
    case Phase::indentation:
      if (in.vision_punctured && in.contact_depth_m > params_.indentation_on_m / 2) {
        go(Phase::puncture);
      } else if (w < params_.indentation_on_m / 2) {
        go(Phase::contact);
      }
      break;
    case Phase::puncture:
    case Phase::injection: {
      // By the encoders: a correction by vision is no motion of the needle.
      state_.deepest_m = std::max(state_.deepest_m, in.inward_m);
      const bool moves_back = in.outward_m_s > params_.withdrawal_speed_m_s &&
                              state_.deepest_m - in.inward_m > params_.withdrawal_back_m;
      if (moves_back || w < -params_.contact_off_m) {
        go(Phase::withdrawal);
      } else if (state_.phase == Phase::puncture && inject && in.may_inject) {
        go(Phase::injection);
      }
      break;
    }
    case Phase::withdrawal:
      if (far_gone && in.contact_depth_m < 0 && !in.vision_contradicts) {
        go(Phase::clear);
      }
      break;
    case Phase::clear:
      break;
  }
  if (entered(Phase::puncture)) {
    state_.deepest_m = in.inward_m;
  }
  return state_.phase;
}

}  // namespace punctum::rt
