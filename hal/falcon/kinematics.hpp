// The three arms of a Falcon: encoder counts to the position of the grip, forces to motor values.
//
// R. E. Stamper, "A Three Degree of Freedom Parallel Manipulator with Only Translational Degrees of Freedom",
// thesis, 1997, with the dimensions that libnifalcon measured. Base frame: origin in the middle of the base,
// axes as the hand's device frame (x right, y up, z towards the operator).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/devices.hpp"

namespace punctum::falcon {

using Counts = std::array<std::int16_t, 3>;  // of the encoders, or values of the motors
using Matrix3 = Eigen::Matrix3d;

// The hand's origin, in the base frame: the middle of what the grip can reach.
inline const hal::Vec3 kCentre_m{0, 0, 0.12};

// Of the arms at the motors, in rad. 4 x 320 counts for a turn of the motor, geared down by 14.25 : 110 mm.
[[nodiscard]] hal::Vec3 arm_angles(const Counts& encoders);

struct Pose {
  hal::Vec3 position_m = kCentre_m;    // base frame
  Matrix3 jacobian = Matrix3::Zero();  // motion of the grip with the arms' angles, m/rad
  double least_leverage = 0;           // sine of the smallest angle between an arm and its rods
};

// The position that the angles mean, to 1e-9 m; nothing where the iteration ends nowhere, or outside of what
// the grip can reach.
[[nodiscard]] std::optional<Pose> solve(const hal::Vec3& angles_rad);

// Motor values that push the grip with force_N. Where a motor would need more than it can give, all are
// scaled: the direction stays.
[[nodiscard]] Counts motors_for(const Pose& pose, const hal::Vec3& force_N);

}  // namespace punctum::falcon
