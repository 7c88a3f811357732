// The yardsticks of topic surface against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tools/report/surface.hpp"

namespace {

using namespace punctum;
using namespace punctum::report;

constexpr double kPi = std::numbers::pi;
constexpr double kR = 60;           // um
constexpr double kStick_um = 1e-4;  // what distances are measured to

const SurfaceMethod& method(std::string_view name) {
  for (const SurfaceMethod& m : surface_methods()) {
    if (m.name == name) {
      return m;
    }
  }
  throw std::runtime_error(std::string(name));
}

sim::MembraneShape zona() { return {.c_over_R = 3.8 / kR, .seat_over_R = 0.5, .nu = 0.5, .prestrain = 0.2}; }

// A polygon's sides are R (1 - cos pi/n) inside the circle; the middle of a cubic through its nodes lies at
// R cos(h/2) (1 + 3/4 (1 - cos h)/(2 + cos h)), h = 2 pi/n (from the spline's three-term relation).
TEST(SurfaceError, of_polygon_and_spline_on_a_sphere_equals_the_closed_form) {
  const DeformedCell sphere = deformed_cell(zona(), kR, 0);
  for (const int n : {8, 16, 32}) {
    const double h = 2 * kPi / n;
    const double side = kR * (1 - std::cos(kPi / n));
    const double middle = kR * (1 - std::cos(h / 2) * (1 + 0.75 * (1 - std::cos(h)) / (2 + std::cos(h))));
    EXPECT_NEAR(surface_error(sphere, method("polygon").given(sphere, n)).max_um, side, 1e-3 * side);
    EXPECT_NEAR(surface_error(sphere, method("periodic spline").given(sphere, n)).max_um, middle, kStick_um);
  }
  const SurfaceError exact = surface_error(sphere, method("undeformed sphere").given(sphere, 0));
  EXPECT_LT(exact.max_um, kStick_um);
}

TEST(SurfaceError, of_the_undeformed_sphere_is_the_depth_of_the_dimple) {
  for (const double wd_um : {2.0, 11.3, 20.0}) {
    const DeformedCell cell = deformed_cell(zona(), kR, wd_um);
    const SurfaceError e = surface_error(cell, method("undeformed sphere").given(cell, 0));
    EXPECT_NEAR(e.max_um, wd_um, kStick_um);
    EXPECT_GT(e.dimple_rms_um, e.rms_um);
    EXPECT_LT(e.dimple_rms_um, wd_um);
  }
}

// Incompressible fluid inside: the solid of revolution keeps the sphere's volume.
TEST(DeformedCell, keeps_its_volume) {
  for (const double wd_um : {5.0, 20.0}) {
    const DeformedCell cell = deformed_cell(zona(), kR, wd_um);
    double volume = 0;
    for (std::size_t i = 0; i + 1 < cell.meridian.size(); ++i) {
      const auto& [x0, r0] = cell.meridian[i];
      const auto& [x1, r1] = cell.meridian[i + 1];
      volume += kPi / 3 * (r0 * r0 + r0 * r1 + r1 * r1) * (x0 - x1);  // a cone's frustum
    }
    EXPECT_NEAR(volume / (4 * kPi / 3 * kR * kR * kR), 1, 2e-5);
    EXPECT_NEAR(cell.meridian.front().x, kR - wd_um, 1e-9);
    EXPECT_NEAR(cell.meridian.back().x, -kR, 1e-9);
  }
}

TEST(SurfaceMethods, describe_better_with_more_nodes) {
  const DeformedCell cell = deformed_cell(zona(), kR, 20);
  for (const char* name : {"polygon", "polygon at equal angles", "periodic spline"}) {
    const SurfaceMethod& m = method(name);
    double last = std::numeric_limits<double>::infinity();
    for (const double nodes : m.values) {
      const SurfaceError e = surface_error(cell, m.given(cell, nodes));
      EXPECT_LT(e.rms_um, last) << name << " " << nodes;
      last = e.rms_um;
    }
    EXPECT_LT(last, 0.01) << name;
  }
}

}  // namespace
