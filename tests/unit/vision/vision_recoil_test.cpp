// Whether a membrane has gone back against the needle, by its motion between two pictures of a texture that
// is moved as a dimple moves it; and by how much the edge of a cell has jumped with the picture.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>

#include "tests/support/pictures.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/edge_pattern.hpp"
#include "vision/membrane/membrane_recoil.hpp"

namespace punctum::vision {
namespace {

constexpr int kWidth = 240, kHeight = 160;
constexpr double kHalfWidth_px = 5, kLevel = 4;

// A needle from the right meets the cell at the entry.
struct Scene {
  Point entry{130, 80};
  double shaken_px =
      0;  // of all that is in the picture, along x; where the entry is expected does not follow
  std::mt19937 random{7};
  MembraneRecoil recoil;

  NeedlePose needle(double depth_px) const {
    NeedlePose n;
    n.ok = true;
    n.tip = entry + Point(-depth_px, 0);
    n.half_width = kHalfWidth_px;
    return n;
  }

  // Its texture beside the needle is moved by the dimple, wide_px from the axis to where it ends.
  cv::Mat draw(double depth_px, double wide_px, double noise) {
    std::normal_distribution<double> grain(0, 1);
    cv::Mat out(kHeight, kWidth, CV_8U);
    for (int y = 0; y < kHeight; ++y) {
      const double u = (y - entry.y) / wide_px, f = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
      for (int x = 0; x < kWidth; ++x) {
        const double at = x + depth_px * f - entry.x - shaken_px;
        double grey = 140;
        for (int k = 1; k <= 4; ++k) {
          const double turn = 2.4 * k, wave = 2 * std::numbers::pi / (7.0 + 4 * k);
          grey += 5 * std::sin(wave * (at * std::cos(turn) + (y - entry.y) * std::sin(turn)) + turn);
        }
        out.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey + noise * grain(random));
      }
    }
    return out;
  }

  std::optional<double> see(double dimple_px, double tip_px, double moved_px, double wide_px = 22,
                            double noise = 5, const Vector<Polygon>& covered = {},
                            double below_px = std::numeric_limits<double>::infinity(),
                            std::optional<double> carried_px = std::nullopt) {
    const cv::Mat pixels = draw(dimple_px, wide_px, noise);
    ClearedPicture picture;
    EXPECT_EQ(picture.load(test::frame_of(pixels), kWidth, kHeight), "");
    picture.compute_gradient({0, 0, kWidth, kHeight});
    picture.cover(covered);
    return recoil.update(picture, needle(tip_px - shaken_px), entry, carried_px, moved_px, kLevel, below_px);
  }
};

TEST(MembraneRecoil, is_told_of_a_dimple_that_goes_back_while_the_needle_goes_on) {
  for (const double wide : {14.0, 22.0, 35.0}) {
    for (const double noise : {2.0, 5.0, 10.0}) {
      Scene scene;
      EXPECT_EQ(scene.see(8, 8, 1, wide, noise), std::nullopt);  // one picture tells nothing
      for (const double depth : {9.0, 10.0}) {
        const auto on = scene.see(depth, depth, 1, wide, noise);
        ASSERT_TRUE(on);
        EXPECT_LT(*on, 0) << wide << ' ' << noise << ' ' << depth;
      }
      const auto back = scene.see(5, 11, 1, wide, noise);
      ASSERT_TRUE(back);
      EXPECT_GT(*back, 3) << wide << ' ' << noise;
    }
  }
}

TEST(MembraneRecoil, is_not_told_of_one_that_follows_the_needle_out_or_waits) {
  Scene scene;
  (void)scene.see(10, 10, 0);
  EXPECT_LT(scene.see(10, 10, 0).value(), 0);
  for (const double depth : {7.0, 4.0, 1.0}) {
    EXPECT_LT(scene.see(depth, depth, -3).value(), 1) << depth;  // 5 are asked for a membrane to be free
  }
}

TEST(MembraneRecoil, is_not_told_of_a_cell_that_moves_as_a_whole) {
  Scene scene;
  (void)scene.see(8, 8, 0);
  scene.entry.x += 4;  // with its outline at rest, against a needle that stays
  EXPECT_LT(scene.see(8, 8, 0).value(), 0);
}

// The needle points to -x, so what goes back goes to +x.
TEST(MembraneRecoil, is_not_told_of_a_picture_that_shakes_where_what_holds_the_cell_shows_that) {
  for (const double by_px : {-2.0, -1.0, -0.5, 0.5, 1.0, 2.0}) {
    for (const bool gives_way : {false, true}) {
      Scene scene;
      (void)scene.see(8, 8, 1);
      scene.shaken_px = by_px;
      const auto odds = scene.see(gives_way ? 4 : 9, 9, 1 - by_px, 22, 5, {},
                                  std::numeric_limits<double>::infinity(), -by_px);
      ASSERT_TRUE(odds);
      EXPECT_EQ(*odds > 3, gives_way) << by_px << ' ' << *odds;
      EXPECT_EQ(*odds < 0, !gives_way) << by_px << ' ' << *odds;
    }
  }
}

// As a yolk far below a chorion does.
TEST(MembraneRecoil, is_told_by_what_lies_above_another_membrane_that_stays) {
  constexpr double kDown_px = 14;
  const auto look = [&](Scene& scene, double dimple_px, double tip_px, double below_px) {
    const cv::Mat outer = scene.draw(dimple_px, 22, 0);
    cv::Mat still = scene.draw(0, 22, 0);
    cv::Mat both = outer.clone();
    still.convertTo(still, -1, 5, -4 * 140);  // five times as clear
    const cv::Rect below(0, 0, static_cast<int>(scene.entry.x - kDown_px), kHeight);
    still(below).copyTo(both(below));
    ClearedPicture picture;
    EXPECT_EQ(picture.load(test::frame_of(both), kWidth, kHeight), "");
    picture.compute_gradient({0, 0, kWidth, kHeight});
    picture.cover({});
    return scene.recoil.update(picture, scene.needle(tip_px), scene.entry, std::nullopt, 1, kLevel, below_px);
  };
  for (const double below : {kDown_px - 4, std::numeric_limits<double>::infinity()}) {
    Scene scene;
    (void)look(scene, 6, 6, below);
    const auto back = look(scene, 1, 7, below);
    ASSERT_TRUE(back);
    EXPECT_EQ(*back > 3, below < kDown_px) << *back;
  }
}

TEST(MembraneRecoil, is_uncertain_where_hardly_anything_is_seen) {
  Scene scene;
  const Vector<Polygon> all{{{1, 1}, {238, 1}, {238, 158}, {1, 158}}};
  (void)scene.see(8, 8, 1, 22, 5, all);
  EXPECT_NEAR(scene.see(2, 9, 1, 22, 5, all).value(), 0, 1e-9);
  scene.recoil.forget();
  EXPECT_EQ(scene.see(2, 9, 1), std::nullopt);
}

TEST(MembraneRecoil, tells_nothing_where_the_needle_jumps_further_than_it_can_see) {
  Scene scene;
  (void)scene.see(20, 20, 1);
  EXPECT_EQ(scene.see(0, 0, -20), std::nullopt);
  EXPECT_LT(scene.see(0, 0, 0).value(), 0);
}

// An ooplasm in its zona, lit along x: above and below hardly anything is seen of either.
struct LitCell {
  static constexpr double kR = 70;
  static constexpr int kSide = 240;
  Point centre{120, 116};
  double noise = 5, contrast = 40;
  std::mt19937 random{3};
  cv::Mat pixels;

  ClearedPicture look(const Point& moved) {
    std::normal_distribution<double> grain(0, 1);
    pixels.create(kSide, kSide, CV_8U);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const Point off = Point(x, y) - centre - moved;
        const double r = cv::norm(off), lit = contrast * off.x / std::max(r, 1.0), zona = (r - kR) / 2.5,
                     ooplasm = (r - kR + 10) / 2.5;
        const double grey = 130 + lit * (std::exp(-zona * zona / 2) + 0.8 * std::exp(-ooplasm * ooplasm / 2));
        pixels.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey + noise * grain(random));
      }
    }
    ClearedPicture out;
    out.grey = pixels;
    out.noise = noise;
    out.compute_gradient({0, 0, kSide, kSide});
    out.cover({});
    return out;
  }
  [[nodiscard]] Contour zona() const {
    Contour out;
    for (int i = 0; i < 256; ++i) {
      out.push_back(on_ray(centre, i, 256, kR + 2));
    }
    return out;
  }
};

TEST(EdgePattern, is_found_wherever_the_picture_has_jumped) {
  LitCell cell;
  EdgePattern pattern;
  EXPECT_FALSE(pattern.known());
  pattern.learn(cell.look({}), cell.zona());
  ASSERT_TRUE(pattern.known());
  for (const Point& by : {Point(5, 0), Point(-5, 0), Point(0, 9), Point(0, -9), Point(-11, 3), Point(17, -13),
                          Point(10, 0), Point(-10, 0), Point(-31, 1), Point(0, 31)}) {
    const ClearedPicture jumped = cell.look(by);
    EXPECT_FALSE(pattern.nearby(jumped.field)) << by;
    const auto found = pattern.anywhere(jumped.field);
    ASSERT_TRUE(found) << by;
    EXPECT_LT(cv::norm(*found - by), 0.7) << by << *found;
  }
  for (const Point& by : {Point(0, 0), Point(1.4, -0.6), Point(-0.5, 1.8)}) {
    const auto found = pattern.nearby(cell.look(by).field);
    ASSERT_TRUE(found) << by;
    EXPECT_LT(cv::norm(*found - by), 0.7) << by << *found;
  }
}

TEST(EdgePattern, is_found_nowhere_without_the_cell_and_not_known_in_noise) {
  LitCell cell;
  EdgePattern pattern;
  pattern.learn(cell.look({}), cell.zona());
  LitCell gone;
  gone.contrast = 0;
  const ClearedPicture empty = gone.look({});
  EXPECT_FALSE(pattern.nearby(empty.field));
  EXPECT_FALSE(pattern.anywhere(empty.field));

  LitCell faint;
  faint.contrast = 8;
  faint.noise = 20;
  EdgePattern unknown;
  unknown.learn(faint.look({}), faint.zona());
  EXPECT_FALSE(unknown.known());
}

}  // namespace
}  // namespace punctum::vision
