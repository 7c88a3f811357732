// The paper's own method, on cells whose picture is a closed form: rings of grey levels with blurred edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "tests/support/pictures.hpp"
#include "vision/events/velocity_reversal.hpp"
#include "vision/membrane/contact_points.hpp"
#include "vision/membrane/snakes.hpp"
#include "vision/tracker.hpp"

namespace {

using namespace punctum;
using namespace punctum::vision;
using test::frame_of;

constexpr int kWide = 320, kHigh = 280;
constexpr double kLens_px = 1.2;

struct RoundCell {
  Point centre{160, 140};
  double R = 74, zona = 5.6, gap = 6;  // px
  // A straight edge, blurred by the lens: the normal distribution function.
  [[nodiscard]] double grey(double x, double y) const {
    const double r = std::hypot(x - centre.x, y - centre.y);
    const auto inside = [r](double edge) {
      return 0.5 * std::erfc((r - edge) / (kLens_px * std::sqrt(2.0)));
    };
    return 150 - 30 * inside(R) + 22 * inside(R - zona) - 25 * inside(R - zona - gap);
  }
};

cv::Mat picture_of(const RoundCell& cell, double noise = 0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> n(0, 1);
  cv::Mat m(kHigh, kWide, CV_8U);
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      m.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(cell.grey(x, y) + noise * n(random));
    }
  }
  return m;
}

// The paper's method, and a picture with a cell and nothing else.
VisionConfig config_of_the_cell_alone() {
  VisionConfig config;
  config.method = Method::paper;
  config.needle = false;
  config.holder.reset();
  return config;
}

double worst_distance(const Contour& c, const RoundCell& cell) {
  double worst = 0;
  for (const Point& p : c) {
    worst = std::max(worst, std::abs(cv::norm(p - cell.centre) - cell.R));
  }
  return worst;
}

double rms_distance(const Contour& c, const RoundCell& cell) {
  double sum = 0;
  for (const Point& p : c) {
    sum += std::pow(cv::norm(p - cell.centre) - cell.R, 2) / static_cast<double>(c.size());
  }
  return std::sqrt(sum);
}

ClearedPicture cleared(const cv::Mat& m, const Vector<Polygon>& pipettes) {
  ClearedPicture p;
  EXPECT_EQ(p.load(frame_of(m), m.cols, m.rows), "");
  p.compute_gradient({0, 0, m.cols, m.rows});
  p.cover(pipettes);
  (void)p.cover_impurities({}, 5 * p.gradient_noise, 30);
  return p;
}

// 80 % of round cells without noise: the paper's share of success with 16 nodes. Success is an error below 2
// px everywhere.
TEST(PaperMethod, finds_the_outer_face_of_round_cells_as_often_as_the_paper_says) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-12, 12), radius(66, 80), gap(4, 8);
  int right = 0, cells = 0;
  for (; cells < 25; ++cells) {
    const RoundCell cell{
        .centre = {160 + at(random), 140 + at(random)}, .R = radius(random), .gap = gap(random)};
    Tracker tracker(config_of_the_cell_alone(), kWide, kHigh);
    const Membrane& outer = tracker.process(frame_of(picture_of(cell))).outer;
    right += outer.ok && outer.nodes.size() == 16 && worst_distance(outer.contour, cell) < 2;
  }
  EXPECT_GE(right, cells * 8 / 10);
}

// Published for a greedy snake of 16 nodes with a spline at a noise of 5 grey levels: 1.14 um rms.
TEST(PaperMethod, errs_no_more_than_its_published_error_at_noise_five) {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    const RoundCell cell{.centre = {160.3, 139.6}, .R = 70 + 2.3 * seed};
    Tracker tracker(config_of_the_cell_alone(), kWide, kHigh);
    const Membrane& outer = tracker.process(frame_of(picture_of(cell, 5, seed))).outer;
    ASSERT_TRUE(outer.ok) << seed;
    EXPECT_LT(rms_distance(outer.contour, cell) * 0.825, 1.14) << seed;
  }
}

// Eq. 3 written out, with each term normalised over the neighbourhood as Williams and Shah do.
TEST(PaperMethod, comes_to_rest_where_equation_three_with_the_squared_gradient_is_least) {
  const RoundCell cell;
  const VisionConfig config = config_of_the_cell_alone();
  const ClearedPicture picture = cleared(picture_of(cell, 8, 3), {});
  FollowedMembrane m;
  m.known = true;
  m.centre = cell.centre;
  m.r.assign(256, cell.R + 1);
  m.nodes = circle_contour({cell.centre, cell.R + 1, 0}, 16);
  const Contour v = follow_snake(m, picture, config, {}).nodes;
  ASSERT_EQ(v.size(), 16U);
  double spacing = 0;
  for (std::size_t i = 0; i < 16; ++i) {
    spacing += cv::norm(v[(i + 1) % 16] - v[i]) / 16;
  }
  const double noise2 = std::pow(4 * picture.gradient_noise, 2);
  int least = 0;
  for (std::size_t i = 0; i < 16; ++i) {
    const Point before = v[(i + 15) % 16], after = v[(i + 1) % 16];
    Vector<double> elastic, bending, gradient2;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        const Point p = v[i] + Point(dx, dy);
        const Point vss = before - 2 * p + after;
        elastic.push_back(std::abs(spacing - cv::norm(p - before)));
        bending.push_back(vss.dot(vss));
        const Point g = picture.field.gradient(p);
        gradient2.push_back(g.dot(g));
      }
    }
    const auto top = [](const Vector<double>& e) { return *std::max_element(e.begin(), e.end()); };
    const double high = top(gradient2),
                 low = std::min(*std::min_element(gradient2.begin(), gradient2.end()), high - noise2);
    Vector<double> total;
    for (std::size_t k = 0; k < 25; ++k) {
      total.push_back(0.6 * elastic[k] / top(elastic) + 0.5 * bending[k] / top(bending) -
                      1.2 * (gradient2[k] - low) / (high - low));
    }
    least += total[12] <= *std::min_element(total.begin(), total.end()) + 1e-3;
  }
  EXPECT_GE(least, 15);  // one node may still move when it stops
}

// Where the picture is erased, eq. 3 has the bending left: between two nodes the least bent curve is the
// cubic spline, which leaves a circle by a thousandth of its radius only. A node that is moved alone goes to
// the chord of its neighbours, 5.6 px inside.
TEST(PaperMethod, bridges_an_erased_arc_instead_of_shrinking_there) {
  const RoundCell cell;
  const VisionConfig config = config_of_the_cell_alone();
  const Polygon pipette{{231, 128}, {320, 128}, {320, 152}, {231, 152}};  // over the node at angle 0
  const ClearedPicture picture = cleared(picture_of(cell), {pipette});
  FollowedMembrane m;
  m.known = true;
  m.centre = cell.centre;
  m.r.assign(256, cell.R);
  m.nodes = circle_contour({cell.centre, cell.R, 0}, 16);
  for (int frame = 0; frame < 5; ++frame) {
    const Membrane seen = follow_snake(m, picture, config, {});
    ASSERT_TRUE(seen.ok);
    EXPECT_NEAR(seen.visible, 15 / 16.0, 1e-9);
    EXPECT_LT(worst_distance(seen.contour, cell), 1.2) << frame;  // whole pixels, on the nodes beside the arc
    EXPECT_NEAR(cv::norm(m.nodes[0] - cell.centre), cell.R, 1.2) << frame;
  }
}

TEST(PaperMethod, passes_through_the_contact_points) {
  const RoundCell cell;
  const ClearedPicture picture = cleared(picture_of(cell), {});
  FollowedMembrane m;
  m.known = true;
  m.centre = cell.centre;
  m.r.assign(256, cell.R);
  m.nodes = circle_contour({cell.centre, cell.R, 0}, 16);
  ContactPoints contact;
  contact.point = {Point(224, 131), Point(224, 149)};  // 10 px inside the circle
  const Membrane seen = follow_snake(m, picture, config_of_the_cell_alone(), contact);
  ASSERT_TRUE(seen.ok);
  for (const auto& p : contact.point) {
    double nearest = 1e9;
    for (const Point& q : seen.contour) {
      nearest = std::min(nearest, cv::norm(q - *p));
    }
    EXPECT_LT(nearest, 1.5);  // half the distance of two points of the contour
  }
}

// A line at the distance u from the centre of a circle meets it sqrt(R^2 - u^2) from the foot of the centre.
TEST(ContactPoints, are_where_the_lines_beside_the_needle_enter_the_circle) {
  const RoundCell cell;
  const ClearedPicture picture = cleared(picture_of(cell, 2), {});
  NeedlePose needle;
  needle.ok = true;
  needle.tip = {250, 145};
  needle.axis = {-1, 0};
  needle.half_width = 5;
  const Contour last =
      circle_contour({cell.centre, cell.R - 4, 0}, 256);  // a frame ago, or a snake that lags
  const ContactPoints seen = contact_points(picture, needle, last, 6);
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_TRUE(seen.point[k]) << k;
    const Point p = *seen.point[k];
    EXPECT_NEAR(std::abs(p.y - 145), 7.5, 1e-9);  // 2.5 px beside the edge
    EXPECT_NEAR(p.x, cell.centre.x + std::sqrt(cell.R * cell.R - std::pow(p.y - cell.centre.y, 2)), 0.4);
    EXPECT_NEAR(seen.behind_tip[k], p.x - 250, 1e-9);
  }
  const ContactPoints none = contact_points(picture, needle, circle_contour({{160, 40}, 20, 0}, 64), 6);
  EXPECT_FALSE(none.point[0] || none.point[1]);  // the lines do not meet that contour
}

// 40 ms frames; places of the membrane and of the tip along the needle's axis, px.
struct Frames {
  VelocityReversal reversal{1.5};
  std::int64_t t = 0;
  bool step(double membrane, double tip, bool contact = true) {
    t += 40'000'000;
    return reversal.update(contact, MembraneAtNeedle{t, {-membrane, 0}, {-tip, 0}, {-1, 0}});
  }
  void push(double depth) {
    for (double d = 0; d <= depth; d += 1) {
      EXPECT_FALSE(step(d, d)) << d;
    }
  }
};

TEST(VelocityReversal,
     is_a_puncture_in_the_first_frame_in_which_the_membrane_goes_back_and_the_needle_does_not) {
  Frames s;
  s.push(12);
  EXPECT_DOUBLE_EQ(s.reversal.membrane_velocity_px_s(), 25);  // 1 px in 40 ms
  EXPECT_TRUE(s.step(7, 13));
  EXPECT_DOUBLE_EQ(s.reversal.membrane_velocity_px_s(), -125);
  EXPECT_TRUE(s.step(7, 14));  // it lasts
  EXPECT_TRUE(s.reversal.update(true, std::nullopt));
  EXPECT_FALSE(s.step(0, -5, false));  // until they touch no longer
  s.push(12);
  EXPECT_TRUE(s.step(9, 12));  // and the next one is told
}

TEST(VelocityReversal, does_not_forget_the_push_while_the_classes_part_over_a_deep_dimple) {
  Frames s;
  s.push(12);
  EXPECT_FALSE(s.step(13, 14, false));  // the contact points still lie behind the tip
  EXPECT_FALSE(s.step(14, 15, false));
  EXPECT_TRUE(s.step(9, 15, false));
}

TEST(VelocityReversal, is_no_puncture_when_the_membrane_follows_a_needle_that_withdraws) {
  Frames s;
  s.push(12);
  for (double d = 12; d > 0; d -= 2) {
    EXPECT_FALSE(s.step(d, d)) << d;
  }
}

TEST(VelocityReversal, is_no_puncture_of_a_membrane_that_was_not_pushed_or_moves_less_than_the_limit) {
  Frames rest;
  EXPECT_FALSE(rest.step(10, 10));
  EXPECT_FALSE(rest.step(6, 10));
  Frames slow;
  slow.push(12);
  for (double d = 12; d > 0; d -= 1.4) {
    EXPECT_FALSE(slow.step(d, 12)) << d;
  }
}

}  // namespace
