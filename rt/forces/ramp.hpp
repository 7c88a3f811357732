// What every effect shares: a spring force that begins without a corner, and a gain that moves without a
// step.
#pragma once

#include <algorithm>

#include "hal/math/elementary.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

// psi(delta) = 0 | delta^2/(2 eps) | delta - eps/2: a unit spring that begins at delta = 0 with no corner
// (C1).
[[nodiscard]] constexpr double soft_spring(double delta, double eps) NONBLOCKING {
  if (delta <= 0) {
    return 0;
  }
  return delta < eps ? delta * delta / (2 * eps) : delta - eps / 2;
}

// Its potential, the integral of psi from 0.
[[nodiscard]] constexpr double soft_spring_energy(double delta, double eps) NONBLOCKING {
  if (delta <= 0) {
    return 0;
  }
  if (delta < eps) {
    return delta * delta * delta / (6 * eps);
  }
  return delta * delta / 2 - eps * delta / 2 + eps * eps / 6;
}

// 0 below 0, 1 above 1, C2 in between; and its derivative.
[[nodiscard]] constexpr double smooth_step(double t) NONBLOCKING {
  if (t <= 0) {
    return 0;
  }
  if (t >= 1) {
    return 1;
  }
  return t * t * t * (t * (6 * t - 15) + 10);
}
[[nodiscard]] constexpr double smooth_step_slope(double t) NONBLOCKING {
  if (t <= 0 || t >= 1) {
    return 0;
  }
  return 30 * t * t * (1 - t) * (1 - t);
}

// What a first-order low-pass of time constant tau_s takes over of its input within dt_s; all of it for tau_s
// = 0.
[[nodiscard]] inline double low_pass_part(double dt_s, double tau_s) NONBLOCKING {
  return tau_s > 0 ? 1 - math::exp(-dt_s / tau_s) : 1.0;
}

// A number in 0 .. 1 that runs towards 0 or 1 in a given time; its gain() has no corner at either end.
class Ramp {
 public:
  explicit constexpr Ramp(double at = 0) NONBLOCKING : at_(at) {}

  // up_s, down_s: time for the whole way; 0 = at once.
  constexpr void step(bool up, double up_s, double down_s, double dt_s) NONBLOCKING {
    if (at_ == (up ? 1.0 : 0.0)) {
      return;
    }
    const double whole_s = up ? up_s : down_s;
    const double part = whole_s > 0 ? dt_s / whole_s : 1.0;
    at_ = std::clamp(at_ + (up ? part : -part), 0.0, 1.0);
    // A rest that rounding leaves would take a tick of its own.
    if (at_ < kRounding) {
      at_ = 0;
    }
    if (at_ > 1 - kRounding) {
      at_ = 1;
    }
  }
  constexpr void set(double at) NONBLOCKING { at_ = at; }
  [[nodiscard]] constexpr double at() const NONBLOCKING { return at_; }
  [[nodiscard]] constexpr double gain() const NONBLOCKING { return smooth_step(at_); }

 private:
  static constexpr double kRounding = 1e-9;
  double at_;
};

}  // namespace punctum::rt
