// The force of the indented membrane. All at the needle, SI. Pure functions of their arguments, real-time
// safe.
//
// Two laws. The paper's, eq. 5 and eq. 4 (Sun & Nelson 2003), of a dimple of radius a:
//
//   F = 2 pi E h w^3 / (a^2 (1-nu)) f(zeta),  zeta = c/a,  f = N / ((1-zeta^2) D^3)
//   N = 3 - 4 zeta^2 + zeta^4 + 2 ln zeta^2,  D = 1 - zeta^2 + ln zeta^2
//
// (the printed eq. 5 has w^2 and lost a fraction bar). Evaluated in a form whose terms are all positive, so
// that nothing cancels near zeta = 1. It is a small-slope, thin-film law: against exact slopes it
// over-predicts by 5 % at a depth of 2-3 um, by a quarter and more beyond 4 um, and h > c is outside its
// assumptions: see `valid`. And the corrected one, large_deflection.hpp, which needs no width of the dimple.
//
// Finite arguments give finite results: what would overflow, or lies outside the geometry (a <= c), gives the
// largest finite number. An argument that is not finite gives a force that is not a number.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hal/math/elementary.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/large_deflection.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// With the values of the paper (Sun & Nelson 2003).
struct MembraneParams {
  enum class Law : std::uint8_t { large_deflection, paper };
  Law law = Law::large_deflection;
  double E_Pa = 35.3e3;     // elastic modulus
  double nu = 0.5;          // Poisson ratio
  double h_m = 4.6e-6;      // thickness
  double c_m = 3.8e-6;      // pipette radius
  double R_m = 60e-6;       // undeformed cell, until vision has measured it
  double prestrain = 0.2;   // large deflection: of the undeformed membrane, by turgor
  double seat_m = 29.5e-6;  // large deflection: radius of the patch that rests in the holding pipette or dish
};
constexpr auto keys_of(const MembraneParams*) {
  return hal::keys(
      hal::choice("law", &MembraneParams::law, "large_deflection", "paper"),
      hal::kilo("E_kPa", &MembraneParams::E_Pa, 0.1, 1e5), hal::real("nu", &MembraneParams::nu, 0, 0.5),
      hal::micro("h_um", &MembraneParams::h_m, 0.05, 100), hal::micro("c_um", &MembraneParams::c_m, 0.2, 50),
      hal::micro("R_um", &MembraneParams::R_m, 5, 2000),
      hal::real("prestrain", &MembraneParams::prestrain, 0.002, 1),
      hal::micro("seat_um", &MembraneParams::seat_m, 1, 2000));
}

// f(zeta) and -D(zeta)/2 from s = (1-zeta^2)/(1+zeta^2) and atanh s = -ln zeta.
template <class Real>
struct MembraneShape {
  Real f = 0;          // of eq. 5
  Real half_D = 0;     // -D/2 = ln(a/c) - (1-zeta^2)/2: depth of the profile over its scale k
  Real steepness = 0;  // dln f / dln zeta
};

// c > 0, reach = a - c > 0, in the same unit. Pass the difference itself: a - c of rounded numbers is what
// limits the result near zeta = 1. A reach below 1e-70 a (float: 1e-9 a) counts as that.
template <class Real>
[[nodiscard]] MembraneShape<Real> membrane_shape(Real c, Real reach) NONBLOCKING {
  const Real a = c + reach;
  constexpr Real least = std::numeric_limits<Real>::digits > 24 ? Real(1e-70) : Real(1e-9);
  const Real zeta = std::max(c / a, std::numeric_limits<Real>::min());
  const Real narrow = std::max(reach / a, least);
  const Real s = narrow * (1 + zeta) / (1 + zeta * zeta);
  const Real q = 1 + s;
  Real T;  // (atanh s - s)/s^3
  if (s <= Real(0.5)) {
    // Sum of s^(2k)/(2k+3), four sums of every fourth term side by side.
    constexpr int kRounds = std::numeric_limits<Real>::digits > 24 ? 7 : 3;
    const Real s2 = s * s;
    const Real s4 = s2 * s2;
    const Real s8 = s4 * s4;
    std::array<Real, 4> sum{};
    for (int k = kRounds - 1; k >= 0; --k) {
      for (int i = 0; i < 4; ++i) {
        const auto j = static_cast<std::size_t>(i);
        sum[j] = sum[j] * s8 + 1 / Real(2 * (4 * k + i) + 3);
      }
    }
    T = (sum[0] + s2 * sum[1]) + s4 * (sum[2] + s2 * sum[3]);
  } else {
    T = (-static_cast<Real>(math::log(static_cast<double>(zeta))) - s) / (s * s * s);
  }
  const Real p = 1 + s * q * T;
  const Real s2 = s * s;
  const Real f = q * q * (1 + q * q * T) / (4 * s2 * s2 * p * p * p);
  const Real half_D = s2 * p / q;
  const Real u = narrow * (1 + zeta);  // 1 - zeta^2
  return {f, half_D, 2 * zeta * zeta / u + u / half_D * (3 - 1 / (2 * f * half_D * half_D))};
}

// 2 pi E h w^3 f / (a^2 (1-nu)), f of membrane_shape; no partial product overflows or is lost.
template <class Real>
[[nodiscard]] Real eq5(Real E_Pa, Real nu, Real h_m, Real wd_m, Real a_m, Real f) NONBLOCKING {
  int exponent = 0;
  const auto mantissa = [&exponent](Real x, int power) {
    int e = 0;
    const Real m = std::frexp(x, &e);
    exponent += power * e;
    return m;
  };
  const Real w = mantissa(wd_m, 3);
  const Real a = mantissa(a_m, -2);
  const Real stiffness = mantissa(E_Pa, 1) * mantissa(h_m, 1) /
                         mantissa(std::max(1 - nu, std::numeric_limits<Real>::epsilon()), -1);
  const Real shape = mantissa(f, 1);
  const Real slope = w / a;
  const Real F = Real(2 * 3.14159265358979323846L) * stiffness * shape * (w * slope * slope);
  return std::clamp(std::ldexp(F, exponent), Real(0), std::numeric_limits<Real>::max());
}

// Eq. 5 for a dimple of depth w and radius a, both measured. 0 for w <= 0.
template <class Real>
[[nodiscard]] Real membrane_force(Real E_Pa, Real nu, Real h_m, Real c_m, Real wd_m, Real a_m) NONBLOCKING {
  if (wd_m <= 0) {
    return 0;
  }
  if (a_m <= c_m || c_m < 0) {
    return std::numeric_limits<Real>::max();
  }
  return eq5(E_Pa, nu, h_m, wd_m, a_m, membrane_shape(c_m, a_m - c_m).f);
}

// One evaluation of a law at the needle.
struct MembraneState {
  double force_N = 0;
  double a_m = 0;            // where the membrane is level: F = pi a^2 p (eq. 4), the dimple's edge
  double sigma_d_Pa = 0;     // membrane stress at the pipette's rim, eq. 4
  double pressure_Pa = 0;    // eq. 4: F = pi c^2 p + 2 pi c h sigma_d sin(theta)
  double slope = 0;          // tan(theta) at the rim; < 0 while the pressed sphere still bulges there
  double pull_N = 0;         // outwards round the whole rim, 2 pi c h sigma_d cos(theta)
  double stiffness_N_m = 0;  // dF/dw as it is rendered
  double energy_J = 0;       // in the dimple: the integral of F dw from contact at today's R and scale
  bool valid = false;        // all of the law's assumptions hold
  bool shallow = true;       // the part of it that changes as the needle advances
};

// Slope at the rim up to which the paper's law is within some 6 % of exact slopes.
inline constexpr double kMembraneSlopeMax = 0.7;

// The paper's law where only the depth is known: a = c + scale sqrt(2 R w), which makes F ~ w at contact (an
// exponent of 3/4 or more would give a force that does not vanish there). scale may be observed by vision.
[[nodiscard]] double dimple_reach(double R_m, double wd_m, double scale) NONBLOCKING;

// By params.law; `scale` is for the paper's. Exactly 0 for wd_m <= 0. R_m, scale > 0. Paper: valid = small
// slope, thin film (h <= c), dimple smaller than the cell; large deflection: within its calibration, and what
// does not depend on the depth is kept for as long as R_m stays.
class MembraneLaw {
 public:
  explicit MembraneLaw(const MembraneParams& params) NONBLOCKING;
  [[nodiscard]] MembraneState at(double wd_m, double R_m, double scale) NONBLOCKING;

 private:
  MembraneParams params_;
  bool finite_ = true;  // params_ are
  double curve_R_m_ = std::numeric_limits<double>::quiet_NaN();
  DeflectionCurve curve_;
};
[[nodiscard]] inline MembraneState membrane_law(const MembraneParams& params, double wd_m, double R_m,
                                                double scale) NONBLOCKING {
  return MembraneLaw(params).at(wd_m, R_m, scale);
}

// The force as vectors at points of the pipette's rim, spread evenly round the axis: each has its share of
// the axial force and of the outward pull of the membrane. Their sum is -F b.
inline constexpr int kRimPoints = 4;
using RimForces = std::array<hal::Vec3, kRimPoints>;
[[nodiscard]] RimForces rim_forces(const MembraneState& state, double force_N, const hal::Vec3& axis)
    NONBLOCKING;

// The law as it is rendered: follows the depth until the membrane is punctured, then falls monotonically to
// zero from what it was and stays there, whatever the depth does: the energy in the dimple is dropped, never
// given back. A new cell has a new membrane.
class Membrane {
 public:
  using Params = MembraneParams;
  static constexpr Gives kGives{.point = EnergyPoint::needle, .storing = true};

  Membrane(const MembraneParams& params, const EffectSetup& setup) NONBLOCKING : law_(params), setup_(setup) {
    rim_.fill(hal::Vec3::Zero());
  }

  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

  [[nodiscard]] const MembraneState& state() const NONBLOCKING {
    return state_;
  }  // at the needle, as rendered
  [[nodiscard]] const RimForces& rim() const NONBLOCKING { return rim_; }  // at the hand
  [[nodiscard]] bool punctured() const NONBLOCKING { return punctured_; }
  [[nodiscard]] double dropped_energy_J() const NONBLOCKING { return dropped_J_; }  // at the last puncture

 private:
  void advance(double depth_m, const EffectInput& in) NONBLOCKING;

  MembraneLaw law_;
  EffectSetup setup_;
  MembraneState state_;
  bool punctured_ = false;
  MembraneState at_puncture_;
  double since_puncture_s_ = 0;
  double dropped_J_ = 0;
  hal::Vec3 last_force_N_ = hal::Vec3::Zero();  // at the hand
  RimForces rim_;
};

}  // namespace punctum::rt
