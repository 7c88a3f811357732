// Ways to describe the surface of the indented cell, and how far each is from it.
//
// Own frame of a cell, um: the origin is the undeformed centre, +x points out of it along the needle, the
// dimple is at +x.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hal/sim/membrane_truth.hpp"
#include "tools/report/polyline.hpp"
#include "vision/contour.hpp"

namespace punctum::report {

// The true one: an axisymmetric membrane of large deflection.
struct DeformedCell {
  double R_um = 0, c_um = 0;
  double wd_um = 0;              // depth of the dimple
  double a_um = 0;               // its half-width, where the depth is 1 % of w_d
  std::vector<Point2> meridian;  // (x, distance from the axis) from the bottom of the dimple to the far pole
  vision::Contour seen;          // outer contour of the tracker in one picture of it; empty = none
};

// Solved to 1e-4 um, apart from any table; throws std::runtime_error when the solver fails.
[[nodiscard]] DeformedCell deformed_cell(const sim::MembraneShape& shape, double R_um, double wd_um);

// Points of a surface: `along` from the bottom of the dimple to the far pole, times `around` the axis.
struct Net {
  int along, around;
  std::vector<double> cosine, sine;           // of the turn about the axis
  std::vector<std::array<double, 3>> points;  // [along][around], um
  Net(int along, int around);
};

// What a method makes of a cell, ready to be evaluated: builds its description from the measured quantities
// or nodes it was given, and fills the net.
using Surface = std::function<void(Net&)>;

struct SurfaceMethod {
  std::string name;
  std::string knob;  // "{} nodes"; empty = none
  std::vector<double> values;
  std::function<Surface(const DeformedCell&, double)> given;  // takes what vision would hand over
  double shipped = -1;                                        // this value is the program's own
};
// One row per method: another description is one row more.
[[nodiscard]] const std::vector<SurfaceMethod>& surface_methods();

struct SurfaceError {
  double rms_um = 0;         // normal distance, over the area of the true surface
  double dimple_rms_um = 0;  // the same over the part nearer to the axis than a, on the needle's side
  double max_um = 0;         // either way: of the true surface from it, and of it from the true surface
};
// Measured to 1e-4 um on a cell of 60 um.
[[nodiscard]] SurfaceError surface_error(const DeformedCell& cell, const Surface& surface);

}  // namespace punctum::report
