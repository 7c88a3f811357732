// Repulsive region, friction and vibration: against finite differences, balances of work kept here, and a
// simulated handle.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <deque>
#include <random>

#include "hal/sim/plant/hand.hpp"
#include "rt/forces/friction.hpp"
#include "rt/forces/repulsive_region.hpp"
#include "rt/forces/vibration.hpp"
#include "tests/support/fixtures.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using namespace test;
const Vec3 kCentre(3e-6, -37e-6, 1e-6);

EffectInput in_cell(const Vec3& tip, const Vec3& cell_centre, bool known, double dt) {
  EffectInput in;
  in.fixture_point_m = tip;
  in.cell_centre_m = cell_centre;
  in.cell_known = known;
  in.dt_s = dt;
  return in;
}

EffectInput handle_at(const Vec3& x) {
  EffectInput in;
  in.handle_m = x;
  in.force_fade = 1;
  return in;
}

TEST(RepulsiveRegion, pushes_away_by_the_gradient_of_its_hill) {
  const RepulsiveParams params;
  std::mt19937_64 random(3);
  std::normal_distribution<double> n;
  const double h = 2e-8;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 tip = kCentre + 8e-6 * Vec3(n(random), n(random), n(random));
    const auto U = [&](const Vec3& p) { return repulsive_push(params, kScale, kCentre, p).energy_J; };
    const Vec3 force = repulsive_push(params, kScale, kCentre, tip).force_N;
    EXPECT_LT((force + gradient(U, tip, h) / kScale).norm(), 1e-6);
    EXPECT_GE(force.dot(tip - kCentre), 0);
  }
  EXPECT_EQ(repulsive_push(params, kScale, kCentre, kCentre).force_N.norm(), 0);
  EXPECT_EQ(repulsive_push(params, kScale, kCentre, kCentre + Vec3(15e-6, 0, 0)).force_N.norm(), 0);
}

TEST(RepulsiveRegion, no_eigenvalue_of_its_hessian_exceeds_the_stiffness_it_gives) {
  const RepulsiveParams params;
  RepulsiveRegion region(params, kSetup);
  EXPECT_EQ(region.step(EffectInput{}).stiffness_N_m, 0);
  const Vec3 cell = kCentre - params.offset_m;
  double bound = 0;
  for (int i = 0; i < 1000; ++i) {
    bound = region.step(in_cell(kCentre, cell, true, 1e-3)).stiffness_N_m;
  }
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  const double h = 1e-9;
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    // At the centre, anywhere, and at the rim.
    Vec3 V = Vec3(u(random), u(random), u(random)) * params.radius_m * (i % 3 == 0 ? 1e-3 : 1.0);
    if (i % 3 == 1) {
      V = V.normalized() * params.radius_m * (1 + 1e-4 * u(random));
    }
    const Vec3 tip = kCentre + V;
    Eigen::Matrix3d hessian;
    for (int k = 0; k < 3; ++k) {
      hessian.col(k) = -(repulsive_push(params, kScale, kCentre, tip + Vec3::Unit(k) * h).force_N -
                         repulsive_push(params, kScale, kCentre, tip - Vec3::Unit(k) * h).force_N) /
                       (2 * h * kScale);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (hessian + hessian.transpose()),
                                                               Eigen::EigenvaluesOnly);
    worst = std::max(worst, eigen.eigenvalues().cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst, bound * (1 + 1e-6));
  EXPECT_GT(worst, 0.999 * bound);
  EXPECT_EQ(region.step(in_cell(kCentre + Vec3(16e-6, 0, 0), cell, true, 1e-3)).stiffness_N_m, 0);
}

TEST(RepulsiveRegion, books_every_joule_while_it_is_switched_and_moved) {
  const RepulsiveParams params;
  RepulsiveRegion region(params, kSetup);
  std::mt19937_64 random(11);
  std::normal_distribution<double> n;
  Vec3 cell = kCentre - params.offset_m;
  Vec3 tip = kCentre + Vec3(6e-6, 3e-6, 0);
  Vec3 velocity = Vec3::Zero();
  const double dt = 1e-4;
  double work = 0;
  (void)region.step(in_cell(tip, cell, true, dt));
  const double start = region.stored_energy_J() - region.injected_energy_J();
  for (int k = 0; k < 60000; ++k) {
    velocity += 1e-6 * Vec3(n(random), n(random), n(random)) - 0.002 * velocity -
                5e-5 * (tip - region.centre_m()) / 0.01;
    const Vec3 next = tip + velocity * dt;
    const Vec3 mean =
        region.gain() * repulsive_push(params, kScale, region.centre_m(), 0.5 * (tip + next)).force_N;
    work += mean.dot(next - tip) * kScale;
    tip = next;
    if (k % 9000 == 5000) {
      cell += 4e-6 * Vec3(n(random), n(random), n(random));
    }
    (void)region.step(in_cell(tip, cell, k % 20000 < 15000, dt));
  }
  EXPECT_NEAR(region.stored_energy_J() - region.injected_energy_J() - start + work, 0, 1e-8);
  EXPECT_GT(std::abs(region.injected_energy_J()), 1e-5);
}

TEST(Friction, gives_back_no_more_than_its_bristle_holds_whatever_the_way) {
  const FrictionParams params;
  const double most_J = params.F_c_N * params.F_c_N / (2 * params.K_N_m);
  std::mt19937_64 random(5);
  std::normal_distribution<double> n;
  for (int trial = 0; trial < 200; ++trial) {
    Friction friction(params, kSetup);
    Vec3 x = Vec3::Zero();
    Vec3 way = Vec3::Zero();
    Vec3 force = friction.step(handle_at(x)).storing_N;
    double given = 0;  // to the hand, by the trapezoidal rule on small steps
    for (int k = 0; k < 5000; ++k) {
      way = 0.99 * way + 2e-6 * Vec3(n(random), n(random), n(random));
      x += way;
      const EffectOutput out = friction.step(handle_at(x));
      const Vec3 next = out.storing_N;
      given += 0.5 * (force + next).dot(way);
      force = next;
      EXPECT_LE(force.norm(), params.F_c_N * (1 + 1e-12));
      EXPECT_LE(out.stored_J, most_J * (1 + 1e-12));
      ASSERT_LE(given, 1e-9) << "from a bristle at rest there is nothing to give";
    }
    EXPECT_LT(given, -most_J);  // it slid
  }
}

TEST(Friction, neither_drifts_nor_changes_under_a_trembling_hand_that_rests) {
  const FrictionParams params;
  Friction friction(params, kSetup);
  (void)friction.step(handle_at(Vec3::Zero()));
  const Vec3 first = friction.step(handle_at(Vec3(0.4e-3, 0, 0))).storing_N;
  // An encoder that flickers by one count for an hour at 1 kHz, and the same force at the end.
  for (int k = 0; k < 3'600'000; ++k) {
    (void)friction.step(handle_at(Vec3(0.4e-3 + (k % 2) * 0.03e-3, 0, 0)));
  }
  EXPECT_EQ(friction.step(handle_at(Vec3(0.4e-3, 0, 0))).storing_N.x(), first.x());
  EXPECT_EQ(first.x(), -params.K_N_m * 0.4e-3);
}

TEST(Friction, lets_a_handle_that_nobody_holds_come_to_rest) {
  // The simulated device at 1 kHz with its encoder and no friction of its own.
  sim::HandParams hand_params;
  hand_params.coulomb_N = 0;
  for (const int delay : {0, 1}) {
    hand_params.delay_ticks = delay;
    FrictionParams params;
    if (delay == 1) {
      params.K_N_m = 50;  // below b / (3/2 T)
    }
    sim::SimHand hand(hand_params, {0, 0});
    sim::HandPlantState pushed;
    pushed.velocity_m_s = sim::Point(0.1, 0, 0);
    hand.restore(pushed);
    Friction friction(params, kSetup);
    double least = 1, most = -1;
    for (int k = 1; k <= 30'000; ++k) {
      hand.step(1'000'000LL * k, 1e-3, Vec3::Zero(), Vec3::Zero(), true, sim::Failure::none);
      hal::HandState seen;
      ASSERT_EQ(hand.read(seen), hal::Status::ok);
      ASSERT_EQ(hand.write_force(friction.step(handle_at(seen.position_m)).storing_N), hal::Status::ok);
      if (k > 29'000) {
        least = std::min(least, hand.state().position_m.x);
        most = std::max(most, hand.state().position_m.x);
      }
    }
    EXPECT_LT(most - least, 4 * hand_params.encoder_step_m) << delay << " ticks";
  }
}

TEST(Friction, lets_go_while_no_force_is_rendered_and_adheres_anew_afterwards) {
  Friction friction(FrictionParams{}, kSetup);
  (void)friction.step(handle_at(Vec3::Zero()));
  EffectInput faded = handle_at(Vec3(0.4e-3, 0, 0));
  faded.force_fade = 0;
  EXPECT_EQ(friction.step(faded).storing_N.norm(), 0);
  EXPECT_EQ(friction.step(faded).stiffness_N_m, 0);
  const EffectOutput out = friction.step(handle_at(Vec3(0.5e-3, 0, 0)));
  EXPECT_EQ(out.storing_N.norm(), 0);
  EXPECT_EQ(out.stiffness_N_m, FrictionParams{}.K_N_m);
  EXPECT_EQ(Friction::kGives.point, EnergyPoint::handle);
}

EffectInput burst_at(const Vec3& handle, bool begins, double dt) {
  EffectInput in;
  in.handle_m = handle;
  in.approach_axis = Vec3::UnitX();
  in.contact_or_puncture_begins = begins;
  in.force_fade = 1;
  in.dt_s = dt;
  return in;
}

TEST(Vibration, is_a_bounded_burst_that_ends) {
  const VibrationParams params;
  Vibration vibration(params, kSetup);
  double largest = 0;
  int last = 0;
  int turns = 0;
  double before = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3 force = vibration.step(burst_at(Vec3::Zero(), k == 100, 0.25e-3)).active_N;
    EXPECT_EQ(force.y(), 0);
    EXPECT_LE(force.norm(), params.amplitude_N * std::exp(-(k - 100) * 0.25e-3 / params.decay_s) + 1e-15);
    largest = std::max(largest, force.norm());
    if (force.norm() > 0) {
      last = k;
    }
    if (force.x() * before < 0) {
      ++turns;
    }
    before = force.x();
  }
  EXPECT_GT(largest, 0.9 * params.amplitude_N * std::exp(-0.0017 / params.decay_s));
  EXPECT_NEAR((last - 100) * 0.25e-3, 7 * params.decay_s, 0.01);
  EXPECT_NEAR(turns, 2 * params.frequency_Hz * 7 * params.decay_s, 2);
  EXPECT_EQ(vibration.injected_energy_J(), 0);  // the hand did not move
}

TEST(Vibration, counts_what_it_gives_to_a_handle_and_stops_at_its_budget) {
  for (const int delay : {0, 1, 5}) {
    for (const double budget_J : {1.0, 1e-7}) {
      sim::HandParams hand_params;
      hand_params.delay_ticks = delay;
      sim::SimHand hand(hand_params, {0, 0});
      sim::HandPlantState moving;
      moving.velocity_m_s = sim::Point(0.05, 0, 0);
      hand.restore(moving);
      VibrationParams params;
      params.energy_J = budget_J;
      params.decay_s = 0.2;
      Vibration vibration(params, {.force_delay_ticks = delay});
      double given = 0;  // by the device itself
      double largest_step = 0;
      double highest = 0;
      for (int k = 0; k < 3000; ++k) {
        // The device's own book of work against the effect's, up to the encoder's rounding.
        const Vec3 x = hand.state().position_m;
        const Vec3 force = vibration.step(burst_at(x, k == 10, 1e-3)).active_N;
        ASSERT_EQ(hand.write_force(force), hal::Status::ok);
        EXPECT_NEAR(vibration.injected_energy_J(), given, 1e-15) << k;
        highest = std::max(highest, vibration.injected_energy_J());
        hand.step(1'000'000LL * (k + 1), 1e-3, Vec3::Zero(), Vec3::Zero(), true, sim::Failure::none);
        largest_step = std::max(largest_step, std::abs(hand.state().work_J - given));
        given = hand.state().work_J;
      }
      EXPECT_LE(highest, budget_J + (delay + 1) * largest_step);
      EXPECT_EQ(highest > budget_J, budget_J < 1e-6);  // the small one was reached
    }
  }
}

}  // namespace
}  // namespace punctum::rt
