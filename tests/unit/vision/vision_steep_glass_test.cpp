// A needle that widens so steeply that only its tip is in focus, and what looks like one. Drawn here: two
// dark walls, each a line that is wider and fainter the further it lies out of the plane of focus.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/injection_pipette.hpp"
#include "vision/pipettes/steep_glass.hpp"

namespace steep {
namespace {

using namespace punctum::vision;

constexpr int kW = 720, kH = 560;
constexpr double kNoise = 1.5, kRadius = 6, kTip_px = 1.5;

struct Glass {
  Point tip{420.3, 260.7};
  double degrees = -20;  // of its axis
  double taper = 0.18;
  double unsharp = 0.06;  // px of blur per px from where it is in focus
  double focus_px = 0;    // that is so far behind the tip
  double blur_px = 1;     // of all
  double ahead_px = 0;    // so far its walls go on past the tip
  double length_px = 2000;
  double radius = kRadius;
};

double bump(double x, double sd) { return std::exp(-0.5 * x * x / (sd * sd)); }

double step(double x) { return 1 / (1 + std::exp(-1.7 * x)); }

GradientField photographed(const Glass& glass, unsigned seed = 1) {
  constexpr double kMiddleOfWall = 0.85, kWall = 0.1, kGrey = 178, kWall_grey = 90, kClosed_grey = 40;
  const double a = glass.degrees * CV_PI / 180;
  const Point axis(std::cos(a), std::sin(a)), across(-axis.y, axis.x);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kNoise);
  cv::Mat grey(kH, kW, CV_8U);
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      const Point r = Point(x, y) - glass.tip;
      const double s = -r.dot(axis), u = r.dot(across), w = glass.radius + glass.taper * s;
      const double blur = std::hypot(glass.blur_px, glass.unsharp * (s - glass.focus_px));
      const double wall = std::max(kWall * std::abs(w), 0.8), sd = std::hypot(blur, wall);
      const double walls = bump(u - kMiddleOfWall * w, sd) + bump(u + kMiddleOfWall * w, sd);
      const double glass_here = step((s + glass.ahead_px) / blur) * step((glass.length_px - s) / blur);
      double dark = glass_here * kWall_grey * wall / sd * walls;
      if (glass.ahead_px == 0 && std::abs(u) < kMiddleOfWall * glass.radius) {
        dark += kClosed_grey / blur * bump(s - 1, blur);
      }
      grey.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(kGrey - dark + noise(random));
    }
  }
  GradientField field;
  field.compute(grey, cv::Rect(0, 0, kW, kH), 1.2);
  return field;
}

TEST(SteepGlass, ends_where_it_ends_wherever_it_comes_from) {
  for (const double taper : {0.12, 0.18, 0.26}) {
    for (const double degrees : {-20.0, 8.0, 160.0, 200.0, 75.0, -100.0}) {
      const Glass glass{.degrees = degrees, .taper = taper};
      const auto seen = steep_glass(photographed(glass), kNoise);
      ASSERT_TRUE(seen) << taper << ' ' << degrees;
      EXPECT_LT(cv::norm(seen->tip - glass.tip), kTip_px) << taper << ' ' << degrees << ' ' << seen->tip;
      EXPECT_NEAR(seen->axis.x, std::cos(degrees * CV_PI / 180), 0.03) << taper << ' ' << degrees;
      EXPECT_NEAR(seen->taper, taper, 0.05) << taper << ' ' << degrees;
      EXPECT_NEAR(seen->half_width, glass.radius, 1.5) << taper << ' ' << degrees;
    }
  }
}

TEST(SteepGlass, is_followed_as_it_moves) {
  InjectionPipette needle(Side::automatic, kRadius);
  Glass glass;
  const auto anywhere = [](const Point&) { return true; };
  ASSERT_TRUE(needle.start(photographed(glass), kNoise, anywhere));
  EXPECT_EQ(needle.side(), Side::left);
  EXPECT_LT(cv::norm(needle.as_found(kNoise).tip - glass.tip), kTip_px);
  for (unsigned frame = 2; frame < 14; ++frame) {
    glass.tip += Point(1.9, -0.7);
    const GradientField field = photographed(glass, frame);
    const NeedlePose seen = needle.find(field, kNoise, std::nullopt);
    ASSERT_TRUE(seen.ok) << frame << ' ' << seen.reason;
    EXPECT_LT(cv::norm(seen.tip - glass.tip), 2 * kTip_px) << frame << ' ' << seen.tip - glass.tip;
    needle.learn(field, seen, kNoise);
  }
}

TEST(SteepGlass, is_none_where_lines_cross) {
  for (const double ahead_px : {60.0, 110.0, 2000.0}) {
    for (const double unsharp : {0.0, 0.06}) {
      const Glass lines{.unsharp = unsharp, .ahead_px = ahead_px};
      EXPECT_FALSE(steep_glass(photographed(lines), kNoise)) << ahead_px << ' ' << unsharp;
    }
  }
}

TEST(SteepGlass, is_none_that_does_not_come_from_the_border) {
  for (const double length_px : {120.0, 200.0, 280.0}) {
    EXPECT_FALSE(steep_glass(photographed({.length_px = length_px}), kNoise)) << length_px;
  }
}

TEST(SteepGlass, is_none_where_the_end_is_out_of_focus) {
  for (const double blur_px : {4.0, 6.0, 9.0}) {
    EXPECT_FALSE(steep_glass(photographed({.blur_px = blur_px}), kNoise)) << blur_px;
  }
  for (const double focus_px : {80.0, 120.0, 180.0}) {
    EXPECT_FALSE(steep_glass(photographed({.focus_px = focus_px}), kNoise)) << focus_px;
  }
}

}  // namespace
}  // namespace steep
