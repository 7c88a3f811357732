// Hand device frame (x right, y up, z towards the operator) and world frame (x right, y down, z away): a turn
// by pi about x, its own inverse.
#pragma once

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum {

[[nodiscard]] inline hal::Vec3 world_from_hand(const hal::Vec3& v) NONBLOCKING {
  return {v.x(), -v.y(), -v.z()};
}
[[nodiscard]] inline hal::Vec3 hand_from_world(const hal::Vec3& v) NONBLOCKING {
  return {v.x(), -v.y(), -v.z()};
}

}  // namespace punctum
