#include "rt/forces/vibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::rt {
namespace {

constexpr double kDecays = 7;  // a burst ends after as many: a thousandth is left

}  // namespace

Vibration::Vibration(const VibrationParams& params, const EffectSetup& setup) NONBLOCKING
    : params_(params),
      delay_(static_cast<std::size_t>(std::clamp(setup.force_delay_ticks, 0, kKept - 1))) {
  given_N_.fill(hal::Vec3::Zero());
}

EffectOutput Vibration::step(const EffectInput& in) NONBLOCKING {
  const double last_injected_J = injected_J_;
  if (stepped_) {
    const double work_J = given_N_[delay_].dot(in.handle_m - last_handle_m_);
    injected_J_ += work_J;
    burst_J_ += work_J;
  }
  last_handle_m_ = in.handle_m;
  stepped_ = true;

  since_s_ += in.dt_s;
  if (in.contact_or_puncture_begins) {
    running_ = true;
    since_s_ = 0;
    burst_J_ = 0;
  }
  if (since_s_ > kDecays * params_.decay_s || burst_J_ > params_.energy_J) {
    running_ = false;
  }

  EffectOutput out;
  if (running_) {
    const double swing = math::sin(2 * std::numbers::pi * params_.frequency_Hz * since_s_);
    out.active_N = params_.amplitude_N * math::exp(-since_s_ / params_.decay_s) * swing * in.approach_axis;
  }
  std::copy_backward(given_N_.begin(), given_N_.end() - 1, given_N_.end());
  given_N_.front() = in.force_fade * out.active_N;
  out.injected_J = injected_J_ - last_injected_J;
  return out;
}

}  // namespace punctum::rt
