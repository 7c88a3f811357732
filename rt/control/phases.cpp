#include "rt/control/phases.hpp"

#include <algorithm>

namespace punctum::rt {

bool Phases::inside() const noexcept {
  return phase_ == Phase::puncture || phase_ == Phase::injection || phase_ == Phase::withdrawal;
}

bool Phases::timed_out() const noexcept {
  return in_phase_s_ > params_.timeout_s[static_cast<std::size_t>(phase_)];
}

void Phases::go(Phase next) noexcept {
  phase_ = next;
  changed_ = true;
  in_phase_s_ = 0;
}

Phase Phases::step(const PhaseInput& in, double dt_s) noexcept {
  changed_ = false;
  in_phase_s_ += std::max(dt_s, 0.0);
  const bool next_cell = in.next_cell && !next_cell_was_;
  next_cell_was_ = in.next_cell;

  if (phase_ == Phase::clear) {
    if (next_cell) {
      ++cell_;
      go(Phase::free);
    }
    return phase_;
  }
  if (!in.membrane_known) return phase_;

  const double w = in.depth_m;
  // What vision sees may begin a contact a little early, but never against the local model's hysteresis.
  const bool touches = w > params_.contact_on_m || (in.vision_contact && w > -params_.contact_off_m / 2);
  const bool gone = w < -params_.contact_off_m && !in.vision_contact;
  const bool far_gone = w < -params_.clear_m;
  switch (phase_) {
    case Phase::free:
      if (touches) go(Phase::contact);
      break;
    case Phase::contact:
      if (in.vision_punctured && w > params_.contact_on_m) {
        go(Phase::puncture);
      } else if (gone || far_gone) {
        go(Phase::free);
      } else if (w > params_.indentation_on_m) {
        go(Phase::indentation);
      }
      break;
    case Phase::indentation:
      if (in.vision_punctured) {
        go(Phase::puncture);
      } else if (w < params_.indentation_on_m / 2) {
        go(Phase::contact);
      }
      break;
    case Phase::puncture:
    case Phase::injection: {
      // By the encoders: what vision corrects meanwhile is no way back.
      deepest_m_ = std::max(deepest_m_, in.inward_m);
      const bool moves_back = in.outward_m_s > params_.withdrawal_speed_m_s &&
                              deepest_m_ - in.inward_m > params_.withdrawal_back_m;
      if (moves_back || w < -params_.contact_off_m) {
        go(Phase::withdrawal);
      } else if (phase_ == Phase::puncture && in.inject) {
        go(Phase::injection);
      }
      break;
    }
    case Phase::withdrawal:
      if (far_gone) go(Phase::clear);
      break;
    case Phase::clear:
      break;
  }
  if (entered(Phase::puncture)) deepest_m_ = in.inward_m;
  return phase_;
}

}  // namespace punctum::rt
