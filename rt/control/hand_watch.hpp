// Finds a haptic device whose readings have stopped although they look fresh.
//
// A hand may hold still too. One fact, axis by axis, shows that the readings stopped and not the handle: a
// force that changes by more than friction and by more than an arm pulls over one encoder step moves a handle
// by at least one bit of its reading. (HandCheck finds the leap with which such readings go on.) A handle
// that stands still under a steady force is no evidence: friction or a resting arm may hold it. It is not
// reported.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

class HandWatch {
 public:
  // A good reading, elapsed_s after the one before; force: on the handle meanwhile.
  void step(const hal::Vec3& position_m, const hal::Vec3& force_N, double elapsed_s) NONBLOCKING {
    stuck_ = false;
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      Axis& axis = axes_[i];
      const double x_m = position_m[static_cast<Eigen::Index>(i)];
      const double f_N = force_N[static_cast<Eigen::Index>(i)];
      if (x_m != axis.at_m) {
        axis = {.at_m = x_m, .low_N = f_N, .high_N = f_N};
        continue;
      }
      axis.low_N = std::min(axis.low_N, f_N);
      axis.high_N = std::max(axis.high_N, f_N);
      if (axis.high_N - axis.low_N > kMoving_N) {
        axis.unmoved_s = std::min(axis.unmoved_s + elapsed_s, 2 * kUnmoved_s);
      }
      stuck_ = stuck_ || axis.unmoved_s > kUnmoved_s;
    }
  }

  // A changing force has not moved the handle.
  [[nodiscard]] bool stuck() const NONBLOCKING { return stuck_; }

 private:
  static constexpr double kMoving_N = 0.5;
  static constexpr double kUnmoved_s = 0.1;  // half a newton moves a kilogram by an encoder step in 15 ms

  struct Axis {
    double at_m = 0;
    double low_N = 0;
    double high_N = 0;
    double unmoved_s = 0;  // the time since the force has changed by kMoving_N, up to 2 kUnmoved_s
  };

  std::array<Axis, 3> axes_{};
  bool stuck_ = false;
};

}  // namespace punctum::rt
