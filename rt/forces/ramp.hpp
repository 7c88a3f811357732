// The soft edges every effect shares: a force that begins without a corner, and a gain that moves without a
// step.
#pragma once

#include <algorithm>

namespace punctum::rt {

// psi(delta) = 0 | delta^2/(2 eps) | delta - eps/2: a unit spring that begins at delta = 0 with no corner
// (C1).
[[nodiscard]] constexpr double soft_spring(double delta, double eps) noexcept {
  if (delta <= 0) return 0;
  return delta < eps ? delta * delta / (2 * eps) : delta - eps / 2;
}

// Its potential, the integral of psi from 0.
[[nodiscard]] constexpr double soft_spring_energy(double delta, double eps) noexcept {
  if (delta <= 0) return 0;
  if (delta < eps) return delta * delta * delta / (6 * eps);
  return delta * delta / 2 - eps * delta / 2 + eps * eps / 6;
}

// 0 below 0, 1 above 1, C2 in between; and its derivative.
[[nodiscard]] constexpr double smooth_step(double t) noexcept {
  if (t <= 0) return 0;
  if (t >= 1) return 1;
  return t * t * t * (t * (6 * t - 15) + 10);
}
[[nodiscard]] constexpr double smooth_step_slope(double t) noexcept {
  if (t <= 0 || t >= 1) return 0;
  return 30 * t * t * (1 - t) * (1 - t);
}

// A number in 0 .. 1 that runs towards 0 or 1 in a given time; its gain() has no corner at either end.
class Ramp {
 public:
  explicit constexpr Ramp(double at = 0) noexcept : at_(at) {}

  // up_s, down_s: time for the whole way; 0 = at once.
  constexpr void step(bool up, double up_s, double down_s, double dt_s) noexcept {
    const double whole_s = up ? up_s : down_s;
    const double part = whole_s > 0 ? dt_s / whole_s : 1.0;
    at_ = std::clamp(at_ + (up ? part : -part), 0.0, 1.0);
    // Rounding leaves no crumb that would cost a tick.
    if (at_ < kCrumb) at_ = 0;
    if (at_ > 1 - kCrumb) at_ = 1;
  }
  constexpr void set(double at) noexcept { at_ = at; }
  [[nodiscard]] constexpr double at() const noexcept { return at_; }
  [[nodiscard]] constexpr double gain() const noexcept { return smooth_step(at_); }

 private:
  static constexpr double kCrumb = 1e-9;
  double at_;
};

}  // namespace punctum::rt
