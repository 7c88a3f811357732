#include "rt/control/hand_velocity.hpp"

#include <cmath>

#include "rt/forces/ramp.hpp"

namespace punctum::rt {

HandVelocity::HandVelocity(const VelocityParams& params, double rate_Hz) NONBLOCKING
    : smooth_s_(params.smooth_s) {
  if (params.method == VelocityParams::Method::foaw) {
    foaw_.emplace(at_rate(params, rate_Hz));
  } else {
    kalman_.emplace(params, 1 / rate_Hz);
  }
}

const hal::Vec3& HandVelocity::step(const Readings& readings, double dt_s) NONBLOCKING {
  if (readings.hand_begins || readings.hand_leaps) {
    restart();
  }
  if (readings.hand_fresh && kalman_) {
    estimated_m_s_ = kalman_->step(readings.hand.position_m, readings.between_hand_s);
  }
  if (readings.hand_fresh && foaw_) {
    estimated_m_s_ = foaw_->step(readings.hand.position_m, readings.between_hand_s);
  }
  const double part = low_pass_part(dt_s, smooth_s_);
  smoothed_m_s_ += part * (estimated_m_s_ - smoothed_m_s_);
  return smoothed_m_s_;
}

void HandVelocity::restart() NONBLOCKING {
  if (kalman_) {
    kalman_->restart();
  }
  if (foaw_) {
    foaw_->restart();
  }
}

}  // namespace punctum::rt
