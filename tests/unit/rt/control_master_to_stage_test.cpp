// From the hand to the needle.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "rt/control/master_to_stage.hpp"
#include "tests/support/tick.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using test::kTick_s;

hal::HandState hand_at(const Vec3& x, const hal::Quat& q = hal::Quat::Identity()) {
  hal::HandState hand;
  hand.position_m = x;
  hand.orientation = q;
  return hand;
}

TEST(MasterToStage, scales_the_hand_and_turns_it_into_the_picture) {
  MasterToStage m{MappingParams{}};
  m.anchor(hand_at({0.1, 0.2, 0.3}), Vec3(90e-6, 6e-6, 0), -Vec3::UnitX());
  m.step(hand_at({0.1 - 0.02, 0.2 + 0.01, 0.3 + 0.005}), true, true);
  // Up at the hand is up in the picture (y falls), towards the operator is towards the observer (z falls).
  EXPECT_LT((m.hand_point() - Vec3(90e-6 - 40e-6, 6e-6 - 20e-6, -10e-6)).norm(), 1e-15);
}

TEST(MasterToStage, clutch_uncouples_and_couples_again_without_a_jump) {
  MasterToStage m{MappingParams{}};
  m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  m.step(hand_at({0.01, 0, 0}), true, true);
  const Vec3 before = m.hand_point();
  for (int k = 0; k < 100; ++k) {
    m.step(hand_at({0.01 - k * 1e-3, 0.02, 0}), false, true);
  }
  EXPECT_EQ(m.hand_point(), before);
  m.step(hand_at({0.01 - 99e-3, 0.02, 0}), true, true);
  EXPECT_LT((m.hand_point() - before).norm(), 1e-18);
  m.step(hand_at({0.01 - 99e-3 + 5e-3, 0.02, 0}), true, true);
  EXPECT_LT((m.hand_point() - before - Vec3(10e-6, 0, 0)).norm(), 1e-15);
}

TEST(MasterToStage, slips_at_a_limit_so_that_turning_back_moves_the_needle_at_once) {
  MasterToStage m{MappingParams{}};
  m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  for (int k = 0; k <= 100; ++k) {
    m.step(hand_at({-k * 1e-3, 0, 0}), true, true);
    m.slip(m.hand_point().cwiseMax(Vec3(-50e-6, -1, -1)));
  }
  EXPECT_NEAR(m.hand_point().x(), -50e-6, 1e-15);
  m.step(hand_at({-99e-3, 0, 0}), true, true);
  EXPECT_NEAR(m.hand_point().x(), -48e-6, 1e-15);
}

TEST(MasterToStage, filters_tremor_like_a_second_order_butterworth) {
  const MappingParams params;
  for (const double f : {0.5, 3.0, 8.0, 10.0, 12.0, 40.0}) {
    MasterToStage m{params};
    m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
    double sum = 0;
    int n = 0;
    for (int k = 0; k < 20000; ++k) {
      const double t = k * kTick_s;
      m.step(hand_at({0.25e-3 * std::sin(2 * std::numbers::pi * f * t), 0, 0}), true, true);
      const double x = m.filter(kTick_s).tip_m.x();
      if (t > 4) {
        sum += x * x;
        ++n;
      }
    }
    const double gain = std::sqrt(2 * sum / n) / (0.25e-3 / params.position_scale);
    const double u = f / params.tremor_cutoff_Hz;
    EXPECT_NEAR(gain, 1 / std::sqrt(1 + u * u * u * u), 0.004) << f << " Hz";
  }
}

TEST(MasterToStage, filter_is_stable_and_settles_at_any_period) {
  for (const double dt : {0.125e-3, 1e-3, 0.02, 0.5, 10.0}) {
    MasterToStage m{MappingParams{}};
    m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
    m.step(hand_at({0.05, 0, 0}), true, true);
    double largest = 0;
    for (double t = 0; t < 3000 * std::max(dt, 1e-3); t += dt) {
      largest = std::max(largest, m.filter(dt).tip_m.x());
    }
    EXPECT_LT(largest, 2.1 * 100e-6);
    EXPECT_NEAR(m.filter(dt).tip_m.x(), 100e-6, 1e-7) << dt;
  }
}

TEST(MasterToStage, tilts_the_needle_with_the_handle_within_its_limit) {
  const MappingParams params;
  MasterToStage m{params};
  m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  // Turned by 0.05 rad about the hand's z (towards the operator): about -z of the world. -x turns to +y.
  const auto turned = [](double angle) {
    return hand_at(Vec3::Zero(), hal::Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())));
  };
  for (int k = 0; k < 3000; ++k) {
    m.step(turned(0.05), true, true);
    m.filter(kTick_s);
  }
  EXPECT_LT((m.set_point().axis - Vec3(-std::cos(0.05), std::sin(0.05), 0)).norm(), 1e-6);
  for (int k = 0; k < 3000; ++k) {
    m.step(turned(1.5), true, true);
    m.filter(kTick_s);
    ASSERT_LE(std::acos(std::min(1.0, m.set_point().axis.dot(-Vec3::UnitX()))), params.max_tilt_rad + 1e-9);
  }
  // Turning about the needle's own axis tilts nothing.
  MasterToStage own{params};
  own.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  own.step(hand_at(Vec3::Zero(), hal::Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX()))), true, true);
  own.filter(kTick_s);
  EXPECT_LT((own.set_point().axis + Vec3::UnitX()).norm(), 1e-12);
}

TEST(MasterToStage, freezes_the_axis_and_goes_on_from_there) {
  MasterToStage m{MappingParams{}};
  m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  const auto turned = [](double angle) {
    return hand_at(Vec3::Zero(), hal::Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())));
  };
  for (int k = 0; k < 3000; ++k) {
    m.step(turned(0.04), true, true);
    m.filter(kTick_s);
  }
  const Vec3 frozen = m.set_point().axis;
  for (int k = 0; k < 3000; ++k) {
    m.step(turned(0.04 - 1e-4 * k), true, false);
    ASSERT_LT((m.filter(kTick_s).axis - frozen).norm(), 1e-12);
  }
  for (int k = 0; k < 3000; ++k) {
    m.step(turned(0.04 - 0.3), true, true);
    ASSERT_LT((m.filter(kTick_s).axis - frozen).norm(), 2e-4);  // where the handle is now counts as zero
  }
}

TEST(MasterToStage, anchors_anew_without_moving_the_needle) {
  MasterToStage m{MappingParams{}};
  m.anchor(hand_at(Vec3::Zero()), Vec3::Zero(), -Vec3::UnitX());
  for (int k = 0; k < 100; ++k) {
    m.step(hand_at({0.001 * k, 0, 0}), true, true);
    m.filter(kTick_s);
  }
  const Vec3 tip(12e-6, 3e-6, -4e-6);
  m.anchor(hand_at({0.099, 0, 0}), tip, -Vec3::UnitX());
  for (int k = 0; k < 1000; ++k) {
    m.step(hand_at({0.099, 0, 0}), true, true);
    ASSERT_LT((m.filter(kTick_s).tip_m - tip).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace punctum::rt
