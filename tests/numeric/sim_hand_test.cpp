// The haptic device against independent solutions: closed forms written down here, and the matrix
// exponentials of sim_hand_reference.py in 40 digits.
#include <gtest/gtest.h>

#include <cmath>

#include "hal/sim/noise.hpp"
#include "hal/sim/plant/hand.hpp"

namespace punctum::sim {
namespace {

constexpr ArmImpedance kNoArm{0, 0};

HandParams handle(double mass_kg, double damping_Ns_m, double coulomb_N) {
  HandParams p;
  p.mass_kg = mass_kg;
  p.damping_Ns_m = damping_Ns_m;
  p.coulomb_N = coulomb_N;
  return p;
}

struct HandReference {
  double m, b, K, B, friction, force, u, x, v, p, T;
  double x_end, v_end;
};

// Printed by sim_hand_reference.py.
constexpr HandReference kReferences[] = {
    {0.075, 0.1, 250.0, 6.0, 0.0, 0.8, 0.02, 0.001, -0.03, 0.002, 0.001, 0.00097880514245328878291,
     -0.012602661108794278093},  // smooth
    {0.075, 0.1, 250.0, 6.0, 0.0, 0.8, 0.02, 0.001, -0.03, 0.002, 0.2, 0.0091909256283799565019,
     0.020112937882195368542},  // smooth
    {0.075, 0.1, 20.0, 6.0, 0.0, -0.3, 0.01, 0.0, 0.05, 0.0, 0.05, -0.00085693707352001512574,
     -0.035006927123652873404},  // smooth
    {0.25, 0.0, 100.0, 10.0, 0.0, 0.5, 0.0, 0.003, 0.1, 0.0, 0.03, 0.0048902376727811947135,
     0.035123944710017691688},  // smooth
    {0.075, 0.1, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.5, 0.30661939462144363829,
     1.0245074738380751489},  // smooth
    {0.075, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.5, 0.38333333333333333333,
     1.4333333333333333333},  // smooth
    {0.075, 0.1, 250.0, 6.0, 0.04, 0.0, 0.002, 0.0, 0.0, 0.0, 0.3, 0.00043919800123404995828,
     0.0020001352622849618926},  // slips 0.056
    {0.075, 0.1, 250.0, 0.2, 0.04, 0.0, 0.0, 0.01, 0.0, 0.0, 1.0, -0.0001238130706997031164,
     0.0},  // stops 0.054446659; stops 0.10889332; stops 0.16333998; stops 0.21778663; stops 0.27223329;
            // stops 0.32667995; stops 0.38112661; stops 0.43557327; stops 0.49001993; stops 0.54446659; stops
            // 0.59891325; stops 0.6533599; stops 0.70780656; stops 0.76225322
    {0.075, 0.1, 250.0, 0.2, 0.3, 1.0, -0.004, 0.01, 0.0, 0.0, 0.6, 0.0027850785393896378078,
     -0.0020843666690544273641},  // stops 0.054975592; stops 0.10808944; slips 0.28024267
    {0.075, 0.02, 400.0, 0.05, 0.5, 0.1, 0.05, 0.0, 0.0, 0.0, 0.4, 0.018708988142659029097,
     0.086320129826562803549},  // slips 0.019875
};

TEST(SimHand, matches_the_matrix_exponential_in_40_digits) {
  for (const HandReference& r : kReferences) {
    HandAxis axis{r.x, r.v};
    advance(axis, handle(r.m, r.b, r.friction), {r.K, r.B}, r.force, r.p, r.u, r.T);
    EXPECT_NEAR(axis.x_m, r.x_end, 1e-14) << "K " << r.K << " friction " << r.friction << " T " << r.T;
    EXPECT_NEAR(axis.v_m_s, r.v_end, 2e-13) << "K " << r.K << " friction " << r.friction << " T " << r.T;
  }
}

TEST(SimHand, gives_the_same_however_the_interval_is_cut) {
  for (const HandReference& r : kReferences) {
    for (const int pieces : {7, 400}) {
      HandAxis axis{r.x, r.v};
      const double dt = r.T / pieces;
      for (int i = 0; i < pieces; ++i) {
        advance(axis, handle(r.m, r.b, r.friction), {r.K, r.B}, r.force, r.p + r.u * dt * i, r.u, dt);
      }
      EXPECT_NEAR(axis.x_m, r.x_end, 1e-12);
      EXPECT_NEAR(axis.v_m_s, r.v_end, 1e-11);
    }
  }
}

TEST(SimHand, falls_like_a_body_without_friction) {
  HandAxis axis{0.01, -0.2};
  advance(axis, handle(0.1, 0, 0), kNoArm, 0.3, 0, 0, 0.7);
  EXPECT_NEAR(axis.x_m, 0.01 - 0.2 * 0.7 + 0.5 * 3.0 * 0.7 * 0.7, 1e-15);
  EXPECT_NEAR(axis.v_m_s, -0.2 + 3.0 * 0.7, 1e-15);
}

TEST(SimHand, stops_by_dry_friction_where_mechanics_says_it_stops) {
  // v0^2 m / (2 f_c), after v0 m / f_c.
  const double m = 0.075;
  const double friction = 0.04;
  const double v0 = 0.1;
  HandAxis axis{0, v0};
  advance(axis, handle(m, 0, friction), kNoArm, 0, 0, 0, v0 * m / friction - 1e-6);
  EXPECT_GT(axis.v_m_s, 0);
  advance(axis, handle(m, 0, friction), kNoArm, 0, 0, 0, 1);
  EXPECT_EQ(axis.v_m_s, 0);
  EXPECT_NEAR(axis.x_m, v0 * v0 * m / (2 * friction), 1e-15);
}

TEST(SimHand, stops_by_dry_and_viscous_friction_where_mechanics_says_it_stops) {
  // t = m/b ln(1 + b v0 / f_c), x = m/b (v0 - f_c t / m).
  const double m = 0.075;
  const double b = 0.3;
  const double friction = 0.04;
  const double v0 = -0.2;
  const double t = m / b * std::log(1 + b * std::abs(v0) / friction);
  HandAxis axis{0, v0};
  advance(axis, handle(m, b, friction), kNoArm, 0, 0, 0, 1);
  EXPECT_EQ(axis.v_m_s, 0);
  EXPECT_NEAR(axis.x_m, -m / b * (std::abs(v0) - friction * t / m), 1e-15);
}

TEST(SimHand, sticks_until_the_arm_pulls_harder_than_friction) {
  // K u t = f_c.
  const ArmImpedance arm{250, 0};
  const double u = 0.002;
  const double until = 0.04 / (250 * u);
  HandAxis axis{0, 0};
  advance(axis, handle(0.075, 0.1, 0.04), arm, 0, 0, u, until * (1 - 1e-9));
  EXPECT_EQ(axis.x_m, 0);
  EXPECT_EQ(axis.v_m_s, 0);
  advance(axis, handle(0.075, 0.1, 0.04), arm, 0, u * until, u, 0.01);
  EXPECT_GT(axis.v_m_s, 0);
}

TEST(SimHand, holds_against_a_force_below_friction_for_ever) {
  HandAxis axis{0.001, 0};
  for (int i = 0; i < 1000; ++i) {
    advance(axis, handle(0.075, 0.1, 0.04), kNoArm, 0.0399, 0, 0, 0.001);
  }
  EXPECT_EQ(axis.x_m, 0.001);
}

TEST(SimHand, creates_no_energy) {
  // The arm's intention at rest: kinetic energy and the arm's spring gain no more than the amplifier's work.
  const Noise noise(7, Noise::Stream::free_use);
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    const double friction = trial % 3 == 0 ? 0.0 : 0.3 * noise.uniform(10 * trial);
    const HandParams hand =
        handle(0.05 + 0.3 * noise.uniform(10 * trial + 1), 0.3 * noise.uniform(10 * trial + 2), friction);
    const ArmImpedance arm{trial % 5 == 0 ? 0 : 1500 * noise.uniform(10 * trial + 3),
                           trial % 4 == 0 ? 0 : 8 * noise.uniform(10 * trial + 4)};
    const double p = 0.01 * noise.gaussian(10 * trial + 5);
    HandAxis axis{0, 0.1 * noise.gaussian(10 * trial + 6)};
    const auto energy = [&] {
      return 0.5 * hand.mass_kg * axis.v_m_s * axis.v_m_s +
             0.5 * arm.stiffness_N_m * (axis.x_m - p) * (axis.x_m - p);
    };
    double stored = energy();
    for (std::uint64_t k = 0; k < 500; ++k) {
      const double force = 2 * noise.gaussian(100'000 + 1000 * trial + k);
      const double before = axis.x_m;
      advance(axis, hand, arm, force, p, 0, 0.001);
      const double now = energy();
      EXPECT_LE(now - stored, force * (axis.x_m - before) + 1e-12 * (1 + now)) << "trial " << trial;
      stored = now;
    }
  }
}

TEST(SimHand, reads_in_steps_of_its_encoder) {
  HandParams p;
  SimHand hand(p, kNoArm);
  HandPlantState s;
  s.position_m = Point(0.0100123, -0.02, 0.03);
  hand.restore(s);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::none);
  hal::HandState seen;
  ASSERT_EQ(hand.read(seen), hal::Status::ok);
  EXPECT_NEAR(seen.position_m.x(), 334 * 0.03e-3, 1e-12);  // 0.0100123 / 0.03e-3 = 333.74
  EXPECT_NEAR((seen.position_m - Vec3(s.position_m)).cwiseAbs().maxCoeff(), 0, 0.015e-3 + 1e-12);
}

TEST(SimHand, gives_no_more_force_than_its_motors_can) {
  HandParams p;
  p.coulomb_N = 0;
  p.damping_Ns_m = 0;
  SimHand hand(p, kNoArm);
  ASSERT_EQ(hand.write_force(Vec3(30, 40, 0)), hal::Status::ok);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::none);
  EXPECT_NEAR(hand.state().velocity_m_s.x, 0.6 * 8.5 / 0.075 * 0.001, 1e-12);
  EXPECT_NEAR(hand.state().velocity_m_s.y, 0.8 * 8.5 / 0.075 * 0.001, 1e-12);
  EXPECT_NEAR(hand.state().work_J, 0.5 * 0.075 * std::pow(8.5 / 0.075 * 0.001, 2), 1e-12);
}

TEST(SimHand, gives_a_force_so_many_ticks_late_as_its_delay) {
  for (int delay = 0; delay <= kMaxDelayTicks; ++delay) {
    HandParams p;
    p.delay_ticks = delay;
    SimHand hand(p, kNoArm);
    for (int k = 0; k < 12; ++k) {
      const double wanted = k + 1;  // written before step k: acts over step k + delay
      ASSERT_EQ(hand.write_force(Vec3(0.1 * wanted, 0, 0)), hal::Status::ok);
      hand.step(1'000'000 * (k + 1), 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::none);
      EXPECT_EQ(hand.state().applied_N.x, k >= delay ? 0.1 * (wanted - delay) : 0.0) << delay << " ticks";
    }
  }
}

TEST(SimHand, gives_no_force_without_power) {
  HandParams p;
  SimHand hand(p, kNoArm);
  ASSERT_EQ(hand.write_force(Vec3(1, 0, 0)), hal::Status::ok);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), false, Failure::none);
  EXPECT_EQ(hand.state().position_m.x, 0);
  EXPECT_EQ(hand.state().amplifier_on, 0U);
}

TEST(SimHand, refuses_a_force_that_is_not_a_number) {
  SimHand hand(HandParams{}, kNoArm);
  EXPECT_EQ(hand.write_force(Vec3(1, std::nan(""), 0)), hal::Status::fault);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::none);
  EXPECT_EQ(hand.state().position_m.x, 0);
}

TEST(SimHand, tells_how_the_handle_is_tilted) {
  SimHand hand(HandParams{}, kNoArm);
  hand.set_grip(0.03, -0.04, hal::kButtonInject);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::none);
  hal::HandState seen;
  ASSERT_EQ(hand.read(seen), hal::Status::ok);
  const Eigen::AngleAxisd turn(seen.orientation);
  EXPECT_NEAR(turn.angle(), 0.05, 1e-15);
  EXPECT_NEAR(turn.axis().dot(Vec3(0.6, -0.8, 0)), 1, 1e-12);
  EXPECT_EQ(seen.buttons, hal::kButtonInject);
}

}  // namespace
}  // namespace punctum::sim
