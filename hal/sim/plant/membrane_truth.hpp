// True mechanics of an indented membrane: a prestretched elastic sphere full of incompressible fluid, pressed
// by a pipette tip along its axis into the seat of the holding pipette. Large deflection, arc-length form.
//
// Everything is nondimensional: lengths over R (inflated radius), tensions over E h, forces over E h R,
// pressures over E h / R, energies over E h R^2. One table therefore serves every cell of the same c/R, nu
// and prestrain. This is the simulated world's truth: it shares nothing with the fitted law (eq. 5) that the
// control core uses.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "hal/realtime.hpp"

namespace punctum::sim {

struct MembraneShape {
  double c_over_R = 3.8 / 60;  // radius of the patch that moves with the pipette tip
  double seat_over_R = 0.5;    // radius of the patch that sticks in the mouth of the holding pipette
  double nu = 0.5;             // Poisson ratio
  double prestrain = 0.01;     // of the inflated sphere, > 0

  bool operator==(const MembraneShape&) const = default;
};

// One converged equilibrium. Nodes run by reference polar angle from the rim of the tip to the edge of the
// seat.
struct MembraneSolution {
  double w = 0;                          // depth of the tip
  double force = 0;                      // F
  double pressure = 0;                   // p
  double energy = 0;                     // stored, above the undeformed inflated sphere
  double volume = 0;                     // enclosed; 4 pi / 3
  double strain = 0;                     // largest principal strain anywhere, from the stress-free state
  double tip_tension = 0;                // nominal meridional tension at the rim of the tip, over E h
  double half_width = 0;                 // a: radius where the depth has fallen to 1 % of w
  double rim_radius = 0;                 // of the dimple's rim, its highest circle; F = p pi rim^2 there
  double rim_depth = 0;                  // of the dimple's bottom below its rim
  double residual = 0;                   // of the collocation equations, largest component
  std::vector<double> theta;             // reference polar angle of each node
  std::vector<double> r, z;              // deformed place; undeformed pole z = +1
  std::vector<double> dr, dz;            // over theta
  std::vector<double> pull;              // r T1, meridional tension round the circle over 2 pi
  std::vector<double> sin_phi;           // of the meridian below the horizontal
  std::vector<double> lambda1, lambda2;  // meridional and hoop stretch, from the stress-free state
};

// Equilibrium at tip depth w > 0. `out` is the starting guess when it holds a solution on the same mesh, else
// the sphere is; the mesh has 2 * intervals intervals. False when Newton does not converge; `out` then
// holds nothing of use. Set-up code: allocates.
[[nodiscard]] bool solve_membrane(const MembraneShape& shape, double w, int intervals, MembraneSolution& out);

// The table over depth. The constructor solves and allocates; every query is real-time safe.
class MembraneTruth {
 public:
  static constexpr int kProfile = 257;  // nodes of a profile, from the axis under the tip to the far pole
  static constexpr double kDepthMax = 0.85;  // last tabled depth over R; beyond it the laws go on straight

  explicit MembraneTruth(const MembraneShape& shape, int intervals = 64);

  [[nodiscard]] const MembraneShape& shape() const NONBLOCKING { return shape_; }
  [[nodiscard]] double depth_max() const NONBLOCKING {
    return w_.back();
  }  // < kDepthMax: the solver stopped there

  struct Reading {
    double force, pressure, strain, tip_tension, half_width, rim_radius, rim_depth;
  };
  [[nodiscard]] Reading read(double w) const NONBLOCKING;  // all of the following in one search

  // Argument: depth w over R; 0 or less gives the undeformed sphere. Monotone cubic (PCHIP) between table
  // points.
  [[nodiscard]] double force(double w) const NONBLOCKING;
  [[nodiscard]] double pressure(double w) const NONBLOCKING;
  [[nodiscard]] double strain(double w) const NONBLOCKING;
  [[nodiscard]] double energy(double w) const NONBLOCKING;  // the integral of force()
  [[nodiscard]] double tip_tension(double w) const NONBLOCKING;
  [[nodiscard]] double half_width(double w) const NONBLOCKING;  // a/R: where the depth has fallen to 1 % of w
  [[nodiscard]] double rim_radius(double w) const
      NONBLOCKING;  // of the dimple as it is seen: where it is highest
  [[nodiscard]] double rim_depth(double w) const NONBLOCKING;             // of its bottom below that rim
  [[nodiscard]] double depth_at_strain(double strain) const NONBLOCKING;  // inverse of strain()

  // Deformed meridian (r, z), r >= 0, z = +1 at the undeformed pole; rz.size() >= kProfile.
  void profile(double w, std::span<std::array<double, 2>> rz) const NONBLOCKING;
  // Where node `node` of a profile was before: (sin, cos) of this angle.
  [[nodiscard]] double undeformed_theta(int node) const NONBLOCKING;

 private:
  struct Curve {
    std::vector<double> y, slope;
  };
  [[nodiscard]] double at(const Curve& curve, double w) const NONBLOCKING;
  [[nodiscard]] std::size_t interval(double w) const NONBLOCKING;
  [[nodiscard]] double work_within(std::size_t i, double w) const NONBLOCKING;

  MembraneShape shape_;
  std::vector<double> w_;
  std::vector<double> work_;  // of the force, from 0 to each depth
  Curve force_, pressure_, strain_, tip_tension_, half_width_, rim_radius_, rim_depth_;
  std::vector<std::array<double, 2>> rows_, row_slopes_;  // [depth][node]
};

}  // namespace punctum::sim
