// Descriptions of the surface of the indented cell, and their errors.
//
// All places are in the cell's own frame, in um: the origin is the undeformed centre, and the dimple is at
// +x, on the axis of the needle.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "hal/sim/plant/membrane_truth.hpp"
#include "vision/image/contour.hpp"

namespace punctum::report {

// The true surface: an axisymmetric membrane of large deflection.
struct DeformedCell {
  double R_um = 0, c_um = 0;
  double wd_um = 0;          // depth of the dimple
  double a_um = 0;           // its half-width, where the depth is 1 % of w_d
  vision::Contour meridian;  // (x, distance from the axis) from the bottom of the dimple to the far pole
  vision::Contour seen;      // outer contour of the tracker in one picture of the cell; empty: none
};

// Solved to 1e-4 um, without the cell's table. Throws std::runtime_error when the solver fails.
[[nodiscard]] DeformedCell deformed_cell(const sim::MembraneShape& shape, double R_um, double wd_um);

// Points of a surface: `along` from the bottom of the dimple to the far pole, times `around` the axis.
struct Net {
  int along, around;
  std::vector<double> cosine, sine;           // of the angle about the axis
  std::vector<std::array<double, 3>> points;  // [along][around], um
  Net(int along, int around);
};

// A description that is ready to be evaluated: fills the net with points of the surface.
using Surface = std::function<void(Net&)>;

struct SurfaceMethod {
  std::string name;
  std::string knob;  // "{} nodes"; empty: none
  std::vector<double> values;
  std::function<Surface(const DeformedCell&, double)>
      given;            // from what vision measures, and the value of the knob
  double shipped = -1;  // the value that the program ships
};
// One row per method: another description is one more row.
[[nodiscard]] const std::vector<SurfaceMethod>& surface_methods();

struct SurfaceError {
  double rms_um = 0;         // normal distance, over the area of the true surface
  double dimple_rms_um = 0;  // the same over the part nearer to the axis than a, on the needle's side
  double max_um = 0;         // the larger of the two one-sided distances
};
// Accurate to 1e-4 um for a cell of 60 um.
[[nodiscard]] SurfaceError surface_error(const DeformedCell& cell, const Surface& surface);

}  // namespace punctum::report
