// Counts of the drives <-> the tip in the world frame: tip = offset + C counts. Each column of C is the
// motion of the tip with one count of one axis; axes may be oblique, and there may be more than three of
// them.
#pragma once

#include <Eigen/Core>

#include "hal/cia402/config.hpp"
#include "hal/realtime.hpp"

namespace punctum::cia402 {

using Counts = Eigen::Matrix<double, kMaxAxes, 1>;  // 0 beyond the last axis
using CountMatrix = Eigen::Matrix<double, 3, kMaxAxes>;

// Of the directions of the axes, largest by smallest stretch: 1 for three perpendicular axes; infinite where
// three axes do not span space. Set-up code.
[[nodiscard]] double condition_of_axes(const CanStageParams& params);

class Calibration {
 public:
  // Set-up code. With fewer than three axes the tip is reached as nearly as they can.
  explicit Calibration(const CanStageParams& params);

  [[nodiscard]] hal::Vec3 tip_m(const Counts& counts) const NONBLOCKING {
    return offset_m_ + motion_m(counts);
  }
  [[nodiscard]] hal::Vec3 motion_m(const Counts& counts) const NONBLOCKING {
    return tip_from_counts_.lazyProduct(counts);
  }
  [[nodiscard]] Counts counts(const hal::Vec3& motion_m) const NONBLOCKING {
    return counts_from_tip_.lazyProduct(motion_m);
  }

 private:
  CountMatrix tip_from_counts_;
  Eigen::Matrix<double, kMaxAxes, 3> counts_from_tip_;
  hal::Vec3 offset_m_;
};

}  // namespace punctum::cia402
