// Tells a haptic device whose readings stand still, although they look fresh, from a hand that holds still.
//
// Two things give it away without a guess at what the hand is doing, axis by axis:
//  - From rest a handle cannot be far away on its next reading. If it is, the readings stood still, not the
//    handle.
//  - A force that changes by more than friction, and the pull of an arm over one encoder step, moves a handle
//    by at least a bit of its reading.
// A handle that stands still under a steady force is no evidence: friction or a resting arm holds it, and
// nothing goes out that would tell. It is not reported.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "hal/devices.hpp"

namespace punctum::rt {

class HandWatch {
 public:
  // A good reading, elapsed_s after the one before; force: on the handle meanwhile.
  void step(const hal::Vec3& position_m, const hal::Vec3& force_N, double elapsed_s) noexcept {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      Axis& axis = axes_[i];
      const double x_m = position_m[static_cast<Eigen::Index>(i)];
      const double f_N = force_N[static_cast<Eigen::Index>(i)];
      if (x_m != axis.at_m) {
        axis = {.at_m = x_m, .low_N = f_N, .high_N = f_N};
        continue;
      }
      axis.still_s += elapsed_s;
      axis.low_N = std::min(axis.low_N, f_N);
      axis.high_N = std::max(axis.high_N, f_N);
      if (axis.high_N - axis.low_N > kMoving_N) axis.unmoved_s += elapsed_s;
    }
  }

  // A changing force has not moved the handle.
  [[nodiscard]] bool stuck() const noexcept {
    return std::any_of(axes_.begin(), axes_.end(), [](const Axis& a) { return a.unmoved_s > kUnmoved_s; });
  }

  // An axis whose readings were the same for longer than still_s is further away than a hand can push it
  // within elapsed_s.
  [[nodiscard]] bool leaps(const hal::Vec3& position_m, double still_s, double elapsed_s) const noexcept {
    const double reach_m = reach_from_rest_m(elapsed_s);
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      const double way_m = std::abs(position_m[static_cast<Eigen::Index>(i)] - axes_[i].at_m);
      if (axes_[i].still_s > still_s && way_m > reach_m) return true;
    }
    return false;
  }

 private:
  static constexpr double kPush_m_s2 = 100;
  static constexpr double kSampling_s = 0.005;  // a device may sample slowly and repeat its readings
  static constexpr double kMoving_N = 0.5;
  static constexpr double kUnmoved_s = 0.1;  // half a newton moves a kilogram by an encoder step in 15 ms

  struct Axis {
    double at_m = 0;
    double low_N = 0;
    double high_N = 0;
    double still_s = 0;    // so long it has been there
    double unmoved_s = 0;  // since the force has changed by kMoving_N
  };

  [[nodiscard]] static double reach_from_rest_m(double elapsed_s) noexcept {
    const double t = elapsed_s + kSampling_s;
    return 0.5 * kPush_m_s2 * t * t;
  }

  std::array<Axis, 3> axes_{};
};

}  // namespace punctum::rt
