// The surface of a membrane: against the NURBS of its control net, written out from the definition, and
// against bodies whose surface is known in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "vision/membrane/undeformed.hpp"
#include "vision/surface/membrane_net.hpp"
#include "vision/surface/surface_grid.hpp"

namespace surface {
namespace {

using namespace punctum::vision;
using Vector = Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kR = 60;
const Point kFromRight(-1, 0);

using Radius = std::function<double(double cosine)>;  // of the angle at the middle, from +x

Contour contour_of(const Radius& radius, int points) {
  Contour c;
  for (int i = 0; i < points; ++i) {
    const double phi = 2 * kPi * (i + 0.37) / points;  // no point on the axis
    c.push_back(radius(std::cos(phi)) * Point(std::cos(phi), std::sin(phi)));
  }
  return c;
}

double round_cell(double) { return kR; }

// Analytic at both poles too.
struct Dimpled {
  double depth = 15, width = 0.35;
  double operator()(double cosine) const { return kR - depth * std::exp((cosine - 1) / (width * width)); }
  // Of rho - radius(x / rho), normalised.
  [[nodiscard]] Vector normal(const Vector& p) const {
    const double rho = p.norm(), cosine = p.x() / rho;
    const double slope = -depth / (width * width) * std::exp((cosine - 1) / (width * width));
    const Vector cosine_slope = Vector(1, 0, 0) / rho - p * (p.x() / (rho * rho * rho));
    return (p / rho - slope * cosine_slope).normalized();
  }
};

MembraneNet net_of(const Contour& contour, int control_points, double dimple, const Point& through = {0, 0},
                   const Point& axis = kFromRight) {
  MembraneNet net;
  NetFit(control_points).fit(contour, through, axis, dimple, net);
  EXPECT_TRUE(net.ok) << net.reason;
  return net;
}

struct Grid {
  int along, around;
  GridVectors points, normals;

  Grid(const MembraneNet& net, int along_, int around_) : along(along_), around(around_) {
    SurfaceGrid(net.size, along, around).points_and_normals(net, points, normals);
  }
  [[nodiscard]] static Vector at(const GridVectors& v, std::size_t k) { return {v.x[k], v.y[k], v.z[k]}; }
  [[nodiscard]] std::size_t size() const { return points.x.size(); }
};

// N(i, degree) by its recursion (The NURBS Book, eq. 2.5), 0/0 = 0; the last span is closed.
double basis(const std::vector<double>& knots, int i, int degree, double u) {
  const auto k = [&knots](int j) { return knots[static_cast<std::size_t>(j)]; };
  if (degree == 0) {
    const bool last = u == knots.back() && k(i + 1) == u && k(i) < u;
    return (k(i) <= u && u < k(i + 1)) || last ? 1 : 0;
  }
  const double left = k(i + degree) - k(i), right = k(i + degree + 1) - k(i + 1);
  return (left > 0 ? (u - k(i)) / left * basis(knots, i, degree - 1, u) : 0) +
         (right > 0 ? (k(i + degree + 1) - u) / right * basis(knots, i + 1, degree - 1, u) : 0);
}

Vector nurbs_point(const MembraneNet& net, double u, double v) {
  const std::vector<double> round{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
  std::vector<double> along(static_cast<std::size_t>(net.size) + 4);
  for (int i = 0; i < net.size + 4; ++i) {
    along[static_cast<std::size_t>(i)] = std::clamp((i - 3.0) / (net.size - 3.0), 0.0, 1.0);
  }
  Vector sum = Vector::Zero();
  double weights = 0;
  for (int i = 0; i < net.size; ++i) {
    const double a = basis(along, i, 3, u);
    const Section& c = net.control[static_cast<std::size_t>(i)];
    for (int j = 0; j < kCirclePoints && a != 0; ++j) {
      const CirclePoint& p = circle_points()[static_cast<std::size_t>(j)];
      const double w = a * basis(round, j, 2, v) * p.weight;
      sum += w * Vector(c[0] + p.along * c[2], c[1] + p.along * c[3], p.across * c[4]);
      weights += w;
    }
  }
  return sum / weights;
}

TEST(SurfaceGrid, lies_on_the_nurbs_surface_of_the_control_net) {
  const MembraneNet net = net_of(contour_of(Dimpled(), 256), 32, 20);
  constexpr int kAlong = 41,
                kEighths = 8;  // quarter turns are knots of the circle, eighths the middles between
  const Grid grid(net, kAlong, kEighths);
  for (int i = 0; i < kAlong; ++i) {
    for (int j = 0; j < kEighths; ++j) {
      const Vector wanted = nurbs_point(net, static_cast<double>(i) / (kAlong - 1), 0.5 * j);
      const Vector p = Grid::at(grid.points, static_cast<std::size_t>(i * kEighths + j));
      ASSERT_LT((p - wanted).norm(), 1e-12) << i << " " << j;
    }
  }
}

// What a step between control points half as long leaves of the error: 2 to the order.
template <class Error>
std::vector<double> orders(const Error& error) {
  std::vector<double> orders;
  double before = 0;
  for (const int spans : {7, 14, 28, 56}) {
    const double now = error(spans + 3);
    if (before > 0) {
      orders.push_back(std::log2(before / now));
      std::printf("%d control points: error %.3g px, order %.2f\n", spans + 3, now, orders.back());
    }
    before = now;
  }
  return orders;
}

TEST(MembraneNet, of_a_round_contour_is_a_sphere_to_fourth_order) {
  const Contour contour = contour_of(round_cell, 8192);
  const auto order = orders([&contour](int control_points) {
    const Grid grid(net_of(contour, control_points, 0), 129, 16);
    double worst = 0;
    for (std::size_t k = 0; k < grid.size(); ++k) {
      worst = std::max(worst, std::abs(Grid::at(grid.points, k).norm() - kR));
    }
    return worst;
  });
  for (const double o : order) {
    EXPECT_GE(o, 3.9);
  }
}

TEST(MembraneNet, of_a_dimpled_body_converges_to_fourth_order) {
  const Dimpled body;
  const Contour contour = contour_of(body, 8192);
  const auto order = orders([&](int control_points) {
    const Grid grid(net_of(contour, control_points, 20), 257, 16);
    double worst = 0;
    for (std::size_t k = 0; k < grid.size(); ++k) {
      const Vector p = Grid::at(grid.points, k);
      worst = std::max(worst, std::abs(p.norm() - body(p.x() / p.norm())));
    }
    return worst;
  });
  EXPECT_GE(order.back(), 3.9);
  EXPECT_GE(order[1], 3.5);  // while the dimple is hardly resolved
}

TEST(MembraneNet, of_a_contour_that_mirrors_itself_is_an_exact_surface_of_revolution) {
  const Grid grid(net_of(contour_of(Dimpled(), 720), 32, 20), 64, 64);
  for (int i = 0; i < grid.along; ++i) {
    const auto first = static_cast<std::size_t>(i * grid.around);
    const double x = grid.points.x[first], r = std::hypot(grid.points.y[first], grid.points.z[first]);
    for (std::size_t j = 1; j < static_cast<std::size_t>(grid.around); ++j) {
      EXPECT_NEAR(grid.points.x[first + j], x, 2e-4);
      EXPECT_NEAR(std::hypot(grid.points.y[first + j], grid.points.z[first + j]), r, 2e-4);
    }
  }
}

// 256 points of a round contour on any axis, also beside its middle: one sphere.
TEST(MembraneNet, of_a_round_contour_does_not_depend_on_the_axis) {
  const Contour contour = contour_of(round_cell, 256);
  for (const double offset : {0.0, 10.0, -35.0}) {
    for (const double turn : {0.0, 0.4, 2.5}) {
      const Point axis(-std::cos(turn), std::sin(turn));
      const Grid grid(net_of(contour, 32, 0, offset * Point(axis.y, -axis.x), axis), 64, 64);
      for (std::size_t k = 0; k < grid.size(); ++k) {
        const Vector p = Grid::at(grid.points, k);
        EXPECT_NEAR(p.norm(), kR, 1e-3);
        EXPECT_NEAR(Grid::at(grid.normals, k).dot(p) / kR, 1, 1e-5);
      }
    }
  }
}

TEST(MembraneNet, passes_through_both_halves_of_a_contour_that_differ) {
  // An ellipse that stands across the axis at 30 degrees.
  const auto ellipse = [](double phi) {
    const Point p(70 * std::cos(phi), 50 * std::sin(phi));
    const double c = std::cos(kPi / 6), s = std::sin(kPi / 6);
    return Point(c * p.x - s * p.y, s * p.x + c * p.y);
  };
  Contour contour;
  for (int i = 0; i < 512; ++i) {
    contour.push_back(ellipse(2 * kPi * i / 512));
  }
  const auto off = [](const Vector& p) {  // of the ellipse's equation, in about pixels
    const double c = std::cos(kPi / 6), s = std::sin(kPi / 6);
    const double a = (c * p.x() + s * p.y()) / 70, b = (-s * p.x() + c * p.y()) / 50;
    return 50 * (std::sqrt(a * a + b * b) - 1);
  };
  const Grid grid(net_of(contour, 32, 0), 64, 64);
  for (int i = 0; i < grid.along; ++i) {
    for (const int j : {0, 32}) {
      const auto k = static_cast<std::size_t>(i * 64 + j);
      EXPECT_NEAR(off(Grid::at(grid.points, k)), 0, 0.01);
      EXPECT_NEAR(grid.points.z[k], 0, 1e-9);
    }
  }
  // At the poles all meridians have one tangent plane: there the normal is that of the ellipse.
  for (const std::size_t row : {std::size_t{0}, std::size_t{63 * 64}}) {
    const Vector p = Grid::at(grid.points, row);
    const double c = std::cos(kPi / 6), s = std::sin(kPi / 6);
    const double a = (c * p.x() + s * p.y()) / 4900, b = (-s * p.x() + c * p.y()) / 2500;
    const Vector normal = Vector(c * a - s * b, s * a + c * b, 0).normalized();
    for (std::size_t j = 0; j < 64; ++j) {
      EXPECT_GT(Grid::at(grid.normals, row + j).dot(normal), 1 - 1e-6);
    }
  }
}

TEST(SurfaceGrid, has_the_normals_of_the_body) {
  const Dimpled body;
  const Grid grid(net_of(contour_of(body, 4096), 64, 20), 64, 64);
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const Vector p = Grid::at(grid.points, k), n = Grid::at(grid.normals, k);
    EXPECT_NEAR(n.norm(), 1, 1e-12);
    EXPECT_GT(n.dot(body.normal(p)), 1 - 2e-6) << k;  // 2 mrad
  }
}

TEST(MembraneNet, has_the_near_pole_where_the_needle_meets_the_contour) {
  const Contour contour = contour_of(Dimpled(), 256);
  const Point through(80, 5), axis(-std::cos(0.1), -std::sin(0.1));
  const MembraneNet net = net_of(contour, 32, 20, through, axis);
  const auto met = entry_point(contour, through, axis);
  ASSERT_TRUE(met);
  EXPECT_NEAR(net.control[0][0], met->x, 0.01);
  EXPECT_NEAR(net.control[0][1], met->y, 0.01);
}

TEST(MembraneNet, is_the_same_in_either_direction_of_the_contour_and_whatever_was_fitted_before) {
  Contour contour = contour_of(Dimpled(), 256);
  NetFit fit(32);
  MembraneNet first, backwards;
  fit.fit(contour, {0, 0}, kFromRight, 20, first);
  fit.fit(contour_of(round_cell, 200), {3, 0}, {0, 1}, 0, backwards);
  std::reverse(contour.begin(), contour.end());
  fit.fit(contour, {0, 0}, kFromRight, 20, backwards);
  for (std::size_t i = 0; i < 32; ++i) {
    EXPECT_LT((first.control[i] - backwards.control[i]).norm(), 1e-11);
  }
}

std::string refusal(const Contour& contour, const Point& through = {0, 0}) {
  MembraneNet net;
  NetFit(32).fit(contour, through, kFromRight, 0, net);
  EXPECT_FALSE(net.ok);
  EXPECT_FALSE(net.reason.empty());
  return std::string(net.reason);
}

TEST(MembraneNet, is_refused_where_there_is_no_surface) {
  const Contour round = contour_of(round_cell, 256);
  EXPECT_EQ(refusal({}), "no contour");
  EXPECT_EQ(refusal(Contour(100, Point(3, 4))), "no contour");
  EXPECT_EQ(refusal(round, {0, 61}), "the axis does not meet the contour");
  Contour bad = round;
  bad[17].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(bad), "a place of the contour is not a number");
  bad[17].y = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal(bad), "a place of the contour is not a number");
}

TEST(MembraneNet, is_refused_where_the_surface_would_cross_itself) {
  Contour eight;
  for (int i = 0; i < 256; ++i) {
    const double phi = 2 * kPi * (i + 0.3) / 256;
    eight.emplace_back(60 * std::cos(phi), 40 * std::sin(2 * phi));
  }
  EXPECT_NE(refusal(eight).find("cross"), std::string::npos);
  // A bent sausage: simple in the picture, but its sections go forth and back along the axis.
  Contour bent;
  for (int i = 0; i <= 100; ++i) {
    const double phi = -2 * kPi / 3 + 4 * kPi / 3 * i / 100;
    bent.push_back(55 * Point(std::cos(phi), std::sin(phi)));
  }
  for (int i = 100; i >= 0; --i) {
    const double phi = -2 * kPi / 3 + 4 * kPi / 3 * i / 100;
    bent.push_back(25 * Point(std::cos(phi), std::sin(phi)));
  }
  ASSERT_TRUE(is_simple(bent));
  MembraneNet net;
  NetFit(32).fit(bent, {0, 34}, {1, 0}, 0, net);
  EXPECT_FALSE(net.ok);
}

TEST(IsSimple, tells_curves_that_cross_themselves_from_those_that_do_not) {
  EXPECT_TRUE(is_simple(contour_of(round_cell, 50)));
  EXPECT_TRUE(is_simple(contour_of(Dimpled{.depth = 55, .width = 0.2}, 200)));
  const Contour horseshoe{{0, 0}, {10, 0}, {10, 10}, {8, 10}, {8, 2}, {2, 2}, {2, 10}, {0, 10}};
  EXPECT_TRUE(is_simple(horseshoe));
  Contour crossed = horseshoe;
  crossed[4].x = 1;
  EXPECT_FALSE(is_simple(crossed));
  Contour twice;  // round twice, at slightly different radii
  for (int i = 0; i < 100; ++i) {
    twice.push_back((10 + 0.01 * i) * Point(std::cos(4 * kPi * i / 100), std::sin(4 * kPi * i / 100)));
  }
  EXPECT_FALSE(is_simple(twice));
}

}  // namespace
}  // namespace surface
