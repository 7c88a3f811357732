#include "hal/falcon/kinematics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace punctum::falcon {
namespace {

// Stamper's letters, in m: arm, rods, joints of the grip, joints of the rods, the grip across, and where the
// motors' axes are.
constexpr double a = 0.060, b = 0.1025, c = 0.01443, d = 0.01125, e = 0.01125, f = -0.025, r = 0.040,
                 s = -0.02309;
constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array<double, 3> kLeg_rad = {105 * kDegree, -15 * kDegree, -135 * kDegree};

constexpr double kCount_rad = 2 * std::numbers::pi / (4 * 320) * 14.25 / 110;
constexpr double kZero_rad = 35 * kDegree;

constexpr int kMostSteps = 20;
constexpr double kLongestStep_m = 0.03;
// Newton squares its error: after a step this short it is below the rounding of the lengths, and the Jacobian
// from before the step is exact as well.
constexpr double kLastStep_m = 1e-10;
// What the grip can reach, and a little beyond: where an arm and its rods are nearly in line, the encoders
// tell next to nothing of the position.
constexpr double kReach_m = 0.075, kNearest_m = 0.065, kFarthest_m = 0.185, kLeastLeverage = 0.1;

constexpr double kMotorPerNm = -1e4, kMostMotor = 4096;

// One leg at a position: how much the rods are too long, and its derivatives.
struct Leg {
  double error_m = 0;
  hal::Vec3 gradient = hal::Vec3::Zero();  // of the error by the position
  double by_angle_m = 0;                   // minus its derivative by the arm's angle
  double leverage = 0;
  bool possible = false;
};

Leg leg_at(const hal::Vec3& p, double phi, double theta) {
  const double cos_phi = std::cos(phi), sin_phi = std::sin(phi);
  const double u = cos_phi * p.x() + sin_phi * p.y() - r;
  const double v = -sin_phi * p.x() + cos_phi * p.y() - s;
  const double across_m = v + f;
  const double within = b * b - across_m * across_m;
  Leg leg;
  if (!(within > 1e-6 * b * b)) {
    return leg;
  }
  const double rods_m = std::sqrt(within);  // in the plane of the arm
  const double along_m = u + c - a * std::cos(theta), up_m = p.z() - a * std::sin(theta);
  const double reach_m = std::hypot(along_m, up_m);
  if (!(reach_m > 1e-3)) {
    return leg;
  }
  const double cos_2 = along_m / reach_m, sin_2 = up_m / reach_m;
  const double by_u = cos_2, by_v = across_m / rods_m;
  leg.error_m = reach_m - (d + e + rods_m);
  leg.gradient = {cos_phi * by_u - sin_phi * by_v, sin_phi * by_u + cos_phi * by_v, sin_2};
  leg.leverage = sin_2 * std::cos(theta) - cos_2 * std::sin(theta);
  leg.by_angle_m = a * leg.leverage;
  leg.possible = true;
  return leg;
}

bool reachable(const Pose& pose) {
  const hal::Vec3& p = pose.position_m;
  return std::hypot(p.x(), p.y()) <= kReach_m && p.z() >= kNearest_m && p.z() <= kFarthest_m &&
         pose.least_leverage >= kLeastLeverage;
}

}  // namespace

hal::Vec3 arm_angles(const Counts& encoders) {
  return {kZero_rad + kCount_rad * encoders[0], kZero_rad + kCount_rad * encoders[1],
          kZero_rad + kCount_rad * encoders[2]};
}

std::optional<Pose> solve(const hal::Vec3& angles_rad) {
  Pose pose;
  for (int step = 0; step < kMostSteps; ++step) {
    hal::Vec3 error_m, by_angle_m;
    Matrix3 gradient;
    pose.least_leverage = 1;
    for (int i = 0; i < 3; ++i) {
      const Leg leg = leg_at(pose.position_m, kLeg_rad[static_cast<std::size_t>(i)], angles_rad[i]);
      if (!leg.possible) {
        return std::nullopt;
      }
      error_m[i] = leg.error_m;
      gradient.row(i) = leg.gradient;
      by_angle_m[i] = leg.by_angle_m;
      pose.least_leverage = std::min(pose.least_leverage, leg.leverage);
    }
    const Matrix3 inverse = gradient.inverse();
    const hal::Vec3 motion_m = inverse * error_m;
    if (!motion_m.allFinite()) {
      return std::nullopt;
    }
    const double length_m = motion_m.norm();
    pose.position_m -= motion_m * std::min(1.0, kLongestStep_m / std::max(length_m, kLastStep_m));
    if (length_m < kLastStep_m) {
      pose.jacobian = inverse * by_angle_m.asDiagonal();
      return reachable(pose) ? std::optional(pose) : std::nullopt;
    }
  }
  return std::nullopt;
}

Counts motors_for(const Pose& pose, const hal::Vec3& force_N) {
  const hal::Vec3 wanted = kMotorPerNm * (pose.jacobian.transpose() * force_N);
  const double largest = wanted.cwiseAbs().maxCoeff();
  if (!std::isfinite(largest)) {
    return {};
  }
  const double scale = largest > kMostMotor ? kMostMotor / largest : 1;
  Counts motors;
  for (int i = 0; i < 3; ++i) {
    motors[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(std::lround(scale * wanted[i]));
  }
  return motors;
}

}  // namespace punctum::falcon
