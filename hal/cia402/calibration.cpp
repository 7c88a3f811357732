#include "hal/cia402/calibration.hpp"

#include <Eigen/SVD>
#include <limits>

namespace punctum::cia402 {

double condition_of_axes(const CanStageParams& params) {
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

Calibration::Calibration(const CanStageParams& params) : offset_m_(params.tip_m) {
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

}  // namespace punctum::cia402
