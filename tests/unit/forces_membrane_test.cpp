// The membrane as it is rendered: rim vectors, and what happens at the puncture.
#include <gtest/gtest.h>

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
  for (const Vec3& f : rim_forces(MembraneState{}, 0, -Vec3::UnitX())) EXPECT_EQ(f.norm(), 0);
}

TEST(Membrane, force_falls_monotonically_to_zero_after_the_puncture_whatever_the_depth_does) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> u(-30e-6, 60e-6);
  for (const double dt : {1e-3, 0.125e-3}) {
    Membrane membrane{MembraneParams{}};
    membrane.step(20e-6, 60e-6, 0.5, false, dt);
    const double before = membrane.state().force_N;
    const double stored = membrane.stored_energy_J();
    EXPECT_GT(stored, 0);
    double last = before;
    int ticks = 0;
    for (int k = 0; k < 2000; ++k) {
      membrane.step(u(random), 60e-6, 0.5, true, dt);
      const double force = membrane.state().force_N;
      ASSERT_LE(force, last);
      ASSERT_GE(force, 0);
      ASSERT_LT(last - force, before * 2 * dt / 0.03 + 1e-12);  // a ramp, no step
      if (force > 0) ++ticks;
      last = force;
    }
    EXPECT_EQ(last, 0);
    EXPECT_LE(ticks * dt, 0.031);
    EXPECT_EQ(membrane.stored_energy_J(), 0);
    EXPECT_EQ(membrane.dropped_energy_J(), stored);
    // A late denial by vision does not bring it back; a fresh membrane does.
    membrane.step(20e-6, 60e-6, 0.5, false, dt);
    EXPECT_EQ(membrane.state().force_N, 0);
    membrane.rearm();
    membrane.step(20e-6, 60e-6, 0.5, false, dt);
    EXPECT_EQ(membrane.state().force_N, before);
  }
}

}  // namespace
}  // namespace punctum::rt
