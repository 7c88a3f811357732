// Eq. 1 against its definition, summed by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vision/image/correlation.hpp"
#include "vision/image/registration.hpp"
#include "vision/pipettes/drifting_place.hpp"
#include "vision/pipettes/holding_pipette.hpp"
#include "vision/pipettes/wide_tube.hpp"

namespace {

using namespace punctum::vision;

cv::Mat noise_picture(int w, int h, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat m(h, w, CV_8U);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      m.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random() % 256);
    }
  }
  return m;
}

TEST(NormalisedCorrelation, equals_equation_one_at_every_place) {
  const cv::Mat window = noise_picture(23, 19, 1), pattern = noise_picture(7, 5, 2);
  const cv::Mat map = correlation_map(window, pattern);
  ASSERT_EQ(map.cols, 17);
  ASSERT_EQ(map.rows, 15);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      double mi = 0, mm = 0, ii = 0;
      for (int v = 0; v < pattern.rows; ++v) {
        for (int u = 0; u < pattern.cols; ++u) {
          const double m = pattern.at<std::uint8_t>(v, u), i = window.at<std::uint8_t>(y + v, x + u);
          mi += m * i;
          mm += m * m;
          ii += i * i;
        }
      }
      EXPECT_NEAR(static_cast<double>(map.at<float>(y, x)), mi / std::sqrt(mm * ii), 1e-5);
    }
  }
}

TEST(NormalisedCorrelation, does_not_depend_on_the_global_luminosity) {
  const cv::Mat pattern = noise_picture(8, 8, 3);
  cv::Mat window = noise_picture(30, 30, 4) / 2;
  cv::Mat half;
  pattern.convertTo(half, CV_8U, 0.5);
  half.copyTo(window(cv::Rect(11, 7, 8, 8)));
  const auto p = peak(correlation_map(window, pattern));
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->at.x, 11, 0.3);
  EXPECT_NEAR(p->at.y, 7, 0.3);
  EXPECT_GT(p->score, 0.999);
}

TEST(NormalisedCorrelation, of_a_template_that_does_not_fit_is_empty) {
  EXPECT_TRUE(correlation_map(noise_picture(5, 5, 1), noise_picture(6, 3, 2)).empty());
  EXPECT_TRUE(correlation_map(cv::Mat(), noise_picture(3, 3, 2)).empty());
  EXPECT_FALSE(peak(cv::Mat()));
}

TEST(Peak, is_sub_pixel_on_a_parabola) {
  cv::Mat map(9, 9, CV_32F);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) {
      map.at<float>(y, x) = static_cast<float>(1 - 0.01 * std::pow(x - 4.3, 2) - 0.02 * std::pow(y - 3.8, 2));
    }
  }
  const auto p = peak(map);
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->at.x, 4.3, 1e-4);
  EXPECT_NEAR(p->at.y, 3.8, 1e-4);
}

// Smooth blobs of known place under light that changes across the picture: drawn anew for every shift.
cv::Mat blobs(const Point& shift, double gain, double slope, unsigned seed, double noise) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, std::max(noise, 1e-9));
  const Point places[] = {{40, 35}, {52, 61}, {70, 40}, {61, 52}, {44, 70}};
  cv::Mat m(110, 120, CV_8U);
  for (int y = 0; y < m.rows; ++y) {
    for (int x = 0; x < m.cols; ++x) {
      double grey = 0;
      for (const Point& p : places) {
        const Point d = Point(x, y) - p - shift;
        grey += (p.x > 60 ? -35 : 30) * std::exp(-d.dot(d) / 30);
      }
      m.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(gain * grey + 130 + slope * (x - 60) + normal(random));
    }
  }
  return m;
}

TEST(Registration, tells_hundredths_of_a_pixel_under_uneven_light) {
  const cv::Rect box(30, 25, 52, 56);
  Registration pattern(blobs({}, 1, 0, 1, 0)(box), 0);
  for (const Point& shift : {Point(0, 0), Point(0.3, -0.4), Point(-0.85, 0.5), Point(1.4, 1.1)}) {
    for (const double gain : {0.6, 1.0, 1.3}) {
      const cv::Mat seen = blobs(shift, gain, 0.1, 2, 0);
      const auto place = pattern.place(seen, Point(box.x + std::round(shift.x), box.y + std::round(shift.y)));
      ASSERT_TRUE(place) << shift << gain;
      EXPECT_NEAR(place->corner.x, box.x + shift.x, 0.05) << shift << gain;
      EXPECT_NEAR(place->corner.y, box.y + shift.y, 0.05) << shift << gain;
    }
  }
}

TEST(Registration, knows_how_well_it_knows) {
  const cv::Rect box(30, 25, 52, 56);
  constexpr double kNoise = 6;
  Registration pattern(blobs({}, 1, 0, 1, kNoise)(box), kNoise);
  double ss = 0, sd = 0;
  constexpr int kPictures = 60;
  Point mean;
  std::vector<Point> corners;
  for (unsigned i = 0; i < kPictures; ++i) {
    const auto place = pattern.place(blobs({}, 1, 0, 100 + i, kNoise), box.tl());
    ASSERT_TRUE(place);
    corners.push_back(place->corner);
    mean += place->corner / kPictures;
    sd += place->sd / kPictures;
  }
  for (const Point& c : corners) {
    ss += (c - mean).dot(c - mean) / (2 * kPictures);
  }
  // The noise of the pattern itself is the same in all.
  EXPECT_GT(sd, 0.7 * std::sqrt(ss));
  EXPECT_LT(sd, 3 * std::sqrt(ss));
}

TEST(Registration, claims_nothing_where_there_is_nothing_or_along_an_edge) {
  const cv::Rect box(30, 25, 52, 56);
  EXPECT_FALSE(
      Registration(cv::Mat(56, 52, CV_8U, cv::Scalar(90)), 0).place(blobs({}, 1, 0, 1, 0), box.tl()));
  EXPECT_FALSE(
      Registration(blobs({}, 1, 0, 1, 0)(box), 0).place(cv::Mat(110, 120, CV_8U, cv::Scalar(90)), box.tl()));
  EXPECT_FALSE(Registration(blobs({}, 1, 0, 1, 0)(box), 0).place(blobs({6, 0}, 1, 0, 1, 0), box.tl()));
  EXPECT_FALSE(Registration(blobs({}, 1, 0, 1, 0)(box), 0).place(blobs({}, 1, 0, 1, 0), {900, -300}));
  EXPECT_FALSE(Registration().place(blobs({}, 1, 0, 1, 0), box.tl()));
  cv::Mat stripes = noise_picture(110, 120, 5) / 32;  // of one edge along x, and noise
  stripes.rowRange(0, 60) += 120;
  const auto place =
      Registration(stripes(box), 2.3).place(stripes + noise_picture(110, 120, 6) / 32, box.tl());
  EXPECT_TRUE(!place || place->sd > 0.25);
}

// What is left of the noise in each of the frames from the 30th on, and how much of it the deviation covers.
struct Followed {
  double rms = 0, mean = 0, covered = 0;
};
Followed follow_place(const Point& drift, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> one(0, noise);
  DriftingPlace place;
  Followed f;
  constexpr int kFrames = 400, kFirst = 30;
  for (int k = 0; k < kFrames; ++k) {
    const Point truth = Point(100, 50) + k * drift;
    const auto [at, sd] = place.next(truth + Point(one(random), one(random)), noise);
    if (k >= kFirst) {
      for (const double e : {at.x - truth.x, at.y - truth.y}) {
        f.rms += e * e;
        f.mean += e;
        f.covered += std::abs(e) < sd ? 1 : 0;
      }
    }
  }
  constexpr double kSeen = 2 * (kFrames - kFirst);
  return {std::sqrt(f.rms / kSeen), f.mean / kSeen, f.covered / kSeen};
}

TEST(DriftingPlace, is_told_more_surely_than_by_one_picture_whether_it_drifts_or_not) {
  for (const Point& drift : {Point(0, 0), Point(0.3, 0), Point(-0.1, 0.25)}) {
    for (const double noise : {0.05, 0.3}) {
      const Followed f = follow_place(drift, noise, 7);
      EXPECT_LT(f.rms, 0.65 * noise) << drift << noise;
      EXPECT_LT(std::abs(f.mean), 0.1 * noise) << drift << noise << ": it lags";
      EXPECT_GT(f.covered, 0.6) << drift << noise;
    }
  }
}

TEST(DriftingPlace, that_jumps_is_followed_at_once) {
  DriftingPlace place;
  for (int k = 0; k < 50; ++k) {
    (void)place.next(Point(10, 10), 0.1);
  }
  const auto [at, sd] = place.next(Point(12, 10), 0.1);
  EXPECT_EQ(at, Point(12, 10));
  EXPECT_EQ(sd, 0.1);
}

TEST(DriftingPlace, that_is_not_seen_goes_on_and_is_less_sure) {
  DriftingPlace place;
  DriftingPlace::Place last;
  for (int k = 0; k < 50; ++k) {
    last = place.next(Point(0.2 * k, 0), 0.05);
  }
  for (int k = 50; k < 60; ++k) {
    place.unseen();
  }
  const auto [at, sd] = place.next(Point(0.2 * 60 + 0.1, 0), 0.05);
  EXPECT_NEAR(at.x, 12.05, 0.05) << "between what was expected and what is seen";
  EXPECT_GT(sd, last.sd);
}

TEST(HoldingPipette, is_followed_in_its_window_and_its_loss_is_reported) {
  // A scene of blocks, moved by whole pixels: the answer is exact.
  cv::Mat scene(120, 160, CV_8U, cv::Scalar(140));
  scene(cv::Rect(0, 40, 60, 8)).setTo(30);
  scene(cv::Rect(0, 72, 60, 8)).setTo(30);
  const auto moved = [&](int dx, int dy) {
    cv::Mat m(120, 160, CV_8U, cv::Scalar(140));
    const cv::Rect from(std::max(0, -dx), std::max(0, -dy), 160 - std::abs(dx), 120 - std::abs(dy));
    scene(from).copyTo(m(from + cv::Point(dx, dy)));
    return m;
  };
  HolderVision config;
  HoldingPipette holder(config);
  EXPECT_EQ(holder.find(scene).reason, "no template");
  holder.use_template(scene(cv::Rect(40, 34, 30, 52)));
  HolderPose fix = holder.find(scene);
  ASSERT_TRUE(fix.ok);
  const Point start = fix.mouth;
  for (int k = 1; k < 12; ++k) {  // in total further than one window
    fix = holder.find(moved(3 * k, -k));
    ASSERT_TRUE(fix.ok) << k;
    EXPECT_NEAR(fix.mouth.x - start.x, 3 * k, 0.05);
    EXPECT_NEAR(fix.mouth.y - start.y, -k, 0.05);
    EXPECT_GT(fix.score, 0.999);
  }
  fix = holder.find(cv::Mat(120, 160, CV_8U, cv::Scalar(140)));  // bright and empty: eq. 1 alone is near 1
  EXPECT_GT(fix.score, 0.8);
  EXPECT_FALSE(fix.ok);
  EXPECT_FALSE(fix.reason.empty());
}

// Two dark walls that end before a granular cell with a dark rim: the cell has edges where the walls would go
// on.
TEST(HoldingPipette, ends_at_the_cell_that_it_holds) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    constexpr double kEnd = 150;
    const cv::Point2d centre(kEnd + 70, 160);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    cv::Mat granules(320, 480, CV_64F);
    for (int y = 0; y < granules.rows; ++y) {
      for (int x = 0; x < granules.cols; ++x) {
        granules.at<double>(y, x) = 40 * normal(random);
      }
    }
    cv::GaussianBlur(granules, granules, cv::Size(0, 0), 2);
    cv::Mat m(granules.size(), CV_64F);
    for (int y = 0; y < m.rows; ++y) {
      for (int x = 0; x < m.cols; ++x) {
        const double r = cv::norm(cv::Point2d(x, y) - centre), wall = std::abs(std::abs(y - 160.0) - 48);
        double grey = 150;
        if (r < 72) {
          grey = r > 66 ? 118 : 125 + granules.at<double>(y, x);
        } else if (x < kEnd && wall < 1) {
          grey = 105;
        } else if (x < kEnd && std::abs(y - 160.0) < 48) {
          grey = 160;
        }
        if (seed % 2 == 0 && std::hypot((x - 60.0) / 7, (y - 106.0) / 5) < 1) {
          grey = 95;  // a speck beside its upper wall
        }
        m.at<double>(y, x) = grey;
      }
    }
    cv::GaussianBlur(m, m, cv::Size(0, 0), 1.2);
    cv::Mat grey(m.size(), CV_8U);
    for (int y = 0; y < m.rows; ++y) {
      for (int x = 0; x < m.cols; ++x) {
        grey.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(m.at<double>(y, x) + 4 * normal(random));
      }
    }
    GradientField field;
    field.compute(grey, cv::Rect(0, 0, grey.cols, grey.rows), 1.2);
    const Side left[] = {Side::left};
    const auto tube = find_holder_tube(field, left, 320, 97, 4);
    ASSERT_TRUE(tube) << seed;
    EXPECT_NEAR(tube->end().x, kEnd, 12) << seed;
    EXPECT_NEAR(tube->end_half_width, 48, 3) << seed;
  }
}

// A speck lies so far above it on the border that both fit into the largest width, but for the lower wall.
TEST(HoldingPipette, is_found_below_a_speck_on_the_border) {
  constexpr int kEnd = 150;
  cv::Mat grey(320, 480, CV_8U, cv::Scalar(150));
  for (const int wall : {112, 208}) {
    cv::line(grey, {0, wall}, {kEnd, wall}, cv::Scalar(105), 2);
  }
  cv::ellipse(grey, {12, 50}, {6, 4}, 0, 0, 360, cv::Scalar(110), cv::FILLED);
  cv::GaussianBlur(grey, grey, cv::Size(0, 0), 1.2);
  GradientField field;
  field.compute(grey, cv::Rect(0, 0, grey.cols, grey.rows), 1.2);
  const Side left[] = {Side::left};
  const auto tube = find_holder_tube(field, left, 320, 60, 1);
  ASSERT_TRUE(tube);
  EXPECT_NEAR(tube->root.y, 160, 3);
  EXPECT_NEAR(tube->end().x, kEnd, 12);
}

// A pipette far out of focus: both sides of it are slopes 60 px wide, as strong and straight as walls.
TEST(HoldingPipette, is_no_shadow) {
  cv::Mat grey(320, 480, CV_8U, cv::Scalar(150));
  cv::rectangle(grey, {0, 100}, {300, 220}, cv::Scalar(60), cv::FILLED);
  GradientField field;
  const Side left[] = {Side::left};
  const auto found_with_blur_of = [&](double blur_px) {
    cv::Mat blurred;
    cv::GaussianBlur(grey, blurred, cv::Size(0, 0), blur_px);
    field.compute(blurred, cv::Rect(0, 0, grey.cols, grey.rows), 1.2);
    return find_holder_tube(field, left, 320, 80, 1).has_value();
  };
  EXPECT_TRUE(found_with_blur_of(3));
  EXPECT_FALSE(found_with_blur_of(20));
}

// The edge of an ooplasm, twice as strong, lies 12 px from the face, where the walls ended 3 px short of it.
TEST(HoldingPipette, has_its_mouth_where_its_walls_end) {
  constexpr int kFace = 120;
  cv::Mat grey(200, 300, CV_8U, cv::Scalar(150));
  cv::rectangle(grey, {0, 60}, {kFace, 140}, cv::Scalar(115), cv::FILLED);
  cv::rectangle(grey, {kFace + 12, 40}, {260, 160}, cv::Scalar(80), cv::FILLED);
  GradientField field;
  field.compute(grey, cv::Rect(0, 0, grey.cols, grey.rows), 1.2);
  const auto face = end_face(field, {kFace - 3, 100}, {1, 0}, 24, 16, 1);
  ASSERT_TRUE(face);
  EXPECT_NEAR(*face, 3.5, 1);
}

}  // namespace
