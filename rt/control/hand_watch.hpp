// Tells a haptic device whose readings stand still, although they look fresh, from a hand that holds still.
//
// Two things give it away without a guess at what the hand is doing:
//  - From rest a handle cannot be far away on its next reading. If it is, the readings stood still, not the
//    handle.
//  - A force that changes by more than friction, and the pull of an arm over one encoder step, moves a handle
//    by at least a bit of its reading.
// A handle that stands still under a steady force is no evidence: friction or a resting arm holds it, and
// nothing goes out that would tell. It is not reported.
#pragma once

#include "hal/devices.hpp"

namespace punctum::rt {

class HandWatch {
 public:
  // A good reading, elapsed_s after the one before; force: on the handle meanwhile.
  void step(const hal::HandState& reading, const hal::Vec3& force_N, double elapsed_s) noexcept {
    if (!same(reading, last_)) {
      last_ = reading;
      still_s_ = unmoved_s_ = 0;
      low_N_ = high_N_ = force_N;
      return;
    }
    still_s_ += elapsed_s;
    low_N_ = low_N_.cwiseMin(force_N);
    high_N_ = high_N_.cwiseMax(force_N);
    if ((high_N_ - low_N_).maxCoeff() > kMoving_N) unmoved_s_ += elapsed_s;
  }

  // All readings have been the same for so long.
  [[nodiscard]] double still_s() const noexcept { return still_s_; }
  // A changing force has not moved the handle.
  [[nodiscard]] bool stuck() const noexcept { return unmoved_s_ > kUnmoved_s; }

  // How far a handle at rest can be elsewhere elapsed_s later: a hard push, by a device that samples slowly.
  [[nodiscard]] static double reach_from_rest_m(double elapsed_s) noexcept {
    const double t = elapsed_s + kSampling_s;
    return 0.5 * kPush_m_s2 * t * t;
  }

 private:
  static constexpr double kPush_m_s2 = 100;
  static constexpr double kSampling_s = 0.005;
  static constexpr double kMoving_N = 0.5;
  static constexpr double kUnmoved_s = 0.1;  // half a newton moves a kilogram by an encoder step in 15 ms

  [[nodiscard]] static bool same(const hal::HandState& a, const hal::HandState& b) noexcept {
    return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
  }

  hal::HandState last_;
  hal::Vec3 low_N_ = hal::Vec3::Zero();
  hal::Vec3 high_N_ = hal::Vec3::Zero();
  double still_s_ = 0;
  double unmoved_s_ = 0;
};

}  // namespace punctum::rt
