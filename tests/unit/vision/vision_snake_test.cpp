// The energies of the snake, computed by hand, and the place where it comes to rest.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/image/circle.hpp"
#include "vision/image/snake.hpp"

namespace {

using namespace punctum::vision;

TEST(SnakeEnergy, elastic_is_the_deviation_from_the_mean_spacing) {
  EXPECT_DOUBLE_EQ(elastic_energy({0, 0}, {3, 4}, 7), 2);  // |v_s| = 5
  EXPECT_DOUBLE_EQ(elastic_energy({0, 0}, {3, 4}, 5), 0);
}

TEST(SnakeEnergy, bending_is_the_squared_second_difference) {
  EXPECT_DOUBLE_EQ(bending_energy({0, 0}, {1, 0}, {2, 0}), 0);
  EXPECT_DOUBLE_EQ(bending_energy({0, 0}, {1, 2}, {3, 1}), 1 + 9);  // (0-2+3, 0-4+1)
}

TEST(SnakeEnergy, external_runs_from_zero_to_minus_one_and_a_flat_neighbourhood_does_not_pull) {
  EXPECT_DOUBLE_EQ(external_energy(10, 10, 50, 5), 0);
  EXPECT_DOUBLE_EQ(external_energy(50, 10, 50, 5), -1);
  EXPECT_DOUBLE_EQ(external_energy(30, 10, 50, 5), -0.5);
  // Spread 1 below the floor 5: the lowest of it lies at -0.8, the difference is only 0.2.
  EXPECT_NEAR(external_energy(50, 49, 50, 5), -1, 1e-12);
  EXPECT_NEAR(external_energy(49, 49, 50, 5), -0.8, 1e-12);
  EXPECT_DOUBLE_EQ(external_energy(0, 0, 0, 0), 0);
}

cv::Mat ring_edge(const Circle& c, double sigma) {  // gradient magnitude of a blurred disc, in closed form
  cv::Mat m(240, 240, CV_32F);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 240; ++x) {
      const double d = std::hypot(x - c.centre.x, y - c.centre.y) - c.r;
      m.at<float>(y, x) = static_cast<float>(20 * std::exp(-0.5 * d * d / (sigma * sigma)));
    }
  }
  return m;
}

TEST(Snake, goes_to_the_edge_from_a_circle_that_is_a_few_pixels_off) {
  const Circle truth{{118.3, 121.6}, 70, 0};
  for (const int nodes : {8, 16, 32, 64}) {
    SnakeParams params;
    params.nodes = nodes;
    const Contour r = evolve(ring_edge(truth, 2.0), circle_contour({{120, 120}, 73, 0}, nodes), params, 0.5);
    ASSERT_EQ(r.size(), static_cast<std::size_t>(nodes));
    double worst = 0;
    for (const Point& p : r) {
      worst = std::max(worst, std::abs(cv::norm(p - truth.centre) - truth.r));
    }
    EXPECT_LT(worst, 1.6) << nodes;  // whole pixels, and the elastic term's share
  }
}

TEST(Snake, stays_inside_the_picture_and_returns_too_few_nodes_unchanged) {
  SnakeParams params;
  const cv::Mat flat(40, 40, CV_32F, cv::Scalar(0));
  const Contour r = evolve(flat, circle_contour({{0, 0}, 60, 0}, 16), params, 1);
  for (const Point& p : r) {
    EXPECT_TRUE(p.x >= 0 && p.y >= 0 && p.x <= 39 && p.y <= 39);
  }
  const Contour two{{1, 1}, {2, 2}};
  EXPECT_EQ(evolve(flat, two, params, 1), two);
  const Contour circle = circle_contour({{5, 5}, 3, 0}, 16);
  EXPECT_EQ(evolve(cv::Mat(), circle, params, 1), circle);
}

}  // namespace
