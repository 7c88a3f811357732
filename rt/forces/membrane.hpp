// The force of the indented membrane: eq. 5 and eq. 4 of the paper (Sun & Nelson 2003). All at the needle,
// SI.
//
//   F = 2 pi E h w^3 / (a^2 (1-nu)) f(zeta),  zeta = c/a,  f = N / ((1-zeta^2) D^3)
//   N = 3 - 4 zeta^2 + zeta^4 + 2 ln zeta^2,  D = 1 - zeta^2 + ln zeta^2
//
// (the printed eq. 5 has w^2 and lost a fraction bar). Evaluated in a form whose terms are all positive, so
// that nothing cancels near zeta = 1. It is a small-slope, thin-film law: against exact slopes it
// over-predicts by 5 % at a depth of 2-3 um, by a quarter and more beyond 4 um, and h > c is outside its
// assumptions: see `valid`. Pure functions of their arguments; real-time safe.
#pragma once

#include <array>
#include <cmath>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// f(zeta) and -D(zeta)/2 from s = (1-zeta^2)/(1+zeta^2) and atanh s = -ln zeta.
template <class Real>
struct MembraneShape {
  Real f = 0;          // of eq. 5
  Real half_D = 0;     // -D/2 = ln(a/c) - (1-zeta^2)/2: depth of the profile over its scale k
  Real steepness = 0;  // dln f / dln zeta
};

// c > 0, reach = a - c > 0, in the same unit. Pass the difference itself: a - c of rounded numbers is what
// limits the result near zeta = 1.
template <class Real>
[[nodiscard]] MembraneShape<Real> membrane_shape(Real c, Real reach) noexcept {
  const Real a = c + reach;
  const Real zeta = c / a;
  const Real s = (reach / a) * (1 + zeta) / (1 + zeta * zeta);
  const Real q = 1 + s;
  Real T;  // (atanh s - s)/s^3
  if (s <= Real(0.5)) {
    // sum of s^(2k)/(2k+3)
    const Real s2 = s * s;
    Real term = 1;
    T = 0;
    for (int k = 0; k < 40; ++k) {
      const Real add = term / Real(2 * k + 3);
      T += add;
      term *= s2;
      if (add <= T * Real(1e-18)) break;
    }
  } else {
    T = (-std::log(zeta) - s) / (s * s * s);
  }
  const Real p = 1 + s * q * T;
  const Real s2 = s * s;
  const Real f = q * q * (1 + q * q * T) / (4 * s2 * s2 * p * p * p);
  const Real half_D = s2 * p / q;
  const Real u = (reach / a) * (1 + zeta);  // 1 - zeta^2
  return {f, half_D, 2 * zeta * zeta / u + u / half_D * (3 - 1 / (2 * f * half_D * half_D))};
}

// Eq. 5 for a dimple of depth w and radius a, both measured. 0 for w <= 0; a > c is required.
template <class Real>
[[nodiscard]] Real membrane_force(Real E_Pa, Real nu, Real h_m, Real c_m, Real wd_m, Real a_m) noexcept {
  if (!(wd_m > 0)) return 0;
  const Real f = membrane_shape(c_m, a_m - c_m).f;
  const Real slope = wd_m / a_m;
  return Real(2 * 3.14159265358979323846L) * E_Pa * h_m * wd_m * (slope * slope) / (1 - nu) * f;
}

// One evaluation of the law at the needle.
struct MembraneState {
  double force_N = 0;
  double a_m = 0;         // half-width of the dimple
  double sigma_d_Pa = 0;  // membrane stress at the rim, eq. 4
  double pressure_Pa =
      0;             // inner pressure, eq. 4: F = pi c^2 p + 2 pi c h sigma_d sin(theta), p = F/(pi a^2)
  double slope = 0;  // tan(theta) at the rim
  double stiffness_N_m = 0;  // dF/dw as it is rendered
  bool valid = false;        // small slope, thin film (h <= c), dimple smaller than the cell
  bool small_slope = true;   // the part of it that changes as the needle advances
};

// Slope at the rim up to which the law is within some 6 % of exact slopes.
inline constexpr double kMembraneSlopeMax = 0.7;

// Width of the dimple where only its depth is known: a = c + scale sqrt(2 R w), which makes F ~ w at contact
// (an exponent of 3/4 or more would give a force that does not vanish there). scale is observed by vision.
[[nodiscard]] inline double dimple_reach(double R_m, double wd_m, double scale) noexcept {
  return wd_m > 0 ? scale * std::sqrt(2 * R_m * wd_m) : 0;
}

// Exactly 0 for wd_m <= 0. R_m, scale > 0.
[[nodiscard]] MembraneState membrane_law(const MembraneParams& params, double wd_m, double R_m,
                                         double scale) noexcept;

// The force as vectors at points of the pipette's rim, spread evenly round the axis: each has its share of
// the axial force and the outward pull of the membrane that leaves the rim at angle theta. Their sum is -F b.
inline constexpr int kRimPoints = 4;
using RimForces = std::array<hal::Vec3, kRimPoints>;
[[nodiscard]] RimForces rim_forces(const MembraneState& state, double force_N,
                                   const hal::Vec3& axis) noexcept;

// The law as it is rendered: follows the depth until the membrane is punctured, then falls monotonically to
// zero within release_s from what it was and stays there, whatever the depth does: the energy in the dimple
// (F w / 4) is dropped, never given back. rearm() for a fresh membrane.
class Membrane {
 public:
  explicit Membrane(const MembraneParams& params) noexcept : params_(params) {}

  void step(double wd_m, double R_m, double scale, bool punctured, double dt_s) noexcept;
  void rearm() noexcept;

  [[nodiscard]] const MembraneState& state() const noexcept { return state_; }  // force_N as rendered
  [[nodiscard]] bool punctured() const noexcept { return punctured_; }
  [[nodiscard]] double stored_energy_J() const noexcept { return stored_J_; }    // in the dimple, F w / 4
  [[nodiscard]] double dropped_energy_J() const noexcept { return dropped_J_; }  // at the last puncture

 private:
  MembraneParams params_;
  MembraneState state_;
  bool punctured_ = false;
  double force_at_puncture_N_ = 0;
  double since_puncture_s_ = 0;
  double stored_J_ = 0;
  double dropped_J_ = 0;
};

}  // namespace punctum::rt
