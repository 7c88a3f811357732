// The corrected membrane law: what a prestretched elastic sphere full of fluid, seated in a round mouth,
// gives at large deflection. Polynomials fitted to solutions of the full equations (tests/numeric/
// membrane_calibration.cpp prints them) over the box below; within 6 % of the force everywhere in it, 1 %
// rms.
//
// Nondimensional: lengths over the undeformed radius R, forces over E h R, pressures over E h / R, tensions
// over E h, energies over E h R^2. Pure and real-time safe.
#pragma once

#include <array>
#include <cstddef>

#include "hal/realtime.hpp"

namespace punctum::rt {

struct DeflectionInput {
  double w = 0;            // depth of the tip
  double c = 0.06;         // radius of the pipette
  double seat = 0.5;       // radius of the patch that rests in the holding pipette
  double nu = 0.5;         // Poisson ratio
  double prestrain = 0.2;  // of the undeformed sphere: turgor, and the bending a membrane has not got
};

// Calibrated between these. Outside, the value at the edge counts; beyond w_max the force goes on as a
// straight line.
inline constexpr DeflectionInput kDeflectionMin{0, 0.01, 0.3, 0.3, 0.05};
inline constexpr DeflectionInput kDeflectionMax{0.6, 0.12, 0.7, 0.5, 0.4};

struct Deflection {
  double force = 0;
  double stiffness = 0;  // dF/dw
  double energy = 0;     // integral of F dw
  double pressure = 0;   // inside
  double tension = 0;    // meridional, per deformed length at the tip's rim
  bool calibrated = false;
};

// The terms of the polynomials: powers of sqrt(w/w_max), and of ln c, sqrt(prestrain), seat and nu, each
// mapped from the box to -1 .. 1; up to the fourth degree together.
inline constexpr std::array<int, 5> kDeflectionDegrees{4, 3, 3, 2, 1};
inline constexpr int kDeflectionDegree = 4;
inline constexpr std::size_t kDeflectionTerms = 97;
using DeflectionTerms = std::array<double, kDeflectionTerms>;

// Value of each term and its power of sqrt(w/w_max). `u` = the four mapped variables in the order above.
struct DeflectionTerm {
  int w_power = 0;
  double value = 0;  // without the power of sqrt(w/w_max)
};
[[nodiscard]] std::array<DeflectionTerm, kDeflectionTerms> deflection_terms(const DeflectionInput& at)
    NONBLOCKING;

// The law of one cell, seat and pipette, as a function of the depth alone: what it is made with is worked out
// once. w > 0. Force, stiffness and energy are each other's exact integrals, force rises, is C1 in w > 0 and
// goes to zero in proportion to w, as that of the full equations does.
class DeflectionCurve {
 public:
  DeflectionCurve() = default;                                      // no force
  explicit DeflectionCurve(const DeflectionInput& of) NONBLOCKING;  // whatever of.w
  [[nodiscard]] Deflection at(double w) const NONBLOCKING;

 private:
  static constexpr std::size_t kPowers = kDeflectionDegrees[0] + 1;
  std::array<double, kPowers> G_{};
  std::array<double, kPowers> p_{};
  std::array<double, kPowers> T_{};
  double by_nu_ = 0;
  bool calibrated_ = false;
};

[[nodiscard]] inline Deflection large_deflection(const DeflectionInput& at) NONBLOCKING {
  return DeflectionCurve(at).at(at.w);
}

}  // namespace punctum::rt
