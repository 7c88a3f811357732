// The geometry of a Falcon as its mechanics see it: where the arms are for a place of the grip, and which
// force at the grip holds the torques of the motors in balance. Base frame: x right, y up, z towards the
// operator.
#pragma once

#include <array>
#include <optional>

namespace punctum::emulator {

using Triple = std::array<double, 3>;

// Angles of the arms at the motors, in rad; nothing where an arm does not reach.
[[nodiscard]] std::optional<Triple> falcon_arms(const Triple& grip_m);

// What the grip pushes with, in N; nothing where an arm is in line with its rods.
[[nodiscard]] std::optional<Triple> falcon_push(const Triple& grip_m, const Triple& torques_Nm);

}  // namespace punctum::emulator
