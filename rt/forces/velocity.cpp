#include "rt/forces/velocity.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::rt {
namespace {

constexpr double kRoundingSlack = 1 + 1e-9;  // a sample exactly one encoder step off is still within d

}  // namespace

VelocityParams at_rate(VelocityParams params, double rate_Hz) noexcept {
  const double intervals = params.window * std::max(rate_Hz / 1000, 1.0);
  params.window = static_cast<int>(std::min(intervals, static_cast<double>(Foaw::kMaxWindow)));
  return params;
}

Foaw::Foaw(const VelocityParams& params) noexcept
    : window_(std::clamp(params.window, 1, kMaxWindow)), d_m_(params.d_m * kRoundingSlack) {}

hal::Vec3 Foaw::step(const hal::Vec3& position_m, double dt_s) noexcept {
  if (count_ > 0 && !(dt_s > 0)) return velocity_;
  constexpr int kRing = kMaxWindow + 1;
  newest_ = (newest_ + 1) % kRing;
  const auto at = [this](int ago) { return static_cast<std::size_t>((newest_ - ago + kRing) % kRing); };
  step_s_[at(0)] = dt_s;
  for (std::size_t axis = 0; axis < 3; ++axis) x_[axis][at(0)] = position_m[static_cast<Eigen::Index>(axis)];
  count_ = std::min(count_ + 1, kRing);
  if (count_ < 2) return velocity_ = hal::Vec3::Zero();

  // Times and positions are taken relative to the newest sample, which the line runs through.
  std::array<double, kRing> t;
  t[0] = 0;
  const int longest = std::min(window_, count_ - 1);
  for (int i = 1; i <= longest; ++i) {
    t[static_cast<std::size_t>(i)] = t[static_cast<std::size_t>(i - 1)] - step_s_[at(i - 1)];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<double, kRing> y;
    const double newest = x_[axis][at(0)];
    double St = 0;
    double Stt = 0;
    double Sy = 0;
    double Sty = 0;
    double best = 0;
    for (int n = 1; n <= longest; ++n) {
      const auto i = static_cast<std::size_t>(n);
      y[i] = x_[axis][at(n)] - newest;
      St += t[i];
      Stt += t[i] * t[i];
      Sy += y[i];
      Sty += t[i] * y[i];
      const double samples = n + 1;
      const double slope = (samples * Sty - St * Sy) / (samples * Stt - St * St);
      bool fits = true;
      for (std::size_t j = 1; j <= i && fits; ++j) fits = std::abs(y[j] - slope * t[j]) <= d_m_;
      if (!fits && n > 1) break;
      best = slope;
    }
    velocity_[static_cast<Eigen::Index>(axis)] = best;
  }
  return velocity_;
}

}  // namespace punctum::rt
