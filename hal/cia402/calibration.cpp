#include "hal/cia402/calibration.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace punctum::cia402 {
namespace {

// Where axes stretch space by less than this part of the most, they do not reach.
constexpr double kNoStretch = 1e-6;

using Directions = Eigen::Matrix<double, 3, kMaxAxes>;  // unit vectors; 0 beyond the last axis

Directions directions_of(const CanStageParams& params) {
  Directions directions = Directions::Zero();
  for (int i = 0; i < params.axis_count; ++i) {
    directions.col(i) = params.axes[static_cast<std::size_t>(i)].count_m.normalized();
  }
  return directions;
}

// Squares of the singular values of the directions, from the smallest on, and where they act.
using Stretch = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

}  // namespace

double condition_of_axes(const CanStageParams& params) {
  const Directions directions = directions_of(params);
  if (params.axis_count < 1 || !directions.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const Eigen::Vector3d squares = Stretch(directions * directions.transpose()).eigenvalues();
  const double condition = std::sqrt(squares[2] / squares[3 - std::min(params.axis_count, 3)]);
  return condition < 1 / kNoStretch ? condition : std::numeric_limits<double>::infinity();
}

std::optional<hal::Mat3> reach_of_axes(const CanStageParams& params) {
  if (params.axis_count >= 3) {
    return std::nullopt;
  }
  hal::Mat3 reach = hal::Mat3::Zero();
  const Directions directions = directions_of(params);
  for (int i = 0; i < params.axis_count; ++i) {
    const hal::Vec3 rest = directions.col(i) - reach * directions.col(i);
    reach += rest.normalized() * rest.normalized().transpose();
  }
  return reach;
}

Calibration::Calibration(const CanStageParams& params) : offset_m_(params.tip_m) {
  tip_from_counts_.setZero();
  counts_from_tip_.setZero();
  const Directions directions = directions_of(params);
  const Stretch stretch(directions * directions.transpose());
  const Eigen::Vector3d& squares = stretch.eigenvalues();
  Eigen::Vector3d undone = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    undone[i] = squares[i] > kNoStretch * kNoStretch * squares[2] ? 1 / squares[i] : 0;
  }
  // Shortest way in metres along the axes: counts of different size do not decide which axis moves.
  const Eigen::Matrix<double, kMaxAxes, 3> inverse = directions.transpose() * stretch.eigenvectors() *
                                                     undone.asDiagonal() * stretch.eigenvectors().transpose();
  for (int i = 0; i < params.axis_count; ++i) {
    const hal::Vec3& count_m = params.axes[static_cast<std::size_t>(i)].count_m;
    tip_from_counts_.col(i) = count_m;
    counts_from_tip_.row(i) = inverse.row(i) / count_m.norm();
  }
}

}  // namespace punctum::cia402
