// The measuring sticks of the report's topics vision and surface against closed forms.
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
    if (m.name == name) return m;
  }
  throw std::runtime_error(std::string(name));
}

sim::MembraneShape zona() { return {.c_over_R = 3.8 / kR, .seat_over_R = 0.5, .nu = 0.5, .prestrain = 0.2}; }

TEST(Polyline, FindsTheNearestPlaceWhateverTheRunsAre) {
  std::mt19937 random(3);
  std::normal_distribution<double> step(0, 1);
  for (const std::size_t n : {2U, 15U, 17U, 400U}) {
    std::vector<Point2> walk{{0, 0}};
    while (walk.size() < n) walk.push_back({walk.back()[0] + step(random), walk.back()[1] + step(random)});
    const Polyline line(walk, true);
    for (int k = 0; k < 100; ++k) {
      const Point2 p{10 * step(random), 10 * step(random)};
      double nearest = std::numeric_limits<double>::infinity();  // walked along every piece
      for (std::size_t i = 0; i < n; ++i) {
        const Point2 &a = walk[i], &b = walk[(i + 1) % n];
        for (int s = 0; s <= 1000; ++s) {
          const double t = s / 1000.0;
          nearest =
              std::min(nearest, std::hypot(p[0] - a[0] - t * (b[0] - a[0]), p[1] - a[1] - t * (b[1] - a[1])));
        }
      }
      EXPECT_LE(line.distance(p), nearest + 1e-12);
      EXPECT_GE(line.distance(p), nearest - 1e-2);
    }
  }
}

TEST(Polyline, IsAsFarAsTheCircleItDraws) {
  std::vector<Point2> circle;
  for (int i = 0; i < 4096; ++i)
    circle.push_back({kR * std::cos(kPi * i / 2048), kR * std::sin(kPi * i / 2048)});
  const Polyline line(circle, true);
  const double sagitta = kR * (1 - std::cos(kPi / 4096)) + 1e-12;
  for (const double r : {0.0, 12.0, 59.9, 60.0, 61.0, 1e3}) {
    EXPECT_NEAR(line.distance({r * std::cos(0.3), r * std::sin(0.3)}), std::abs(r - kR), sagitta);
  }
}

// A polygon's sides are R (1 - cos pi/n) inside the circle; the middle of a cubic through its nodes lies at
// R cos(h/2) (1 + 3/4 (1 - cos h)/(2 + cos h)), h = 2 pi/n (from the spline's three-term relation).
TEST(SurfaceError, OfPolygonAndSplineOnASphereIsTheClosedForm) {
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

TEST(SurfaceError, OfTheUndeformedSphereIsTheDepthOfTheDimple) {
  for (const double wd_um : {2.0, 11.3, 20.0}) {
    const DeformedCell cell = deformed_cell(zona(), kR, wd_um);
    const SurfaceError e = surface_error(cell, method("undeformed sphere").given(cell, 0));
    EXPECT_NEAR(e.max_um, wd_um, kStick_um);
    EXPECT_GT(e.dimple_rms_um, e.rms_um);
    EXPECT_LT(e.dimple_rms_um, wd_um);
  }
}

// Incompressible fluid inside: the solid of revolution keeps the sphere's volume.
TEST(DeformedCell, KeepsItsVolume) {
  for (const double wd_um : {5.0, 20.0}) {
    const DeformedCell cell = deformed_cell(zona(), kR, wd_um);
    double volume = 0;
    for (std::size_t i = 0; i + 1 < cell.meridian.size(); ++i) {
      const auto& [x0, r0] = cell.meridian[i];
      const auto& [x1, r1] = cell.meridian[i + 1];
      volume += kPi / 3 * (r0 * r0 + r0 * r1 + r1 * r1) * (x0 - x1);  // a cone's frustum
    }
    EXPECT_NEAR(volume / (4 * kPi / 3 * kR * kR * kR), 1, 2e-5);
    EXPECT_NEAR(cell.meridian.front()[0], kR - wd_um, 1e-9);
    EXPECT_NEAR(cell.meridian.back()[0], -kR, 1e-9);
  }
}

TEST(SurfaceMethods, DescribeBetterTheMoreNodesTheyHave) {
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
