// Measurements on the simulated picture that do not depend on how it is drawn.
#include "hal/sim/camera/microscope.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

using namespace punctum::sim;

namespace {

using Contour = std::vector<std::array<double, 2>>;

constexpr double kPixel_m = 0.825e-6;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MicroscopeParams quiet() {
  MicroscopeParams p;
  p.noise = 0;
  p.impurities = 0;
  p.gradient = 0;
  return p;
}

struct Shot {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] double at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  // Bilinear.
  [[nodiscard]] double at(double x, double y) const {
    const int ix = static_cast<int>(std::floor(x));
    const int iy = static_cast<int>(std::floor(y));
    const double fx = x - ix;
    const double fy = y - iy;
    return (at(ix, iy) * (1 - fx) + at(ix + 1, iy) * fx) * (1 - fy) +
           (at(ix, iy + 1) * (1 - fx) + at(ix + 1, iy + 1) * fx) * fy;
  }
};

Shot shoot(Microscope& microscope, const PictureScene& scene, std::uint64_t frame = 0) {
  Shot s{microscope.width(), microscope.height(), {}};
  s.pixels.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  microscope.render(scene, frame, s.pixels);
  return s;
}

double px_x(const MicroscopeParams& p, double x_m) { return x_m / p.pixel_m + (p.width - 1) / 2.0; }
double px_y(const MicroscopeParams& p, double y_m) { return y_m / p.pixel_m + (p.height - 1) / 2.0; }

Contour ellipse(double cx, double cy, double rx, double ry, int n = 400) {
  Contour c;
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    c.push_back({cx + rx * std::cos(t), cy + ry * std::sin(t)});
  }
  return c;
}

PictureScene cell_scene(const Contour& outer, const Contour& inner, double cx, double cy, double zona_h_m,
                        double z_m = 0) {
  PictureScene scene;
  CellInPicture cell;
  cell.outer = outer;
  cell.inner = inner;
  cell.centre_m = {cx, cy, z_m};
  cell.zona_h_m = zona_h_m;
  scene.cell = cell;
  return scene;
}

// Light along a normal, from -reach to +reach px.
constexpr double kStep_px = 0.05;
using Profile = std::vector<double>;
Profile profile(const Shot& s, double x, double y, double nx, double ny, double reach) {
  Profile p;
  for (double d = -reach + 0.5 * kStep_px; d < reach; d += kStep_px) {
    p.push_back(s.at(x + d * nx, y + d * ny));
  }
  return p;
}

// The place of a step in its profile: it divides the profile into two flat parts with the same integral,
// whatever the blur is.
struct Edge {
  double at = 0;     // px from the middle, along the normal
  double width = 0;  // standard deviation of its slope
};
Edge step_edge(const Profile& p) {
  const std::size_t flat = static_cast<std::size_t>(1 / kStep_px);
  const double reach = 0.5 * kStep_px * static_cast<double>(p.size());
  double first = 0;
  double last = 0;
  for (std::size_t i = 0; i < flat; ++i) {
    first += p[i] / static_cast<double>(flat);
    last += p[p.size() - 1 - i] / static_cast<double>(flat);
  }
  double area = 0;
  double moment = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double part = (p[i] - last) / (first - last) * kStep_px;
    area += part;
    moment += part * ((static_cast<double>(i) + 0.5) * kStep_px - reach);
  }
  // For a step at e blurred by a symmetric kernel of variance v: area = e + reach, 2 moment = e^2 + v -
  // reach^2.
  const double e = area - reach;
  return {e, std::sqrt(std::max(0.0, 2 * moment + reach * reach - e * e))};
}

// Mean profile across an ellipse, outwards: the whole of it, or the part round the direction `from` +-
// `half`.
Profile mean_profile(const Shot& s, const MicroscopeParams& p, double cx, double cy, double rx, double ry,
                     double reach, double from = 0, double half = std::numbers::pi) {
  Profile mean;
  constexpr int n = 360;
  for (int i = 0; i < n; ++i) {
    const double t = from + half * (2 * (i + 0.37) / n - 1);
    double nx = std::cos(t) / rx;
    double ny = std::sin(t) / ry;
    const double length = std::hypot(nx, ny);
    const Profile one = profile(s, px_x(p, cx + rx * std::cos(t)), px_y(p, cy + ry * std::sin(t)),
                                nx / length, ny / length, reach);
    mean.resize(one.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      mean[k] += one[k] / n;
    }
  }
  return mean;
}

TEST(Microscope, the_outer_edge_lies_on_the_contour) {
  const MicroscopeParams p = quiet();
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  struct Case {
    double cx, cy, rx, ry;
  };
  for (const Case& c : {Case{-40e-6, 0, 60e-6, 60e-6}, Case{3.3e-6, 7.71e-6, 75e-6, 60e-6},
                        Case{-20.2e-6, -5.1e-6, 62e-6, 90e-6}}) {
    const Contour outer = ellipse(c.cx, c.cy, c.rx, c.ry);
    const Shot s = shoot(m, cell_scene(outer, {}, c.cx, c.cy, 14e-6));
    EXPECT_LT(std::abs(step_edge(mean_profile(s, p, c.cx, c.cy, c.rx, c.ry, 8)).at), 0.05);
    // At every place, not only on average. The profile is short, since the contrast changes slowly across the
    // cell.
    for (double t = 0; t < 6; t += 0.5) {
      EXPECT_LT(std::abs(step_edge(mean_profile(s, p, c.cx, c.cy, c.rx, c.ry, 5.5, t, 0.25)).at), 0.05) << t;
    }
  }
}

TEST(Microscope, the_inner_edge_lies_on_the_contour) {
  MicroscopeParams p = quiet();
  p.contrast = 45;
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  const Contour outer = ellipse(-40e-6, 1e-6, 85e-6, 85e-6);
  const Contour inner = ellipse(-40e-6, 1e-6, 55e-6, 55e-6);
  PictureScene scene = cell_scene(outer, inner, -40e-6, 1e-6, 8e-6);
  Profile mean;
  for (std::uint64_t i = 0; i < 40; ++i) {  // the grain differs from cell to cell and averages out
    scene.cell->identity = i;
    const Profile one = mean_profile(shoot(m, scene), p, -40e-6, 1e-6, 55e-6, 55e-6, 8);
    mean.resize(one.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      mean[k] += one[k];
    }
  }
  EXPECT_LT(std::abs(step_edge(mean).at), 0.05);
}

TEST(Microscope, the_blur_has_the_width_of_the_parameters) {
  const MicroscopeParams p = quiet();
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  const Contour outer = ellipse(0, 0, 120e-6, 120e-6);
  for (const double z_m : {0.0, 8e-6, -8e-6}) {
    const Shot s = shoot(m, cell_scene(outer, {}, 0, 0, 30e-6, z_m));
    const Edge e = step_edge(mean_profile(s, p, 0, 0, 120e-6, 120e-6, 13));
    EXPECT_LT(std::abs(e.at), 0.05) << z_m;
    // Wider by the rim, the pixel and the bilinear sampling; narrower by the dark and bright line.
    EXPECT_NEAR(e.width, m.blur_px(z_m), 0.45) << z_m;
  }
  EXPECT_DOUBLE_EQ(m.blur_px(0), p.psf_px);
  EXPECT_GT(m.blur_px(10e-6), 1.5 * p.psf_px);
  EXPECT_DOUBLE_EQ(m.blur_px(10e-6), m.blur_px(-10e-6));
}

TEST(Microscope, the_needle_ends_at_its_tip) {
  const MicroscopeParams p = quiet();
  NeedleParams thick;
  thick.radius_m = 12e-6;
  thick.shaft_radius_m = 12e-6;
  Microscope m(p, thick, std::nullopt, 1);
  for (const double angle : {0.0, 0.2, -0.35}) {
    PictureScene scene;
    const Vec3 axis(-std::cos(angle), std::sin(angle), 0);
    const Vec3 tip(10.3e-6, -4.7e-6, 0);
    scene.needle = NeedleInPicture{tip, axis};
    const Shot s = shoot(m, scene);
    const double along = 0.81 * thick.radius_m;  // in the middle of the wall
    for (const double side : {-1.0, 1.0}) {
      const double x = px_x(p, tip.x() - side * along * axis.y());
      const double y = px_y(p, tip.y() + side * along * axis.x());
      EXPECT_NEAR(step_edge(profile(s, x, y, axis.x(), axis.y(), 9)).at, 0, 0.1) << angle << " " << side;
    }
  }
}

TEST(Microscope, noise_variance_is_proportional_to_the_light) {
  MicroscopeParams p;
  p.width = 240;
  p.height = 160;
  p.impurities = 0;
  p.gradient = 1.2;
  p.noise = 4;
  Microscope m(p, NeedleParams{}, std::nullopt, 3);
  MicroscopeParams clean_params = p;
  clean_params.noise = 0;
  Microscope clean(clean_params, NeedleParams{}, std::nullopt, 3);
  const Shot truth = shoot(clean, {});
  constexpr int kBands = 4;
  std::array<double, kBands> sum{};
  std::array<double, kBands> sum2{};
  std::array<double, kBands> light{};
  std::array<double, kBands> n{};
  for (std::uint64_t f = 0; f < 40; ++f) {
    const Shot s = shoot(m, {}, f);
    for (std::size_t i = 0; i < s.pixels.size(); ++i) {
      const double level = truth.pixels[i];
      const auto band = static_cast<std::size_t>(std::clamp((level - 70) / 40, 0.0, 3.0));
      const double d = s.pixels[i] - level;
      sum[band] += d;
      sum2[band] += d * d;
      light[band] += level;
      n[band] += 1;
    }
  }
  for (std::size_t b = 0; b < kBands; ++b) {
    ASSERT_GT(n[b], 1e4);
    const double mean = sum[b] / n[b];
    // Both the noisy and the clean picture are rounded: 1/12 of a squared grey level each.
    const double variance = sum2[b] / n[b] - mean * mean - 2.0 / 12;
    EXPECT_NEAR(mean, 0, 0.05) << b;
    EXPECT_NEAR(variance, 4 * 4 * (light[b] / n[b]) / 128, 0.03 * variance) << b;
  }
}

TEST(Microscope, noise_is_independent_between_pixels_and_frames) {
  MicroscopeParams p;
  p.width = 256;
  p.height = 256;
  p.impurities = 0;
  p.gradient = 0;
  p.noise = 6;
  Microscope m(p, NeedleParams{}, std::nullopt, 3);
  const Shot a = shoot(m, {}, 10);
  const Shot b = shoot(m, {}, 11);
  double variance = 0;
  double across = 0;
  double down = 0;
  double later = 0;
  for (int y = 0; y < 255; ++y) {
    for (int x = 0; x < 255; ++x) {
      const double v = a.at(x, y) - 150;
      variance += v * v;
      across += v * (a.at(x + 1, y) - 150);
      down += v * (a.at(x, y + 1) - 150);
      later += v * (b.at(x, y) - 150);
    }
  }
  const double limit = 4.0 / 255;  // 4 standard deviations of the correlation of 255 x 255 independent pairs
  EXPECT_LT(std::abs(across / variance), limit);
  EXPECT_LT(std::abs(down / variance), limit);
  EXPECT_LT(std::abs(later / variance), limit);
}

// The picture turned by 180 degrees faces the other way: what was bright is dark.
TEST(Microscope, in_relief_an_edge_is_bright_towards_the_light) {
  MicroscopeParams p = quiet();
  p.width = p.height = 301;
  const double r = 50e-6;
  const Contour outer = ellipse(0, 0, r, r), inner = ellipse(0, 0, 0.85 * r, 0.85 * r);
  const PictureScene scene = cell_scene(outer, inner, 0, 0, 5e-6);
  Microscope bright_field(p, NeedleParams{}, std::nullopt, 1);
  const double medium = shoot(bright_field, {}).at(5, 5);
  for (const double degrees : {0.0, 90.0, 180.0, -90.0}) {
    p.relief = ReliefParams{degrees, 0.37};
    Microscope m(p, NeedleParams{}, std::nullopt, 1);
    const Shot shot = shoot(m, scene);
    const double ux = std::cos(degrees * std::numbers::pi / 180),
                 uy = std::sin(degrees * std::numbers::pi / 180);
    const auto at_edge = [&](double x, double y) {  // just inside
      const double d = r - p.pixel_m;
      return shot.at(px_x(p, x * d), px_y(p, y * d));
    };
    EXPECT_GT(at_edge(ux, uy), medium + 10) << degrees;
    EXPECT_LT(at_edge(-ux, -uy), medium - 10) << degrees;
    EXPECT_NEAR(at_edge(-uy, ux), medium, 5) << degrees;
    EXPECT_NEAR(shot.at(5, 5), medium, 1) << degrees;
  }
}

TEST(Microscope, in_relief_contrast_is_that_of_the_parameters) {
  MicroscopeParams p = quiet();
  p.relief = ReliefParams{0, 0.37};
  const double r = 50e-6;
  const Contour outer = ellipse(0, 0, r, r);
  const PictureScene scene = cell_scene(outer, {}, 0, 0, 5e-6);
  const auto brightest = [&](double contrast) {
    p.contrast = contrast;
    Microscope m(p, NeedleParams{}, std::nullopt, 1);
    const Shot shot = shoot(m, scene);
    double most = 0;
    for (int x = 0; x < 6; ++x) {
      most = std::max(most, shot.at(static_cast<int>(px_x(p, r)) - x, static_cast<int>(px_y(p, 0))));
    }
    return most - shot.at(5, 5);
  };
  EXPECT_NEAR(brightest(0), 0, 1);
  EXPECT_GT(brightest(30), 1.5 * brightest(15));  // hardly bounded yet
}

TEST(Microscope, the_same_seed_scene_and_number_give_the_same_bytes) {
  const MicroscopeParams p;
  const Contour outer = ellipse(-40e-6, 0, 60e-6, 60e-6);
  const Contour inner = ellipse(-40e-6, 0, 52e-6, 52e-6);
  PictureScene scene = cell_scene(outer, inner, -40e-6, 0, 4.6e-6);
  scene.needle = NeedleInPicture{{10e-6, 2e-6, 1e-6}, {-1, 0, 0}};
  scene.holder_mouth_m = Vec3(-98e-6, 0, 0);
  Microscope first(p, NeedleParams{}, HolderParams{}, 9);
  Microscope second(p, NeedleParams{}, HolderParams{}, 9);
  Microscope other_seed(p, NeedleParams{}, HolderParams{}, 10);
  const Shot a = shoot(first, scene, 5);
  (void)shoot(second, {}, 4);  // what was drawn before does not matter
  EXPECT_EQ(a.pixels, shoot(second, scene, 5).pixels);
  EXPECT_NE(a.pixels, shoot(first, scene, 6).pixels);
  EXPECT_NE(a.pixels, shoot(other_seed, scene, 5).pixels);
  scene.cell->identity = 1;
  EXPECT_NE(a.pixels, shoot(first, scene, 5).pixels);
}

TEST(Microscope, far_corners_differ_by_the_gradient) {
  MicroscopeParams p = quiet();
  p.gradient = 0.3;
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  const Shot s = shoot(m, {});
  const double middle = s.at(p.width / 2, p.height / 2);
  EXPECT_NEAR((s.at(0, 0) - s.at(p.width - 1, p.height - 1)) / middle, 0.3, 1.0 / middle);
  for (int x = 1; x < p.width; ++x) {
    EXPECT_LE(s.at(x, 100), s.at(x - 1, 100));
  }
}

TEST(Microscope, zona_is_darker_by_the_contrast) {
  MicroscopeParams p = quiet();
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  const Contour outer = ellipse(0, 0, 120e-6, 120e-6);
  const Shot s = shoot(m, cell_scene(outer, {}, 0, 0, 30e-6));
  double zona = 0;
  for (int i = 0; i < 360; ++i) {
    const double t = i * std::numbers::pi / 180;
    zona += s.at(px_x(p, 108e-6 * std::cos(t)), px_y(p, 108e-6 * std::sin(t))) / 360;
  }
  EXPECT_NEAR(s.at(3, 3) - zona, p.contrast, 1.5);
}

TEST(Microscope, the_grain_moves_with_the_cell) {
  const MicroscopeParams p = quiet();
  Microscope m(p, NeedleParams{}, std::nullopt, 1);
  const auto picture_at = [&](double x_m) {
    const Contour outer = ellipse(x_m, 0, 60e-6, 60e-6);
    const Contour inner = ellipse(x_m, 0, 52e-6, 52e-6);
    return shoot(m, cell_scene(outer, inner, x_m, 0, 4.6e-6));
  };
  const Shot a = picture_at(0);
  const Shot b = picture_at(20 * kPixel_m);
  int differing = 0;
  double grain = 0;
  for (int y = 200; y < 285; ++y) {
    for (int x = 320; x < 405; ++x) {
      const double d = a.at(x, y) - b.at(x + 20, y);
      EXPECT_LE(std::abs(d), 1);
      differing += d != 0 ? 1 : 0;
      grain += std::abs(a.at(x, y) - a.at(x + 20, y));
    }
  }
  EXPECT_LT(differing, 85 * 85 / 20);
  EXPECT_GT(grain / (85 * 85), 3);  // there is something to see
}

TEST(Microscope, impurities_drift_slowly) {
  MicroscopeParams p = quiet();
  p.impurities = 12;
  Microscope m(p, NeedleParams{}, std::nullopt, 2);
  const Shot a = shoot(m, {}, 0);
  const auto largest_change = [&](std::uint64_t frame) {
    const Shot b = shoot(m, {}, frame);
    double most = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      most = std::max(most, std::abs(double{a.pixels[i] * 1.0} - b.pixels[i]));
    }
    return most;
  };
  EXPECT_LE(largest_change(1), 4);
  EXPECT_GE(largest_change(250), 8);
  int marked = 0;
  for (const std::uint8_t v : a.pixels) {
    marked += std::abs(v - 150) >= 4 ? 1 : 0;
  }
  EXPECT_GT(marked, 50);
  EXPECT_LT(marked, 12 * 150);
}

// Guard bytes before and after the picture.
class Guarded {
 public:
  explicit Guarded(std::size_t size) : bytes_(size + 2 * kGuard, 0xa5) {}
  [[nodiscard]] std::span<std::uint8_t> inside() {
    return {bytes_.data() + kGuard, bytes_.size() - 2 * kGuard};
  }
  [[nodiscard]] bool intact() const {
    const auto whole = [](std::uint8_t b) { return b == 0xa5; };
    return std::all_of(bytes_.begin(), bytes_.begin() + kGuard, whole) &&
           std::all_of(bytes_.end() - kGuard, bytes_.end(), whole);
  }

 private:
  static constexpr std::ptrdiff_t kGuard = 4096;
  std::vector<std::uint8_t> bytes_;
};

TEST(Microscope, any_size_and_pose_is_drawn_inside_the_buffer) {
  const std::array<double, 9> places{
      0, 90e-6, -400e-6, 1e-3, 0.3, -5.0, 1e30, std::numeric_limits<double>::infinity(), kNan};
  for (const auto& [width, height] :
       {std::array{1, 1}, std::array{3, 2}, std::array{17, 64}, std::array{200, 9}}) {
    MicroscopeParams p;
    p.width = width;
    p.height = height;
    Microscope m(p, NeedleParams{}, HolderParams{}, 1);
    p.relief = ReliefParams{};
    Microscope in_relief(p, NeedleParams{}, HolderParams{}, 1);
    Guarded out(static_cast<std::size_t>(width * height));
    for (const double x : places) {
      for (const double y : places) {
        for (const double z : {0.0, 50e-6, kNan}) {
          const Contour outer = ellipse(x, y, 60e-6, 60e-6, 64);
          const Contour inner = ellipse(y, x, 52e-6, 30e-6, 64);
          PictureScene scene = cell_scene(outer, inner, x, y, 4.6e-6, z);
          scene.needle = NeedleInPicture{{x, y, z}, {x, -1, 0.2}};
          scene.holder_mouth_m = Vec3(x, y, z);
          m.render(scene, 1, out.inside());
          in_relief.render(scene, 1, out.inside());
          ASSERT_TRUE(out.intact()) << width << "x" << height << " at " << x << "," << y;
        }
      }
    }
  }
}

TEST(Microscope, values_that_are_not_finite_are_not_drawn) {
  for (const auto& relief : {std::optional<ReliefParams>(), std::optional(ReliefParams{})}) {
    MicroscopeParams p;
    p.relief = relief;
    Microscope m(p, NeedleParams{}, HolderParams{}, 1);
    const Shot empty = shoot(m, {}, 7);
    Contour broken = ellipse(0, 0, 60e-6, 60e-6);
    broken[17][1] = kNan;
    PictureScene scene = cell_scene(broken, {}, 0, 0, 4.6e-6);
    scene.needle = NeedleInPicture{{kNan, 0, 0}, {-1, 0, 0}};
    scene.holder_mouth_m = Vec3(0, kNan, 0);
    EXPECT_EQ(shoot(m, scene, 7).pixels, empty.pixels);
    scene.needle = NeedleInPicture{{0, 0, 0}, {0, 0, 0}};  // no direction
    EXPECT_EQ(shoot(m, scene, 7).pixels, empty.pixels);
    scene.needle = NeedleInPicture{{0, 0, 0}, {0, 0, 1}};  // seen end on: defined, and something is drawn
    EXPECT_NE(shoot(m, scene, 7).pixels, empty.pixels);
  }
}

TEST(Microscope, a_buffer_that_is_too_small_is_not_written) {
  Microscope m(MicroscopeParams{}, NeedleParams{}, std::nullopt, 1);
  std::vector<std::uint8_t> out(static_cast<std::size_t>(m.width() * m.height() - 1), 7);
  m.render({}, 0, out);
  EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](std::uint8_t b) { return b == 7; }));
}

TEST(Microscope, degenerate_parameters_give_a_picture) {
  for (const double bad : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
    MicroscopeParams p;
    p.width = 40;
    p.height = 30;
    p.psf_px = bad;
    p.defocus_m = bad;
    p.fps = bad;
    p.noise = bad;
    p.pixel_m = bad;
    NeedleParams n{bad, bad, bad};
    HolderParams h;
    h.outer_radius_m = bad;
    h.inner_radius_m = bad;
    const Contour outer = ellipse(0, 0, 60e-6, 60e-6, 64);
    PictureScene scene = cell_scene(outer, outer, 0, 0, bad);
    scene.needle = NeedleInPicture{{0, 0, 0}, {-1, 0, 0}};
    scene.holder_mouth_m = Vec3(0, 0, 0);
    for (const auto& relief : {std::optional<ReliefParams>(), std::optional(ReliefParams{bad, bad})}) {
      p.relief = relief;
      Microscope m(p, n, h, 1);
      (void)shoot(m, scene, 3);
    }
  }
}

TEST(Microscope, the_mouth_of_the_holder_is_at_its_place) {
  const MicroscopeParams p = quiet();
  Microscope m(p, NeedleParams{}, HolderParams{}, 1);
  const auto front = [&](double x_m) {
    PictureScene scene;
    scene.holder_mouth_m = Vec3(x_m, 0, 0);
    const Shot s = shoot(m, scene);
    // Steepest fall towards the tube, by the centre of gravity of the slope.
    const int y = static_cast<int>(px_y(p, 0));
    const double around = px_x(p, x_m);
    double weight = 0;
    double moment = 0;
    for (int x = static_cast<int>(around) - 3; x <= static_cast<int>(around) + 4; ++x) {
      const double slope = std::max(0.0, s.at(x + 1, y) - s.at(x, y));
      weight += slope;
      moment += slope * (x + 0.5);
    }
    return moment / weight - around;
  };
  EXPECT_NEAR(front(-98e-6), 0, 0.8);
  EXPECT_NEAR(front(-98e-6), front(-98e-6 + 5 * kPixel_m), 1e-6);
}

}  // namespace
