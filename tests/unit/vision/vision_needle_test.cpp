// The injection pipette where its end is hard to see. Drawn here, by another renderer than the simulated
// microscope: a cone of glass whose walls are about a pixel thick near the tip.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>
#include <vector>

#include "vision/image/gradient.hpp"
#include "vision/membrane/membrane_on_needle.hpp"
#include "vision/pipettes/backdrop.hpp"
#include "vision/pipettes/face_lines.hpp"
#include "vision/pipettes/faint_wall.hpp"
#include "vision/pipettes/injection_pipette.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/thin_end.hpp"

namespace cone {
namespace {

using namespace punctum::vision;

constexpr int kW = 420, kH = 120;
constexpr double kTipRadius = 2.3, kTaper = 0.035, kAxis_y = 60.2, kYolk_x = 240;
constexpr double kNoise = 2, kSmoothing_px = 1.1;

struct Drawing {
  double tip = 330;     // x of the end face; the needle comes from the right
  double blur = 1.2;    // px, of the needle
  double granules = 0;  // deviation of the yolk's grey level, left of kYolk_x
  double noise = kNoise;
  bool closed = false;  // by a line of glass
  unsigned frame = 0;
};

// Share of the light that a needle takes, before blur.
cv::Mat glass(double tip, bool closed) {
  cv::Mat m = cv::Mat::zeros(kH, kW, CV_32F);
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      for (int k = 0; k < 16; ++k) {
        const double s = x + (k % 4 - 1.5) / 4 - tip, u = std::abs(y + (k / 4 - 1.5) / 4 - kAxis_y);
        const double w = kTipRadius + kTaper * s;
        if (s > 0 && u < w) {
          const bool is_glass = u > 0.62 * w || (closed && s < 0.9);
          m.at<float>(y, x) += static_cast<float>((is_glass ? 0.3 : -0.06) / 16);
        }
      }
    }
  }
  return m;
}

// Everywhere the same granules: they stand still.
cv::Mat yolk(double granules) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  cv::Mat m(kH, kW, CV_32F);
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      m.at<float>(y, x) = normal(random);
    }
  }
  cv::GaussianBlur(m, m, cv::Size(0, 0), 1.5);
  cv::Scalar mean, deviation;
  cv::meanStdDev(m, mean, deviation);
  m = (m - mean[0]) * (granules / deviation[0]) - 45;
  m(cv::Rect(static_cast<int>(kYolk_x), 0, kW - static_cast<int>(kYolk_x), kH)).setTo(0);
  return m;
}

// With noise, in whole grey levels.
GradientField photographed(const cv::Mat& m, unsigned seed, double noise_grey) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, static_cast<float>(std::max(noise_grey, 1e-6)));
  cv::Mat grey(kH, kW, CV_8U);
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      grey.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(m.at<float>(y, x) + noise(random));
    }
  }
  GradientField field;
  field.compute(grey, cv::Rect(0, 0, kW, kH), kSmoothing_px);
  return field;
}

GradientField draw(const Drawing& d) {
  cv::Mat m(kH, kW, CV_32F, cv::Scalar(150));
  if (d.granules > 0) {
    m += yolk(d.granules);
  }
  cv::Mat take = glass(d.tip, d.closed);
  cv::GaussianBlur(take, take, cv::Size(0, 0), d.blur);
  m = m.mul(1 - take);
  return photographed(m, 1000 + d.frame, d.noise);
}

// The needle comes from the right to the yolk, in focus and in clear medium, and is learnt meanwhile.
class Needle : public testing::Test {
 protected:
  void approach(Drawing& d) {
    ASSERT_TRUE(needle_.start(draw(d), kNoise, [](const Point&) { return true; }));
    for (; d.tip > kYolk_x + 6; d.tip -= 2.5) {
      const NeedlePose seen = look(d);
      ASSERT_TRUE(seen.ok) << d.tip << seen.reason;
      ASSERT_NEAR(seen.tip.x, d.tip, 1.5);
    }
    learns_ = false;
  }
  NeedlePose look(Drawing& d) {
    ++d.frame;
    const GradientField field = draw(d);
    const NeedlePose seen = needle_.find(field, kNoise, std::nullopt);
    if (learns_) {
      needle_.learn(field, seen, kNoise);
    }
    return seen;
  }
  InjectionPipette needle_{Side::right, kTipRadius};
  bool learns_ = true;
};

TEST_F(Needle, ends_where_it_ends_when_it_leaves_the_plane_of_focus_and_comes_back) {
  Drawing d;
  approach(d);
  learns_ = true;  // nothing touches it: what is out of focus may be offered, and must do no harm
  for (int i = 0; i <= 60; ++i) {
    d.blur = 1.2 + 1.2 * std::sin(CV_PI * i / 60);
    d.tip -= 0.5;
    const NeedlePose seen = look(d);
    ASSERT_TRUE(seen.ok) << i << seen.reason;
    EXPECT_NEAR(seen.tip.x, d.tip, 3) << i << ", blur " << d.blur;
    EXPECT_LT(std::abs(seen.tip.x - d.tip), 3 * seen.sd) << i << ", blur " << d.blur;
  }
}

// A line of glass across a lumen that is hardly seen makes the walls seem to end 0.7 px ahead of it.
TEST_F(Needle, that_is_thin_ends_with_the_glass_whether_a_line_closes_it_or_not) {
  for (const bool closed : {true, false}) {
    for (const unsigned frame : {0U, 1000U, 2000U}) {
      needle_ = {Side::right, kTipRadius};
      Drawing d{.closed = closed, .frame = frame};
      ASSERT_TRUE(needle_.start(draw(d), kNoise, [](const Point&) { return true; }));
      constexpr int kFrames = 60, kLast = 20;
      double mean = 0;
      NeedlePose seen;
      for (int i = 0; i < kFrames; ++i, d.tip -= 1.1) {
        seen = look(d);
        ASSERT_TRUE(seen.ok) << i << seen.reason;
        mean += i < kFrames - kLast ? 0 : (seen.tip.x - d.tip) / kLast;
      }
      EXPECT_NEAR(mean, 0, closed ? 0.4 : 1) << "closed: " << closed << ", frames from " << frame;
      EXPECT_LT(std::abs(mean), 2 * seen.sd);
    }
  }
}

// A membrane that is lit otherwise could tell it again and again.
TEST_F(Needle, reaches_no_further_unseen_than_the_sharpest_cut_is_long) {
  Drawing d;
  approach(d);
  const double seen = look(d).tip.x;
  EXPECT_DOUBLE_EQ(needle_.reaches_further(3), 3);
  EXPECT_NEAR(look(d).tip.x, seen - 3, 0.5);
  for (int i = 0; i < 10; ++i) {
    (void)needle_.reaches_further(3);
  }
  EXPECT_GT(look(d).tip.x, seen - 8 * kTipRadius);  // four times its width, blurred as it is
}

// The manipulator has the tip further ahead than what is taken for the end.
TEST_F(Needle, goes_on_behind_a_speck_as_far_as_its_walls_do) {
  constexpr double kFurther_px = 14;
  for (const unsigned frame : {0U, 1000U, 2000U}) {
    Drawing d{.frame = frame};
    needle_ = {Side::right, kTipRadius};
    ASSERT_TRUE(needle_.start(draw(d), kNoise, [](const Point&) { return true; }));
    const NeedlePose end = look(d);
    NeedlePose speck = end;
    speck.tip = end.at(kFurther_px, 0);
    speck.half_width = end.half_width_at(kFurther_px);
    EXPECT_TRUE(needle_.goes_on_to(draw(d), kNoise, speck, end.tip)) << frame;
    EXPECT_FALSE(needle_.goes_on_to(draw(d), kNoise, end, end.at(-kFurther_px, 0))) << frame;
    EXPECT_FALSE(needle_.goes_on_to(draw(d), kNoise, speck, end.at(-kFurther_px, 0))) << frame;
    EXPECT_FALSE(needle_.goes_on_to(draw(d), kNoise, speck, end.at(0, 2 * end.half_width))) << frame;
    d.granules = 12;
    d.tip = kYolk_x + 2;
    NeedlePose at_yolk = end;
    at_yolk.tip.x = d.tip;
    EXPECT_FALSE(needle_.goes_on_to(draw(d), kNoise, at_yolk, at_yolk.at(-kFurther_px, 0))) << frame;
  }
}

// The manipulator has the tip further back than what is taken for the end.
TEST_F(Needle, ends_before_what_lies_ahead_of_it) {
  constexpr double kFurther_px = 14, kLittle_px = 6;
  for (const unsigned frame : {0U, 1000U, 2000U}) {
    Drawing d{.frame = frame};
    needle_ = {Side::right, kTipRadius};
    ASSERT_TRUE(needle_.start(draw(d), kNoise, [](const Point&) { return true; }));
    const NeedlePose end = look(d);
    NeedlePose beyond = end;
    beyond.tip = end.at(-kFurther_px, 0);
    EXPECT_TRUE(needle_.ends_before(draw(d), kNoise, beyond, end.tip)) << frame;
    EXPECT_FALSE(needle_.ends_before(draw(d), kNoise, end, end.at(kFurther_px, 0)))
        << frame << ": it has slipped, and its walls are seen";
    beyond.tip = end.at(-kLittle_px, 0);
    EXPECT_FALSE(needle_.ends_before(draw(d), kNoise, beyond, end.tip)) << frame;
  }
}

TEST_F(Needle, is_the_less_certain_the_further_it_is_out_of_focus) {
  Drawing d;
  approach(d);
  const double in_focus = look(d).sd;
  EXPECT_LT(in_focus, 1);
  int doubtful = 0;
  for (; d.blur < 4; d.blur += 0.1) {
    const NeedlePose seen = look(d);
    if (d.blur > 2 && seen.ok) {
      EXPECT_GT(seen.sd, in_focus + 0.2) << d.blur;
    }
    if (d.blur > 3.2 && seen.ok) {  // more than any that is tried
      ++doubtful;
      EXPECT_GT(seen.sd, 5) << d.blur;
    }
  }
  EXPECT_GT(doubtful, 3);
}

TEST_F(Needle, is_told_from_granules_that_were_there_before_it_came) {
  Drawing d;
  d.granules = 12;
  approach(d);
  int seen = 0, frames = 0;
  for (; d.tip > 150; d.tip -= 1, ++frames) {
    if (const NeedlePose n = look(d); n.ok) {
      ++seen;
      EXPECT_NEAR(n.tip.x, d.tip, 6);
      EXPECT_NEAR(n.tip.y, kAxis_y, 1);
    }
  }
  EXPECT_GT(seen, frames * 9 / 10);
}

// Out of focus, granules look more like the tip in focus than the tip itself does.
TEST_F(Needle, is_not_led_aside_by_granules_that_look_like_its_tip) {
  Drawing d;
  d.granules = 12;
  approach(d);
  d.blur = 2.5;
  int seen = 0, frames = 0;
  for (; d.tip > 165; d.tip -= 1, ++frames) {
    if (const NeedlePose n = look(d); n.ok) {
      ++seen;
      EXPECT_NEAR(n.tip.y, kAxis_y, 2) << d.tip;
    }
  }
  EXPECT_GT(seen, frames * 9 / 10);
}

// The needle stands at one place, so what lies far enough from it is known, and nothing else.
class BackdropOfYolk : public testing::Test {
 protected:
  BackdropOfYolk() {
    NeedlePose needle;
    needle.ok = true;
    needle.half_width = kTipRadius;
    needle.taper = kTaper;
    needle.tip = {drawn_.tip, kAxis_y};
    drawn_.granules = 12;
    for (; drawn_.frame < 60; ++drawn_.frame) {
      last_ = draw(drawn_);
      backdrop_.learn(last_, needle);
    }
    Drawing without = drawn_;
    without.tip = 1000;
    without.noise = 0;
    empty_ = draw(without);
  }
  Drawing drawn_;
  Backdrop backdrop_;
  GradientField last_, empty_;
};

TEST_F(BackdropOfYolk, is_the_picture_without_the_needle_and_quieter_than_a_frame) {
  double squares = 0, squares_of_frame = 0;
  for (double x = 30; x < 280; x += 7.3) {
    const Point p(x, kAxis_y);
    const auto grey = backdrop_.grey(p);
    ASSERT_TRUE(grey) << x;
    EXPECT_NEAR(*grey, empty_.grey(p), 1) << x;
    squares += std::pow(*grey - empty_.grey(p), 2);
    squares_of_frame += std::pow(last_.grey(p) - empty_.grey(p), 2);
  }
  EXPECT_LT(squares, squares_of_frame / 8);
}

TEST_F(BackdropOfYolk, is_not_known_at_the_needle_nor_where_it_blurs_nor_close_ahead_of_it) {
  EXPECT_FALSE(Backdrop{}.grey({10, 10}));
  const double x = drawn_.tip + 30, wall = kTipRadius + kTaper * 30;
  for (const double side : {-1.0, 1.0}) {
    EXPECT_FALSE(backdrop_.grey({x, kAxis_y}));
    EXPECT_FALSE(backdrop_.grey({x, kAxis_y + side * (wall + 6)}));
    EXPECT_TRUE(backdrop_.grey({x, kAxis_y + side * (wall + 14)}));
  }
  EXPECT_FALSE(backdrop_.grey({drawn_.tip - 20, kAxis_y}));
  // Between a pixel that is known and one that is not, nothing is made up.
  int known = 0, unknown = 0;
  for (double y = 20; y < 100; y += 0.25) {
    const auto grey = backdrop_.grey({x, y});
    (grey ? known : unknown) += 1;
    EXPECT_NEAR(grey.value_or(empty_.grey({x, y})), empty_.grey({x, y}), 1) << y;
  }
  EXPECT_GT(known, 100);
  EXPECT_GT(unknown, 50);
}

TEST_F(BackdropOfYolk, is_not_known_outside_the_picture) {
  EXPECT_TRUE(backdrop_.grey({0, 20}));
  EXPECT_FALSE(backdrop_.grey({-1, 20}));
  EXPECT_FALSE(backdrop_.grey({20, -1}));
  EXPECT_FALSE(backdrop_.grey({kW - 0.5, 20}));
  EXPECT_FALSE(backdrop_.grey({20, kH - 0.5}));
}

// A wide needle whose lumen is seen.
struct Wide {
  double tangent = 0;     // by how much further back the glass ends, per px across
  double speck_px = 0;    // dark, on one of its walls, behind the tip
  double side = 1;        // of the axis
  double other_wall = 1;  // grey levels of the upper wall, over those of the lower one
  bool closed = false;    // by a line of glass across the lumen
  double membrane = 0;    // dark ahead of its face, grey levels
  double behind = 0;      // px by which that lies behind the outermost glass; 0: the tip touches it
  double halo = 0;        // of that membrane: bright 1.5 px outside, grey levels
  double lump_px = 0;     // dark, over all of the shaft, behind the tip
  double fringes = 0;     // bright, beside the needle, grey levels
  double blur_px = 1.1;
  double tip = 150.3;  // x of the outermost glass
  double radius = 5;
};

constexpr double kWideRadius = 5, kWideNoise = 5;

constexpr double kHalo_px = 1.5;

GradientField draw(const Wide& wide, unsigned seed = 2000) {
  constexpr double kLumen = 0.72, kWidens = 0.02, kWall_grey = 46, kLumen_grey = -6;
  constexpr double kSpeck_px = 3, kClosed_px = 2, kSpeck_grey = 40, kLump_px = 9, kLump_grey = 60,
                   kFringe_px = 9;
  constexpr int kFine = 4;
  cv::Mat m(kH, kW, CV_32F, cv::Scalar(150));
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      for (int k = 0; k < kFine * kFine; ++k) {
        const double s = x + (k % kFine - 1.5) / kFine - wide.tip,
                     u = y + (k / kFine - 1.5) / kFine - kAxis_y;
        const double half = wide.radius + kWidens * std::max(s, 0.0);
        double dark = 0;
        if (std::abs(u) < half && s > wide.tangent * u + std::abs(wide.tangent) * wide.radius) {
          dark += std::abs(u) > kLumen * half || (wide.closed && s < kClosed_px)
                      ? kWall_grey * (u < 0 ? wide.other_wall : 1)
                      : kLumen_grey;
        }
        if (s > 0 && std::abs(std::abs(u) - half - kFringe_px) < 1.5) {
          dark -= wide.fringes;
        }
        if (wide.speck_px > 0 && std::hypot(s - wide.speck_px, u - wide.side * half) < kSpeck_px) {
          dark += kSpeck_grey;
        }
        if (wide.lump_px > 0 && std::hypot(s - wide.lump_px, u) < kLump_px) {
          dark = kLump_grey;
        }
        const double outside = s - wide.behind, of_halo = outside - kHalo_px;
        dark += outside < 0 ? wide.membrane : 0;
        dark -= wide.halo * std::exp(-0.5 * of_halo * of_halo);
        m.at<float>(y, x) -= static_cast<float>(dark / (kFine * kFine));
      }
    }
  }
  cv::GaussianBlur(m, m, cv::Size(0, 0), wide.blur_px);
  return photographed(m, seed, kWideNoise);
}

const InjectionPipette::Clear kClear = [](const Point&) { return true; };

// With what is right in the first frames of tests/numeric.
TEST(WideNeedle, ends_with_the_outermost_glass_though_a_speck_lies_on_a_wall) {
  constexpr double kTip_px = 2.5, kAside_px = 1;
  for (const double tangent : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
    for (const double speck_px : {10.0, 14.0, 20.0}) {
      for (const double side : {-1.0, 1.0}) {
        InjectionPipette needle(Side::right, kWideRadius);
        const Wide wide{.tangent = tangent, .speck_px = speck_px, .side = side};
        ASSERT_TRUE(needle.start(draw(wide), kWideNoise, kClear));
        const NeedlePose seen = needle.as_found(kWideNoise);
        EXPECT_NEAR(seen.tip.x, wide.tip, kTip_px) << tangent << ' ' << speck_px << ' ' << side;
        EXPECT_NEAR(seen.tip.y, kAxis_y, kAside_px) << tangent << ' ' << speck_px << ' ' << side;
      }
    }
  }
}

TEST(WideNeedle, that_is_ground_sharp_ends_with_its_point) {
  constexpr double kTip_px = 1.5, kAside_px = 1.5;
  for (const double tangent : {1.0, 1.1, 1.2, 1.4, 1.7, 2.0}) {
    for (const double side : {-1.0, 1.0}) {
      InjectionPipette needle(Side::right, kWideRadius);
      const Wide wide{.tangent = side * tangent};
      ASSERT_TRUE(needle.start(draw(wide), kWideNoise, kClear)) << tangent;
      const NeedlePose seen = needle.as_found(kWideNoise);
      EXPECT_NEAR(seen.point().x, wide.tip, kTip_px) << side * tangent;
      EXPECT_NEAR(seen.point().y, kAxis_y - side * kWideRadius, kAside_px) << side * tangent;
    }
  }
}

// It looks as if that wall went on there, but for the light before it.
TEST(WideNeedle, does_not_go_on_to_a_speck_in_line_with_a_wall) {
  constexpr double kTip_px = 2.5;
  for (const double ahead_px : {5.0, 6.0, 7.0, 8.0}) {
    for (const double side : {-1.0, 1.0}) {
      InjectionPipette needle(Side::right, kWideRadius);
      const Wide wide{.speck_px = -ahead_px, .side = side};
      ASSERT_TRUE(needle.start(draw(wide), kWideNoise, kClear));
      const NeedlePose seen = needle.as_found(kWideNoise);
      EXPECT_NEAR(seen.tip.x, wide.tip, kTip_px) << ahead_px << ' ' << side;
      EXPECT_EQ(seen.point_aside, 0) << ahead_px << ' ' << side;
    }
  }
}

// What light from one side makes of the faces of two walls.
struct LineAlong {
  double aside, grey;  // px from the axis, over the medium
};

std::optional<NeedlePose> widened(std::initializer_list<LineAlong> lines, double half_width) {
  constexpr double kTip_x = 150, kBlur_px = 1.3;
  cv::Mat m(kH, kW, CV_32F, cv::Scalar(150));
  for (int y = 0; y < kH; ++y) {
    for (int x = static_cast<int>(kTip_x); x < kW; ++x) {
      for (const LineAlong& line : lines) {
        const double z = (kAxis_y - y - line.aside) / kBlur_px;
        m.at<float>(y, x) += static_cast<float>(line.grey * std::exp(-0.5 * z * z));
      }
    }
  }
  NeedlePose pose;
  pose.tip = {kTip_x, kAxis_y};
  pose.half_width = half_width;
  return with_outer_line(photographed(m, 2100, kWideNoise), kWideNoise, pose);
}

TEST(WideNeedle, reaches_to_the_outermost_line_of_its_walls_in_relief) {
  constexpr double kFace_px = 1.3, kAbout_px = 1.2;  // outside the middle of a line
  for (const double sign : {-1.0, 1.0}) {
    const auto one = widened({{-7, 25 * sign}, {-3.3, -18 * sign}, {0, 18 * sign}, {3.7, -40 * sign}}, 4.9);
    ASSERT_TRUE(one);
    EXPECT_NEAR(one->at(0, one->half_width).y, kAxis_y - 4.9, kAbout_px);
    EXPECT_NEAR(one->at(0, -one->half_width).y, kAxis_y + 7 + kFace_px, kAbout_px);
    const auto both = widened({{-6, -44 * sign}, {-2, 16 * sign}, {2, -18 * sign}, {6, 16 * sign}}, 3.5);
    ASSERT_TRUE(both);
    EXPECT_NEAR(both->at(0, both->half_width).y, kAxis_y - 6 - kFace_px, kAbout_px);
    EXPECT_NEAR(both->at(0, -both->half_width).y, kAxis_y + 6 + kFace_px, kAbout_px);
  }
}

// As in a real picture of a needle in an oocyte, in bright field, and with a line too faint to be a wall.
TEST(WideNeedle, is_no_wider_for_a_fringe) {
  EXPECT_FALSE(widened({{-3, -72}, {3, 60}, {7, -40}}, 4.5));
  EXPECT_FALSE(widened({{-4, -40}, {4, -40}, {-7.5, 12}, {7.5, 12}}, 5));
  EXPECT_FALSE(widened({{-3.3, -18}, {0, 18}, {3.7, -40}, {-7, 2}}, 4.9));
  EXPECT_FALSE(widened({{-4, -40}, {4, -40}}, 5));
}

// A tube that is cut obliquely, lit from one side: the slope of the light's path through its glass.
struct Tube {
  double tangent, light_deg;  // by how much further back it ends, per px across; 0: light comes from the tip
  double tip = 150.3, radius = 4.7, widens = 0.012;
  double gain = 9;      // grey levels of slope
  double parallel = 0;  // behind the tip it does not widen, px
  double turned = 0;    // of the cut about the axis, out of the focal plane, rad
};

// Along z, of a tube of that radius, at u beside its axis and s behind its tip.
double chord(const Tube& tube, double radius, double s, double u) {
  const double half = std::sqrt(std::max(radius * radius - u * u, 0.0));
  if (tube.turned == 0) {
    return s > tube.tangent * u + std::abs(tube.tangent) * tube.radius ? 2 * half : 0;
  }
  constexpr int kSlices = 40;
  int within = 0;
  for (int k = 0; k < kSlices; ++k) {
    const double z = half * ((2 * k + 1.0) / kSlices - 1);
    const double towards = u * std::cos(tube.turned) + z * std::sin(tube.turned);
    within += s > tube.tangent * towards + std::abs(tube.tangent) * tube.radius ? 1 : 0;
  }
  return 2 * half * within / kSlices;
}

GradientField lit(const Tube& tube, unsigned seed = 2300) {
  constexpr int kFine = 3;
  constexpr double kBore = 0.65, kMost_grey = 45, kLens_px = 1.2;
  const double angle = tube.light_deg * std::numbers::pi / 180;
  cv::Mat path(kH * kFine, kW * kFine, CV_32F, cv::Scalar(0));
  for (int y = 0; y < path.rows; ++y) {
    for (int x = 0; x < path.cols; ++x) {
      const double s = (x + 0.5) / kFine - 0.5 - tube.tip, u = (y + 0.5) / kFine - 0.5 - kAxis_y;
      const double outer = tube.radius + tube.widens * std::max(s - tube.parallel, 0.0);
      path.at<float>(y, x) = static_cast<float>(chord(tube, outer, s, u) - chord(tube, kBore * outer, s, u));
    }
  }
  cv::GaussianBlur(path, path, cv::Size(0, 0), 0.5 * kFine);
  cv::Mat along, across;
  cv::Sobel(path, along, CV_32F, 1, 0, 1, 0.5 * kFine);
  cv::Sobel(path, across, CV_32F, 0, 1, 1, 0.5 * kFine);
  cv::Mat slope = tube.gain * (std::cos(angle) * along + std::sin(angle) * across);
  for (auto g = slope.begin<float>(); g != slope.end<float>(); ++g) {
    *g = static_cast<float>(150 + kMost_grey * std::tanh(static_cast<double>(*g) / kMost_grey));
  }
  cv::GaussianBlur(slope, slope, cv::Size(0, 0), kLens_px * kFine);
  cv::Mat picture;
  cv::resize(slope, picture, cv::Size(kW, kH), 0, 0, cv::INTER_AREA);
  return photographed(picture, seed, kWideNoise);
}

TEST(WideNeedle, that_is_ground_sharp_ends_with_its_point_wherever_light_comes_from) {
  constexpr double kPoint_px = 2, kAside_px = 1, kCertain_px = 2, kDeviations = 2;
  for (const double tangent : {-1.7, -1.1, 1.1, 1.4, 1.7}) {
    for (const double light_deg : {60.0, 90.0, 200.0, 240.0, 270.0}) {
      InjectionPipette needle(Side::right, kWideRadius);
      Tube tube{tangent, light_deg};
      const auto expect_point = [&](const NeedlePose& seen, const char* when) {
        EXPECT_NEAR(seen.point().x, tube.tip, std::max(kPoint_px, kDeviations * seen.sd))
            << when << ' ' << tangent << ' ' << light_deg;
        EXPECT_NEAR(seen.point().y, kAxis_y - std::copysign(tube.radius, tangent), kAside_px)
            << when << ' ' << tangent << ' ' << light_deg;
        EXPECT_LT(seen.sd, kCertain_px) << when << ' ' << tangent << ' ' << light_deg;
      };
      ASSERT_TRUE(needle.start(lit(tube), kWideNoise, kClear)) << tangent << ' ' << light_deg;
      expect_point(needle.as_found(kWideNoise), "found");
      needle.in_relief(true);
      for (unsigned frame = 1; frame < 5; ++frame) {
        tube.tip -= 1;
        const GradientField field = lit(tube, 2300 + frame);
        const NeedlePose seen = needle.find(field, kWideNoise, std::nullopt);
        expect_point(seen, "followed");
        needle.learn(field, seen, kWideNoise);
      }
    }
  }
}

#ifndef PUNCTUM_SANITIZED  // minutes, for the same code
// The point is not where the walls of the cut have it then: it lies nearer to the axis, and further ahead.
TEST(WideNeedle, that_is_ground_sharp_ends_with_its_point_however_the_cut_is_turned) {
  constexpr double kPoint_px = 1, kRms_px = 0.4, kAside_px = 0.8;
  constexpr unsigned kFrames = 6;
  double squares = 0;
  int needles = 0;
  unsigned seed = 2400;
  for (const double turned : {0.0, 0.25, 0.5}) {
    for (const double tangent : {-1.2, 1.7}) {
      for (const double light_deg : {40.0, 90.0, 140.0}) {
        InjectionPipette needle(Side::right, kWideRadius);
        Tube tube{tangent, light_deg};
        tube.gain = 25;
        tube.turned = turned;
        ASSERT_TRUE(needle.start(lit(tube, ++seed), kWideNoise, kClear));
        needle.in_relief(true);
        NeedlePose pose;
        for (unsigned frame = 1; frame < kFrames; ++frame) {
          tube.tip -= 1;
          const GradientField field = lit(tube, ++seed);
          pose = needle.find(field, kWideNoise, std::nullopt);
          needle.learn(field, pose, kWideNoise);
        }
        const double error = pose.point().x - tube.tip;
        EXPECT_NEAR(error, 0, kPoint_px) << turned << ' ' << tangent << ' ' << light_deg;
        EXPECT_NEAR(pose.point().y, kAxis_y - std::copysign(tube.radius * std::cos(turned), tangent),
                    kAside_px)
            << turned << ' ' << tangent << ' ' << light_deg;
        squares += error * error;
        ++needles;
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / needles), kRms_px);
}
#endif

// Of a sharp one that was there before it nothing is left.
TEST(WideNeedle, that_is_blunt_is_told_as_if_there_had_been_no_other) {
  InjectionPipette fresh(Side::right, kWideRadius), used(Side::right, kWideRadius);
  Tube sharp{1.7, 90.0}, blunt{0, 20.0};
  sharp.gain = 25;
  ASSERT_TRUE(used.start(lit(sharp), kWideNoise, kClear));
  for (InjectionPipette* needle : {&fresh, &used}) {
    ASSERT_TRUE(needle->start(lit(blunt), kWideNoise, kClear));
    needle->in_relief(true);
  }
  for (unsigned frame = 1; frame < 5; ++frame) {
    blunt.tip -= 1;
    const GradientField field = lit(blunt, 2300 + frame);
    const NeedlePose one = fresh.find(field, kWideNoise, std::nullopt),
                     other = used.find(field, kWideNoise, std::nullopt);
    EXPECT_EQ(one.tip, other.tip) << frame;
    EXPECT_EQ(one.sd, other.sd) << frame;
    fresh.learn(field, one, kWideNoise);
    used.learn(field, other, kWideNoise);
  }
}

TEST(WideNeedle, that_is_blunt_ends_where_light_from_one_side_shows_a_line_across_it) {
  constexpr double kEnd_px = 0.3, kDeviations = 3;
  for (const double light_deg : {20.0, 45.0, 135.0, 160.0, 200.0, 300.0}) {
    InjectionPipette needle(Side::right, kWideRadius);
    Tube tube{.tangent = 0, .light_deg = light_deg, .tip = 150 + 1 / 6.0, .widens = 0.04, .gain = 30};
    ASSERT_TRUE(needle.start(lit(tube), kWideNoise, kClear)) << light_deg;
    needle.in_relief(true);
    for (unsigned frame = 0; frame < 5; ++frame) {
      const NeedlePose seen =
          frame == 0 ? needle.as_found(kWideNoise) : needle.find(lit(tube, 2300 + frame), kWideNoise, {});
      ASSERT_TRUE(seen.ok) << light_deg;
      EXPECT_NEAR(seen.tip.x, tube.tip, kEnd_px) << light_deg << ' ' << frame;
      EXPECT_LT(std::abs(seen.tip.x - tube.tip), kDeviations * seen.sd) << light_deg << ' ' << frame;
      tube.tip -= 4 / 3.0;  // whole pixels of the drawing
    }
  }
}

// Edges that are looked for one by one may be those of the outer line of a wall near the tip and of the inner
// one further back.
TEST(WideNeedle, that_is_told_turned_lies_along_the_lines_of_its_faces) {
  // The outer flank of a face's line: 1.6 to 1.8 px outside, by quadrature of the slope through all blurs.
  constexpr double kFace_px = 1.8, kTurned = 0.003, kAcross_px = 0.4, kWidens = 0.004;
  for (const double light_deg : {50.0, 90.0, 250.0}) {
    const Tube tube{.tangent = 1.4, .light_deg = light_deg, .widens = 0.016};
    const GradientField field = lit(tube);
    NeedlePose right;
    right.tip = {tube.tip, kAxis_y};
    right.half_width = tube.radius + kFace_px;
    right.taper = tube.widens;
    EXPECT_FALSE(along_face_lines(field, kWideNoise, right)) << light_deg;
    for (const double side : {-1.0, 1.0}) {
      NeedlePose turned = right;
      turned.axis = Point(-1, side * tube.widens) / std::hypot(1, tube.widens);
      turned.half_width += 0.5;
      turned.taper = 0;
      const auto found = along_face_lines(field, kWideNoise, turned);
      ASSERT_TRUE(found) << light_deg << ' ' << side;
      EXPECT_NEAR(found->axis.y, 0, kTurned) << light_deg << ' ' << side;
      EXPECT_NEAR(found->tip.y, kAxis_y, kAcross_px) << light_deg << ' ' << side;
      EXPECT_NEAR(found->half_width, right.half_width, kAcross_px) << light_deg << ' ' << side;
      EXPECT_NEAR(found->taper, tube.widens, kWidens) << light_deg << ' ' << side;
    }
  }
  // In bright field both faces are dark.
  NeedlePose turned;
  turned.tip = {150.3, kAxis_y};
  turned.axis = Point(-1, 0.02) / std::hypot(1, 0.02);
  turned.half_width = kWideRadius + kFace_px;
  EXPECT_FALSE(along_face_lines(draw(Wide{}), kWideNoise, turned));
}

// Where its glass begins is a line across it, where the light comes along it: not the middle of its wall.
TEST(WideNeedle, that_is_blunt_ends_where_its_glass_begins_in_relief) {
  constexpr double kEnd_px = 0.3, kBlur_px = 0.6, kReach_px = 6;
  constexpr unsigned kFrames = 6;
  for (const double light_deg : {20.0, 45.0, 170.0}) {
    const Tube tube{.tangent = 0, .light_deg = light_deg, .tip = 150 + 1 / 6.0, .widens = 0.03, .gain = 30};
    NeedlePose pose;
    pose.tip = {tube.tip + 1, kAxis_y};
    pose.half_width = tube.radius + kBlur_px;
    pose.taper = tube.widens;
    double ahead = 0;
    for (unsigned frame = 0; frame < kFrames; ++frame) {
      const auto end = end_of_glass(lit(tube, 2300 + frame), kWideNoise, pose, 0, kReach_px, kReach_px, true);
      ASSERT_TRUE(end) << light_deg;
      ahead += end->ahead / kFrames;
    }
    EXPECT_NEAR(ahead, 1, kEnd_px) << light_deg;
  }
}

// The rows of the picture then lie behind all that an end is compared by.
TEST(WideNeedle, that_ends_beyond_the_border_of_the_picture_is_told_nowhere) {
  const Tube tube{.tangent = 0, .light_deg = 45, .tip = 150, .widens = 0, .gain = 30};
  const GradientField field = lit(tube);
  NeedlePose pose;
  pose.half_width = tube.radius + 0.6;
  for (const double beyond_px : {20.0, 40.0, 60.0, 90.0}) {
    pose.tip = {static_cast<double>(field.area.width) + beyond_px, kAxis_y};
    pose.axis = {1, 0};
    EXPECT_FALSE(end_of_glass(field, kWideNoise, pose, 0, 6, 6, true)) << beyond_px;
  }
}

// With light along it a line across its end shows, with light across it what its sides show begins there.
TEST(ThinNeedle, ends_where_its_glass_does_wherever_light_comes_from) {
  constexpr double kEnd_px = 0.45, kDeviations = 2.5, kRadius = 2.8, kBlur_px = 0.5;
  constexpr unsigned kFrames = 16;
  for (const double light_deg : {0.0, 75.0, 170.0}) {
    const Tube tube{.tangent = 0,
                    .light_deg = light_deg,
                    .tip = 150 + 1 / 6.0,
                    .radius = kRadius,
                    .widens = 0.03,
                    .gain = 20};
    NeedlePose pose;
    pose.tip = {tube.tip - 1, kAxis_y};
    pose.half_width = kRadius + kBlur_px;
    pose.taper = tube.widens;
    ThinEnd thin;
    for (unsigned frame = 0; frame < kFrames; ++frame) {
      ASSERT_TRUE(thin.add(lit(tube, 2300 + frame), pose, true));
    }
    const auto end = thin.end(kWideNoise);
    ASSERT_TRUE(end) << light_deg;
    EXPECT_NEAR(end->ahead, -1, kEnd_px) << light_deg;
    EXPECT_LT(std::abs(end->ahead + 1), kDeviations * end->sd) << light_deg;
  }
}

// Its cut is a slanted line, of which either half looks like that of a blunt end 6 px further back.
TEST(WideNeedle, that_is_ground_sharp_ends_with_no_line_across_it) {
  constexpr double kPoint_px = 1.5;
  for (const double light_deg : {20.0, 200.0, 260.0}) {
    InjectionPipette needle(Side::right, kWideRadius);
    Tube tube{.tangent = -1.1, .light_deg = light_deg, .widens = 0.02, .gain = 40};
    ASSERT_TRUE(needle.start(lit(tube), kWideNoise, kClear)) << light_deg;
    needle.in_relief(true);
    for (unsigned frame = 0; frame < 4; ++frame) {
      const GradientField field = lit(tube, 2300 + frame);
      const NeedlePose seen =
          frame == 0 ? needle.as_found(kWideNoise) : needle.find(field, kWideNoise, std::nullopt);
      EXPECT_NEAR(seen.point().x, tube.tip, kPoint_px) << light_deg << ' ' << frame;
      needle.learn(field, seen, kWideNoise);
      tube.tip -= 1;
    }
  }
}

// Over 60 px it does not widen, so that nothing of its walls shows.
TEST(WideNeedle, whose_walls_do_not_show_near_its_tip_ends_with_the_line_ahead_of_them) {
  for (const double light_deg : {0.0, 180.0}) {
    InjectionPipette needle(Side::right, kWideRadius);
    Tube tube{.tangent = 0,
              .light_deg = light_deg,
              .tip = 120 + 1 / 6.0,
              .widens = 0.08,
              .gain = 40,
              .parallel = 60};
    ASSERT_TRUE(needle.start(lit(tube), kWideNoise, kClear)) << light_deg;
    needle.in_relief(true);
    needle.learn(lit(tube), needle.as_found(kWideNoise), kWideNoise);
    for (unsigned frame = 1; frame < 5; ++frame) {
      const NeedlePose seen = needle.find(lit(tube, 2300 + frame), kWideNoise, {});
      ASSERT_TRUE(seen.ok) << light_deg;
      EXPECT_NEAR(seen.tip.x, tube.tip, 0.3) << light_deg;
      needle.learn(lit(tube, 2300 + frame), seen, kWideNoise);
      tube.tip -= 4 / 3.0;
    }
  }
}

// As where light comes from one side: the strong wall alone looks like a thin needle.
TEST(WideNeedle, lies_between_a_strong_wall_and_a_faint_one) {
  constexpr double kTip_px = 2.5, kAside_px = 1.5, kAxis_y_most = 0.03;
  for (const double other : {0.15, 0.3, -0.3}) {
    for (const double radius : {5.0, 6.0}) {
      InjectionPipette needle(Side::right, radius);
      const Wide wide{.other_wall = other, .radius = radius};
      ASSERT_TRUE(needle.start(draw(wide), kWideNoise, kClear)) << other << ' ' << radius;
      const NeedlePose seen = needle.as_found(kWideNoise);
      EXPECT_NEAR(seen.tip.x, wide.tip, kTip_px) << other << ' ' << radius;
      EXPECT_NEAR(seen.tip.y, kAxis_y, kAside_px) << other << ' ' << radius;
      EXPECT_NEAR(seen.axis.y, 0, kAxis_y_most) << other << ' ' << radius;
    }
  }
}

// Both faces of one wall look like a thin needle.
TEST(WideNeedle, is_not_one_of_its_walls) {
  for (const double radius : {5.0, 6.0}) {
    const Wide wide{.radius = radius};
    const GradientField field = draw(wide);
    for (const double side : {-1.0, 1.0}) {
      NeedlePose wall;
      wall.half_width = 2.6;
      wall.tip = {wide.tip, kAxis_y + side * 0.8 * radius};
      const auto needle = with_faint_wall(field, kWideNoise, radius, wall);
      ASSERT_TRUE(needle) << radius << ' ' << side;
      EXPECT_NEAR(needle->tip.y, kAxis_y, 1) << radius << ' ' << side;
      EXPECT_NEAR(needle->half_width, radius + 1, 1.5) << radius << ' ' << side;
    }
  }
}

// A fringe on either side is no wall.
TEST(WideNeedle, is_no_wider_for_fringes_beside_a_thin_one) {
  InjectionPipette needle(Side::right, kTipRadius);
  const Wide thin{.fringes = 8, .radius = kTipRadius};
  ASSERT_TRUE(needle.start(draw(thin), kWideNoise, kClear));
  const NeedlePose seen = needle.as_found(kWideNoise);
  EXPECT_LT(seen.half_width, kTipRadius + 2.5);
  EXPECT_NEAR(seen.tip.y, kAxis_y, 1);
}

TEST(WideNeedle, does_not_end_where_something_lies_across_it) {
  constexpr double kSharp_px = 1.1, kBlurred_px = 2.6;
  for (const auto& [blur_px, lump_px] :
       {std::pair{kSharp_px, 90.0}, {kSharp_px, 170.0}, {kSharp_px, 200.0}, {kBlurred_px, 200.0}}) {
    InjectionPipette needle(Side::right, kWideRadius);
    const Wide wide{.closed = true, .lump_px = lump_px, .blur_px = blur_px, .radius = 6};
    ASSERT_TRUE(needle.start(draw(wide), kWideNoise, kClear)) << lump_px << ' ' << blur_px;
    EXPECT_NEAR(needle.as_found(kWideNoise).tip.x, wide.tip, 3) << lump_px << ' ' << blur_px;
  }
}

// A needle out of focus, found and then followed as it moves on by a pixel per frame. each(frame, by how much
// it is told too far ahead, pose); frame 0 is the one in which it is found.
void follow_out_of_focus(unsigned seed, unsigned frames,
                         const std::function<void(unsigned, double, const NeedlePose&)>& each) {
  InjectionPipette needle(Side::right, kWideRadius);
  Wide wide{.closed = true, .blur_px = 2.6, .radius = 6};
  ASSERT_TRUE(needle.start(draw(wide, 100 * seed), kWideNoise, kClear)) << seed;
  const NeedlePose found = needle.as_found(kWideNoise);
  each(0, wide.tip - found.tip.x, found);
  for (unsigned frame = 1; frame <= frames; ++frame) {
    wide.tip -= 1;
    const GradientField field = draw(wide, 100 * seed + frame);
    const NeedlePose seen = needle.find(field, kWideNoise, std::nullopt);
    ASSERT_TRUE(seen.ok) << seed << ' ' << frame << ": " << seen.reason;
    needle.learn(field, seen, kWideNoise);
    each(frame, wide.tip - seen.tip.x, seen);
  }
}

// There its shape and its walls end several pixels apart.
TEST(WideNeedle, is_followed_where_it_was_found_though_it_is_out_of_focus) {
  constexpr double kUsual_px = 1.5;
  constexpr unsigned kSeeds = 6, kFrames = 6;
  double shifts = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    double off = 0;
    follow_out_of_focus(seed, kFrames, [&](unsigned frame, double ahead, const NeedlePose&) {
      off = frame == 0 ? ahead : off;
      shifts += std::abs(ahead - off) / (kFrames * kSeeds);
    });
  }
  EXPECT_LT(shifts, kUsual_px);
}

// The shape that is learnt at the start fits best 1 to 3 px further ahead; that is put right by its glass,
// frame by frame.
TEST(WideNeedle, is_the_more_certain_the_longer_it_is_seen_out_of_focus) {
  constexpr double kAtFirst_px = 1.5, kBias_px = 0.4, kCovers = 3;
  constexpr unsigned kSeeds = 6, kFrames = 10;
  double bias = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    double sd_at_first = 0, sd = 0;
    follow_out_of_focus(seed, kFrames, [&](unsigned frame, double ahead, const NeedlePose& seen) {
      EXPECT_LT(std::abs(ahead), kCovers * seen.sd) << seed << ' ' << frame;
      sd_at_first = frame == 1 ? seen.sd : sd_at_first;
      sd = seen.sd;
      bias += frame > kFrames / 2 ? ahead / (kFrames / 2 * kSeeds) : 0;
    });
    EXPECT_GT(sd_at_first, kAtFirst_px) << seed;
    EXPECT_LT(sd, sd_at_first / 1.5) << seed;
  }
  EXPECT_NEAR(bias, 0, kBias_px);
}

NeedlePose pose_at(const Point& tip) {
  NeedlePose pose;
  pose.ok = true;
  pose.tip = tip;
  pose.half_width = 6;
  pose.taper = 0.02;
  return pose;
}

// A membrane as the picture itself shows it all round the cell: blurred, with a halo. Without one a step of
// its blur says the same.
EdgeLearnt membrane_of(const Wide& wide) {
  constexpr double kStep_px = 0.5, kOutside_px = 6;
  EdgeLearnt out;
  out.own_blur_px = wide.blur_px;
  if (wide.halo > 0) {
    out.inside = 8;
    const double step = wide.blur_px, line = std::hypot(1, step);
    for (double x = -out.inside; x <= kOutside_px; x += kStep_px) {
      const double off = (x - kHalo_px) / line;
      out.shape.push_back(150 - 0.5 * wide.membrane * std::erfc(x / (std::sqrt(2) * step)) +
                          wide.halo / line * std::exp(-0.5 * off * off));
    }
  }
  return out;
}

// A pose that is drawn aside by a membrane on the tip is put right, in focus, in a halo, and out of focus;
// and the membrane is seen where it is, be that a little behind the outermost glass.
TEST(TipOnMembrane, is_where_glass_and_membrane_meet) {
  struct World {
    double blur_px, halo, behind, scatter_px;
  };
  constexpr double kBias_px = 0.3, kMembrane_px = 0.2;
  constexpr unsigned kLearnt = 12, kFrames = 8;
  const NeedlePose true_pose = pose_at({150.3, kAxis_y});
  for (const auto& [blur_px, halo, behind, scatter_px] :
       {World{1.1, 0, 0, 0.5}, World{1.1, 25, 0, 0.5}, World{2.5, 0, 0, 0.75}, World{1.1, 0, 0.6, 0.5},
        World{1.1, 25, 0.6, 0.5}}) {
    const Wide clear{.closed = true, .blur_px = blur_px, .radius = 6};
    Wide touching = clear;
    touching.membrane = 30;
    touching.halo = halo;
    touching.behind = behind;
    TipOnMembrane tip;
    const EdgeLearnt membrane = membrane_of(touching);
    EXPECT_FALSE(tip.ahead(draw(touching), kWideNoise, membrane, true_pose));
    for (unsigned frame = 1; frame <= kLearnt; ++frame) {
      tip.learn(draw(clear, frame), true_pose);
    }
    for (const double drawn_px : {-1.5, 0.0, 2.5}) {
      NeedlePose drawn = true_pose;
      drawn.tip += drawn_px * drawn.axis;
      double bias = 0, of_membrane = 0;
      for (unsigned frame = 1; frame <= kFrames; ++frame) {
        const auto seen = tip.ahead(draw(touching, kLearnt + frame), kWideNoise, membrane, drawn);
        ASSERT_TRUE(seen) << blur_px << ' ' << halo << ' ' << drawn_px;
        EXPECT_LT(std::abs(seen->ahead + drawn_px), 3 * seen->sd + kBias_px) << blur_px << ' ' << halo;
        EXPECT_LT(seen->sd, scatter_px) << blur_px << ' ' << halo << ' ' << drawn_px;
        EXPECT_EQ(seen->gone_odds, 0) << blur_px << ' ' << halo << ' ' << drawn_px;
        bias += (seen->ahead + drawn_px) / kFrames;
        of_membrane += (seen->ahead + drawn_px + seen->membrane + behind) / kFrames;
      }
      EXPECT_NEAR(bias, 0, kBias_px) << blur_px << ' ' << halo << ' ' << behind << ' ' << drawn_px;
      EXPECT_NEAR(of_membrane, 0, kMembrane_px) << blur_px << ' ' << halo << ' ' << behind << ' ' << drawn_px;
    }
  }
}

// A membrane that gave way crosses the lumen behind the tip, which is then where its glass is.
TEST(TipOnMembrane, is_left_where_it_is_by_a_membrane_that_went_back) {
  constexpr double kMembrane_px = 1.2;
  const NeedlePose pose = pose_at({150.3, kAxis_y});
  TipOnMembrane tip;
  for (unsigned frame = 1; frame <= 12; ++frame) {
    tip.learn(draw({.closed = true, .radius = 6}, frame), pose);
  }
  for (const double halo : {0.0, 25.0}) {
    for (const double behind : {2.5, 4.0, 6.0}) {
      const Wide wide{.closed = true, .membrane = 30, .behind = behind, .halo = halo, .radius = 6};
      const auto seen = tip.ahead(draw(wide, 20), kWideNoise, membrane_of(wide), pose);
      ASSERT_TRUE(seen);
      EXPECT_GT(seen->gone_odds, 2) << behind << ' ' << halo;
      EXPECT_EQ(seen->ahead, 0) << behind << ' ' << halo;
      EXPECT_NEAR(seen->membrane, -behind, kMembrane_px) << behind << ' ' << halo;
    }
  }
}

// Something dark over the end looks neither like glass nor like a membrane.
TEST(TipOnMembrane, is_left_where_it_is_by_what_is_no_membrane) {
  const NeedlePose pose = pose_at({150.3, kAxis_y});
  TipOnMembrane tip;
  for (unsigned frame = 1; frame <= 12; ++frame) {
    tip.learn(draw({.closed = true, .radius = 6}, frame), pose);
  }
  for (const double lump_px : {0.5, 2.0, 4.0, 6.0}) {
    const auto seen =
        tip.ahead(draw({.closed = true, .lump_px = lump_px, .radius = 6}, 20), kWideNoise, {}, pose);
    ASSERT_TRUE(seen) << lump_px;
    EXPECT_EQ(seen->ahead, 0) << lump_px;
    EXPECT_EQ(seen->sd, 0) << lump_px;
  }
}

// Where noise hides both, the pose counts, and the deviation says so.
TEST(TipOnMembrane, is_left_where_it_is_by_a_picture_that_tells_nothing) {
  constexpr double kNothing = 1000;  // grey levels of noise
  const NeedlePose pose = pose_at({149.3, kAxis_y});
  TipOnMembrane tip;
  tip.learn(draw({.closed = true, .radius = 6}, 1), pose);
  const auto seen = tip.ahead(draw({.closed = true, .membrane = 30, .radius = 6}, 2), kNothing, {}, pose);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->ahead, 0, 0.1);
  EXPECT_GT(seen->sd, 2);
}

}  // namespace
}  // namespace cone
