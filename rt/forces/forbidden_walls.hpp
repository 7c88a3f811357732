// The walls of the forbidden regions, as the hand feels them before the set-point stops at them.
//
// With d the distance to the region less the clearance, at needle scale, delta = felt - d, at the hand:
//
//   U = K k_p^2 Psi(delta),   F = K k_p psi(delta) n     (Psi, psi of ramp.hpp; n away from the region)
//
// The hand's point goes no further than d = 0 (rt/control/limits), so the push ends at K k_p felt: from there
// on the hand slips. The regions are where the scene says, whatever vision sees, so the walls do not fade
// with it; with the clutch they do. A wall pushes only along the ways that the stage can make: no other way
// of the hand leads out of it. Tilting the needle moves the walls; what that does to U is counted. No
// eigenvalue of the Hessian exceeds K where felt <= tip_radius + clearance, or the walls are flat. Real-time
// safe.
#pragma once

#include <array>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/forbidden_regions.hpp"

namespace punctum::rt {

class ForbiddenWalls {
 public:
  using Params = ForbiddenParams;
  static constexpr Gives kGives{.point = EnergyPoint::handle, .storing = true};

  ForbiddenWalls(const ForbiddenParams& params, const EffectSetup& setup) NONBLOCKING : params_(params),
                                                                                        regions_(params),
                                                                                        reach_(setup.reach) {}

  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

 private:
  // At unit gain and scale.
  [[nodiscard]] PotentialForce push(Region region, const NeedlePose& needle) NONBLOCKING;

  ForbiddenParams params_;
  ForbiddenRegions regions_;
  std::optional<hal::Mat3> reach_;
  std::array<hal::Vec3, std::size(kRegions)> away_{hal::Vec3::UnitX(), hal::Vec3::UnitX()};
  SeenRoom seen_;  // before a wall is felt
  double last_stored_J_ = 0;
  hal::Vec3 last_force_N_ = hal::Vec3::Zero();
  hal::Vec3 last_handle_m_ = hal::Vec3::Zero();
};

}  // namespace punctum::rt
