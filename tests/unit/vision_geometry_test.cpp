// Splines, circles, profiles: against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "vision/contour.hpp"
#include "vision/dimple.hpp"

namespace {

using namespace punctum::vision;

TEST(Spline, ThroughSixteenNodesOfACircleIsClosedOrderedAndWithinAThousandthOfItsRadius) {
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

TEST(Spline, PassesThroughItsNodesAndRepeatedNodesDoNoHarm) {
  const Contour nodes{{0, 0}, {40, 0}, {40, 0}, {50, 30}, {20, 50}, {-10, 20}, {0, 0}};
  const Contour c = spline_through(nodes, 1000);
  ASSERT_EQ(c.size(), 1000u);
  for (const Point& n : nodes) {
    EXPECT_LT(distance_to(c, n), 0.02);
  }
  EXPECT_TRUE(spline_through(Contour{{1, 1}, {2, 2}}, 128).empty());
  EXPECT_TRUE(spline_through(Contour(9, Point(5, 5)), 128).empty());
}

TEST(CircleFit, FindsTheCircleOfAnArcDespiteOutliers) {
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

TEST(PolarRadii, OfAShiftedCircleFollowTheLawOfCosines) {
  const Contour c = circle_contour({{3, -2}, 40, 0}, 4000);
  const auto r = polar_radii(c, {0, 0}, 256);
  ASSERT_EQ(r.size(), 256u);
  for (int i = 0; i < 256; ++i) {
    const double t = 2 * std::numbers::pi * i / 256;
    const double along = 3 * std::cos(t) - 2 * std::sin(t), across = 3 * std::sin(t) + 2 * std::cos(t);
    EXPECT_NEAR(r[static_cast<std::size_t>(i)], along + std::sqrt(1600 - across * across), 1e-4);
  }
}

TEST(Undeformed, IsTheCircleOfTheArcsOutsideTheDimple) {
  Contour c = circle_contour({{100, 100}, 70, 0}, 256);
  std::vector<double> weight(c.size(), 1.0);
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

TEST(EntryPoint, IsWhereTheAxisFirstMeetsTheUndeformedMembrane) {
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

TEST(HalfWidth, IsWhereTheDepthHasFallenToOnePercent) {
  // Depth 12 (1 - (u/30)^2)^2: one per cent is left where u = 30 sqrt(1 - 0.1).
  std::vector<ProfilePoint> profile;
  for (double u = -80; u <= 80; u += 0.5) {
    const double s = 1 - u * u / 900;
    profile.push_back({u, s > 0 ? 12 * s * s : 0});
  }
  const auto a = half_width(profile, 12, 4.6, 73);
  ASSERT_TRUE(a);
  EXPECT_NEAR(*a, 30 * std::sqrt(0.9), 1.0);
  EXPECT_FALSE(half_width(profile, 0, 4.6, 73));
  EXPECT_FALSE(half_width({}, 12, 4.6, 73));
}

}  // namespace
