// Whether the stage goes where it is sent.
#include <gtest/gtest.h>

#include "rt/control/following.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
constexpr double kLimit_m = 10e-6;

TEST(FollowingCheck, has_nothing_to_object_before_anything_was_sent) {
  FollowingCheck check(0.02);
  EXPECT_TRUE(check.follows(Vec3(1, 1, 1), kLimit_m));
  check.sent(Vec3::Zero());
  EXPECT_FALSE(check.follows(Vec3(1, 1, 1), kLimit_m));
  check.restart();
  EXPECT_TRUE(check.follows(Vec3(1, 1, 1), kLimit_m));
}

TEST(FollowingCheck, accepts_every_place_on_the_path_of_the_time_that_a_reading_may_be_old) {
  // 10 mm/s: the path of 20 ms is twenty times the limit long.
  FollowingCheck check(0.02);
  Vec3 sent = Vec3::Zero();
  for (int k = 0; k < 200; ++k) {
    check.step(1e-3);
    sent.x() += 10e-6;
    check.sent(sent);
  }
  for (double behind_m = 0; behind_m < 200e-6; behind_m += 1e-6) {
    EXPECT_TRUE(check.follows(sent - Vec3(behind_m, 0, 0), kLimit_m)) << behind_m;
    EXPECT_TRUE(check.follows(sent - Vec3(behind_m, 9e-6, 0), kLimit_m)) << behind_m;
    EXPECT_FALSE(check.follows(sent - Vec3(behind_m, 11e-6, 0), kLimit_m)) << behind_m;
  }
  EXPECT_FALSE(check.follows(sent + Vec3(11e-6, 0, 0), kLimit_m));
  EXPECT_FALSE(check.follows(sent - Vec3(250e-6, 0, 0), kLimit_m));
}

TEST(FollowingCheck, no_longer_accepts_where_the_stage_stood_before_it_was_sent_away) {
  FollowingCheck check(0.02);
  for (int k = 0; k < 10; ++k) {
    check.step(1e-3);
    check.sent(Vec3::Zero());
  }
  // The path is kept in pieces of a sixteenth of that time.
  for (int k = 1; k < 40; ++k) {
    check.step(1e-3);
    check.sent(Vec3(100e-6, 0, 0));
    const bool accepted = check.follows(Vec3::Zero(), kLimit_m);
    if (k <= 18) {
      EXPECT_TRUE(accepted) << k;
    }
    if (k >= 23) {
      EXPECT_FALSE(accepted) << k;
    }
  }
}

}  // namespace
}  // namespace punctum::rt
