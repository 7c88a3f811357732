// Repulsive region: a hill of potential that keeps the needle away from a place in the cell, for example the
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
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// A hill of potential that keeps the needle away from a place in the cell.
struct RepulsiveParams {
  hal::Vec3 offset_m{0, -40e-6, 0};  // of its centre from the cell's, world frame, needle scale
  double radius_m = 15e-6;           // needle scale
  double K_N_m = 150;                // at the hand, its largest stiffness
  double ramp_s = 0.2;               // moving or switching
};
constexpr auto keys_of(const RepulsiveParams*) {
  return hal::keys(hal::micro_vector("offset_um", &RepulsiveParams::offset_m, -2000, 2000),
                   hal::micro("radius_um", &RepulsiveParams::radius_m, 0.5, 2000),
                   hal::real("K_N_m", &RepulsiveParams::K_N_m, 0, 3000),
                   hal::real("ramp_s", &RepulsiveParams::ramp_s, 0.001, 5));
}

// The standing field: a pure function of the tip (needle scale, stage frame).
[[nodiscard]] PotentialForce repulsive_push(const RepulsiveParams& params, double position_scale,
                                            const hal::Vec3& centre_m, const hal::Vec3& tip_m) NONBLOCKING;

class RepulsiveRegion {
 public:
  using Params = RepulsiveParams;
  static constexpr Gives kGives{.point = EnergyPoint::fixture_point, .storing = true};

  RepulsiveRegion(const RepulsiveParams& params, const EffectSetup& /*setup*/) NONBLOCKING : params_(params) {
  }

  // On while the cell is known: the region follows its place in the cell and its gain rises or falls, both
  // over ramp_s.
  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

  [[nodiscard]] double stored_energy_J() const NONBLOCKING { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const NONBLOCKING { return injected_J_; }  // signed, cumulative
  [[nodiscard]] double gain() const NONBLOCKING { return ramp_.gain(); }
  [[nodiscard]] const hal::Vec3& centre_m() const NONBLOCKING { return centre_m_; }

 private:
  RepulsiveParams params_;
  hal::Vec3 centre_m_ = hal::Vec3::Zero();
  Ramp ramp_;
  double stored_J_ = 0;
  double injected_J_ = 0;
};

}  // namespace punctum::rt
