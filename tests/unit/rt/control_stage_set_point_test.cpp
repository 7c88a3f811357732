// The path of the needle: when it follows the hand, and when it begins anew.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hal/frames.hpp"
#include "rt/control/stage_set_point.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

ServoConfig unfiltered() {
  ServoConfig config;
  config.mapping.tremor_cutoff_Hz = 0;
  return config;
}

struct Path {
  Path() {
    readings.hand_seen = readings.has_stage = readings.stage_seen = true;
    readings.stage_fresh = true;
    readings.stage.enabled = true;
    readings.stage.tip_m = Vec3(60e-6, 0, 0);
  }
  void follow_for(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds * 1000); ++k) {
      (void)path.follow_hand(readings, in);
      (void)path.step(in.constraint, 1e-3);
    }
  }
  Readings readings;
  FollowInput in;
  StageSetPoint path{unfiltered()};
};

TEST(StageSetPoint, begins_at_the_needle_and_follows_the_hand_at_needle_scale) {
  Path p;
  EXPECT_EQ(p.path.command(), nullptr);
  p.readings.hand.position_m = Vec3(0.1, 0, 0);
  (void)p.path.follow_hand(p.readings, p.in);
  EXPECT_TRUE(p.path.uncoupled());
  EXPECT_EQ(p.path.command(), nullptr) << "one sample says where the needle is";
  EXPECT_EQ(p.path.hand_point_m(), p.readings.stage.tip_m);
  (void)p.path.follow_hand(p.readings, p.in);
  ASSERT_NE(p.path.command(), nullptr);
  p.follow_for(0.01);
  p.readings.hand.position_m.x() -= 5e-3;
  p.follow_for(1);
  EXPECT_FALSE(p.path.uncoupled());
  EXPECT_NEAR(p.path.hand_point_m().x(), 50e-6, 1e-12);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 50e-6, 1e-9);
}

TEST(StageSetPoint, waits_until_hand_and_needle_were_both_seen) {
  for (const bool hand : {true, false}) {
    Path p;
    (hand ? p.readings.hand_seen : p.readings.stage_seen) = false;
    (void)p.path.follow_hand(p.readings, p.in);
    EXPECT_FALSE(p.path.anchored());
    EXPECT_EQ(p.path.step(p.in.constraint, 1e-3), 0U);
  }
}

TEST(StageSetPoint, stays_at_the_needle_during_a_stop_wherever_the_hand_goes) {
  Path p;
  p.follow_for(0.01);
  p.in.running = false;
  p.readings.hand.position_m = Vec3(-0.1, 0.05, 0);
  p.readings.stage.tip_m = Vec3(55e-6, 1e-6, 0);
  (void)p.path.follow_hand(p.readings, p.in);
  EXPECT_TRUE(p.path.uncoupled());
  EXPECT_EQ(p.path.set_point().tip_m, p.readings.stage.tip_m);
  p.in.running = true;
  p.follow_for(0.1);
  EXPECT_LT((p.path.set_point().tip_m - p.readings.stage.tip_m).norm(), 1e-12);
}

TEST(StageSetPoint, takes_another_position_scale_only_while_uncoupled_and_moves_nothing_by_it) {
  Path p;
  p.follow_for(0.01);
  p.readings.hand.position_m.x() -= 10e-3;
  p.follow_for(1);
  const Vec3 point = p.path.hand_point_m();
  const Vec3 set_point = p.path.set_point().tip_m;
  EXPECT_NEAR(point.x(), 40e-6, 1e-12);
  const auto nothing_moved = [&] {
    EXPECT_LT((p.path.hand_point_m() - point).norm(), 1e-15);
    EXPECT_LT((p.path.set_point().tip_m - set_point).norm(), 1e-9);
  };
  p.in.position_scale = 250;
  p.in.nothing_felt = true;
  p.follow_for(0.5);  // coupled: not yet
  EXPECT_EQ(p.path.position_scale(), 500);
  nothing_moved();
  p.readings.hand.buttons = hal::kButtonClutch;
  p.in.clutched = true;
  p.in.nothing_felt = false;
  p.follow_for(0.05);  // a fixture's force still fades
  EXPECT_EQ(p.path.position_scale(), 500);
  p.in.nothing_felt = true;
  p.follow_for(0.1);
  EXPECT_EQ(p.path.position_scale(), 250);
  nothing_moved();
  p.readings.hand.buttons = 0;
  p.in.clutched = p.in.nothing_felt = false;
  p.follow_for(0.5);
  nothing_moved();
  p.readings.hand.position_m.x() += 5e-3;
  p.follow_for(1);
  EXPECT_NEAR(p.path.hand_point_m().x(), 60e-6, 1e-12);
}

TEST(StageSetPoint, forgets_what_the_hand_did_while_vision_was_stale) {
  Path p;
  p.follow_for(0.01);
  p.in.vision_fresh = false;
  p.in.constraint.withdrawal_only = true;
  p.readings.hand.position_m.x() = -20e-3;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 60e-6, 1e-12);
  p.in.vision_fresh = true;
  p.in.constraint.withdrawal_only = false;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 60e-6, 1e-12);
}

TEST(StageSetPoint, draws_back_blind_by_every_way_back_of_the_hand_and_by_nothing_else) {
  Path p;
  p.follow_for(0.01);
  p.in.vision_fresh = false;
  p.in.constraint.withdrawal_only = true;
  double furthest_m = 60e-6;
  const auto hand_by = [&](double needle_m) {
    for (int k = 0; k < 100; ++k) {
      p.readings.hand.position_m.x() += needle_m * 500 / 100;
      p.follow_for(0.002);
    }
    p.follow_for(0.2);
    EXPECT_GE(p.path.set_point().tip_m.x(), furthest_m - 1e-15);
    furthest_m = p.path.set_point().tip_m.x();
    return furthest_m;
  };
  EXPECT_NEAR(hand_by(-60e-6), 60e-6, 1e-12);
  EXPECT_NEAR(hand_by(55e-6), 115e-6, 2e-6);  // a hand's millimetre is lost where it turns
  EXPECT_NEAR(hand_by(-1), 115e-6, 2e-6);
  EXPECT_NEAR(hand_by(5e-6), 118e-6, 3e-6);
  p.in.vision_fresh = true;
  p.in.constraint.withdrawal_only = false;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), furthest_m, 1e-9);
}

TEST(StageSetPoint, is_not_drawn_back_blind_by_a_hand_that_trembles) {
  for (const double cutoff_Hz : {3.0, 0.0}) {
    ServoConfig config;
    config.mapping.tremor_cutoff_Hz = cutoff_Hz;
    Path p;
    p.path = StageSetPoint(config);
    p.follow_for(0.01);
    p.in.vision_fresh = false;
    p.in.constraint.withdrawal_only = true;
    for (int k = 0; k < 10'000; ++k) {
      p.readings.hand.position_m.x() =
          0.25e-3 * std::sqrt(2.0) * std::sin(2 * std::numbers::pi * 10 * k * 1e-3);
      p.follow_for(0.001);
    }
    EXPECT_LT(p.path.set_point().tip_m.x() - 60e-6, 1e-6);
  }
}

TEST(StageSetPoint, does_not_go_on_for_long_after_a_hand_that_was_too_fast_for_it) {
  Path p;
  p.readings.stage.tip_m = Vec3(-200e-6, 0, 0);
  p.follow_for(0.01);
  for (int k = 0; k < 100; ++k) {
    p.readings.hand.position_m.x() += 2e-3;  // 400 um of the needle in 0.1 s
    p.follow_for(0.001);
  }
  const double x = p.path.set_point().tip_m.x();
  p.follow_for(2);
  EXPECT_LT(p.path.set_point().tip_m.x() - x, 400e-6 * 0.25);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), p.path.hand_point_m().x(), 1e-12);
}

TEST(StageSetPoint, begins_anew_after_a_gap_between_ticks_or_between_samples_of_the_hand) {
  for (const bool ticks : {true, false}) {
    Path p;
    p.readings.hand_fresh = true;
    p.readings.between_hand_s = p.in.elapsed_s = 1e-3;
    p.follow_for(0.01);
    (ticks ? p.in.elapsed_s : p.readings.between_hand_s) = 0.02;
    p.readings.hand.position_m.x() = -40e-3;
    (void)p.path.follow_hand(p.readings, p.in);
    p.readings.between_hand_s = p.in.elapsed_s = 1e-3;
    p.follow_for(0.5);
    EXPECT_NEAR(p.path.set_point().tip_m.x(), 60e-6, 1e-12);
    p.readings.hand.position_m.x() -= 5e-3;
    p.follow_for(0.5);
    EXPECT_NEAR(p.path.set_point().tip_m.x(), 50e-6, 1e-9);
  }
}

TEST(StageSetPoint, does_not_follow_a_leap_of_the_hand_but_outward_and_says_so) {
  Path p;
  p.readings.hand_fresh = true;
  p.readings.between_hand_s = 5e-3;
  p.follow_for(0.1);
  double x = p.path.set_point().tip_m.x();
  for (const double leap_m : {-5e-3, 5e-3}) {
    p.readings.hand.position_m.x() += leap_m;
    p.readings.hand_leaps = true;
    EXPECT_EQ(p.path.follow_hand(p.readings, p.in), alarm_travel_limited);
    p.readings.hand_leaps = false;
    EXPECT_EQ(p.path.follow_hand(p.readings, p.in), 0U);
    p.follow_for(0.5);
    x += leap_m > 0 ? 10e-6 : 0;  // what drew back is taken, once it is over
    EXPECT_NEAR(p.path.set_point().tip_m.x(), x, 1e-9);
  }
  p.readings.hand.position_m.x() -= 5e-3;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), x - 10e-6, 1e-9);
}

TEST(StageSetPoint, lets_the_hand_slip_at_a_limit_and_says_so) {
  Path p;
  p.follow_for(0.01);
  std::uint32_t alarms = 0;
  for (int k = 0; k < 5000; ++k) {
    p.readings.hand.position_m.x() += 0.1e-3;  // a millimetre of the needle
    alarms = p.path.follow_hand(p.readings, p.in);
    (void)p.path.step(p.in.constraint, 1e-3);
  }
  EXPECT_EQ(alarms, alarm_travel_limited);
  EXPECT_NEAR(p.path.hand_point_m().x(), 280e-6, 1e-12);
  // Back by 5 mm: the needle follows at once, nothing has wound up.
  p.readings.hand.position_m.x() -= 5e-3;
  (void)p.path.follow_hand(p.readings, p.in);
  EXPECT_NEAR(p.path.hand_point_m().x(), 270e-6, 1e-12);
}

TEST(StageSetPoint, leaves_the_needle_where_it_is_while_the_clutch_is_pressed) {
  Path p;
  p.follow_for(0.01);
  p.in.clutched = true;
  p.readings.hand.position_m.x() = 0.05;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 60e-6, 1e-12);
}

TEST(StageSetPoint, forgets_what_the_hand_did_up_to_the_sample_that_shows_the_clutch_released) {
  Path p;
  p.follow_for(0.01);
  p.in.clutched = true;
  p.follow_for(0.1);
  p.in.clutched = false;
  p.readings.hand.position_m.x() = 5e-3;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 60e-6, 1e-12);
  p.readings.hand.position_m.x() += 5e-3;
  p.follow_for(0.5);
  EXPECT_NEAR(p.path.set_point().tip_m.x(), 70e-6, 1e-9);
}

}  // namespace
}  // namespace punctum::rt
