// The velocity of the hand as the servo uses it; the estimators have tests of their own.
#include <gtest/gtest.h>

#include "rt/control/hand_velocity.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

Readings moved_to(const Vec3& x) {
  Readings r;
  r.hand.position_m = x;
  r.hand_fresh = true;
  r.between_hand_s = 1e-3;
  return r;
}

TEST(HandVelocity, finds_a_steady_speed_with_either_method) {
  for (const auto method : {VelocityParams::Method::kalman, VelocityParams::Method::foaw}) {
    VelocityParams params;
    params.method = method;
    HandVelocity velocity(params, 1000);
    Vec3 v = Vec3::Zero();
    for (int k = 0; k < 500; ++k) {
      v = velocity.step(moved_to(Vec3(0.03e-3 * k, 0, 0)), 1e-3);
    }
    EXPECT_NEAR(v.x(), 0.03, 1e-4);
    EXPECT_EQ(v.y(), 0);
  }
}

TEST(HandVelocity, takes_the_time_between_the_samples_of_a_slow_hand_and_not_between_the_ticks) {
  for (const auto method : {VelocityParams::Method::kalman, VelocityParams::Method::foaw}) {
    for (const int every : {2, 4, 10}) {
      VelocityParams params;
      params.method = method;
      HandVelocity velocity(params, 1000);
      Vec3 v = Vec3::Zero();
      for (int k = 0; k < 1000; ++k) {
        Readings r = moved_to(Vec3(0.03e-3 * (k - k % every), 0, 0));
        r.hand_fresh = k % every == 0;
        r.between_hand_s = 1e-3 * every;
        v = velocity.step(r, 1e-3);
      }
      EXPECT_NEAR(v.x(), 0.03, 1e-4) << every;
    }
  }
}

TEST(HandVelocity, begins_at_rest_where_the_hand_begins_anew_or_leaps) {
  for (const auto method : {VelocityParams::Method::kalman, VelocityParams::Method::foaw}) {
    for (const bool leaps : {false, true}) {
      VelocityParams params;
      params.method = method;
      HandVelocity velocity(params, 1000);
      for (int k = 0; k < 100; ++k) {
        (void)velocity.step(moved_to(Vec3(0.03e-3 * k, 0, 0)), 1e-3);
      }
      Readings r = moved_to(Vec3(0.3, 0, 0));
      (leaps ? r.hand_leaps : r.hand_begins) = true;
      EXPECT_EQ(velocity.step(r, 1e-3), Vec3::Zero());
      EXPECT_EQ(velocity.step(moved_to(Vec3(0.3, 0, 0)), 1e-3).norm(), 0);
    }
  }
}

TEST(HandVelocity, keeps_its_estimate_while_no_fresh_reading_arrives) {
  HandVelocity velocity(VelocityParams{}, 1000);
  Vec3 v = Vec3::Zero();
  for (int k = 0; k < 500; ++k) {
    v = velocity.step(moved_to(Vec3(0.03e-3 * k, 0, 0)), 1e-3);
  }
  Readings silent = moved_to(Vec3(1, 1, 1));
  silent.hand_fresh = false;
  EXPECT_EQ(velocity.step(silent, 1e-3), v);
}

TEST(HandVelocity, is_low_passed_where_the_scene_says_so) {
  VelocityParams params;
  params.smooth_s = 0.1;
  HandVelocity smooth(params, 1000);
  HandVelocity direct(VelocityParams{}, 1000);
  Vec3 v = Vec3::Zero();
  Vec3 fast = Vec3::Zero();
  for (int k = 0; k < 100; ++k) {
    v = smooth.step(moved_to(Vec3(0.03e-3 * k, 0, 0)), 1e-3);
    fast = direct.step(moved_to(Vec3(0.03e-3 * k, 0, 0)), 1e-3);
  }
  EXPECT_GT(v.x(), 0);
  EXPECT_LT(v.x(), 0.8 * fast.x());
}

}  // namespace
}  // namespace punctum::rt
