#include "rt/forces/vibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace punctum::rt {
namespace {

constexpr double kDecays = 7;  // a burst ends after as many: a thousandth is left

}  // namespace

Vibration::Vibration(const VibrationParams& params, int delay_ticks) noexcept
    : params_(params), delay_(static_cast<std::size_t>(std::clamp(delay_ticks, 0, kKept - 1))) {
  given_N_.fill(hal::Vec3::Zero());
}

hal::Vec3 Vibration::step(const hal::Vec3& hand_m, const hal::Vec3& axis, bool begins, double gain,
                          double dt_s) noexcept {
  if (seen_) {
    const double work_J = given_N_[delay_].dot(hand_m - hand_before_m_);
    injected_J_ += work_J;
    burst_J_ += work_J;
  }
  hand_before_m_ = hand_m;
  seen_ = true;

  since_s_ += dt_s;
  if (begins) {
    running_ = true;
    since_s_ = 0;
    burst_J_ = 0;
  }
  if (since_s_ > kDecays * params_.decay_s || burst_J_ > params_.energy_J) running_ = false;

  hal::Vec3 force_N = hal::Vec3::Zero();
  if (running_) {
    const double swing = std::sin(2 * std::numbers::pi * params_.frequency_Hz * since_s_);
    force_N = params_.amplitude_N * std::exp(-since_s_ / params_.decay_s) * swing * axis;
  }
  std::copy_backward(given_N_.begin(), given_N_.end() - 1, given_N_.end());
  given_N_.front() = gain * force_N;
  return force_N;
}

}  // namespace punctum::rt
