// Splines, circles, profiles: against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "vision/image/circle.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/image/polyline.hpp"
#include "vision/image/spline.hpp"
#include "vision/membrane/dimple.hpp"

namespace {

using namespace punctum::vision;

TEST(Spline, through_sixteen_nodes_of_a_circle_is_closed_ordered_and_within_a_thousandth_of_its_radius) {
  const Circle circle{{120, 80}, 60, 0};
  const Contour c = spline_through(circle_contour(circle, 16), 128);
  ASSERT_EQ(c.size(), 128u);
  double turn = 0, longest = 0, shortest = 1e9;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const Point a = c[i] - circle.centre, b = c[(i + 1) % c.size()] - circle.centre;
    EXPECT_NEAR(cv::norm(a), 60, 0.06);
    turn += std::atan2(a.cross(b), a.dot(b));
    longest = std::max(longest, cv::norm(b - a));
    shortest = std::min(shortest, cv::norm(b - a));
  }
  EXPECT_NEAR(turn, 2 * std::numbers::pi, 1e-9);  // once round, in order
  EXPECT_LT(longest / shortest, 1.05);            // equal steps
  EXPECT_NEAR(signed_area(c), std::numbers::pi * 3600, 0.002 * std::numbers::pi * 3600);
}

TEST(Spline, passes_through_its_nodes_and_ignores_repeated_ones) {
  const Contour nodes{{0, 0}, {40, 0}, {40, 0}, {50, 30}, {20, 50}, {-10, 20}, {0, 0}};
  const Contour c = spline_through(nodes, 1000);
  ASSERT_EQ(c.size(), 1000u);
  const Polyline line(c, true);
  for (const Point& n : nodes) {
    EXPECT_LT(line.distance(n), 0.02);
  }
  EXPECT_TRUE(spline_through(Contour{{1, 1}, {2, 2}}, 128).empty());
  EXPECT_TRUE(spline_through(Contour(9, Point(5, 5)), 128).empty());
}

TEST(Polyline, finds_the_nearest_place) {
  std::mt19937 random(3);
  std::normal_distribution<double> step(0, 1);
  for (const std::size_t n : {2U, 15U, 17U, 400U}) {
    Vector<Point> walk{{0, 0}};
    while (walk.size() < n) {
      walk.push_back(walk.back() + Point(step(random), step(random)));
    }
    const Polyline line(walk, true);
    for (int k = 0; k < 100; ++k) {
      const Point p(10 * step(random), 10 * step(random));
      double nearest = std::numeric_limits<double>::infinity();  // of 1001 places on every piece
      for (std::size_t i = 0; i < n; ++i) {
        const Point &a = walk[i], &b = walk[(i + 1) % n];
        for (int s = 0; s <= 1000; ++s) {
          nearest = std::min(nearest, cv::norm(p - a - s / 1000.0 * (b - a)));
        }
      }
      EXPECT_LE(line.distance(p), nearest + 1e-12);
      EXPECT_GE(line.distance(p), nearest - 1e-2);
    }
  }
}

TEST(Polyline, of_a_circle_is_as_far_away_as_the_circle) {
  constexpr double kR = 60;
  const Polyline line(circle_contour({{0, 0}, kR, 0}, 4096), true);
  const double sagitta = kR * (1 - std::cos(std::numbers::pi / 4096)) + 1e-12;
  for (const double r : {0.0, 12.0, 59.9, 60.0, 61.0, 1e3}) {
    EXPECT_NEAR(line.distance({r * std::cos(0.3), r * std::sin(0.3)}), std::abs(r - kR), sagitta);
  }
}

TEST(CircleFit, finds_the_circle_of_an_arc_despite_outliers) {
  Contour p;
  for (int i = 0; i < 200; ++i) {
    const double t = 4.0 * i / 200;
    p.push_back(Point(33, 21) + 47.0 * Point(std::cos(t), std::sin(t)));
  }
  for (int i = 0; i < 30; ++i) {
    p[static_cast<std::size_t>(3 * i)] += Point(6, -9);
  }
  const auto c = fit_circle(p);
  ASSERT_TRUE(c);
  EXPECT_NEAR(c->centre.x, 33, 2e-3);
  EXPECT_NEAR(c->centre.y, 21, 2e-3);
  EXPECT_NEAR(c->r, 47, 2e-3);
  EXPECT_FALSE(fit_circle(Contour{{0, 0}, {1, 1}, {2, 2}, {3, 3}}));  // a line
  EXPECT_FALSE(fit_circle(Contour{}));
}

TEST(PolarRadii, of_a_shifted_circle_follow_the_law_of_cosines) {
  const Contour c = circle_contour({{3, -2}, 40, 0}, 4000);
  const auto r = polar_radii(c, {0, 0}, 256);
  ASSERT_EQ(r.size(), 256u);
  for (int i = 0; i < 256; ++i) {
    const double t = 2 * std::numbers::pi * i / 256;
    const double along = 3 * std::cos(t) - 2 * std::sin(t), across = 3 * std::sin(t) + 2 * std::cos(t);
    EXPECT_NEAR(r[static_cast<std::size_t>(i)], along + std::sqrt(1600 - across * across), 1e-4);
  }
}

TEST(Undeformed, is_the_circle_of_the_arcs_outside_the_dimple) {
  Contour c = circle_contour({{100, 100}, 70, 0}, 256);
  Vector<double> weight(c.size(), 1.0);
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double t =
        std::remainder(2 * std::numbers::pi * static_cast<double>(i) / 256, 2 * std::numbers::pi);
    if (std::abs(t) < 0.7) {
      c[i].x -= 15 * std::pow(std::cos(t / 0.7 * std::numbers::pi / 2), 2);
      weight[i] = 0;
    }
  }
  const auto u = fit_undeformed(c, weight);
  ASSERT_TRUE(u);
  EXPECT_TRUE(u->round);
  EXPECT_NEAR(u->circle.centre.x, 100, 1e-6);
  EXPECT_NEAR(u->circle.r, 70, 1e-6);
}

TEST(EntryPoint, is_where_the_axis_first_meets_the_undeformed_membrane) {
  const Contour circle = circle_contour({{100, 100}, 70, 0}, 4096);
  // From the right along -x at 20 px off the middle; also for a tip that is inside already.
  for (const double x : {250.0, 120.0}) {
    const auto e = entry_point(circle, {x, 120}, {-1, 0});
    ASSERT_TRUE(e);
    EXPECT_NEAR(e->x, 100 + std::sqrt(70.0 * 70 - 20 * 20), 1e-3);
    EXPECT_NEAR(e->y, 120, 1e-9);
  }
  EXPECT_FALSE(entry_point(circle, {250, 300}, {-1, 0}));
}

TEST(HalfWidth, is_where_the_depth_has_fallen_to_one_percent) {
  // Depth 12 (1 - (u/30)^2)^2: one per cent is left where u = 30 sqrt(1 - 0.1).
  Vector<ProfilePoint> profile;
  for (double u = -80; u <= 80; u += 0.5) {
    const double s = 1 - u * u / 900;
    profile.push_back({u, s > 0 ? 12 * s * s : 0});
  }
  const auto a = half_width(profile, 12, 4.6, 73, 0);
  ASSERT_TRUE(a);
  EXPECT_NEAR(a->a, 30 * std::sqrt(0.9), 1.0);
  EXPECT_EQ(a->sd, 0);
  EXPECT_FALSE(half_width(profile, 0, 4.6, 73, 0));
  EXPECT_FALSE(half_width({}, 12, 4.6, 73, 0));
}

TEST(HalfWidth, is_as_certain_as_the_profile_is_steep_where_it_ends) {
  // A cone: its depth falls by 0.4 per px, so an error of 0.2 in the depth is one of 0.5 px in the width of
  // each side, and of 0.5/sqrt(2) in their mean.
  Vector<ProfilePoint> profile;
  for (double u = -80; u <= 80; u += 0.5) {
    profile.push_back({u, 12 - 0.4 * std::abs(u)});
  }
  const auto a = half_width(profile, 12, 4.6, 73, 0.2);
  ASSERT_TRUE(a);
  EXPECT_NEAR(a->a, (12 - 0.12) / 0.4, 0.1);
  EXPECT_NEAR(a->sd, 0.5 / std::sqrt(2), 0.02);
}

}  // namespace
