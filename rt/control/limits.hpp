// What the needle and the hand may do. Checked on every set-point and on every force, last of all.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

// Where the needle is in the cell, for the depth limits.
struct Membrane3D {
  bool known = false;
  hal::Vec3 entry_m = hal::Vec3::Zero();  // of the undeformed membrane, on the axis through the cell's centre
  hal::Vec3 axis = -hal::Vec3::UnitX();
  double R_m = 0;

  // Depth of a point past the undeformed membrane along the axis; < 0 outside.
  [[nodiscard]] double depth_m(const hal::Vec3& p) const noexcept;
  // Depth of the far wall on the same line.
  [[nodiscard]] double chord_m(const hal::Vec3& p) const noexcept;
};

struct StageConstraint {
  Membrane3D membrane;
  bool withdrawal_only = false;  // vision is stale: only outward along the axis
  bool no_deeper = false;        // soft tip-force limit
  bool frozen = false;           // no motion at all
};

// Set-points for the stage: never faster, never outside, never deeper, never NaN. A limit that the needle is
// already beyond holds it, it never pushes it back by itself. Position limits win over the acceleration
// limit: a needle may always stop at once.
class StageLimits {
 public:
  StageLimits(const LimitParams& limits, const MappingParams& mapping) noexcept;

  void restart(const hal::Vec3& tip_m, const hal::Vec3& axis) noexcept;  // at rest there

  // Where the hand's own point may be: the same position limits without dynamics. The alarms say which bit.
  struct Checked {
    hal::Vec3 point_m;
    std::uint32_t alarms;
  };
  [[nodiscard]] Checked check(const hal::Vec3& wanted_m, const StageConstraint& c) const noexcept;

  // The next set-point. A target that is not finite leaves it where it is.
  const hal::StageCommand& step(const hal::StageCommand& target, const StageConstraint& c,
                                double dt_s) noexcept;

  [[nodiscard]] const hal::StageCommand& set_point() const noexcept { return set_point_; }
  [[nodiscard]] const hal::Vec3& velocity() const noexcept { return velocity_m_s_; }
  [[nodiscard]] std::uint32_t alarms() const noexcept { return alarms_; }  // of the last step
  [[nodiscard]] bool finite() const noexcept { return finite_; }           // the last target was

 private:
  LimitParams limits_;
  hal::Vec3 low_m_;
  hal::Vec3 high_m_;
  hal::StageCommand set_point_;
  hal::Vec3 velocity_m_s_ = hal::Vec3::Zero();
  std::uint32_t alarms_ = 0;
  bool finite_ = true;
};

// The force to the hand, last of all: at most max_N long, and zero if it is not finite.
struct LimitedForce {
  hal::Vec3 force_N = hal::Vec3::Zero();
  bool limited = false;
  bool finite = true;
};
[[nodiscard]] LimitedForce limit_hand_force(const hal::Vec3& wanted_N, double max_N) noexcept;

}  // namespace punctum::rt
