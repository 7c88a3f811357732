// Repulsive region: a hill of potential that keeps the needle away from a place in the cell, as from the
// spindle under the polar body.
//
// With r the distance from its centre and rho its radius, both at needle scale, x = r^2/rho^2, at the hand:
//
//   U = K k_p^2 rho^2/6 (1 - x)^3,   F = K k_p (1 - x)^2 V   for x < 1, V from the centre to the tip; else 0
//
// C2, without a singular point at the centre, where the hill is steepest in curvature: no eigenvalue of its
// Hessian exceeds K in magnitude. The push is largest at r = 0.45 rho: 0.29 K k_p rho. A hill, not a wall:
// K (k_p rho)^2/6 carries a hand across it. Real-time safe.
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// The standing field: a pure function of the tip (needle scale, stage frame).
[[nodiscard]] Pull repulsive_push(const RepulsiveParams& params, double position_scale,
                                  const hal::Vec3& centre_m, const hal::Vec3& tip_m) noexcept;

class RepulsiveRegion {
 public:
  RepulsiveRegion(const RepulsiveParams& params, double position_scale) noexcept
      : params_(params), scale_(position_scale) {}

  // One tick: the region follows its place in the cell and its gain follows `on`, both ramped over ramp_s.
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& tip_m, const hal::Vec3& cell_centre_m, bool on,
                               double dt_s) noexcept;

  [[nodiscard]] double stored_energy_J() const noexcept { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const noexcept { return injected_J_; }  // signed, cumulative
  [[nodiscard]] double gain() const noexcept { return ramp_.gain(); }
  [[nodiscard]] const hal::Vec3& centre_m() const noexcept { return centre_m_; }
  // Upper bound now, at the hand, of the Hessian's eigenvalues in magnitude: 0 outside.
  [[nodiscard]] double stiffness_N_m() const noexcept {
    return stored_J_ > 0 ? ramp_.gain() * params_.K_N_m : 0;
  }

 private:
  RepulsiveParams params_;
  double scale_;
  hal::Vec3 centre_m_ = hal::Vec3::Zero();
  Ramp ramp_;
  double stored_J_ = 0;
  double injected_J_ = 0;
};

}  // namespace punctum::rt
