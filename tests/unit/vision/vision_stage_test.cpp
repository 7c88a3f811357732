// Where the manipulator has the needle's tip: what the tracker makes of it, and where it comes from.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include "rt/station/station.hpp"
#include "tools/vision/live_stage.hpp"
#include "tools/vision/stage_poses.hpp"
#include "vision/pipettes/tip_by_stage.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum;
using vision::NeedlePose;
using vision::Point;
using vision::TipByStage;

NeedlePose seen_at(const Point& tip, double sd) {
  NeedlePose pose;
  pose.ok = true;
  pose.tip = tip;
  pose.sd = sd;
  pose.axis = {-1, 0};
  return pose;
}

// A needle that comes 1 px per frame and is seen with 0.2 px of noise; the stage is off by (40, -3) px.
class StageTip : public testing::Test {
 protected:
  void approach(int frames, double scatter_px = 0) {
    std::normal_distribution<double> noise(0, 0.2), scatter(0, scatter_px > 0 ? scatter_px : 1);
    for (int k = 0; k < frames; ++k) {
      x_ -= 1;
      told_.begin(Point(x_ - 40 + (scatter_px > 0 ? scatter(random_) : 0), 103));
      told_.learn(seen_at({x_ + noise(random_), 100}, 0.25));
    }
  }
  TipByStage told_;
  double x_ = 500;
  std::mt19937 random_{3};
};

TEST_F(StageTip, is_off_by_what_nothing_but_clear_frames_tell) {
  EXPECT_FALSE(told_.tip());
  approach(20);
  ASSERT_TRUE(told_.tip());
  EXPECT_NEAR(told_.tip()->x, x_, 0.15);
  EXPECT_NEAR(told_.tip()->y, 100, 0.15);
  ASSERT_TRUE(told_.moved());
  EXPECT_NEAR(told_.moved()->x, -1, 1e-12);
}

// No frame was seen while the needle went 300 px back: how far off the stage is, was learnt before.
TEST_F(StageTip, is_told_after_a_pause_wherever_the_needle_is_by_then) {
  approach(20);
  const double sd = told_.sd();
  told_.after_gap();
  x_ += 300;
  told_.begin(Point(x_ - 40, 103));
  EXPECT_FALSE(told_.moved());
  ASSERT_TRUE(told_.tip());
  EXPECT_NEAR(told_.tip()->x, x_, 0.2);
  EXPECT_GT(told_.sd(), sd) << "it may have drifted";
  told_.forget();
  EXPECT_FALSE(told_.tip());
  told_.learn(seen_at({x_, 100}, 0.25));
  ASSERT_TRUE(told_.tip()) << "where the stage is in this frame is still known";
  EXPECT_NEAR(told_.tip()->x, x_, 0.3);
}

// A needle whose walls end 0.8 px before its glass in every frame: stage and picture share that.
TEST_F(StageTip, is_no_more_certain_than_the_picture_that_it_was_learnt_from) {
  std::normal_distribution<double> noise(0, 0.2);
  const auto seen = [&] {
    NeedlePose pose = seen_at({x_ + noise(random_), 100}, std::hypot(0.25, 0.8));
    pose.constant_sd = 0.8;
    return pose;
  };
  for (int k = 0; k < 60; ++k) {
    x_ -= 1;
    told_.begin(Point(x_ - 40, 103));
    told_.learn(seen());
  }
  EXPECT_GT(told_.sd(), 0.8);
  EXPECT_LT(told_.sd(), 0.85);
  NeedlePose aside = seen();
  aside.tip.x = x_ + 1;
  const NeedlePose both = told_.most_likely(aside);
  EXPECT_NEAR(both.tip.x, x_, 0.25) << "what is the same in every frame gives the picture no less weight";
  EXPECT_GT(both.sd, 0.8);
}

TEST_F(StageTip, holds_against_a_picture_that_is_drawn_aside) {
  approach(20);
  for (int k = 0; k < 200; ++k) {
    told_.begin(Point(x_ - 40, 103));
    EXPECT_NEAR(told_.most_likely(seen_at({x_ + 3, 100}, 2)).tip.x, x_, 0.35) << k;
  }
}

// What crosses the tip in one frame is no sign that the stage scatters.
TEST_F(StageTip, holds_after_one_frame_that_is_far_off) {
  approach(20);
  told_.begin(Point(x_ - 40, 103));
  const NeedlePose doubtful = told_.most_likely(seen_at({x_ - 9, 100}, 0.25));
  EXPECT_GT(doubtful.sd, 6) << "one of the two is far off";
  told_.learn(seen_at({x_ - 9, 100}, 0.25));
  for (int k = 0; k < 5; ++k) {
    told_.begin(Point(x_ - 40, 103));
    EXPECT_NEAR(told_.most_likely(seen_at({x_ + 3, 100}, 0.25)).tip.x, x_, 0.6) << k;
  }
}

// 1.5 px from frame to frame: the picture is better where it is clear.
TEST_F(StageTip, counts_little_where_it_scatters) {
  approach(60, 1.5);
  told_.begin(Point(x_ - 40 + 3, 103));
  EXPECT_NEAR(told_.most_likely(seen_at({x_, 100}, 0.25)).tip.x, x_, 0.4);
}

TEST_F(StageTip, is_given_up_where_the_needle_has_slipped) {
  approach(20);
  Point last;
  for (int k = 0; k < 12; ++k) {
    told_.begin(Point(x_ - 40, 103));
    last = told_.most_likely(seen_at({x_ + 12, 100}, 2)).tip;
  }
  EXPECT_NEAR(last.x, x_ + 12, 1e-12);
  EXPECT_FALSE(told_.tip());
}

// Granules within a cell look like its end, 20 px away, where the manipulator goes on as before.
TEST_F(StageTip, shows_that_the_picture_strays_unless_the_manipulator_itself_has_jumped) {
  approach(20);
  const auto strays = [&](double stage_px, double seen_px) {
    told_.begin(Point(x_ - 40 + stage_px, 103));
    return told_.picture_strays(seen_at({x_ + seen_px, 100}, 0.5));
  };
  EXPECT_FALSE(strays(0, 1));
  EXPECT_TRUE(strays(0, 20));
  EXPECT_TRUE(strays(-3, 20)) << "and goes on doing so";
  EXPECT_FALSE(strays(0, 0));
  EXPECT_FALSE(strays(-20, 0)) << "no hand moves a needle by 20 px in a frame";
  EXPECT_FALSE(strays(-20, 0));
  EXPECT_FALSE(strays(0, 0)) << "both agree again";
  EXPECT_TRUE(strays(0, 20));
}

// Out of focus the end of a needle is seen 10 px too far back, and said to be within 6 px.
TEST_F(StageTip, holds_against_a_picture_that_says_how_wrong_it_may_be) {
  approach(20);
  for (int k = 0; k < 60; ++k) {
    told_.begin(Point(x_ - 40, 103));
    EXPECT_NEAR(told_.most_likely(seen_at({x_ + 10, 100}, 6)).tip.x, x_, 0.5) << k;
  }
}

// A speck on the needle looks like its end, and stays while the needle goes on.
TEST_F(StageTip, tells_that_the_picture_stays_where_the_needle_is_moved_on) {
  for (int k = 0; k < 40; ++k) {
    x_ -= 0.3;
    told_.begin(Point(x_ - 40, 103));
    told_.learn(seen_at({500, 100 + 0.2 * k}, 0.25));  // aside it follows the shaft
    EXPECT_EQ(told_.picture_stays(), k > 14) << k << ": told once it was moved by 4 px";
    if (told_.picture_stays()) {
      return;
    }
  }
  ADD_FAILURE() << "never told";
}

// The edge of another cell, or a fibre, is taken for a needle; the real one comes without a rest.
TEST_F(StageTip, tells_so_of_what_lies_anywhere_while_the_needle_comes) {
  for (const Point& axis : {Point(-1, 0), Point(0, -1), Point(0.8, 0.6)}) {
    TipByStage told;
    std::normal_distribution<double> noise(0, 0.5);
    int when = 0;
    for (int k = 0; k < 40 && !told.picture_stays(); ++k) {
      told.begin(Point(460 - k, 103));
      NeedlePose seen = seen_at({300 + noise(random_), 200 + noise(random_)}, 0.9);
      seen.axis = axis;
      told.learn(seen);
      when = k;
    }
    EXPECT_TRUE(told.picture_stays()) << axis;
    EXPECT_GE(when, 12) << axis << ": a camera may be late";
  }
}

TEST_F(StageTip, does_not_tell_so_of_a_needle_that_a_late_camera_shows) {
  for (int k = 0; k < 100; ++k) {
    told_.begin(Point(460 - k, 103));
    told_.learn(seen_at({500.0 - std::max(0, k - 8), 100}, 0.25));
    EXPECT_FALSE(told_.picture_stays()) << k;
  }
}

TEST_F(StageTip, does_not_tell_so_of_a_needle_that_is_seen_late_or_thinly) {
  std::normal_distribution<double> noise(0, 0.5);
  double one_ago = x_, two_ago = x_;  // where a camera that is two frames late still sees it
  for (int k = 0; k < 400; ++k) {
    const double seen = two_ago;
    two_ago = one_ago;
    one_ago = x_ -= k % 100 > 80 ? 8 : 0.3;
    told_.begin(Point(x_ - 40, 103));
    told_.learn(seen_at({seen + noise(random_), 100}, 0.9));
    EXPECT_FALSE(told_.picture_stays()) << k;
  }
}

TEST_F(StageTip, is_learnt_anew_where_the_stage_jumps) {
  approach(20);
  told_.begin(Point(x_ - 40 - 300, 103));
  EXPECT_FALSE(told_.moved());
  EXPECT_FALSE(told_.tip());
}

TEST_F(StageTip, is_not_known_from_what_is_no_place) {
  approach(20);
  for (const double x : {std::nan(""), 1e300, -std::numeric_limits<double>::infinity()}) {
    told_.begin(Point(x, 103));
    EXPECT_FALSE(told_.tip());
    EXPECT_FALSE(told_.moved());
  }
}

TEST_F(StageTip, is_not_known_in_a_frame_without_one) {
  approach(20);
  told_.begin(std::nullopt);
  EXPECT_FALSE(told_.tip());
  EXPECT_FALSE(told_.moved());
  EXPECT_EQ(told_.most_likely(seen_at({300, 100}, 2)).tip.x, 300);
}

// ---- from a table ----

class Poses : public testing::Test {
 protected:
  void TearDown() override { fs::remove(file_); }
  tl::expected<tools::StagePoses, std::string> read(const std::string& text) const {
    std::ofstream(file_) << text;
    return tools::StagePoses::read(file_);
  }
  std::string file_ = testing::TempDir() + "poses_" + std::to_string(getpid()) + ".csv";
};

TEST_F(Poses, lie_between_the_rows_of_a_table) {
  const auto poses =
      read("t_s,phase,tip_x_m,tip_y_m,tip_z_m\n0,free,1e-6,0,0\n0.1,free,3e-6,-1e-6,0\n1,free,0,0,0\n");
  ASSERT_TRUE(poses) << poses.error();
  ASSERT_TRUE(poses->at(0.025));
  EXPECT_NEAR(poses->at(0.025)->x, 1.5e-6, 1e-15);
  EXPECT_NEAR(poses->at(0.025)->y, -0.25e-6, 1e-15);
  EXPECT_NEAR(poses->at(0.1)->x, 3e-6, 1e-15);
  EXPECT_FALSE(poses->at(-0.01));
  EXPECT_FALSE(poses->at(0.5)) << "the rows round it are too far apart";
  EXPECT_FALSE(poses->at(1.01));
}

TEST_F(Poses, that_cannot_be_are_refused_in_one_line) {
  for (const auto& [text, why] :
       {std::pair{"", "no column t_s"}, std::pair{"t_s,tip_x_m\n0,0\n", "no column tip_y_m"},
        std::pair{"t_s,tip_x_m,tip_y_m\n0,0,0\n0,0,0\n", ":3: t_s does not rise"},
        std::pair{"t_s,tip_x_m,tip_y_m\n0,nan,0\n", ":2: "}, std::pair{"t_s,tip_x_m,tip_y_m\n0,0\n", ":2: "},
        std::pair{"t_s,tip_x_m,tip_y_m\n0,0,2\n", "at most"},
        std::pair{"t_s,tip_x_m,tip_y_m\ninf,0,0\n", ":2: "}}) {
    const auto poses = read(text);
    ASSERT_FALSE(poses) << text;
    EXPECT_NE(poses.error().find(why), std::string::npos) << poses.error();
    EXPECT_EQ(poses.error().find('\n'), std::string::npos);
  }
  EXPECT_FALSE(tools::StagePoses::read("/no/such/file"));
}

// ---- from the core ----

class LiveStage : public testing::Test {
 protected:
  void SetUp() override {
    core_->status.started.store(1);
    core_->status.start_ns.store(5'000'000'000);
    core_->status.period_ns.store(1'000'000);
  }
  // Ticks from..to - 1, in which the tip comes 100 um/s.
  void ticks(int from, int to) {
    for (int k = from; k < to; ++k) {
      rt::TelemetrySample s;
      s.tick = static_cast<std::uint64_t>(k);
      s.t_s = k * 1e-3;
      s.tip_m[0] = 1e-3 - 1e-7 * k;
      s.tip_m[1] = 2e-3;
      core_->telemetry.push(s);
    }
  }
  [[nodiscard]] std::optional<cv::Point2d> at_tick(int k) const {
    return tools::stage_tip_at(*core_, 5'000'000'000 + k * 1'000'000LL);
  }
  std::unique_ptr<rt::CoreSegment> core_ = std::make_unique<rt::CoreSegment>();
};

TEST_F(LiveStage, is_the_same_whether_the_tick_of_the_exposure_is_written_or_not) {
  ticks(0, 500);
  const auto before = at_tick(500);
  ticks(500, 520);
  const auto after = at_tick(500);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(before->x, after->x);
  EXPECT_NEAR(before->x, 1e-3 - 5e-5, 1e-12);
  EXPECT_NEAR(before->y, 2e-3, 1e-12);
}

TEST_F(LiveStage, is_not_told_from_samples_that_are_not_near) {
  EXPECT_FALSE(at_tick(0)) << "none";
  ticks(0, 2);
  EXPECT_FALSE(at_tick(1)) << "one before it is not enough";
  ticks(2, 500);
  EXPECT_FALSE(at_tick(600)) << "the core has stopped";
  ticks(500, 20'000);
  EXPECT_FALSE(at_tick(500)) << "overwritten";
  EXPECT_TRUE(at_tick(19'000));
  core_->status.started.store(0);
  EXPECT_FALSE(at_tick(19'000));
}

TEST_F(LiveStage, is_not_told_from_what_no_stage_can_be) {
  ticks(0, 10);
  rt::TelemetrySample s;
  s.t_s = 0.010;
  s.tip_m[0] = std::nan("");
  core_->telemetry.push(s);
  EXPECT_FALSE(at_tick(11));
}

}  // namespace
