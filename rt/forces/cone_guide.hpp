// The cone-shaped attractive guide (eq. 6, fig. 13): leads the needle to the axis through the entry point.
//
// b: axis, V: from the entry point to the tip, d = -b.V: distance from the membrane (> 0 outside), r:
// distance from the axis, both at needle scale; the force is a hand force:
//
//   U = K k_p^2 f(d) Phi(delta),  delta = (r - r_c(d)) cos(alpha),  r_c = r0 + d tan(alpha) for d > 0, r0
//   inside
//
// f = 1/(1+(d/d0)^2); Phi is a soft spring over the free core that lets go far from it (half-width reach_m),
// so that every eigenvalue of its Hessian is bounded by a small multiple of K. Being a gradient, it does no
// work round a loop while it stands still; what it injects when it moves or is switched is counted. Exactly
// zero deeper than 2 d0 behind the membrane. `paper` is the printed law -K f(d) r with f = d0/(d0+d), lateral
// only: it is not conservative, kept for comparison.
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// Where a fixture stands: stage frame, needle scale.
struct FixtureFrame {
  hal::Vec3 entry_m = hal::Vec3::Zero();
  hal::Vec3 axis = -hal::Vec3::UnitX();  // unit, into the cell
};

// A hand force in world axes, and the energy stored at the hand.
struct Pull {
  hal::Vec3 force_N = hal::Vec3::Zero();
  double energy_J = 0;
};

// The standing fields: pure functions of the tip (needle scale, stage frame).
[[nodiscard]] Pull cone_pull(const ConeParams& params, double position_scale, const FixtureFrame& frame,
                             const hal::Vec3& tip_m) noexcept;

// N/m at the hand: no eigenvalue of the standing field's Hessian is larger in magnitude. Grows as
// (reach/d0)^2 once the attraction reaches further than it decays. Of `paper`, which has no Hessian: K, the
// largest eigenvalue of its Jacobian. Not for the tick.
[[nodiscard]] double cone_stiffness_bound_N_m(const ConeParams& params) noexcept;

class ConeGuide {
 public:
  ConeGuide(const ConeParams& params, double position_scale) noexcept
      : params_(params), scale_(position_scale), stiffness_bound_N_m_(cone_stiffness_bound_N_m(params)) {}

  // One tick: the frame follows `target` and the gain follows `on`, both ramped over ramp_s. The frame is
  // taken over at once while the gain is zero.
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& tip_m, const FixtureFrame& target, bool on,
                               double dt_s) noexcept;

  [[nodiscard]] double stored_energy_J() const noexcept { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const noexcept { return injected_J_; }  // signed, cumulative
  [[nodiscard]] const FixtureFrame& frame() const noexcept { return frame_; }
  [[nodiscard]] double gain() const noexcept { return ramp_.gain(); }
  // Upper bound now, at the hand, of the Hessian's eigenvalues in magnitude.
  [[nodiscard]] double stiffness_N_m() const noexcept { return ramp_.gain() * stiffness_bound_N_m_; }

 private:
  ConeParams params_;
  double scale_;
  double stiffness_bound_N_m_;
  FixtureFrame frame_;
  Ramp ramp_;
  double stored_J_ = 0;
  double injected_J_ = 0;
};

// Moves a frame towards another with time constant tau_s, without a step; the axis stays a unit vector.
void follow_frame(FixtureFrame& frame, const FixtureFrame& target, double tau_s, double dt_s) noexcept;

}  // namespace punctum::rt
