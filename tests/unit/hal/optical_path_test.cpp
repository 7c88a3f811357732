// Light in relief against the slopes of paths that are known in closed form: balls, tubes, Gaussians.
#include "hal/sim/camera/optical_path.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

using namespace punctum::sim;

namespace {

constexpr Box kPicture{0, 0, 320, 300};
constexpr double kGain = 2.5, kBlur_px = 0.7;
constexpr Pixel kMiddle{160.3, 149.6};
// As in the file: refractive indices above that of the medium, limits of the modulation, of the aperture.
constexpr double kGlass = 0.14, kZona = 0.006, kOoplasm = 0.017;
constexpr double kBright = 0.8, kDark = 0.65, kAperture = 0.65;

using Direction = std::array<double, 2>;

struct Light {
  std::vector<float> value;
  [[nodiscard]] double at(double x, double y) const {  // bilinear
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    const double fx = x - ix, fy = y - iy;
    const auto v = [&](int i, int j) {
      return static_cast<double>(value[static_cast<std::size_t>(j * kPicture.width() + i)]);
    };
    return (v(ix, iy) * (1 - fx) + v(ix + 1, iy) * fx) * (1 - fy) +
           (v(ix, iy + 1) * (1 - fx) + v(ix + 1, iy + 1) * fx) * fy;
  }
};

Light shone(OpticalPath& path, const Direction& towards) {
  Light out{std::vector<float>(static_cast<std::size_t>(kPicture.width() * kPicture.height()), 1.0F)};
  path.shine(towards, kGain, kBlur_px, out.value);
  return out;
}

// Of a place where the path has that slope, px per px.
double light_of(double slope_x, double slope_y, const Direction& towards) {
  const double s = -kGain * (slope_x * towards[0] + slope_y * towards[1]);
  const double limit = s > 0 ? kBright : kDark;
  const double bent = std::pow(std::hypot(slope_x, slope_y) / kAperture, 6);
  return (1 + limit * std::tanh(s / limit)) / (1 + bent);
}

std::vector<Pixel> circle(double r) {
  std::vector<Pixel> out;
  for (int i = 0; i < 720; ++i) {
    const double t = 2 * std::numbers::pi * i / 720;
    out.push_back({kMiddle.x + r * std::cos(t), kMiddle.y + r * std::sin(t)});
  }
  return out;
}

constexpr double kOuter_px = 120, kWithinZona_px = 112, kOoplasm_px = 104;

void add_cell(OpticalPath& path) {
  path.add_cell(circle(kOuter_px), circle(kWithinZona_px), circle(kOoplasm_px), kMiddle, 0, 0);
}

// Of the path through the three balls, d from their middle.
double slope_of_cell(double d) {
  const auto ball = [&](double r) { return r > d ? -2 * d / std::sqrt(r * r - d * d) : 0; };
  return kZona * (ball(kOuter_px) - ball(kWithinZona_px)) + kOoplasm * ball(kOoplasm_px);
}

TEST(OpticalPath, a_cell_shines_as_the_slope_of_its_path) {
  OpticalPath path;
  path.start(kPicture);
  add_cell(path);
  for (const double degrees : {0.0, 90.0, -135.0, 40.0}) {
    const Direction towards{std::cos(degrees * std::numbers::pi / 180),
                            std::sin(degrees * std::numbers::pi / 180)};
    const Light light = shone(path, towards);
    for (const double d : {20.0, 50.0, 80.0, 95.0, 108.0}) {
      for (int i = 0; i < 12; ++i) {
        const double t = 2 * std::numbers::pi * i / 12, s = slope_of_cell(d);
        const double expected = light_of(s * std::cos(t), s * std::sin(t), towards);
        EXPECT_NEAR(light.at(kMiddle.x + d * std::cos(t), kMiddle.y + d * std::sin(t)), expected,
                    0.004 + 0.05 * std::abs(expected - 1))
            << degrees << ' ' << d << ' ' << i;
      }
    }
    EXPECT_NEAR(light.at(8, 8), 1, 1e-6);
  }
}

TEST(OpticalPath, an_edge_is_bright_where_it_faces_the_light_and_dark_where_it_does_not) {
  OpticalPath path;
  path.start(kPicture);
  add_cell(path);
  const Light light = shone(path, {1, 0});
  for (const double r : {kOoplasm_px - 1, kOuter_px - 1}) {
    EXPECT_GT(light.at(kMiddle.x + r, kMiddle.y), 1.1) << r;
    EXPECT_LT(light.at(kMiddle.x - r, kMiddle.y), 0.9) << r;
    EXPECT_NEAR(light.at(kMiddle.x, kMiddle.y + r), 1, 0.02) << r;
    EXPECT_NEAR(light.at(kMiddle.x, kMiddle.y - r), 1, 0.02) << r;
  }
}

// What lies above and below the focus is blurred: all of the path is there, its rim is as sharp as before.
TEST(OpticalPath, a_lens_has_a_plane_of_focus) {
  constexpr double kFaint = 0.05, kSoft_px = 3;  // gain and blur: light in proportion to the slope
  const auto sum_and_rim = [](double defocus) {
    OpticalPath path;
    path.start(kPicture);
    path.add_cell(circle(60), {}, circle(60), kMiddle, kSoft_px, defocus);
    Light light{std::vector<float>(static_cast<std::size_t>(kPicture.width() * kPicture.height()), 1.0F)};
    path.shine({1, 0}, kFaint, kBlur_px, light.value);
    double moment = 0, rim = 0;  // the moment of the slope is the sum of the path
    for (int y = 0; y + 1 < kPicture.height(); ++y) {
      for (int x = 0; x + 1 < kPicture.width(); ++x) {
        moment += (light.at(x, y) - 1) * (x - kMiddle.x) / kFaint;
      }
    }
    for (const double x : {58.0, 59.0, 60.0}) {
      rim = std::max(rim, (light.at(kMiddle.x + x, kMiddle.y) - 1) / kFaint);
    }
    return std::array{moment, rim};
  };
  const auto sharp = sum_and_rim(0), blurred = sum_and_rim(0.15);
  const double volume = (kZona + kOoplasm) * 4 / 3 * std::numbers::pi * 60 * 60 * 60;
  EXPECT_NEAR(sharp[0], volume, 0.02 * volume);
  EXPECT_NEAR(blurred[0], volume, 0.02 * volume);
  EXPECT_GT(blurred[1], 0.6 * sharp[1]);
  EXPECT_LT(blurred[1], 0.97 * sharp[1]);
}

// From the right, straight, with a bore.
Tube tube(double outer_px, double bore_px) {
  Tube out;
  out.front = {60, kMiddle.y};
  out.inwards = {1, 0};
  out.stations = {{{0, outer_px, bore_px}, {100, outer_px, bore_px}, {200, outer_px, bore_px}}};
  return out;
}

TEST(OpticalPath, a_tube_shines_as_the_slope_of_its_glass) {
  constexpr double kOut_px = 90, kBore_px = 40;
  OpticalPath path;
  path.start(kPicture);
  path.add_tube(tube(kOut_px, kBore_px), 0);
  const Direction up{0, -1};
  const Light light = shone(path, up);
  for (const double v : {-60.0, -50.0, -30.0, -10.0, 10.0, 30.0, 50.0, 60.0}) {
    const auto chord = [&](double r) { return std::abs(v) < r ? -2 * v / std::sqrt(r * r - v * v) : 0; };
    const double s = kGlass * (chord(kOut_px) - chord(kBore_px));
    const double expected = light_of(0, s, up);
    EXPECT_NEAR(light.at(200, kMiddle.y + v), expected, 0.004 + 0.05 * std::abs(expected - 1)) << v;
  }
  // Before its front there is nothing, and at it light is bent out of the aperture.
  EXPECT_NEAR(light.at(50, kMiddle.y + 60), 1, 1e-6);
  EXPECT_LT(light.at(60, kMiddle.y + 60), 0.2);
}

TEST(OpticalPath, glass_takes_the_place_of_the_cell) {
  constexpr double kThin_px = 30;
  OpticalPath path;
  path.start(kPicture);
  add_cell(path);
  path.add_tube(tube(kThin_px, kThin_px), 0);  // all bore: the medium itself
  const Direction up{0, -1};
  const Light light = shone(path, up);
  for (const double v : {-20.0, -10.0, 10.0, 20.0}) {
    const double s = slope_of_cell(std::abs(v)) * (v < 0 ? -1 : 1) +
                     kOoplasm * 2 * v / std::sqrt(kThin_px * kThin_px - v * v);
    const double expected = light_of(0, s, up);
    EXPECT_NEAR(light.at(kMiddle.x, kMiddle.y + v), expected, 0.004 + 0.05 * std::abs(expected - 1)) << v;
  }
}

TEST(OpticalPath, a_speck_has_the_slope_it_is_given) {
  OpticalPath path;
  path.start(kPicture);
  constexpr double kSigma_px = 8, kSlope = 0.05;
  path.add_speck(kMiddle, kSigma_px, kSlope);
  const Light light = shone(path, {1, 0});
  EXPECT_NEAR(light.at(kMiddle.x + kSigma_px, kMiddle.y), light_of(-kSlope, 0, {1, 0}), 0.005);
  EXPECT_NEAR(light.at(kMiddle.x - kSigma_px, kMiddle.y), light_of(kSlope, 0, {1, 0}), 0.005);
}

TEST(OpticalPath, what_lies_beyond_the_picture_is_left_out) {
  OpticalPath path;
  for (const double far : {-1000.0, 1000.0}) {
    path.start(kPicture);
    std::vector<Pixel> line = circle(kOuter_px);
    for (Pixel& p : line) {
      p.x += far;
    }
    path.add_cell(line, line, line, {kMiddle.x + far, kMiddle.y}, 2, 0.15);
    Tube t = tube(20, 10);
    t.front.y += far;
    path.add_tube(t, 2);
    path.add_speck({kMiddle.x + far, kMiddle.y}, 3, 1);
    const Light light = shone(path, {1, 0});
    for (const float v : light.value) {
      ASSERT_EQ(v, 1.0F);
    }
  }
}

}  // namespace
