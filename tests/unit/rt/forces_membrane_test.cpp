// The membrane as it is rendered: rim vectors, and what happens at the puncture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rt/forces/membrane.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

TEST(RimForces, sum_to_the_force_along_the_axis_whatever_the_axis) {
  MembraneParams params;
  std::mt19937_64 random(1);
  std::normal_distribution<double> n;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 axis = Vec3(n(random), n(random), n(random)).normalized();
    const double w = 1e-8 * std::exp(std::abs(3 * n(random)));
    params.law = i % 2 == 0 ? MembraneParams::Law::large_deflection : MembraneParams::Law::paper;
    const MembraneState s = membrane_law(params, w, 60e-6, 0.6);
    const RimForces rim = rim_forces(s, 0.3, axis);
    Vec3 sum = Vec3::Zero();
    for (const Vec3& f : rim) {
      sum += f;
      // Each has its share of the outward pull.
      const double axial = -f.dot(axis);
      const double radial = (f + axial * axis).norm();
      EXPECT_NEAR(axial, 0.3 / kRimPoints, 1e-12);
      EXPECT_NEAR(radial * s.force_N, 0.3 / kRimPoints * s.pull_N, 1e-9 * s.pull_N);
    }
    EXPECT_LT((sum + 0.3 * axis).norm(), 1e-12 * (1 + s.pull_N / s.force_N));
  }
}

TEST(RimForces, are_zero_without_force) {
  for (const Vec3& f : rim_forces(MembraneState{}, 0, -Vec3::UnitX())) {
    EXPECT_EQ(f.norm(), 0);
  }
}

EffectInput pressed(double depth_m, bool punctured, double dt) {
  EffectInput in;
  in.cell_known = true;
  in.cell_radius_m = 60e-6;
  in.dimple_scale = 0.5;
  in.depth_m = depth_m;
  in.punctured = punctured;
  in.fixture_gain = 1;
  in.force_fade = in.last_force_fade = 1;
  in.dt_s = dt;
  return in;
}

TEST(Membrane, force_falls_monotonically_to_zero_after_the_puncture_whatever_the_depth_does) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> u(-30e-6, 60e-6);
  for (const double dt : {1e-3, 0.125e-3}) {
    Membrane membrane(MembraneParams{}, EffectSetup{});
    EffectOutput out = membrane.step(pressed(20e-6, false, dt));
    const double before_N = membrane.state().force_N;
    const double stored_J = membrane.state().energy_J;
    EXPECT_GT(out.stored_J, 0);
    double last_N = before_N;
    int ticks = 0;
    for (int k = 0; k < 2000; ++k) {
      out = membrane.step(pressed(u(random), true, dt));
      const double force_N = membrane.state().force_N;
      ASSERT_LE(force_N, last_N);
      ASSERT_GE(force_N, 0);
      ASSERT_LT(last_N - force_N, before_N * 2 * dt / 0.03 + 1e-12);  // a ramp, no step
      if (force_N > 0) {
        ++ticks;
      }
      last_N = force_N;
    }
    EXPECT_EQ(last_N, 0);
    EXPECT_EQ(out.storing_N.norm(), 0);
    EXPECT_LE(ticks * dt, 0.031);
    EXPECT_EQ(out.stored_J, 0);
    EXPECT_EQ(membrane.dropped_energy_J(), stored_J);
    // A late denial by vision does not bring it back; a new cell has a new membrane.
    (void)membrane.step(pressed(20e-6, false, dt));
    EXPECT_EQ(membrane.state().force_N, 0);
    EffectInput fresh = pressed(20e-6, false, dt);
    fresh.new_cell = true;
    (void)membrane.step(fresh);
    EXPECT_EQ(membrane.state().force_N, before_N);
  }
}

TEST(Membrane, gives_force_energy_and_stiffness_at_the_scale_of_the_hand) {
  const EffectSetup setup{.force_scale = 2e5};
  Membrane membrane(MembraneParams{}, setup);
  EffectInput in = pressed(20e-6, false, 1e-3);
  in.position_scale = 400;
  in.fixture_gain = 0.5;
  in.commanded_scale = 0.25;
  in.depth_correction_m = 1e-8;
  const EffectOutput out = membrane.step(in);
  const MembraneState needle = membrane_law(MembraneParams{}, 20e-6, 60e-6, 0.5);
  const double scale = 0.5 * 0.25 * 2e5;
  EXPECT_EQ(Membrane::kGives.point, EnergyPoint::needle);
  EXPECT_NEAR(out.storing_N.x(), scale * needle.force_N, 1e-12);  // against the approach along -x
  EXPECT_NEAR(out.stored_J, scale * 400 * needle.energy_J, 1e-15);
  EXPECT_NEAR(out.stiffness_N_m, scale / 400 * needle.stiffness_N_m, 1e-9);
  // What vision's correction adds in depth against this force was not given by the hand.
  EXPECT_NEAR(out.injected_J, scale * needle.force_N * 1e-8 * 400, 1e-15);
  Vec3 rim = Vec3::Zero();
  for (const Vec3& f : membrane.rim()) {
    rim += f;
  }
  EXPECT_LT((rim - out.storing_N).norm(), 1e-12);
}

TEST(Membrane, keeps_the_rendered_force_from_rising_after_the_puncture_while_the_gains_return) {
  Membrane membrane(MembraneParams{}, EffectSetup{});
  EffectInput in = pressed(20e-6, false, 1e-3);
  in.fixture_gain = 0.1;
  in.force_fade = in.last_force_fade = 0.1;
  double last_N = 0.1 * membrane.step(in).storing_N.norm();
  EXPECT_GT(last_N, 0);
  in.punctured = true;
  for (int k = 0; k < 40; ++k) {
    in.fixture_gain = std::min(1.0, in.fixture_gain + 0.1);
    in.last_force_fade = in.force_fade;
    in.force_fade = std::min(1.0, in.force_fade + 0.1);
    const double force_N = in.force_fade * membrane.step(in).storing_N.norm();
    EXPECT_LE(force_N, last_N * (1 + 1e-12));
    last_N = force_N;
  }
  EXPECT_EQ(last_N, 0);
}

}  // namespace
}  // namespace punctum::rt
