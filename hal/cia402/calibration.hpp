// Counts of the drives <-> the tip in the world frame: tip = offset + C counts. Each column of C is the
// motion of the tip with one count of one axis; axes may be oblique, and there may be more than three of
// them.
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>
#include <limits>

#include "hal/cia402/config.hpp"
#include "hal/realtime.hpp"

namespace punctum::cia402 {

using Counts = Eigen::Matrix<double, kMaxAxes, 1>;  // 0 beyond the last axis
using CountMatrix = Eigen::Matrix<double, 3, kMaxAxes>;

// Of the directions of the axes, largest by smallest stretch: 1 for three perpendicular axes; infinite where
// three axes do not span space. Set-up code.
[[nodiscard]] inline double condition_of_axes(const CanStageParams& params) {
  Eigen::Matrix3Xd directions(3, params.axis_count);
  for (int i = 0; i < params.axis_count; ++i) {
    directions.col(i) = params.axes[static_cast<std::size_t>(i)].count_m.normalized();
  }
  if (params.axis_count < 3 || !directions.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const Eigen::Vector3d stretch = Eigen::JacobiSVD<Eigen::Matrix3Xd>(directions).singularValues();
  return stretch[2] > 0 ? stretch[0] / stretch[2] : std::numeric_limits<double>::infinity();
}

class Calibration {
 public:
  // Set-up code. With fewer than three axes the tip is reached as nearly as they can.
  explicit Calibration(const CanStageParams& params) : offset_m_(params.tip_m) {
    tip_from_counts_.setZero();
    counts_from_tip_.setZero();
    if (params.axis_count == 0) {
      return;
    }
    Eigen::Matrix3Xd directions(3, params.axis_count);
    for (int i = 0; i < params.axis_count; ++i) {
      tip_from_counts_.col(i) = params.axes[static_cast<std::size_t>(i)].count_m;
      directions.col(i) = tip_from_counts_.col(i).normalized();
    }
    // Shortest way in metres along the axes: counts of different size do not decide which axis moves.
    const Eigen::MatrixXd inverse =
        directions.jacobiSvd(Eigen::ComputeThinU | Eigen::ComputeThinV).solve(Eigen::Matrix3d::Identity());
    for (int i = 0; i < params.axis_count; ++i) {
      counts_from_tip_.row(i) = inverse.row(i) / tip_from_counts_.col(i).norm();
    }
  }

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
