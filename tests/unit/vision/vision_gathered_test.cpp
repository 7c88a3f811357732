// What several noisy frames tell together: their mean, a needle's end in all of them, and what crosses the
// border.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>

#include "vision/pipettes/gathered_frames.hpp"
#include "vision/pipettes/moving_end.hpp"
#include "vision/pipettes/narrow_tube.hpp"

namespace gathered {
namespace {

using namespace punctum::vision;

constexpr int kW = 160, kH = 90;
constexpr double kSigma_px = 1.2;
const cv::Rect kWhole(0, 0, kW, kH);

cv::Mat with_dot(const cv::Point& at) {
  cv::Mat m(kH, kW, CV_8U, cv::Scalar(100));
  cv::rectangle(m, at - cv::Point(1, 1), at + cv::Point(1, 1), cv::Scalar(190), cv::FILLED);
  return m;
}

TEST(GatheredFrames, show_what_stands_still_through_the_noise) {
  constexpr double kNoise = 20;
  GatheredFrames frames;
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, kNoise);
  for (int k = 0; k < GatheredFrames::kMost; ++k) {
    cv::Mat m = with_dot({80, 45});
    for (auto it = m.begin<uchar>(); it != m.end<uchar>(); ++it) {
      *it = cv::saturate_cast<uchar>(*it + normal(random));
    }
    frames.add(m, std::nullopt);
  }
  (void)frames.at_rest(kSigma_px);
  EXPECT_NEAR(frames.noise(), kNoise / std::sqrt(GatheredFrames::kMost), 0.7);
  EXPECT_NEAR(frames.noise_of_one(), kNoise, 2);
}

// Each as bright as in one frame, and where the last one has it.
TEST(GatheredFrames, show_what_moves_where_the_last_one_has_it) {
  const cv::Point step(-3, 2), last(60, 40);
  for (const bool known : {false, true}) {
    GatheredFrames frames;
    for (int age = 4; age >= 0; --age) {
      frames.add(with_dot(last - age * step), known ? std::optional(Point(step)) : std::nullopt);
    }
    EXPECT_EQ(frames.motion_known(), known);
    const double one = frames.one(0, kWhole, kSigma_px).grey(last);
    EXPECT_NEAR(frames.moving(kWhole, known ? Point() : Point(step), kSigma_px).grey(last), one, 0.01);
    EXPECT_LT(frames.at_rest(kSigma_px).grey(last), 100 + 0.6 * (one - 100));
  }
}

TEST(GatheredFrames, go_on_beyond_the_border_as_at_it) {
  const cv::Mat even(kH, kW, CV_8U, cv::Scalar(130));
  GatheredFrames frames;
  for (int k = 0; k < 5; ++k) {
    frames.add(even, std::nullopt);
  }
  const GradientField& field = frames.moving(kWhole, Point(-60, 35), kSigma_px);
  for (const Point p : {Point(1, 1), Point(kW - 3, kH - 3), Point(80, 45)}) {
    EXPECT_NEAR(field.grey(p), 130, 0.01);
  }
}

TEST(GatheredFrames, are_the_last_ones) {
  GatheredFrames frames;
  frames.add(with_dot({20, 20}), std::nullopt);
  for (int k = 0; k < GatheredFrames::kMost; ++k) {
    frames.add(with_dot({80, 45}), std::nullopt);
  }
  EXPECT_EQ(frames.count(), GatheredFrames::kMost);
  EXPECT_NEAR(frames.at_rest(kSigma_px).grey(Point(20, 20)), 100, 0.01);
  frames.forget();
  EXPECT_EQ(frames.count(), 0);
}

// Each frame tells the end with a Gaussian error of kEnd_px. With the motion that is a line through all of
// them: what least squares tell of it is known.
constexpr double kEnd_px = 1.5, kRadius_px = 5;

Vector<SeenEnds> seen_at(double behind, double per_frame, double known_per_frame) {
  constexpr double kOtherCut = 60;  // as much less likely
  Vector<SeenEnds> frames;
  for (int age = 0; age < 8; ++age) {
    SeenEnds one{{}, known_per_frame * age, age};
    const double end = behind + (per_frame + known_per_frame) * age;
    for (std::size_t cut = 0; cut < LikelyEnds::kCuts; ++cut) {
      for (std::size_t k = 0; k < one.ends.gain[cut].size(); ++k) {
        const double off = static_cast<double>(k) - LikelyEnds::kReach_px - end;
        one.ends.gain[cut][k] = -off * off / (kEnd_px * kEnd_px) - (cut == 2 ? 0 : kOtherCut);
      }
    }
    frames.push_back(one);
  }
  return frames;
}

TEST(MovingEnd, is_the_line_through_all_frames) {
  const double mean_age = 3.5, squares_of_age = 42;  // of 0..7; about the mean
  for (const double per_frame : {-1.0, 0.0, 0.5, 1.25}) {
    const auto end = moving_end(seen_at(-3, per_frame, 0), kRadius_px, false);
    ASSERT_TRUE(end) << per_frame;
    EXPECT_NEAR(end->behind, -3, 1e-9) << per_frame;
    EXPECT_NEAR(end->per_frame, per_frame, 0.01) << per_frame;
    EXPECT_NEAR(end->motion_sd, kEnd_px * mean_age / std::sqrt(squares_of_age), 0.05) << per_frame;
  }
}

TEST(MovingEnd, moves_as_it_is_known_to) {
  const auto end = moving_end(seen_at(-4, 0, 1.5), kRadius_px, true);
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->behind, -4, 1e-9);
  EXPECT_EQ(end->per_frame, 0);
  EXPECT_NEAR(end->motion_sd, 0, 1e-6);
}

TEST(MovingEnd, is_not_told_where_it_moves_too_fast) {
  EXPECT_FALSE(moving_end(seen_at(-11, 3.5, 0), kRadius_px, false));
}

// A needle that widens towards the right border, and a speck darker than its walls a little way below it, in
// one half of the strip that is looked at.
TEST(NarrowTube, is_not_wider_for_a_dark_speck_beside_it) {
  constexpr double kHalf_px = 11, kWidens = 0.025, kNoise = 2, kHalf_most_off_px = 2;
  constexpr int kWide = 727, kHigh = 300;
  constexpr double kAxis_y = 150.3;
  for (const double speck_x : {673.0, 710.0}) {
    cv::Mat m(kHigh, kWide, CV_32F, cv::Scalar(150));
    for (int y = 0; y < kHigh; ++y) {
      for (int x = 460; x < kWide; ++x) {
        const double u = std::abs(y - kAxis_y), half = kHalf_px - kWidens * (kWide - x);
        const bool speck = std::hypot(x - speck_x, y - kAxis_y - 24) < 6;
        m.at<float>(y, x) -= (std::abs(u - half + 1.5) < 1.5 ? 40.0F : 0.0F) + (speck ? 120.0F : 0.0F);
      }
    }
    cv::GaussianBlur(m, m, cv::Size(0, 0), 1.1);
    std::mt19937 random(3);
    std::normal_distribution<float> normal(0, kNoise);
    for (auto it = m.begin<float>(); it != m.end<float>(); ++it) {
      *it += normal(random);
    }
    m.convertTo(m, CV_8U);
    GradientField field;
    field.compute(m, {0, 0, kWide, kHigh}, kSigma_px);
    const auto tube = narrow_tube_at_border(field, Border::right, 3, 60, kNoise, true);
    ASSERT_TRUE(tube) << speck_x;
    EXPECT_NEAR(tube->half_width, kHalf_px, kHalf_most_off_px) << speck_x;
    EXPECT_NEAR(tube->root.y, kAxis_y, kHalf_most_off_px) << speck_x;
  }
}

// Behind the cell lies the holding pipette, whose bore may look like a needle out of focus.
TEST(NarrowTube, ends_where_it_is_not_seen_though_a_pipette_like_it_goes_on_behind) {
  constexpr double kTip_px = 230, kGoesOn_px = 216, kAxis_y = 100, kHalf_px = 9;
  constexpr int kWide = 400, kHigh = 200;
  for (const bool pipette : {false, true}) {
    cv::Mat picture(kHigh, kWide, CV_8U);
    for (int y = 0; y < kHigh; ++y) {
      for (int x = 0; x < kWide; ++x) {
        const bool glass = x > kTip_px || (pipette && x < kGoesOn_px);
        const double off = std::abs(y - kAxis_y) - kHalf_px;
        picture.at<std::uint8_t>(y, x) =
            static_cast<std::uint8_t>(150 - (glass ? 40 * std::exp(-off * off / 8) : 0));
      }
    }
    GradientField field;
    field.compute(picture, {0, 0, kWide, kHigh}, kSigma_px);
    const auto section = narrow_tube_at_border(field, Border::right, 3, 60, 1, false);
    ASSERT_TRUE(section);
    NarrowTubeTrace trace(*section);
    for (int part = 0; part < 50 && !trace.advance(field); ++part) {
    }
    const auto tube = trace.tube(field);
    ASSERT_TRUE(tube) << pipette;
    EXPECT_NEAR(tube->root.x - tube->length, kTip_px, 12) << pipette;
  }
}

}  // namespace
}  // namespace gathered
