#include "tools/emulators/falcon/kinematics.hpp"

#include <cmath>
#include <numbers>

namespace punctum::emulator {
namespace {

constexpr double kArm_m = 0.060;       // from the motor's axis to the knee
constexpr double kRod_m = 0.1025;      // the parallelogram's long sides
constexpr double kStubs_m = 0.0225;    // from knee and grip to the parallelogram's short sides, together
constexpr double kGripIn_m = 0.01443;  // the grip's joint, towards the motor's axis
constexpr double kGripAcross_m = -0.025;
constexpr double kMotorOut_m = 0.040;  // the motor's axis, from the middle of the base
constexpr double kMotorAcross_m = -0.02309;
constexpr double kThird = 2 * std::numbers::pi / 3;
constexpr double kFirstLeg = std::numbers::pi * 105 / 180;

using Direction = Triple;

// One leg, in its own frame: x out of the base through the motor, y along the motor's axis, z as the base.
struct Leg {
  double out_x, out_y;  // its x, in the base frame
  double arm_rad = 0;
  Direction rod{};  // unit vector along the rods, from knee to grip
};

std::optional<Leg> leg_to(const Triple& grip_m, int number) {
  const double direction = kFirstLeg - kThird * number;
  Leg leg{std::cos(direction), std::sin(direction)};
  // The joint of the grip, seen from the motor's axis.
  const double x = grip_m[0] * leg.out_x + grip_m[1] * leg.out_y - kMotorOut_m + kGripIn_m;
  const double y = grip_m[1] * leg.out_x - grip_m[0] * leg.out_y - kMotorAcross_m + kGripAcross_m;
  const double z = grip_m[2];
  const double rod_in_plane_m2 = kRod_m * kRod_m - y * y;
  if (!(rod_in_plane_m2 > 0)) {
    return std::nullopt;
  }
  const double rod_in_plane_m = std::sqrt(rod_in_plane_m2);
  // The knee is where two circles meet: the arm's round the motor, the rods' round the grip's joint.
  const double forearm_m = rod_in_plane_m + kStubs_m;
  const double apart_m = std::hypot(x, z);
  const double to_chord_m = (apart_m * apart_m + kArm_m * kArm_m - forearm_m * forearm_m) / (2 * apart_m);
  const double half_chord_m2 = kArm_m * kArm_m - to_chord_m * to_chord_m;
  if (!(half_chord_m2 > 0)) {
    return std::nullopt;
  }
  const double half_chord_m = std::sqrt(half_chord_m2);
  // Of the two, the one on the outer side.
  const double knee_x = (x * to_chord_m + z * half_chord_m) / apart_m;
  const double knee_z = (z * to_chord_m - x * half_chord_m) / apart_m;
  leg.arm_rad = std::atan2(knee_z, knee_x);
  leg.rod = {(x - knee_x) / forearm_m * rod_in_plane_m / kRod_m, y / kRod_m,
             (z - knee_z) / forearm_m * rod_in_plane_m / kRod_m};
  return leg;
}

}  // namespace

std::optional<Triple> falcon_arms(const Triple& grip_m) {
  Triple angles{};
  for (int i = 0; i < 3; ++i) {
    const auto leg = leg_to(grip_m, i);
    if (!leg) {
      return std::nullopt;
    }
    angles[static_cast<std::size_t>(i)] = leg->arm_rad;
  }
  return angles;
}

// Rods carry force along themselves only. What a rod takes at the knee, times the arm's lever, is the torque;
// the grip adds the three up.
std::optional<Triple> falcon_push(const Triple& grip_m, const Triple& torques_Nm) {
  Triple push{};
  for (int i = 0; i < 3; ++i) {
    const auto leg = leg_to(grip_m, i);
    if (!leg) {
      return std::nullopt;
    }
    const double lever_m =
        kArm_m * (leg->rod[2] * std::cos(leg->arm_rad) - leg->rod[0] * std::sin(leg->arm_rad));
    if (std::abs(lever_m) < 1e-4) {
      return std::nullopt;
    }
    const double along_N = torques_Nm[static_cast<std::size_t>(i)] / lever_m;
    push[0] += along_N * (leg->rod[0] * leg->out_x - leg->rod[1] * leg->out_y);
    push[1] += along_N * (leg->rod[0] * leg->out_y + leg->rod[1] * leg->out_x);
    push[2] += along_N * leg->rod[2];
  }
  return push;
}

}  // namespace punctum::emulator
