// Coverage against areas known in closed form or counted on a fine grid; blur against the error function.
#include "hal/sim/camera/area_raster.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "hal/sim/camera/blurred_layer.hpp"

using namespace punctum::sim;

namespace {

std::vector<double> coverage(const Box& box, std::span<const Pixel> polygon) {
  AreaRaster raster;
  raster.start(box);
  raster.add(polygon, 1);
  std::vector<double> out;
  for (int y = 0; y < box.height(); ++y) {
    double sum = 0;
    for (int x = 0; x < box.width(); ++x) {
      out.push_back(sum += static_cast<double>(raster.row(y)[x]));
    }
  }
  return out;
}

bool inside(std::span<const Pixel> p, double x, double y) {
  bool in = false;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++) {
    if ((p[i].y > y) != (p[j].y > y) && x < (p[j].x - p[i].x) * (y - p[i].y) / (p[j].y - p[i].y) + p[i].x) {
      in = !in;
    }
  }
  return in;
}

TEST(AreaRaster, a_rectangle_covers_the_exact_share_of_each_pixel) {
  // Pixel centres at integers: pixel 2 reaches from 1.5 to 2.5.
  const std::array<Pixel, 4> r{{{1.75, 0.75}, {4.0, 0.75}, {4.0, 2.0}, {1.75, 2.0}}};
  const auto c = coverage({0, 0, 6, 4}, r);
  const std::array<double, 6> across{0, 0, 0.75, 1, 0.5, 0};
  const std::array<double, 4> down{0, 0.75, 0.5, 0};
  for (std::size_t y = 0; y < 4; ++y) {
    for (std::size_t x = 0; x < 6; ++x) {
      EXPECT_NEAR(c[y * 6 + x], across[x] * down[y], 1e-6) << x << "," << y;
    }
  }
}

TEST(AreaRaster, slanted_edges_cover_the_exact_area_of_each_pixel) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-4, 16);
  const Box box{0, 0, 12, 10};
  for (int round = 0; round < 60; ++round) {
    std::array<Pixel, 3> t;  // reaching out of the box on all sides
    for (Pixel& p : t) {
      p = {place(random), place(random)};
    }
    const auto c = coverage(box, t);
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x) {
        int hits = 0;
        constexpr int kFine = 24;
        for (int k = 0; k < kFine * kFine; ++k) {
          hits += inside(t, x - 0.5 + (k % kFine + 0.5) / kFine, y - 0.5 + (k / kFine + 0.5) / kFine) ? 1 : 0;
        }
        EXPECT_NEAR(c[static_cast<std::size_t>(y * 12 + x)], hits / double{kFine * kFine}, 0.04);
      }
    }
  }
}

TEST(AreaRaster, the_sum_of_the_coverage_is_the_area_of_the_polygon) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> wobble(0.7, 1.3);
  for (int round = 0; round < 50; ++round) {
    std::vector<Pixel> p;
    for (int i = 0; i < 37; ++i) {
      const double t = 2 * std::numbers::pi * i / 37;
      const double r = 18 * wobble(random);
      p.push_back({30.3 + r * std::cos(t), 28.8 + r * std::sin(t)});
    }
    double sum = 0;
    for (const double v : coverage({0, 0, 60, 60}, p)) {
      sum += v;
    }
    EXPECT_NEAR(sum, std::abs(signed_area(p)), 1e-3);
  }
}

TEST(AreaRaster, a_polygon_that_reaches_far_outside_covers_all_or_nothing) {
  const Box box{-3, -2, 5, 6};
  const std::array<Pixel, 4> all{{{-1e6, -1e6}, {1e6, -1e6}, {1e6, 1e6}, {-1e6, 1e6}}};
  for (const double v : coverage(box, all)) {
    EXPECT_NEAR(v, 1, 1e-6);
  }
  for (const double dx : {-1e6, 1e6}) {
    const std::array<Pixel, 3> away{{{dx, 0}, {dx + 10, 0}, {dx, 10}}};
    for (const double v : coverage(box, away)) {
      EXPECT_NEAR(v, 0, 1e-6);
    }
  }
}

TEST(AreaRaster, an_offset_of_a_circle_is_a_circle) {
  std::vector<Pixel> p;
  std::vector<Pixel> moved;
  for (int i = 0; i < 100; ++i) {
    const double t = -2 * std::numbers::pi * i / 100;  // either sense of rotation
    p.push_back({5 + 20 * std::cos(t), 7 + 20 * std::sin(t)});
  }
  offset(p, 3, moved);
  for (const Pixel& q : moved) {
    EXPECT_NEAR(std::hypot(q.x - 5, q.y - 7), 23, 1e-9);
  }
  offset(p, -3, moved);
  for (const Pixel& q : moved) {
    EXPECT_NEAR(std::hypot(q.x - 5, q.y - 7), 17, 1e-9);
  }
}

TEST(BlurredLayer, an_edge_becomes_the_error_function) {
  for (const double sigma : {0.8, 1.2, 3.0}) {
    for (const bool upright : {true, false}) {
      const double at = 24.3;
      AreaRaster raster;
      const Box box{0, 0, 50, 50};
      raster.start(box);
      const std::array<Pixel, 4> half =
          upright ? std::array<Pixel, 4>{{{at, -100}, {200, -100}, {200, 200}, {at, 200}}}
                  : std::array<Pixel, 4>{{{-100, at}, {200, at}, {200, 200}, {-100, 200}}};
      raster.add(half, 1);
      BlurredLayer layer;
      layer.start(box);
      for (int y = 0; y < 50; ++y) {
        float sum = 0;
        for (int x = 0; x < 50; ++x) {
          layer.row(y)[x] = sum += raster.row(y)[x];
        }
      }
      layer.blur(sigma);
      for (int i = 10; i < 40; ++i) {
        const double got = static_cast<double>(upright ? layer.row(25)[i] : layer.row(i)[25]);
        // Mean of the blurred edge over the pixel, by Simpson's rule.
        const auto edge = [&](double x) { return 0.5 * std::erfc((at - x) / (sigma * std::numbers::sqrt2)); };
        const double expected = (edge(i - 0.5) + 4 * edge(i) + edge(i + 0.5)) / 6;
        // A kernel sampled at whole pixels is coarse below one pixel.
        EXPECT_NEAR(got, expected, sigma < 1 ? 0.015 : 0.004) << sigma << " " << i;
      }
    }
  }
}

}  // namespace
