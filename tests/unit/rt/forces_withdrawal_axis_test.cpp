// The withdrawal axis and the viscous damping.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "rt/forces/damping.hpp"
#include "rt/forces/withdrawal_axis.hpp"
#include "tests/support/fixtures.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using namespace test;
const FixtureFrame kLine{Vec3(15e-6, 3e-6, -1e-6), Vec3(-0.98, 0.1, 0.17).normalized()};

// Inside a known cell, on the line kLine.
EffectInput inside(const Vec3& tip, const Vec3& velocity = Vec3::Zero(), bool withdrawing = false) {
  EffectInput in;
  in.fixture_point_m = tip;
  in.handle_velocity_m_s = velocity;
  in.insertion = kLine;
  in.cell_known = true;
  in.inside_cell = true;
  in.withdrawing = withdrawing;
  in.dt_s = 1e-3;
  return in;
}

TEST(WithdrawalAxis, force_is_the_gradient_of_its_well_and_free_along_the_axis) {
  const AxisParams params;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-6e-6, 6e-6);
  const double h = 1e-8;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 tip = kLine.entry_m + Vec3(10 * u(random), u(random), u(random));
    const auto U = [&](const Vec3& p) { return axis_pull(params, kScale, kLine, p).energy_J; };
    const Vec3 force = axis_pull(params, kScale, kLine, tip).force_N;
    EXPECT_LT((force + gradient(U, tip, h) / kScale).norm(), 2e-6);
    EXPECT_NEAR(force.dot(kLine.axis), 0, 1e-15);
    // Moved along the axis nothing changes.
    EXPECT_LT((axis_pull(params, kScale, kLine, tip + 30e-6 * kLine.axis).force_N - force).norm(), 1e-12);
  }
}

TEST(WithdrawalAxis, no_eigenvalue_of_its_hessian_exceeds_the_stiffness_it_gives) {
  const AxisParams params;
  WithdrawalAxis axis(params, kSetup);
  EXPECT_EQ(axis.step(EffectInput{}).stiffness_N_m, 0);
  double bound = 0;
  for (int k = 0; k < 1000; ++k) {
    bound = axis.step(inside(kLine.entry_m)).stiffness_N_m;
  }
  std::mt19937_64 random(9);
  std::normal_distribution<double> n;
  const double h = 1e-10;
  double largest = 0;
  double smallest = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double size = std::pow(10, -9 + 5.0 * (i % 1000) / 1000);  // 1 nm .. 0.1 mm
    const Vec3 tip = kLine.entry_m + size * Vec3(n(random), n(random), n(random));
    Eigen::Matrix3d hessian;
    for (int k = 0; k < 3; ++k) {
      hessian.col(k) = -(axis_pull(params, kScale, kLine, tip + Vec3::Unit(k) * h).force_N -
                         axis_pull(params, kScale, kLine, tip - Vec3::Unit(k) * h).force_N) /
                       (2 * h * kScale);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (hessian + hessian.transpose()),
                                                               Eigen::EigenvaluesOnly);
    largest = std::max(largest, eigen.eigenvalues().maxCoeff());
    smallest = std::min(smallest, eigen.eigenvalues().minCoeff());
  }
  EXPECT_LE(largest, bound * (1 + 1e-6));
  EXPECT_GT(largest, 0.99 * bound);
  EXPECT_GT(smallest, -1e-4 * bound);  // a well
}

TEST(WithdrawalAxis, is_smooth_on_the_axis_itself) {
  const AxisParams params;
  EXPECT_EQ(axis_pull(params, kScale, kLine, kLine.entry_m).force_N.norm(), 0);
  // psi(r)/r -> 0: no kink at r = 0, and K k_p beyond the ramp.
  const Vec3 across = kLine.axis.cross(Vec3::UnitZ()).normalized();
  EXPECT_LT(axis_pull(params, kScale, kLine, kLine.entry_m + 1e-10 * across).force_N.norm(), 1e-9);
  const double far = axis_pull(params, kScale, kLine, kLine.entry_m + 10e-6 * across).force_N.norm();
  EXPECT_NEAR(far, params.K_N_m * kScale * (10e-6 - params.eps_m / 2), 1e-12);
}

TEST(WithdrawalAxis, resists_only_motion_into_the_cell_and_only_in_withdrawal) {
  const AxisParams params;
  WithdrawalAxis axis(params, kSetup);
  const Vec3 in = 0.01 * kLine.axis;  // m/s at the hand
  for (int k = 0; k < 1000; ++k) {
    (void)axis.step(inside(kLine.entry_m, in));
  }
  EXPECT_EQ(axis.step(inside(kLine.entry_m, in)).dissipative_N.norm(), 0);
  EffectOutput out;
  for (int k = 0; k < 1000; ++k) {
    out = axis.step(inside(kLine.entry_m, in, true));
  }
  EXPECT_NEAR(out.dissipative_N.dot(kLine.axis), -params.B_inward_Ns_m * 0.01, 1e-12);
  EXPECT_EQ(out.damping_Ns_m, params.B_inward_Ns_m);
  EXPECT_EQ(axis.step(inside(kLine.entry_m, -in, true)).dissipative_N.norm(), 0);
  // Beside the axis it is told apart from the well, which stores.
  const Vec3 beside = kLine.entry_m + 4e-6 * kLine.axis.cross(Vec3::UnitY()).normalized();
  out = axis.step(inside(beside, in, true));
  EXPECT_NEAR(out.dissipative_N.dot(kLine.axis), -params.B_inward_Ns_m * 0.01, 1e-12);
  EXPECT_LT((out.storing_N - axis_pull(params, kScale, kLine, beside).force_N).norm(), 1e-12);
  EXPECT_EQ(WithdrawalAxis::kGives.point, EnergyPoint::fixture_point);
}

TEST(WithdrawalAxis, books_what_switching_injects_and_lets_go_without_a_step) {
  const AxisParams params;
  WithdrawalAxis axis(params, kSetup);
  const Vec3 tip = kLine.entry_m + 4e-6 * kLine.axis.cross(Vec3::UnitY()).normalized();
  Vec3 before = Vec3::Zero();
  double steepest = 0;
  double injected_J = 0;
  for (int k = 0; k < 1000; ++k) {
    EffectInput in = inside(tip);
    in.inside_cell = k < 500;
    const EffectOutput out = axis.step(in);
    const Vec3 force = out.storing_N;
    injected_J += out.injected_J;
    steepest = std::max(steepest, (force - before).norm());
    before = force;
    // The hand does not move: all that is stored was injected.
    EXPECT_NEAR(out.stored_J, axis.injected_energy_J(), 1e-18);
    EXPECT_NEAR(injected_J, axis.injected_energy_J(), 1e-18);
  }
  EXPECT_EQ(before.norm(), 0);
  EXPECT_NEAR(axis.injected_energy_J(), 0, 1e-18);
  EXPECT_LT(steepest, 3e-3);  // N per ms
}

TEST(Damping, opposes_motion_and_rises_inside_without_a_bump) {
  const DampingParams params;
  Damping damping(params, EffectSetup{});
  EffectInput in;
  in.dt_s = 1e-3;
  const Vec3 v(0.03, -0.01, 0.02);
  in.handle_velocity_m_s = v;
  Vec3 before = damping.step(in).dissipative_N;
  EXPECT_LT((before + params.B1_Ns_m * v).norm(), 1e-15);
  in.inside_cell = true;
  int ticks = 0;
  double largest = 0;
  double B_Ns_m = params.B1_Ns_m;
  while (B_Ns_m < params.B2_Ns_m) {
    const EffectOutput out = damping.step(in);
    B_Ns_m = out.damping_Ns_m;
    const Vec3 force = out.dissipative_N;
    EXPECT_EQ(out.storing_N.norm() + out.stored_J + out.stiffness_N_m, 0);
    EXPECT_LE(force.dot(v), 0);
    largest = std::max(largest, (force - before).norm());
    before = force;
    ASSERT_LT(++ticks, 60);
  }
  EXPECT_GE(ticks, 20);  // 20 .. 50 ms
  EXPECT_LE(ticks, 50);
  // A smooth ramp never steps by more than 15/8 of an even one.
  EXPECT_LE(largest, 1.9 * (params.B2_Ns_m - params.B1_Ns_m) * v.norm() / ticks);
}

}  // namespace
}  // namespace punctum::rt
