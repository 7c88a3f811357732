// The cone-shaped attractive guide (eq. 6, fig. 13): leads the needle to the axis through the entry point.
//
// b: axis, V: from the entry point to the tip, d = -b.V: distance from the membrane (> 0 outside), r:
// distance from the axis, both at needle scale; the force is a hand force:
//
//   U = K k_p^2 f(d) Phi(delta),  delta = (r - r_c(d)) cos(alpha),  r_c = r0 + d tan(alpha) for d > 0, r0
//   inside
//
// f = 1/(1+(d/d0)^2); Phi is a soft spring round the free core that fades far from it (half-width reach_m),
// so that every eigenvalue of its Hessian is bounded by a small multiple of K. Being a gradient, it does no
// work round a loop while it stands still; what it injects when it moves or is switched is counted. Exactly
// zero deeper than 2 d0 behind the membrane. `paper` is the printed law -K f(d) r with f = d0/(d0+d), lateral
// only: it is not conservative, kept for comparison.
#pragma once

#include "hal/devices.hpp"
#include "hal/math/elementary.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// Cone-shaped attractive guide, eq. 6 and fig. 13.
struct ConeParams {
  enum class Method : std::uint8_t { potential, paper };
  Method method = Method::potential;
  double K_N_m =
      150;  // at the hand, on the membrane: with the membrane's own, below 0.9 of what keeps passive
  double d0_m = 40e-6;     // distance from the membrane at which the pull has halved (needle scale)
  double r0_m = 1e-6;      // free radius at the membrane (needle scale)
  double alpha_rad = 0.2;  // half-angle of the free core
  double eps_m = 2e-6;     // width of the C1 ramp (needle scale)
  double ramp_s = 0.2;     // moving or switching
  double reach_m = 40e-6;  // half-width of the attraction; it fades further off (needle scale)
};
constexpr auto keys_of(const ConeParams*) {
  return hal::keys(
      hal::choice("method", &ConeParams::method, "potential", "paper"),
      hal::real("K_N_m", &ConeParams::K_N_m, 0, 3000), hal::micro("d0_um", &ConeParams::d0_m, 0.1, 2000),
      hal::micro("r0_um", &ConeParams::r0_m, 0, 100), hal::real("alpha_rad", &ConeParams::alpha_rad, 0, 1.2),
      hal::micro("eps_um", &ConeParams::eps_m, 0.01, 100), hal::real("ramp_s", &ConeParams::ramp_s, 0.001, 5),
      hal::micro("reach_um", &ConeParams::reach_m, 0.1, 5000));
}

// The parameters, and the functions of their angle that every tick needs.
struct Cone : ConeParams {
  // Not explicit: parameters are a cone.
  Cone(const ConeParams& params) NONBLOCKING : ConeParams(params),  // NOLINT(google-explicit-constructor)
                                               cos_alpha(math::cos(params.alpha_rad)),
                                               tan_alpha(math::tan(params.alpha_rad)) {}
  double cos_alpha;
  double tan_alpha;
};

// The standing field: a pure function of the tip (needle scale, stage frame).
[[nodiscard]] PotentialForce cone_pull(const Cone& cone, double position_scale, const FixtureFrame& frame,
                                       const hal::Vec3& tip_m) NONBLOCKING;

// N/m at the hand: no eigenvalue of the standing field's Hessian is larger in magnitude. Grows as
// (reach/d0)^2 once the attraction reaches further than it decays. Of `paper`, which has no Hessian: K, the
// largest eigenvalue of its Jacobian. Not for the tick.
[[nodiscard]] double cone_stiffness_bound_N_m(const ConeParams& params) NONBLOCKING;

class ConeGuide {
 public:
  using Params = ConeParams;
  static constexpr Gives kGives{.point = EnergyPoint::fixture_point, .storing = true};

  ConeGuide(const ConeParams& params, const EffectSetup& /*setup*/) NONBLOCKING
      : cone_(params),
        stiffness_bound_N_m_(cone_stiffness_bound_N_m(params)) {}

  // On while the cell is known and not punctured: the frame follows the entry point and the gain rises or
  // falls, both over ramp_s. The frame is taken over at once while the gain is zero.
  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

  [[nodiscard]] double stored_energy_J() const NONBLOCKING { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const NONBLOCKING { return injected_J_; }  // signed, cumulative
  [[nodiscard]] const FixtureFrame& frame() const NONBLOCKING { return frame_; }
  [[nodiscard]] double gain() const NONBLOCKING { return ramp_.gain(); }

 private:
  Cone cone_;
  double stiffness_bound_N_m_;
  FixtureFrame frame_;
  Ramp ramp_;
  double stored_J_ = 0;
  double injected_J_ = 0;
};

}  // namespace punctum::rt
