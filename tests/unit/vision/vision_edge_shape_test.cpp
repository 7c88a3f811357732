// The contour by the common shape of its edge, on rings drawn here by area sampling and blurred by OpenCV:
// the true radius is that of the drawing, before any blur.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vision/image/polar_contour.hpp"
#include "vision/membrane/edge_shape.hpp"

namespace {

using namespace punctum::vision;

constexpr int kSide = 240, kAngles = 256;
const Point kMiddle{118.3, 121.6};

struct Ring {
  double R = 75, wall = 5.6;  // px, of the outer face; 30 grey levels darker than the ground
  double gap = 0;             // px between the wall's inner face and a dark body; 0: no body
  double nearer = 0;          // px by which the gap is narrower at angle 0
  double blur = 1.2, noise = 0;
  double ripple = 0;  // px, of the outline, three times round
  double fade = 0;    // the contrast varies by this share round the cell
  double dimple = 0;  // px, at angle 0
  double slope = 0;   // grey levels per px of the ground
  double halo = 0;    // grey levels: a bright lobe, 4 px wide, outside of the wall
};

double outline(const Ring& ring, double t) {
  const double u = std::atan2(std::sin(t), std::cos(t)) / 0.13;
  return ring.R + ring.ripple * std::cos(3 * t) - ring.dimple * std::exp(-u * u / 2);
}

double gap_at(const Ring& ring, double t) {
  const double u = std::atan2(std::sin(t), std::cos(t)) / 0.25;
  return ring.gap - ring.nearer * std::exp(-u * u / 2);
}

cv::Mat drawn(const Ring& ring) {
  cv::Mat m(kSide, kSide, CV_32F);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      double sum = 0;
      for (int k = 0; k < 64; ++k) {
        const Point d = Point(x + (k % 8 + 0.5) / 8 - 0.5, y + (k / 8 + 0.5) / 8 - 0.5) - kMiddle;
        const double t = std::atan2(d.y, d.x), r = cv::norm(d) - outline(ring, t);
        const double contrast = 1 + ring.fade * std::cos(t);
        const bool body = ring.gap > 0 && r < -ring.wall - gap_at(ring, t);
        sum += r > 0 && r < 4 ? ring.halo * (1 - std::cos(std::numbers::pi * r / 2)) / 2 / 64 : 0;
        sum += (body ? -25 : r < 0 && r > -ring.wall ? -30 : r < 0 ? -8 : 0) * contrast / 64;
      }
      m.at<float>(y, x) = static_cast<float>(150 + ring.slope * (x - kMiddle.x) + sum);
    }
  }
  cv::GaussianBlur(m, m, cv::Size(0, 0), ring.blur);
  return m;
}

ClearedPicture noisy(const cv::Mat& m, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  ClearedPicture out;
  out.grey.create(kSide, kSide, CV_8U);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      out.grey.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(static_cast<double>(m.at<float>(y, x)) + noise * normal(random));
    }
  }
  out.covered = cv::Mat::zeros(kSide, kSide, CV_8U);
  out.noise = std::max(noise, 0.3);
  return out;
}

ClearedPicture picture_with(const Ring& ring) { return noisy(drawn(ring), ring.noise, 1); }

// What a search hands over: about right, and wavy.
Contour rough(const Ring& ring, double offset, double waves) {
  Vector<double> r(kAngles);
  for (int i = 0; i < kAngles; ++i) {
    const double t = polar_angle(i, kAngles);
    r[static_cast<std::size_t>(i)] = outline(ring, t) + offset + waves * std::sin(29 * t);
  }
  return from_polar(kMiddle, r);
}

std::optional<SeenOutline> place_edge(const ClearedPicture& picture, const Contour& contour,
                                      const Vector<double>& soft, const EdgeShape& edge) {
  EdgeLearnt learnt;
  return shaped_edge(picture, contour, soft, edge, learnt);
}

struct Error {
  double mean = 0, rms = 0, largest = 0;  // px
};
Error error_against(const Contour& contour, const Ring& ring) {
  Error e;
  const auto n = static_cast<double>(contour.size());
  for (const Point& p : contour) {
    const Point d = p - kMiddle;
    const double off = cv::norm(d) - outline(ring, std::atan2(d.y, d.x));
    e.mean += off / n;
    e.rms += off * off / n;
    e.largest = std::max(e.largest, std::abs(off));
  }
  e.rms = std::sqrt(e.rms);
  return e;
}

const Vector<double> kNowhereSoft(kAngles, 0.0);
EdgeShape wall_of(double px) {
  EdgeShape edge;
  edge.nearby = {-px, 0.15 * px};
  return edge;
}

TEST(EdgeShape, of_a_thin_wall_out_of_focus_is_not_shifted_by_its_other_face) {
  for (const double blur : {1.2, 2.5}) {
    const Ring ring{.blur = blur, .noise = 0.5};
    const auto found = place_edge(picture_with(ring), rough(ring, 0.8, 0.3), kNowhereSoft, wall_of(5.6));
    ASSERT_TRUE(found) << blur;
    // Of a step of sd s on a circle of radius R the middle of the blurred edge moves inwards by s^2 / 2R.
    EXPECT_NEAR(error_against(found->contour, ring).mean, -blur * blur / (2 * ring.R), 0.04) << blur;
    EXPECT_LT(error_against(found->contour, ring).rms, 0.08) << blur;
  }
}

// The bound of Cramer and Rao for a contour with K free modes over the length L, at 30 grey levels and a blur
// of 1.2 px with the pixel's own: 0.344 sqrt(K / L) px per 5 grey levels of noise.
TEST(EdgeShape, averages_the_noise_out_round_the_cell) {
  const double modes = 2 * 12 + 1;
  const Ring ring{.ripple = 1.5};
  const cv::Mat clean = drawn(ring);
  for (const double noise : {2.0, 5.0, 10.0, 20.0}) {
    double square = 0;
    constexpr int kPictures = 6;
    for (unsigned seed = 1; seed <= kPictures; ++seed) {
      const auto found =
          place_edge(noisy(clean, noise, seed), rough(ring, -0.5, 0.5), kNowhereSoft, wall_of(5.6));
      ASSERT_TRUE(found) << noise;
      square += std::pow(error_against(found->contour, ring).rms, 2) / kPictures;
    }
    const double bound = 0.344 * noise / 5 * std::sqrt(modes / (2 * std::numbers::pi * 75));
    EXPECT_LT(std::sqrt(square), std::hypot(1.7 * bound, 0.03)) << noise;
  }
}

// What is handed over wanders from one side of the edge to the other, as a path does when focus or light
// change.
TEST(EdgeShape, of_the_last_frame_follows_a_contour_that_wanders) {
  const Ring ring{.noise = 2, .ripple = 1.5};
  const cv::Mat clean = drawn(ring);
  EdgeLearnt learnt;
  constexpr int kFrames = 31;
  for (int k = 0; k < kFrames; ++k) {
    const auto found =
        shaped_edge(noisy(clean, ring.noise, 1 + static_cast<unsigned>(k)),
                    rough(ring, -1.5 + 3.0 * k / (kFrames - 1), 0.3), kNowhereSoft, wall_of(5.6), learnt);
    ASSERT_TRUE(found) << k;
    EXPECT_LT(error_against(found->contour, ring).rms, 0.1) << k;
  }
}

// Granules of 1.8 px, as in a yolk.
cv::Mat granular(const cv::Mat& m, double sd, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat grains(kSide, kSide, CV_32F);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      grains.at<float>(y, x) = static_cast<float>(normal(random));
    }
  }
  cv::GaussianBlur(grains, grains, cv::Size(0, 0), 1.8);
  grains *= sd * 2 * std::sqrt(std::numbers::pi) * 1.8;           // what the blur has left of a sd of 1
  cv::circle(grains, cv::Point(118, 122), 66, cv::Scalar(0), 8);  // the wall is smooth
  return m + grains;
}

TEST(EdgeShape, says_by_how_much_each_point_may_be_off) {
  const Ring ring{.ripple = 1.5};
  const cv::Mat smooth = drawn(ring);
  for (const double grains : {0.0, 6.0}) {
    for (const double noise : {2.0, 5.0, 10.0, 20.0}) {
      double points = 0, within_one = 0, within_two = 0, square = 0, said = 0;
      EdgeLearnt learnt;
      for (unsigned seed = 1; seed <= 8; ++seed) {
        const cv::Mat clean = granular(smooth, grains, 100 + seed);
        const auto found = shaped_edge(noisy(clean, noise, seed), rough(ring, -0.5, 0.5), kNowhereSoft,
                                       wall_of(5.6), learnt);
        ASSERT_TRUE(found) << noise;
        for (std::size_t i = 0; i < found->contour.size(); ++i) {
          const Point d = found->contour[i] - kMiddle;
          const double off = std::abs(cv::norm(d) - outline(ring, std::atan2(d.y, d.x)));
          const double sd = std::sqrt(found->variance[i]);
          points += 1;
          within_one += off < sd;
          within_two += off < 1.96 * sd;
          square += off * off;
          said += found->variance[i];
          ASSERT_GE(found->variance[i], found->lasting[i]);
        }
      }
      EXPECT_GT(within_one / points, 0.6) << noise << ' ' << grains;
      EXPECT_GT(within_two / points, 0.9) << noise << ' ' << grains;
      EXPECT_LT(said / square, 4) << noise << ' ' << grains;
    }
  }
}

// Granules that the blur has widened make waves that are as long as those of an outline in focus.
TEST(EdgeShape, of_a_granular_body_is_smoother_out_of_focus) {
  constexpr double kNoise = 3, kLeft = 3;  // of the granules' contrast, times that in focus
  const Ring ring{.gap = 6, .blur = 2.8, .ripple = 1};
  const cv::Mat clean = drawn(ring);
  Ring body = ring;
  body.R = ring.R - ring.wall - ring.gap;
  EdgeShape edge;
  edge.inside = 6;
  edge.outside = 5;
  edge.modes = 9;
  edge.nearby = {6, 0};
  double even = 0, smoother = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    cv::Mat grains = granular(cv::Mat::zeros(kSide, kSide, CV_32F), 8, 40 + seed);
    cv::GaussianBlur(grains, grains, cv::Size(0, 0), ring.blur);
    const ClearedPicture picture = noisy(clean + kLeft * grains, kNoise, seed);
    for (const bool granular_body : {false, true}) {
      edge.granular = granular_body;
      const auto found = place_edge(picture, rough(body, -0.5, 0.2), kNowhereSoft, edge);
      ASSERT_TRUE(found) << seed << ' ' << granular_body;
      (granular_body ? smoother : even) += std::pow(error_against(found->contour, body).rms, 2);
    }
  }
  EXPECT_LT(smoother, 0.8 * even);
}

// The same granules under another noise: what differs is the part that does not last.
TEST(EdgeShape, tells_what_the_next_frame_repeats_from_what_it_tells_anew) {
  const Ring ring;
  for (const double grains : {0.0, 6.0}) {
    constexpr double kNoise = 5;
    const cv::Mat clean = granular(drawn(ring), grains, 7);
    double between = 0, said = 0;
    constexpr int kPairs = 12;
    for (unsigned k = 0; k < kPairs; ++k) {
      const auto a =
          place_edge(noisy(clean, kNoise, 2 * k + 1), rough(ring, 0.3, 0), kNowhereSoft, wall_of(5.6));
      const auto b =
          place_edge(noisy(clean, kNoise, 2 * k + 2), rough(ring, 0.3, 0), kNowhereSoft, wall_of(5.6));
      ASSERT_TRUE(a && b);
      for (std::size_t i = 0; i < a->contour.size(); ++i) {
        between += std::pow(cv::norm(a->contour[i] - kMiddle) - cv::norm(b->contour[i] - kMiddle), 2) / 2;
        said += a->variance[i] - a->lasting[i];
      }
    }
    EXPECT_NEAR(said / between, 1, 0.5) << grains;
  }
}

TEST(EdgeShape, is_not_shifted_by_a_halo) {
  for (const double halo : {15.0, 25.0}) {
    const Ring ring{.noise = 2, .halo = halo};
    const auto found = place_edge(picture_with(ring), rough(ring, 0.8, 0.3), kNowhereSoft, wall_of(5.6));
    ASSERT_TRUE(found) << halo;
    EXPECT_LT(std::abs(error_against(found->contour, ring).mean), 0.3) << halo;  // px: a quarter of a um
  }
}

TEST(EdgeShape, stays_where_it_is_under_uneven_contrast_and_light) {
  const Ring ring{.noise = 1, .fade = 0.5, .slope = 0.08};
  const auto found = place_edge(picture_with(ring), rough(ring, 0.6, 0.3), kNowhereSoft, wall_of(5.6));
  ASSERT_TRUE(found);
  EXPECT_LT(error_against(found->contour, ring).largest, 0.25);
}

TEST(EdgeShape, is_not_pulled_by_a_speck_on_the_edge) {
  const Ring ring{.noise = 2};
  ClearedPicture picture = picture_with(ring);
  cv::circle(picture.grey, cv::Point(static_cast<int>(kMiddle.x), static_cast<int>(kMiddle.y - ring.R - 3)),
             4, cv::Scalar(95), cv::FILLED);
  const auto found = place_edge(picture, rough(ring, 0.5, 0.3), kNowhereSoft, wall_of(5.6));
  ASSERT_TRUE(found);
  EXPECT_LT(error_against(found->contour, ring).largest, 0.5);
  EXPECT_LT(error_against(found->contour, ring).rms, 0.12);
}

// As along the face of a holding pipette: a dark line that comes near the edge and touches it.
TEST(EdgeShape, is_not_pulled_by_a_line_beside_the_edge) {
  const Ring ring{.noise = 2};
  ClearedPicture picture = picture_with(ring);
  const int x = static_cast<int>(kMiddle.x - ring.R - 4);
  cv::line(picture.grey, {x, 60}, {x, 180}, cv::Scalar(90), 3);
  const auto found = place_edge(picture, rough(ring, 0.4, 0), kNowhereSoft, wall_of(5.6));
  ASSERT_TRUE(found);
  EXPECT_LT(error_against(found->contour, ring).rms, 0.15);
}

TEST(EdgeShape, keeps_a_dimple_where_the_membrane_may_have_any_shape) {
  const Ring ring{.noise = 2, .dimple = 8};
  Vector<double> soft(kAngles);
  for (int i = 0; i < kAngles; ++i) {
    soft[static_cast<std::size_t>(i)] = angle_between(polar_angle(i, kAngles), 0) < 0.9 ? 1 : 0;
  }
  const ClearedPicture picture = picture_with(ring);
  const auto kept = place_edge(picture, rough(ring, 0.4, 0), soft, wall_of(5.6));
  ASSERT_TRUE(kept);
  EXPECT_LT(error_against(kept->contour, ring).largest, 0.6);
}

TEST(EdgeShape, of_a_body_is_not_shifted_by_the_wall_around_it) {
  const Ring ring{.gap = 4, .blur = 1.8, .noise = 0.5};
  Ring body = ring;
  body.R = ring.R - ring.wall - ring.gap;
  EdgeShape edge;
  edge.inside = 6;
  edge.outside = 5;
  edge.nearby = {4, 0};
  const auto found = place_edge(picture_with(ring), rough(body, -0.5, 0.2), kNowhereSoft, edge);
  ASSERT_TRUE(found);
  EXPECT_NEAR(error_against(found->contour, body).mean, 0, 0.08);
}

// As in a dimple, where the wall comes nearer to the body that it dents.
TEST(EdgeShape, of_a_body_is_not_shifted_where_the_wall_is_nearer_than_elsewhere) {
  const Ring ring{.gap = 5, .nearer = 2.5, .blur = 1.5, .noise = 0.5};
  const ClearedPicture picture = picture_with(ring);
  Vector<double> soft(kAngles);
  Contour face, begun, body;
  for (int i = 0; i < kAngles; ++i) {
    const double t = polar_angle(i, kAngles), in = ring.R - ring.wall;
    soft[static_cast<std::size_t>(i)] = angle_between(t, 0) < 0.9 ? 1 : 0;
    face.push_back(on_ray(kMiddle, i, kAngles, in));
    body.push_back(on_ray(kMiddle, i, kAngles, in - gap_at(ring, t)));
    begun.push_back(on_ray(kMiddle, i, kAngles, in - gap_at(ring, t) - 0.3));
  }
  EdgeShape edge;
  edge.inside = 6;
  edge.outside = 5;
  edge.modes = 9;
  edge.nearby = {5, 0};
  const auto error_at_0 = [&](const EdgeShape& how) {
    EdgeLearnt learnt;
    std::optional<SeenOutline> found;
    for (int frame = 0; frame < 5; ++frame) {
      found = shaped_edge(picture, begun, soft, how, learnt);
    }
    return found ? cv::norm(found->contour[0] - body[0]) : 99;
  };
  const double plain = error_at_0(edge);
  edge.nearby_face = face;
  EXPECT_LT(error_at_0(edge), 0.3);
  EXPECT_LT(error_at_0(edge), 0.6 * plain) << plain;
}

TEST(EdgeShape, is_none_where_there_is_no_edge_or_too_little_of_it) {
  Ring none{.noise = 5};
  ClearedPicture empty = picture_with(none);
  cv::randn(empty.grey, 150, 5);
  EXPECT_FALSE(place_edge(empty, rough(none, 0, 0), kNowhereSoft, wall_of(5.6)));

  ClearedPicture hidden = picture_with(none);
  hidden.covered(cv::Rect(0, 0, kSide, 180)) = 255;
  EXPECT_FALSE(place_edge(hidden, rough(none, 0, 0), kNowhereSoft, wall_of(5.6)));
}

}  // namespace
