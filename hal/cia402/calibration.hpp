// Counts of the drives <-> the tip in the world frame: tip = offset + C counts. Each column of C is the
// motion of the tip with one count of one axis; axes may be oblique, and there may be fewer or more than
// three of them.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "hal/cia402/config.hpp"
#include "hal/realtime.hpp"

namespace punctum::cia402 {

using Counts = Eigen::Matrix<double, kMaxAxes, 1>;  // 0 beyond the last axis
using CountMatrix = Eigen::Matrix<double, 3, kMaxAxes>;

// Of the directions of the axes, largest by smallest stretch: 1 for perpendicular axes; infinite where two
// axes do not span a plane, or three and more not space. Set-up code.
[[nodiscard]] double condition_of_axes(const CanStageParams& params);

// Of one or two axes, the projector onto the motions of the tip that they can make; none where axes span
// space. Set-up code.
[[nodiscard]] std::optional<hal::Mat3> reach_of_axes(const CanStageParams& params);

class Calibration {
 public:
  // Set-up code. With fewer than three axes the tip comes as near as they can bring it.
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
