// Kinematics of the Falcon against three references: poses that mpmath solved to 40 digits
// (falcon_reference.py), inverse kinematics by the intersection of circles, which the emulator has, and the
// balance of forces in its rods.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "hal/falcon/kinematics.hpp"
#include "tools/emulators/falcon/kinematics.hpp"

namespace punctum::falcon {
namespace {

using hal::Vec3;

struct ReferencePose {
  double angles_rad[3], position_m[3], jacobian[9];
};
constexpr ReferencePose kReference[] = {
#include "tests/unit/hal/falcon_reference.inc"
};

// Places all over what the grip reaches: a cylinder, narrower towards the operator.
template <class Do>
void at_many_places(Do check) {
  int places = 0;
  for (double z_m = 0.075; z_m <= 0.1701; z_m += 0.005) {
    const double reach_m = z_m < 0.15 ? 0.06 : 0.06 - 1.2 * (z_m - 0.15);
    for (double r_m = 0; r_m <= reach_m; r_m += 0.012) {
      for (double turn = 0; turn < 2 * std::numbers::pi; turn += 0.35) {
        check(Vec3{r_m * std::cos(turn), r_m * std::sin(turn), z_m});
        ++places;
      }
    }
  }
  EXPECT_GT(places, 1000);
}

emulator::Triple triple(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3 vector(const emulator::Triple& t) { return {t[0], t[1], t[2]}; }

TEST(FalconKinematics, finds_the_poses_that_mpmath_solved_to_a_nanometre_and_their_jacobian) {
  for (const ReferencePose& reference : kReference) {
    const auto pose = solve({reference.angles_rad[0], reference.angles_rad[1], reference.angles_rad[2]});
    ASSERT_TRUE(pose);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(pose->position_m[i], reference.position_m[i], 1e-12);
      for (int j = 0; j < 3; ++j) {
        EXPECT_NEAR(pose->jacobian(i, j), reference.jacobian[3 * i + j], 1e-11);
      }
    }
  }
}

TEST(FalconKinematics, finds_every_place_back_from_its_arms_to_a_nanometre) {
  double largest_m = 0;
  at_many_places([&](const Vec3& place) {
    const auto arms = emulator::falcon_arms(triple(place));
    ASSERT_TRUE(arms) << place.transpose();
    const auto pose = solve(vector(*arms));
    ASSERT_TRUE(pose) << place.transpose();
    largest_m = std::max(largest_m, (pose->position_m - place).norm());
  });
  EXPECT_LT(largest_m, 1e-9);
  std::printf("largest error of a position %.1e m\n", largest_m);
}

TEST(FalconKinematics, jacobian_is_the_difference_of_poses) {
  constexpr double kStep = 1e-5;
  at_many_places([&](const Vec3& place) {
    const Vec3 arms = vector(*emulator::falcon_arms(triple(place)));
    const auto pose = solve(arms);
    ASSERT_TRUE(pose);
    const double scale = pose->jacobian.cwiseAbs().maxCoeff();
    for (int i = 0; i < 3; ++i) {
      Vec3 more = arms, less = arms;
      more[i] += kStep;
      less[i] -= kStep;
      const auto after = solve(more), before = solve(less);
      if (after && before) {
        const Vec3 difference = (after->position_m - before->position_m) / (2 * kStep);
        EXPECT_LT((difference - pose->jacobian.col(i)).norm(), 2e-6 * scale) << place.transpose();
      }
    }
  });
}

// What the rods carry is worked out by the emulator from their directions, without a derivative.
TEST(FalconKinematics, motors_balance_the_force_in_the_rods) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> component(-2, 2);
  at_many_places([&](const Vec3& place) {
    const auto pose = solve(vector(*emulator::falcon_arms(triple(place))));
    ASSERT_TRUE(pose);
    const Vec3 force_N{component(random), component(random), component(random)};
    const Counts motors = motors_for(*pose, force_N);
    const auto felt =
        emulator::falcon_push(triple(place), {-1e-4 * motors[0], -1e-4 * motors[1], -1e-4 * motors[2]});
    ASSERT_TRUE(felt);
    // Half a count of each motor, 5e-5 N m, at the shortest lever.
    const double rounding_N = 5e-5 * std::sqrt(3) * pose->jacobian.inverse().norm() + 1e-9;
    EXPECT_LT((vector(*felt) - force_N).norm(), rounding_N) << place.transpose();
  });
}

TEST(FalconKinematics, force_beyond_what_the_motors_can_give_keeps_its_direction) {
  const emulator::Triple place = {0.01, -0.02, 0.12};
  const auto pose = solve(vector(*emulator::falcon_arms(place)));
  ASSERT_TRUE(pose);
  // From what they can give to what nobody could.
  for (const double strength : {0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.6, 1.0, 1000.0}) {
    const Vec3 wanted = strength * Vec3{30, -12, 50};
    const Counts motors = motors_for(*pose, wanted);
    int largest = 0;
    for (const std::int16_t motor : motors) {
      largest = std::max(largest, std::abs(static_cast<int>(motor)));
    }
    EXPECT_LE(largest, 4096) << strength;
    EXPECT_TRUE(largest == 4096 || strength < 0.4) << strength;
    const Vec3 felt =
        vector(*emulator::falcon_push(place, {-1e-4 * motors[0], -1e-4 * motors[1], -1e-4 * motors[2]}));
    EXPECT_LT(felt.norm(), 1.01 * wanted.norm());
    EXPECT_LT(felt.cross(wanted).norm() / (felt.norm() * wanted.norm()), 1e-3);
  }
}

TEST(FalconKinematics, push_towards_the_operator_takes_the_same_of_all_motors_and_has_the_devices_sign) {
  const auto pose = solve(vector(*emulator::falcon_arms({0, 0, 0.12})));
  ASSERT_TRUE(pose);
  const Counts motors = motors_for(*pose, {0, 0, 3});
  EXPECT_EQ(motors[0], motors[1]);
  EXPECT_EQ(motors[1], motors[2]);
  EXPECT_LT(motors[0], -100);
  EXPECT_EQ(motors_for(*pose, {0, 0, -3})[0], -motors[0]);
}

TEST(FalconKinematics, counts_are_the_encoders_and_their_gear) {
  EXPECT_NEAR(arm_angles({0, 0, 0})[0] * 180 / std::numbers::pi, 35, 1e-12);
  const Vec3 angles = arm_angles({1000, -1000, 1});
  EXPECT_NEAR(angles[0] * 180 / std::numbers::pi, 35 + 36.4347, 1e-4);
  EXPECT_NEAR(angles[1] * 180 / std::numbers::pi, 35 - 36.4347, 1e-4);
  EXPECT_NEAR(angles[2] * 180 / std::numbers::pi, 35 + 0.0364347, 1e-7);
}

TEST(FalconKinematics, angles_that_no_place_of_the_grip_has_give_nothing) {
  EXPECT_FALSE(solve({3, 3, 3}));
  EXPECT_FALSE(solve({-2, -2, -2}));
  EXPECT_FALSE(solve({1.8, -1.2, 0.6}));
  EXPECT_FALSE(solve({std::nan(""), 0.5, 0.5}));
  EXPECT_FALSE(solve({1e300, 0.5, 0.5}));
  // The end of the arms: they are in line with their rods there.
  EXPECT_TRUE(solve({1.6, 1.6, 1.6}));
  EXPECT_FALSE(solve({1.65, 1.65, 1.65}));
  const auto near = solve({0.2, 0.2, 0.2});
  ASSERT_TRUE(near);
  EXPECT_GT(near->least_leverage, 0.1);
}

TEST(FalconKinematics, whatever_the_angles_a_pose_is_one_that_has_them) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-1.5, 2.2);
  int found = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 angles{angle(random), angle(random), angle(random)};
    const auto pose = solve(angles);
    if (!pose) {
      continue;
    }
    ++found;
    const auto arms = emulator::falcon_arms(triple(pose->position_m));
    ASSERT_TRUE(arms) << angles.transpose();
    EXPECT_LT((vector(*arms) - angles).norm(), 1e-8) << angles.transpose();
  }
  EXPECT_GT(found, 1000);
}

}  // namespace
}  // namespace punctum::falcon
