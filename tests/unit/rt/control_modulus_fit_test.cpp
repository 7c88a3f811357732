// The modulus that the force sensor tells, against cells that know theirs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "hal/sim/plant/cell.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/modulus_fit.hpp"

namespace punctum::rt {
namespace {

constexpr double kStep_s = 1e-3, kSpeed_m_s = 8e-6, kNoise_N = 0.15e-6;

// A needle that goes straight into a simulated cell, a noisy sensor, and the law at the core's idea of the
// depth.
struct Press {
  explicit Press(double E_Pa, double R_m = 60e-6, std::uint64_t seed = 1, bool inner = false)
      : cell(cell_of(E_Pa, R_m, inner), {}, sim::HolderParams{}, seed, 0),
        law(MembraneParams{}),
        fit(MembraneParams{}.E_Pa),
        noise(seed) {
    tip.x() = cell.centre_m({}).x() + cell.R_m() + 30e-6;
  }
  static sim::CellParams cell_of(double E_Pa, double R_m, bool inner) {
    sim::CellParams p;
    p.spread = 0;
    p.zona_E_Pa = E_Pa;
    p.R_m = R_m;
    p.inner = inner;
    return p;
  }
  // To this depth of the tip past the undeformed membrane.
  void to(double depth_m) {
    const double goal_m = cell.centre_m({}).x() + cell.R_m() - depth_m;
    while (tip.x() > goal_m) {
      tick(tip - hal::Vec3(kSpeed_m_s * kStep_s, 0, 0));
    }
  }
  void hold(double seconds) {
    for (int k = 0; k < std::lround(seconds / kStep_s); ++k) {
      tick(tip);
    }
  }
  void tick(const hal::Vec3& next) {
    const sim::CellForce force = cell.step(state, {tip, next}, kStep_s);
    tip = next;
    const double truth_N = broken ? 0 : force.membrane_N;
    sensor_N +=
        (1 - std::exp(-kStep_s / kSensorTau_s)) * (truth_N + bias_N + kNoise_N * normal(noise) - sensor_N);
    const double depth_m = force.depth_m + depth_error_m;
    const MembraneState said = law.at(depth_m, cell.R_m(), 1);
    estimate = fit.step({.dt_s = kStep_s,
                         .sensor_N = sensor_N,
                         .sensor_fresh = sensor_fresh,
                         .clear = depth_m < -10e-6,
                         .pressing = !told && depth_m > 0,
                         .new_cell = false,
                         .law = said,
                         .depth_sd_m = depth_sd_m});
  }

  sim::Cell cell;
  sim::CellState state;
  MembraneLaw law;
  ModulusFit fit;
  std::mt19937_64 noise;
  std::normal_distribution<double> normal;
  hal::Vec3 tip = hal::Vec3::Zero();
  double sensor_N = 0, bias_N = 0, depth_error_m = 0, depth_sd_m = 0.2e-6;
  bool sensor_fresh = true, broken = false, told = false;
  ModulusEstimate estimate;
};

TEST(ModulusFit, holds_the_modulus_of_the_simulated_cell_in_its_interval) {
  int within = 0, runs = 0;
  double widest = 0;
  std::normal_distribution<double> normal;
  std::mt19937_64 draw(5);
  for (const double E_Pa : {8.26e3, 17.9e3, 35.3e3, 42.2e3}) {
    for (const double R_m : {50e-6, 55e-6, 60e-6, 65e-6, 70e-6}) {
      for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        Press p(E_Pa, R_m, seed);
        p.depth_error_m = p.depth_sd_m * normal(draw);
        p.to(20e-6);
        ASSERT_GT(p.estimate.sd_Pa, 0);
        within += std::abs(p.estimate.E_Pa - E_Pa) < 1.96 * p.estimate.sd_Pa ? 1 : 0;
        widest = std::max(widest, p.estimate.sd_Pa / p.estimate.E_Pa);
        ++runs;
        std::printf("%.2f kPa, %.0f um: %.2f +- %.2f\n", 1e-3 * E_Pa, 1e6 * R_m, 1e-3 * p.estimate.E_Pa,
                    1e-3 * p.estimate.sd_Pa);
      }
    }
  }
  EXPECT_GE(within, 36) << "of " << runs;
  EXPECT_LT(widest, 0.04);
}

TEST(ModulusFit, takes_an_inner_membrane_for_a_part_of_the_outer_one) {
  Press p(17.9e3, 60e-6, 1, true);
  p.to(20e-6);
  const sim::CellParams cell;
  const double both_Pa = 17.9e3 + cell.inner_E_Pa * cell.inner_h_m / cell.zona_h_m;
  EXPECT_GT(p.estimate.E_Pa, 17.9e3);
  EXPECT_LT(p.estimate.E_Pa, both_Pa + 2 * p.estimate.sd_Pa);
}

TEST(ModulusFit, tells_an_error_of_the_depth_from_a_stiff_cell) {
  for (const double depth_error_m : {-2e-6, 2e-6}) {
    Press p(35.3e3);
    p.depth_sd_m = 2e-6;
    p.depth_error_m = depth_error_m;
    p.to(24e-6);
    EXPECT_NEAR(p.estimate.E_Pa, 35.3e3, 0.05 * 35.3e3);
    EXPECT_LT(p.estimate.sd_Pa, 0.05 * 35.3e3);
  }
}

TEST(ModulusFit, takes_the_sensor_s_offset_for_what_it_is) {
  Press p(17.9e3);
  p.bias_N = 3e-6;
  p.sensor_N = p.bias_N;
  p.to(20e-6);
  EXPECT_NEAR(p.estimate.E_Pa, 17.9e3, 4 * p.estimate.sd_Pa);
}

TEST(ModulusFit, does_not_count_the_force_after_a_puncture_that_vision_has_not_told_yet) {
  Press p(17.9e3);
  p.to(16e-6);
  const ModulusEstimate before = p.estimate;
  p.broken = true;
  p.hold(0.25);
  p.told = true;
  p.hold(0.5);
  EXPECT_NEAR(p.estimate.E_Pa, before.E_Pa, before.sd_Pa);
}

TEST(ModulusFit, says_nothing_of_a_touch_or_without_a_sensor_and_forgets_the_last_cell) {
  Press p(17.9e3);
  p.to(2e-6);
  EXPECT_EQ(p.estimate.E_Pa, 0);
  p.sensor_fresh = false;
  p.to(12e-6);
  EXPECT_EQ(p.estimate.E_Pa, 0);
  p.sensor_fresh = true;
  p.to(20e-6);
  EXPECT_GT(p.estimate.E_Pa, 0);
  const ModulusEstimate next = p.fit.step({.new_cell = true, .law = {}});
  EXPECT_EQ(next.E_Pa, 0);
  EXPECT_EQ(next.sd_Pa, 0);
}

}  // namespace
}  // namespace punctum::rt
