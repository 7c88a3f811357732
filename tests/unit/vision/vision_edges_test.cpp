// Circle start and sub-pixel closed edges on discs drawn here by area sampling, blurred by OpenCV: an
// independent picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vision/image/cheapest_path.hpp"
#include "vision/image/closed_path.hpp"
#include "vision/image/hough_circles.hpp"
#include "vision/image/noise.hpp"
#include "vision/image/periodic_smoothing.hpp"
#include "vision/image/polar_contour.hpp"

namespace {

using namespace punctum::vision;

// radius(angle) of a dark body on a bright ground, 8x8 samples per pixel.
template <class Radius>
cv::Mat draw(int size, const Point& centre, Radius radius, double blur, double noise, unsigned seed) {
  cv::Mat m(size, size, CV_32F);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      int in = 0;
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) {
          const Point d = Point(x + (i + 0.5) / 8 - 0.5, y + (j + 0.5) / 8 - 0.5) - centre;
          in += cv::norm(d) < radius(std::atan2(d.y, d.x));
        }
      }
      m.at<float>(y, x) = 150 - 40 * static_cast<float>(in) / 64;
    }
  }
  cv::GaussianBlur(m, m, cv::Size(0, 0), blur);
  std::mt19937 random(seed);
  std::normal_distribution<float> n(0, static_cast<float>(std::max(noise, 1e-6)));
  cv::Mat out(size, size, CV_8U);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      out.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(m.at<float>(y, x) + n(random));
    }
  }
  return out;
}

GradientField field_of(const cv::Mat& grey) {
  GradientField f;
  f.compute(grey, cv::Rect(0, 0, grey.cols, grey.rows), 1.2);
  return f;
}

// All of them, one by one.
float cheapest_by_trial(const Vector<float>& cost, int angles, int samples, const Vector<float>& bend) {
  float least = 1e9F;
  const int reach = static_cast<int>(bend.size()) - 1;
  Vector<int> path(static_cast<std::size_t>(angles), 0);
  const auto go_on = [&](const auto& self, int i, float so_far) -> void {
    const auto at = [&](int k) { return path[static_cast<std::size_t>(k)]; };
    if (i == angles) {
      const int turn = std::abs(at(angles - 1) - at(0));
      least = turn <= reach ? std::min(least, so_far + bend[static_cast<std::size_t>(turn)]) : least;
      return;
    }
    const int from = i == 0 ? 0 : std::max(0, at(i - 1) - reach),
              to = i == 0 ? samples - 1 : std::min(samples - 1, at(i - 1) + reach);
    for (int j = from; j <= to; ++j) {
      path[static_cast<std::size_t>(i)] = j;
      const float turn = i == 0 ? 0 : bend[static_cast<std::size_t>(std::abs(j - at(i - 1)))];
      self(self, i + 1, so_far + turn + cost[static_cast<std::size_t>(i * samples + j)]);
    }
  };
  go_on(go_on, 0, 0);
  return least;
}

TEST(CheapestPath, costs_no_more_than_any_other_that_closes) {
  constexpr int kRound = 8, kWide = 9;
  const Vector<float> bend{0, 0.3F, 0.9F};
  std::mt19937 random(5);
  std::uniform_int_distribution<int> any(0, 1000);
  for (int trial = 0; trial < 20; ++trial) {
    Vector<float> cost(kRound * kWide);
    std::generate(cost.begin(), cost.end(), [&] { return 0.001F * static_cast<float>(any(random)); });
    // Far cheaper somewhere in one row: every closed path goes through it.
    cost[static_cast<std::size_t>(kRound / 2 * kWide + trial % kWide)] = -20;
    const auto path = cheapest_closed_path(cost, kRound, kWide, bend);
    float sum = 0;
    for (int i = 0; i < kRound; ++i) {
      const int here = path[static_cast<std::size_t>(i)],
                next = path[static_cast<std::size_t>((i + 1) % kRound)];
      ASSERT_LT(static_cast<std::size_t>(std::abs(here - next)), bend.size()) << trial;
      sum += cost[static_cast<std::size_t>(i * kWide + here)] +
             bend[static_cast<std::size_t>(std::abs(here - next))];
    }
    EXPECT_NEAR(sum, cheapest_by_trial(cost, kRound, kWide, bend), 1e-4F) << trial;
  }
}

TEST(Noise, is_estimated_within_a_tenth_in_a_picture_with_edges) {
  for (const double sigma : {2.0, 5.0, 10.0, 20.0}) {
    const cv::Mat m = draw(260, {128, 131}, [](double) { return 70.0; }, 1.2, sigma, 7);
    EXPECT_NEAR(noise_level(m, 1), sigma, 0.1 * sigma);
  }
  EXPECT_EQ(noise_level(cv::Mat(2, 2, CV_8U, cv::Scalar(7))), 0);
}

TEST(HoughCircles, find_centre_and_radius_of_a_disc_at_every_noise) {
  for (const double sigma : {0.5, 2.0, 5.0, 10.0, 20.0}) {
    const cv::Mat m = draw(300, {141.4, 157.7}, [](double) { return 66.0; }, 1.2, sigma, 11);
    const GradientField f = field_of(m);
    const auto c = find_circles(f, {}, 4 * f.noise_of_gradient(noise_level(m)), 42, 97, 3);
    ASSERT_FALSE(c.empty()) << sigma;
    EXPECT_NEAR(c[0].circle.centre.x, 141.4, 1.0) << sigma;
    EXPECT_NEAR(c[0].circle.centre.y, 157.7, 1.0) << sigma;
    EXPECT_NEAR(c[0].circle.r, 66, 1.0) << sigma;
    EXPECT_GT(c[0].score, 0.9) << sigma;
  }
}

TEST(HoughCircles, find_nothing_in_noise_or_on_a_blocked_disc) {
  const cv::Mat noise = draw(200, {-900, -900}, [](double) { return 1.0; }, 1.2, 5, 3);
  const GradientField f = field_of(noise);
  for (const auto& c : find_circles(f, {}, 4 * f.noise_of_gradient(5), 42, 90, 3)) {
    EXPECT_LT(c.score, 0.5);
  }
  const cv::Mat disc = draw(200, {100, 100}, [](double) { return 60.0; }, 1.2, 1, 3);
  EXPECT_TRUE(find_circles(field_of(disc), cv::Mat(200, 200, CV_8U, cv::Scalar(255)), 1, 42, 90, 3).empty());
  EXPECT_TRUE(find_circles(field_of(disc), {}, 1, 90, 42, 3).empty());  // an empty range
}

TEST(ClosedPath, follows_a_dimpled_body_to_a_tenth_of_a_pixel_without_noise) {
  const Point centre(130.2, 126.9);
  const auto radius = [](double t) {
    const double u = t / 0.35;
    return 72.0 - 9 * std::exp(-0.5 * u * u);
  };
  for (const double sigma : {0.0, 2.0, 5.0}) {
    const cv::Mat m = draw(260, centre, radius, 1.2, sigma, 5);
    const GradientField f = field_of(m);
    EdgeBand band;
    band.centre = {131, 128};
    band.middle.assign(256, 70);
    band.half_width = 16;
    const double gn = f.noise_of_gradient(std::max(noise_level(m), 0.3));
    const EdgePath p = closed_path(f, band, Polarity::brighter_out, 3 * gn, 0);
    ASSERT_EQ(p.r.size(), 256u);
    EXPECT_GT(p.support, 0.98);
    EXPECT_DOUBLE_EQ(p.visible, 1);
    double ss = 0;
    for (const Point& q : from_polar(band.centre, p.r)) {
      const Point d = q - centre;
      const double e = cv::norm(d) - radius(std::atan2(d.y, d.x));
      ss += e * e / 256;
    }
    // Bound of the ideal estimate at 5 grey levels is 0.06 px; the blurred disc itself is biased by 0.02 px.
    EXPECT_LT(std::sqrt(ss), sigma < 1 ? 0.1 : sigma < 4 ? 0.15 : 0.25) << sigma;
  }
}

TEST(ClosedPath, follows_the_given_sign_and_bridges_hidden_arcs) {
  const Point centre(100, 100);
  const cv::Mat m = draw(200, centre, [](double) { return 60.0; }, 1.2, 2, 9);
  const GradientField f = field_of(m);
  EdgeBand band;
  band.centre = centre;
  band.middle.assign(256, 58);
  band.half_width = 10;
  const double floor = 3 * f.noise_of_gradient(2);
  EXPECT_LT(closed_path(f, band, Polarity::darker_out, floor, 4).support, 0.5);
  band.covered = cv::Mat::zeros(m.size(), CV_8U);
  band.covered.colRange(141, 200).setTo(255);
  const EdgePath p = closed_path(f, band, Polarity::brighter_out, floor, 4);
  EXPECT_LT(p.visible, 0.8);
  EXPECT_GT(p.support, 0.95);
  for (const double r : p.r) {
    EXPECT_NEAR(r, 60, 0.6);
  }
}

TEST(ClosedPath, passes_through_its_anchors_and_stays_below_its_limits) {
  const Point centre(100, 100);
  const cv::Mat m = draw(200, centre, [](double) { return 60.0; }, 1.2, 1, 9);
  EdgeBand band;
  band.centre = centre;
  band.middle.assign(256, 58);
  band.half_width = 10;
  band.slope = 3;
  band.stiffness = 0.1;
  band.anchors = {{0, 52.0}};
  EdgePath p = closed_path(field_of(m), band, Polarity::brighter_out, 1, 4);
  EXPECT_NEAR(p.r[0], 52, 1.0);
  EXPECT_NEAR(p.r[128], 60, 0.2);
  band.anchors = {{254, 52.0}, {255, 52.0}, {0, 52.0}, {1, 52.0}, {2, 52.0}};  // a flat end face
  p = closed_path(field_of(m), band, Polarity::brighter_out, 1, 4);
  for (const std::size_t i : {254, 255, 0, 1, 2}) {
    EXPECT_NEAR(p.r[i], 52, 0.5);
  }
  EXPECT_NEAR(p.r[128], 60, 0.2);
  band.anchors.clear();
  band.upper.assign(256, 1e9);
  band.upper[10] = 57;
  p = closed_path(field_of(m), band, Polarity::brighter_out, 1, 4);
  EXPECT_LE(p.r[10], 57);
}

TEST(PeriodicSmoothing, equals_the_dense_solution_of_its_normal_equations) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(0, 1);
  const int n = 40;
  Vector<double> r(n), w(n), s(n);
  for (std::size_t i = 0; i < n; ++i) {
    r[i] = 50 + 3 * u(random);
    w[i] = u(random) < 0.2 ? 0 : u(random);
    s[i] = 20 * u(random);
  }
  cv::Mat a = cv::Mat::zeros(n, n, CV_64F), b = cv::Mat::zeros(n, 1, CV_64F), x;
  for (int i = 0; i < n; ++i) {
    a.at<double>(i, i) += w[static_cast<std::size_t>(i)];
    b.at<double>(i) += w[static_cast<std::size_t>(i)] * r[static_cast<std::size_t>(i)];
    const int id[3] = {(i + n - 1) % n, i, (i + 1) % n};
    const double d[3] = {1, -2, 1};
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        a.at<double>(id[p], id[q]) += s[static_cast<std::size_t>(i)] * d[p] * d[q];
      }
    }
  }
  ASSERT_TRUE(cv::solve(a, b, x, cv::DECOMP_SVD));
  const auto y = smooth_periodic(r, w, s);
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(y[static_cast<std::size_t>(i)], x.at<double>(i), 1e-5);
  }
  const cv::Mat inverse = a.inv(cv::DECOMP_SVD);
  const auto variance = variance_of_smoothing(w, s);
  ASSERT_EQ(variance.size(), r.size());
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(variance[static_cast<std::size_t>(i)] / inverse.at<double>(i, i), 1, 1e-5) << i;
  }
}

}  // namespace
