// Dilation and labelling on masks drawn by hand, impurities, and the recoil of the membrane on scripted
// motion.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "vision/events/contact.hpp"
#include "vision/events/puncture.hpp"
#include "vision/image/circle.hpp"
#include "vision/image/impurities.hpp"

namespace {

using namespace punctum::vision;

struct Masks {
  cv::Mat binary{100, 200, CV_8U, cv::Scalar(0)}, needle{100, 200, CV_8U, cv::Scalar(0)},
      cell{100, 200, CV_8U, cv::Scalar(0)};
};

// A cell's right-hand edge at x = 80 and a needle of two walls that ends at `tip`.
Masks needle_and_cell(int tip) {
  Masks m;
  m.binary(cv::Rect(80, 20, 2, 60)).setTo(255);
  m.cell(cv::Rect(80, 20, 2, 60)).setTo(255);
  m.binary(cv::Rect(tip, 45, 200 - tip, 2)).setTo(255);
  m.binary(cv::Rect(tip, 49, 200 - tip, 2)).setTo(255);
  m.needle(cv::Rect(tip, 45, 200 - tip, 6)).setTo(255);
  return m;
}

TEST(Contact, begins_when_the_classes_of_needle_and_cell_merge) {
  for (int tip = 100; tip > 76; --tip) {
    const Masks m = needle_and_cell(tip);
    const Classes c = merge_classes(m.binary, m.needle, m.cell, 4);
    EXPECT_GT(c.needle, 0);
    EXPECT_GT(c.cell, 0);
    EXPECT_EQ(c.merged, tip <= 82) << tip;  // vertical dilation does not reach sideways; diagonals touch
  }
}

TEST(Contact, vertical_dilation_joins_the_needles_two_walls) {
  const Masks m = needle_and_cell(120);
  cv::Mat one = m.needle.clone();
  one(cv::Rect(0, 47, 200, 10)).setTo(0);  // only the upper wall is marked as needle
  cv::Mat lower = m.needle.clone();
  lower(cv::Rect(0, 0, 200, 49)).setTo(0);
  EXPECT_FALSE(merge_classes(m.binary, one, lower, 0).merged);
  EXPECT_TRUE(merge_classes(m.binary, one, lower, 4).merged);
}

// An element of n rows closes gaps of up to n - 1 rows; of the paper's 4 rows, 3.
TEST(Contact, joins_over_as_many_rows_as_the_element_is_high_less_one) {
  for (const int rows : {1, 2, 3, 4, 5}) {
    for (int gap = 0; gap <= 6; ++gap) {
      cv::Mat upper(40, 40, CV_8U, cv::Scalar(0)), lower = upper.clone();
      upper(cv::Rect(5, 10, 30, 2)).setTo(255);
      lower(cv::Rect(5, 12 + gap, 30, 2)).setTo(255);
      EXPECT_EQ(merge_classes(upper | lower, upper, lower, rows).merged, gap <= rows - 1)
          << rows << " " << gap;
    }
  }
}

// A tip that comes by `step` px a frame. It is measured with a scatter of `sd` px, and said to be known to
// `told_sd`.
struct Approach {
  std::mt19937 random;
  double sd, told_sd, step;
  Approach(unsigned seed, double sd_px, double told_px, double step_px)
      : random(seed), sd(sd_px), told_sd(told_px), step(step_px) {}
  // Frames from the one in which the tip passes the membrane to that in which contact is told.
  int told_after() {
    std::normal_distribution<double> scatter(0, sd);
    ContactTest contact;
    const double from = 20 * step + std::uniform_real_distribution<double>(0, step)(random);
    for (int k = 0; k < 60; ++k) {
      if (contact.update(from - step * k + scatter(random), told_sd, step)) {
        return k - static_cast<int>(std::ceil(from / step));
      }
    }
    return 60;
  }
};

TEST(Contact, is_told_within_a_frame_of_a_needle_that_moves_a_pixel_a_frame) {
  for (const auto& [sd, told_sd] : {std::pair(0.1, 0.1), {0.2, 0.2}, {0.3, 0.3}, {0.3, 0.8}}) {
    int within = 0;
    for (unsigned seed = 0; seed < 1000; ++seed) {
      const int after = Approach(seed, sd, told_sd, 1).told_after();
      within += after >= -1 && after <= 1;
    }
    EXPECT_GE(within, 990) << sd << " " << told_sd;
  }
}

TEST(Contact, is_not_told_of_a_needle_that_waits_outside) {
  for (const double sd : {0.1, 0.5, 2.0}) {
    std::mt19937 random(3);
    std::normal_distribution<double> scatter(0, sd);
    ContactTest waits, is_due;
    constexpr double kSystematic_px = 0.2;
    const double away = 3 * std::hypot(sd, kSystematic_px);
    int told = 0, told_due = 0;
    for (int k = 0; k < 10000; ++k) {  // three deviations away
      const double off = scatter(random);
      told += waits.update(3 * sd + off, sd, 0);
      told_due += is_due.update(away + off, sd, 100);  // one gap in 740 is seen inside
    }
    EXPECT_EQ(told, 0) << sd;
    EXPECT_LE(told_due, 20) << sd;
  }
}

TEST(Contact, needs_more_frames_where_the_gap_is_less_certain_and_one_frame_may_be_wrong) {
  const auto frames_until_told = [](double sd) {
    ContactTest contact;
    constexpr double kAway = -10;  // px per frame: it is never due
    contact.update(20, sd, kAway);
    int n = 1;
    while (n < 100 && !contact.update(-1.5, sd, kAway)) {
      ++n;
    }
    return n;
  };
  EXPECT_EQ(frames_until_told(0.2), 1);
  EXPECT_GT(frames_until_told(2), 2);
  EXPECT_LT(frames_until_told(2), 20);
  ContactTest contact;
  for (int k = 0; k < 20; ++k) {
    contact.update(8, 1, 0.5);
  }
  EXPECT_FALSE(contact.update(-1, 1, 0.5));  // a glitch: it was too far to touch by now
  EXPECT_FALSE(contact.update(8, 1, 0.5));
  for (int k = 0; k < 20; ++k) {
    contact.update(-6, 1, 0);
  }
  EXPECT_TRUE(contact.update(1.2, 1, 0));  // a glitch
  EXPECT_TRUE(contact.update(-6, 1, 0));
  EXPECT_FALSE(contact.update(8, 1, 0));  // and this is none
}

TEST(Contact, is_not_found_in_empty_pictures) {
  EXPECT_FALSE(merge_classes(cv::Mat(), cv::Mat(), cv::Mat(), 4).merged);
  const cv::Mat none(10, 10, CV_8U, cv::Scalar(0));
  const Classes c = merge_classes(none, none, none, 4);
  EXPECT_EQ(c.needle, 0);
  EXPECT_FALSE(c.merged);
}

TEST(Impurities, are_small_components_away_from_the_membrane) {
  cv::Mat binary(120, 120, CV_8U, cv::Scalar(0));
  Vector<PixelRun> pixels;
  cv::circle(binary, {60, 60}, 30, cv::Scalar(255), 2);
  binary(cv::Rect(5, 5, 6, 6)).setTo(255);    // impurity
  binary(cv::Rect(88, 58, 4, 4)).setTo(255);  // touches the membrane
  binary.at<std::uint8_t>(100, 10) = 255;     // noise
  const Contour membrane = circle_contour({{60, 60}, 30, 0}, 128);
  EXPECT_EQ(find_impurities(binary, {membrane}, 20, 6, 4, pixels), 1);
  EXPECT_EQ(std::accumulate(pixels.begin(), pixels.end(), 0,
                            [](int n, const PixelRun& run) { return n + run.to - run.from; }),
            36);
  EXPECT_EQ(find_impurities(cv::Mat(), {}, 20, 6, 4, pixels), 0);
}

TEST(Components, touch_at_corners_and_join_from_both_sides) {
  const auto drawn = [](const Vector<std::string>& rows) {
    cv::Mat m(static_cast<int>(rows.size()), static_cast<int>(rows[0].size()), CV_8U, cv::Scalar(0));
    for (int y = 0; y < m.rows; ++y) {
      for (int x = 0; x < m.cols; ++x) {
        m.at<std::uint8_t>(y, x) =
            rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#' ? 255 : 0;
      }
    }
    return m;
  };
  EXPECT_EQ(components_of(drawn({"#...", ".#..", "..#.", "...#"})).box.size(), 1u);
  EXPECT_EQ(components_of(drawn({"..#", ".#.", "#.."})).box.size(), 1u);
  EXPECT_EQ(components_of(drawn({"#..#", "#..#", ".##."})).box.size(), 1u);
  const Components two = components_of(drawn({"##..#", "....#", "##.##"}));
  ASSERT_EQ(two.box.size(), 3u);
  EXPECT_EQ(two.box[1], cv::Rect(3, 0, 2, 3));
  EXPECT_EQ(two.pixels[1], 4);
}

// Against OpenCV's, on random pictures.
TEST(Components, are_those_of_another_labelling) {
  std::mt19937 random(1);
  for (int k = 0; k < 60; ++k) {
    cv::Mat m(17 + k % 5, 23, CV_8U);
    for (int y = 0; y < m.rows; ++y) {
      for (int x = 0; x < m.cols; ++x) {
        m.at<std::uint8_t>(y, x) = random() % 100 < static_cast<unsigned>(15 + k) ? 255 : 0;
      }
    }
    cv::Mat labels, stats, centres;
    const int n = cv::connectedComponentsWithStats(m, labels, stats, centres, 8, CV_32S);
    const Components all = components_of(m);
    ASSERT_EQ(all.box.size(), static_cast<std::size_t>(n - 1)) << k;
    for (const PixelRun& run : all.runs) {
      const int label = labels.at<int>(run.y, run.from);
      EXPECT_EQ(all.pixels[run.component], stats.at<int>(label, cv::CC_STAT_AREA));
      EXPECT_EQ(all.box[run.component].width, stats.at<int>(label, cv::CC_STAT_WIDTH));
      EXPECT_EQ(all.box[run.component].tl(),
                cv::Point(stats.at<int>(label, cv::CC_STAT_LEFT), stats.at<int>(label, cv::CC_STAT_TOP)));
    }
  }
}

// 40 ms frames; depth of tip and membrane past the undeformed membrane, px.
struct Script {
  Puncture puncture{1.5};
  std::int64_t t = 0;
  bool step(double tip, double membrane, bool contact = true, bool free = false, double recoil = 0) {
    PunctureInput in;
    in.free = free;
    in.recoil = recoil;
    in.t_ns = t;
    t += 40'000'000;
    in.contact = contact;
    in.points = contact;
    in.tip_px = tip;
    in.gap_px = -tip;
    in.membrane_px = membrane;
    in.depth_px = membrane;
    in.radius_px = 4.6;
    return puncture.update(in);
  }
  // Ten free frames, then the needle pushes the membrane `depth` px deep at 0.5 px a frame.
  void push(double depth) {
    for (int i = 0; i < 10; ++i) {
      step(-5, 0, false);
    }
    for (double d = 0; d <= depth; d += 0.5) {
      EXPECT_FALSE(step(d, 0.95 * d)) << d;
    }
  }
};

// Whether a puncture is still told of a needle that lies so far outside, after frames in which it was not
// seen.
bool told_outside(int unseen, double gap_px, int frames) {
  Script s;
  s.push(20);
  for (int i = 0; i < 4; ++i) {
    s.step(21, 2);
  }
  EXPECT_TRUE(s.puncture.punctured());
  for (int i = 0; i < unseen; ++i) {
    PunctureInput in;
    in.t_ns = s.t += 40'000'000;
    (void)s.puncture.update(in);
  }
  EXPECT_TRUE(s.puncture.punctured());
  for (int i = 0; i < frames; ++i) {
    s.step(-gap_px, 0, false);
  }
  return s.puncture.punctured();
}

TEST(Puncture, is_over_when_the_needle_has_left_the_cell) {
  EXPECT_FALSE(told_outside(0, 9.5, 1));
  EXPECT_TRUE(told_outside(0, 8, 5));  // its membrane may still hang on it
  EXPECT_FALSE(told_outside(0, 8, 15));
  EXPECT_FALSE(told_outside(30, 8, 1));  // it has been away
  EXPECT_TRUE(told_outside(5, 8, 1));
  EXPECT_TRUE(told_outside(30, -8, 1));
  EXPECT_TRUE(told_outside(30, 2, 15));
}

TEST(Puncture, is_the_recoil_of_the_membrane_while_the_needle_goes_on) {
  Script s;
  s.push(20);
  EXPECT_GT(s.puncture.membrane_velocity_px_s(), 0);
  bool seen = false;
  int frames = 0;
  for (double d = 19; d > 0.5; d *= std::exp(-1.0), ++frames) {  // recoil, time constant one frame
    seen = s.step(20.5 + 0.5 * frames, d * std::exp(-1.0));
    if (frames == 0) {
      EXPECT_LT(s.puncture.membrane_velocity_px_s(), 0);
    }
    if (seen) {
      break;
    }
  }
  EXPECT_TRUE(seen);
  EXPECT_LE(frames, 1);  // by the second frame
}

TEST(Puncture, is_not_a_withdrawal_that_the_membrane_follows) {
  Script s;
  s.push(20);
  for (double d = 20; d > 0; d -= 1) {
    EXPECT_FALSE(s.step(d, 0.95 * d)) << d;
  }
}

TEST(Puncture, is_not_one_mistaken_contact_point) {
  Script s;
  s.push(20);
  EXPECT_FALSE(s.step(20, 8));
  EXPECT_FALSE(s.step(20, 19));
  EXPECT_FALSE(s.step(20, 40));  // far ahead of the needle
  EXPECT_FALSE(s.step(20, 19));
  EXPECT_FALSE(s.step(20, 19));
}

TEST(Puncture, is_told_at_once_where_the_picture_beside_the_needle_shows_it_too) {
  Script s, alone;
  s.push(20);
  alone.push(20);
  EXPECT_TRUE(s.step(20.5, 8, true, true));
  EXPECT_FALSE(alone.step(20.5, 8));
  Script held;
  held.push(20);
  for (int k = 0; k < 100; ++k) {  // the picture alone, while the contact points move with the needle
    EXPECT_FALSE(held.step(20, 18.7, true, true)) << k;
  }
}

TEST(Puncture, is_told_of_a_membrane_that_went_back_while_the_needle_was_not_seen) {
  Script s;
  s.push(20);
  PunctureInput hidden;
  hidden.t_ns = s.t;
  hidden.contact = true;
  EXPECT_FALSE(s.puncture.update(hidden));
  EXPECT_FALSE(s.step(21, 5));
  EXPECT_TRUE(s.step(21.5, 4));
}

// Scatter as large as it says, while a membrane is held for 10 000 frames.
TEST(Puncture, is_not_the_scatter_of_the_contact_points) {
  std::mt19937 random(5);
  for (const double depth : {4.0, 8.0, 20.0}) {
    Script s;
    std::normal_distribution<double> scatter(0, std::min(0.7, depth / 12));
    s.push(depth);
    int told = 0;
    for (int k = 0; k < 10000; ++k) {
      told += s.step(depth, 0.95 * depth + scatter(random));
    }
    EXPECT_EQ(told, 0) << depth;
  }
}

TEST(Puncture, lasts_until_the_needle_is_outside_and_then_the_next_one_is_detected) {
  Script s;
  s.push(20);
  s.step(20, 3);
  ASSERT_TRUE(s.step(20, 2));
  for (double d = 20; d > -9; d -= 1) {
    EXPECT_TRUE(s.step(d, std::min(d, 1.0), d > 0)) << d;
  }
  EXPECT_FALSE(s.step(-12, 0, false));
  s.push(10);
}

TEST(Puncture, is_also_a_tip_deep_inside_an_undented_membrane) {
  Script s;
  EXPECT_TRUE(s.step(40, 2));  // the first frame shows it
  Script late;
  for (int i = 0; i < 20; ++i) {
    late.step(-5, 0, false);
  }
  late.step(0, 0);
  EXPECT_FALSE(late.step(40, 2));
  EXPECT_FALSE(late.step(40, 2));
  EXPECT_TRUE(late.step(40, 2));
}

// Contact points that lie far behind the tip are mistaken where the membrane has not gone back; but not for
// ever: what did not show it go back may have missed it.
TEST(Puncture, is_not_told_by_contact_points_while_the_picture_shows_that_the_membrane_has_not_gone_back) {
  constexpr double kNotBack = -5;
  Script s, alone;
  s.push(20);
  alone.push(20);
  bool told = false;
  for (int k = 0; k < 10; ++k) {
    EXPECT_FALSE(s.step(20, 5, true, false, kNotBack)) << k;
    told = alone.step(20, 5);
  }
  EXPECT_TRUE(told);
  for (int k = 0; k < 10; ++k) {
    told = s.step(20, 5, true, false, kNotBack);
  }
  EXPECT_TRUE(told);
  Script pushed;
  pushed.push(10);
  for (int k = 0; k < 100; ++k) {
    EXPECT_FALSE(pushed.step(10, 5, true, false, kNotBack)) << k;
  }
}

TEST(Puncture, is_told_at_once_by_a_membrane_that_clearly_goes_back_whatever_the_contact_points_say) {
  Script clear, doubtful, outside;
  for (Script* s : {&clear, &doubtful, &outside}) {
    s->push(20);
  }
  EXPECT_TRUE(clear.step(20.5, 20, true, false, 25));
  for (int k = 0; k < 100; ++k) {
    EXPECT_FALSE(doubtful.step(20.5, 19.5, true, false, 4)) << k;
  }
  EXPECT_FALSE(outside.step(-5, 0, false, false, 25));  // nothing touches it
  PunctureInput unseen;
  unseen.t_ns = doubtful.t;
  unseen.contact = true;
  unseen.recoil = 25;
  EXPECT_TRUE(doubtful.puncture.update(unseen));  // no contact points in this frame
}

TEST(InnerPuncture, is_a_contour_that_recoiled_far_behind_the_tip_in_two_frames_of_a_punctured_cell) {
  InnerPuncture inner;
  const double radius = 4.6;
  const InnerOnNeedle pushed{2, 50}, behind{-6, 50};
  const InnerOnNeedle recoiled{InnerPuncture::least_behind_px(radius) + 1, 40};
  EXPECT_FALSE(inner.update(false, recoiled, radius));  // the outer membrane holds
  EXPECT_FALSE(inner.update(false, recoiled, radius));
  for (int k = 0; k < 10; ++k) {  // it lies on the tip, or is not followed
    EXPECT_FALSE(inner.update(true, k % 2 == 0 ? pushed : behind, radius));
    EXPECT_FALSE(inner.update(true, std::nullopt, radius));
  }
  EXPECT_FALSE(inner.update(true, recoiled, radius));  // one frame may be mistaken
  EXPECT_FALSE(inner.update(true, pushed, radius));
  EXPECT_FALSE(inner.update(true, recoiled, radius));
  EXPECT_TRUE(inner.update(true, recoiled, radius));
  EXPECT_TRUE(inner.update(true, std::nullopt, radius));  // stays
  EXPECT_FALSE(inner.update(false, recoiled, radius));    // the needle is clear of the cell
  EXPECT_FALSE(inner.update(true, recoiled, radius));
}

TEST(InnerPuncture, is_not_a_tip_that_is_seen_too_far_ahead_of_a_membrane_it_still_pushes) {
  InnerPuncture inner;
  const double radius = 4.6, least = InnerPuncture::least_behind_px(radius);
  for (int k = 0; k < 30; ++k) {
    EXPECT_FALSE(inner.update(true, InnerOnNeedle{least + 1, 50.0 + 0.5 * k}, radius)) << k;
  }
}

TEST(InnerPuncture, of_a_membrane_that_gave_way_undented_is_told_when_the_tip_is_twice_as_far_past_it) {
  InnerPuncture inner;
  const double radius = 4.6, least = InnerPuncture::least_behind_px(radius);
  EXPECT_FALSE(inner.update(true, InnerOnNeedle{2 * least - 0.1, 50}, radius));
  EXPECT_FALSE(inner.update(true, InnerOnNeedle{2 * least + 0.1, 50}, radius));
  EXPECT_TRUE(inner.update(true, InnerOnNeedle{2 * least + 0.1, 50}, radius));
}

}  // namespace
