// The cone guide: gradient, smoothness, loop work, bounds; against finite differences and closed forms.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "rt/forces/cone_guide.hpp"
#include "tests/support/fixtures.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using namespace test;

FixtureFrame tilted_frame() { return {Vec3(21e-6, -4e-6, 2e-6), Vec3(-0.97, 0.15, -0.2).normalized()}; }

// A point at distance d in front of the membrane and r from the axis, at angle phi round it.
Vec3 at(const FixtureFrame& f, double d, double r, double phi) {
  const Vec3 e1 = f.axis.cross(Vec3::UnitZ()).normalized();
  const Vec3 e2 = f.axis.cross(e1);
  return f.entry_m - d * f.axis + r * (std::cos(phi) * e1 + std::sin(phi) * e2);
}

// Work that the field does on the hand along a polygon, by Simpson's rule on each piece.
double work_along(const ConeParams& params, const FixtureFrame& frame, const std::vector<Vec3>& corners,
                  int pieces) {
  double work = 0;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Vec3 step = (corners[i + 1] - corners[i]) / pieces;
    for (int k = 0; k < pieces; ++k) {
      const Vec3 a = corners[i] + k * step;
      const Vec3 sum = cone_pull(params, kScale, frame, a).force_N +
                       4 * cone_pull(params, kScale, frame, a + 0.5 * step).force_N +
                       cone_pull(params, kScale, frame, a + step).force_N;
      work += sum.dot(step) * kScale / 6;  // the hand moves k_p times the needle's way
    }
  }
  return work;
}

TEST(ConeGuide, pulls_towards_its_axis) {
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  for (const auto method : {ConeParams::Method::potential, ConeParams::Method::paper}) {
    ConeParams p = params;
    p.method = method;
    const Vec3 tip = at(frame, 10e-6, 12e-6, 0.7);
    const Vec3 V = tip - frame.entry_m;
    const Vec3 lateral = V - frame.axis.dot(V) * frame.axis;
    EXPECT_LT(cone_pull(p, kScale, frame, tip).force_N.dot(lateral), 0);
  }
}

TEST(ConeGuide, force_is_the_gradient_of_its_potential_at_hand_scale) {
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> d(-90e-6, 150e-6), r(0, 80e-6), phi(0, 6.28);
  const double h = 2e-8;
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 tip = at(frame, d(random), r(random), phi(random));
    const auto U = [&](const Vec3& p) { return cone_pull(params, kScale, frame, p).energy_J; };
    const Vec3 force = cone_pull(params, kScale, frame, tip).force_N;
    worst = std::max(worst, (force + gradient(U, tip, h) / kScale).norm());
  }
  EXPECT_LT(worst, 2e-6);  // N, of forces up to 0.8 N
  std::printf("worst difference from the gradient: %.1e N\n", worst);
}

TEST(ConeGuide, has_no_corner_anywhere) {
  // C1: one-sided slopes of the force, taken at distance h, differ by no more than a second derivative times
  // h.
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  const auto force = [&](double d, double r) {
    return cone_pull(params, kScale, frame, at(frame, d, r, 1.1)).force_N;
  };
  const auto jump = [&](double d, double r, double ud, double ur, double h) -> double {
    const Vec3 here = force(d, r);
    return ((force(d + ud * h, r + ur * h) - here) - (here - force(d - ud * h, r - ur * h))).norm() / h;
  };
  const double tan_alpha = std::tan(params.alpha_rad);
  const double cos_alpha = std::cos(params.alpha_rad);
  struct Border {
    double d, r;
  };
  std::vector<Border> borders;
  for (const double d : {-79e-6, -60e-6, -1e-6, 20e-6, 100e-6}) {
    const double e = 0.25 * params.d0_m;
    const double core = params.r0_m + (d > e ? tan_alpha * (d - e / 2) : 0.0);
    borders.push_back({d, core});                             // edge of the free core
    borders.push_back({d, core + params.eps_m / cos_alpha});  // end of the ramp
  }
  for (const double r : {5e-6, 20e-6, 60e-6}) {
    for (const double d : {0.0, 0.25 * params.d0_m, -params.d0_m, -2 * params.d0_m}) {
      borders.push_back({d, r});
    }
  }
  for (const Border& b : borders) {
    for (const auto& [ud, ur] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {0.7, 0.7}}) {
      const double coarse = jump(b.d, b.r, ud, ur, 1e-7);
      const double fine = jump(b.d, b.r, ud, ur, 1e-9);
      // A corner's jump stays; without one it goes with h. Slopes are up to K k_p = 6e4 N/m at needle scale.
      EXPECT_LT(fine, 0.02 * coarse + 10) << "d = " << b.d << " r = " << b.r;
    }
  }
}

TEST(ConeGuide, does_no_work_round_a_loop) {
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  const std::vector<Vec3> loop{at(frame, 100e-6, 0, 0), at(frame, 100e-6, 20e-6, 0),
                               at(frame, 2e-6, 20e-6, 0), at(frame, 2e-6, 0, 0), at(frame, 100e-6, 0, 0)};
  EXPECT_NEAR(work_along(params, frame, loop, 20000), 0, 1e-12);
  // Round the axis too, through the membrane and behind.
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> d(-90e-6, 120e-6), r(0, 50e-6), phi(0, 6.28);
  for (int i = 0; i < 20; ++i) {
    std::vector<Vec3> way;
    for (int k = 0; k < 5; ++k) {
      way.push_back(at(frame, d(random), r(random), phi(random)));
    }
    way.push_back(way.front());
    EXPECT_NEAR(work_along(params, frame, way, 4000), 0, 1e-9);
  }
}

TEST(ConeGuide, paper_law_gives_back_half_k_r_squared_times_the_difference_of_f) {
  ConeParams params;
  params.method = ConeParams::Method::paper;
  const FixtureFrame frame = tilted_frame();
  const double r = 20e-6;
  const double d1 = 2e-6;
  const double d2 = 100e-6;
  const auto f = [&](double d) { return params.d0_m / (params.d0_m + d); };
  // Out to r where the pull is weak, along the membrane's normal to where it is strong, and in there.
  const std::vector<Vec3> loop{at(frame, d2, 0, 0), at(frame, d2, r, 0), at(frame, d1, r, 0),
                               at(frame, d1, 0, 0), at(frame, d2, 0, 0)};
  const double analytic = 0.5 * params.K_N_m * (r * kScale) * (r * kScale) * (f(d1) - f(d2));
  EXPECT_NEAR(work_along(params, frame, loop, 2000), analytic, 1e-12);
  EXPECT_GT(analytic, 3e-3);  // millijoules at the hand
}

TEST(ConeGuide, paper_law_matches_the_figure_of_the_notes_3_7_m_j) {
  // K = 100 N/m, r = 10 mm at the hand, f = 1/d in mm, d from 50 to 1 mm: 1/2 K r^2 (1 - 1/50) ... per mm.
  // With f = d0/(d0+d), d0 -> the same numbers: choose d0 + d = 1 and 50 units.
  ConeParams params;
  params.method = ConeParams::Method::paper;
  params.K_N_m = 100;
  params.d0_m = 1e-6;
  const FixtureFrame frame = tilted_frame();
  const double r = 10e-3 / kScale;
  const std::vector<Vec3> loop{at(frame, 49e-6, 0, 0), at(frame, 49e-6, r, 0), at(frame, 0, r, 0),
                               at(frame, 0, 0, 0), at(frame, 49e-6, 0, 0)};
  EXPECT_NEAR(work_along(params, frame, loop, 20000), 0.5 * 100 * 1e-4 * (1 - 1.0 / 50), 1e-8);
}

// Largest magnitude of an eigenvalue of the Hessian at the hand, by central differences of the force.
double curvature(const ConeParams& params, const FixtureFrame& frame, const Vec3& tip) {
  const double h = 1e-4 * std::min({params.eps_m, params.d0_m, params.reach_m});
  Eigen::Matrix3d hessian;
  for (int k = 0; k < 3; ++k) {
    hessian.col(k) = -(cone_pull(params, kScale, frame, tip + Vec3::Unit(k) * h).force_N -
                       cone_pull(params, kScale, frame, tip - Vec3::Unit(k) * h).force_N) /
                     (2 * h * kScale);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (hessian + hessian.transpose()),
                                                             Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().cwiseAbs().maxCoeff();
}

TEST(ConeGuide, no_eigenvalue_of_its_hessian_exceeds_the_bound_it_gives) {
  std::mt19937_64 random(17);
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const FixtureFrame frame = tilted_frame();
  double worst = 0;        // over the bound
  double worst_there = 0;  // of the shipped cone, over K
  Vec3 where = Vec3::Zero();
  for (int guide = 0; guide < 250; ++guide) {
    ConeParams params;
    if (guide > 0) {
      params.d0_m = std::pow(10, between(-5.5, -3.5));
      params.reach_m = params.d0_m * std::pow(10, between(-1.5, 0.6));
      params.eps_m = params.reach_m * std::pow(10, between(-3, 0));
      params.r0_m = guide % 3 == 0 ? 0 : params.reach_m * between(0, 1);
      params.alpha_rad = guide % 5 == 0 ? 0 : between(0, 1.2);
    }
    const double bound = cone_stiffness_bound_N_m(params);
    const double e = 0.25 * params.d0_m;
    for (int i = 0; i < (guide == 0 ? 200'000 : 800); ++i) {
      // Apex, rim of the core, axis, behind the membrane, far away.
      double d = params.d0_m * between(-2.1, 4);
      if (i % 4 == 0) {
        d = e * between(-0.1, 1.1);
      }
      const double core = params.r0_m + (d > 0 ? std::tan(params.alpha_rad) * std::max(d - e / 2, 0.0) : 0.0);
      double r = params.reach_m * std::pow(10, between(-3, 1));
      if (i % 3 == 0) {
        r = core + params.reach_m * between(0, 1);
      }
      if (i % 3 == 1) {
        r = core + params.eps_m * between(-0.5, 2);
      }
      const double k = curvature(params, frame, at(frame, d, std::max(r, 0.0), between(0, 6.28)));
      worst = std::max(worst, k / bound);
      if (guide == 0 && k / params.K_N_m > worst_there) {
        worst_there = k / params.K_N_m;
        where = Vec3(d, r, 0);
      }
    }
  }
  EXPECT_LE(worst, 1);
  const double of_K = cone_stiffness_bound_N_m(ConeParams{}) / ConeParams{}.K_N_m;
  EXPECT_LT(of_K, 1.1);          // of little use if it were much larger
  EXPECT_GT(worst_there, 0.95);  // and the search came near
  std::printf(
      "worst eigenvalue: %.4f of the bound; shipped cone %.4f K at d %.1f um, r %.1f um, bound %.4f K\n",
      worst, worst_there, where[0] * 1e6, where[1] * 1e6, of_K);
}

// The guide is switched by the puncture.
EffectInput guided(const Vec3& tip, const FixtureFrame& entry, bool on, double dt) {
  EffectInput in;
  in.fixture_point_m = tip;
  in.cell_known = true;
  in.entry = entry;
  in.punctured = !on;
  in.dt_s = dt;
  return in;
}

TEST(ConeGuide, tells_its_stiffness_by_its_gain) {
  ConeGuide guide(ConeParams{}, kSetup);
  const EffectInput in = guided(tilted_frame().entry_m, tilted_frame(), true, 1e-3);
  EffectOutput out = guide.step(in);
  EXPECT_LT(out.stiffness_N_m, 0.1);
  for (int i = 0; i < 1000; ++i) {
    out = guide.step(in);
  }
  EXPECT_EQ(out.stiffness_N_m, cone_stiffness_bound_N_m(ConeParams{}));
}

TEST(ConeGuide, stores_at_the_fixture_point_and_is_off_until_the_cell_is_known) {
  ConeGuide guide(ConeParams{}, kSetup);
  EffectInput in = guided(at(tilted_frame(), 10e-6, 15e-6, 0), tilted_frame(), true, 1e-3);
  in.cell_known = false;
  EXPECT_EQ(guide.step(in).storing_N.norm(), 0);
  in.cell_known = true;
  const EffectOutput out = guide.step(in);
  EXPECT_GT(out.storing_N.norm(), 0);
  EXPECT_EQ(ConeGuide::kGives.point, EnergyPoint::fixture_point);
  EXPECT_EQ(out.dissipative_N.norm() + out.active_N.norm() + out.damping_Ns_m, 0);
}

TEST(ConeGuide, force_is_bounded_however_far_away) {
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  double largest = 0;
  for (double d = -100e-6; d < 1e-3; d += 2e-6) {
    for (double r = 1e-7; r < 1e-3; r *= 1.2) {
      largest = std::max(largest, cone_pull(params, kScale, frame, at(frame, d, r, 2)).force_N.norm());
    }
  }
  EXPECT_LT(largest, 2.0);  // N, under the hand's limit of 3
  std::printf("largest pull: %.2f N\n", largest);
}

TEST(ConeGuide, is_exactly_zero_in_the_free_core_and_behind_the_cell) {
  const ConeParams params;
  const FixtureFrame frame = tilted_frame();
  EXPECT_EQ(cone_pull(params, kScale, frame, at(frame, 30e-6, 0.9e-6, 1)).force_N.norm(), 0);
  EXPECT_EQ(cone_pull(params, kScale, frame, frame.entry_m).force_N.norm(), 0);
  EXPECT_EQ(cone_pull(params, kScale, frame, at(frame, -2.01 * params.d0_m, 20e-6, 1)).force_N.norm(), 0);
  EXPECT_EQ(cone_pull(params, kScale, frame, at(frame, -1e-3, 20e-6, 1)).energy_J, 0);
}

TEST(ConeGuide, books_every_joule_while_it_is_switched_and_moved) {
  // U(k) - U(0) = -(work on the hand) + injected, for a hand that wanders while the guide moves and switches.
  const ConeParams params;
  ConeGuide guide(params, kSetup);
  FixtureFrame target = tilted_frame();
  std::mt19937_64 random(11);
  std::normal_distribution<double> n;
  Vec3 tip = at(target, 40e-6, 15e-6, 0);
  Vec3 velocity = Vec3::Zero();
  const double dt = 1e-4;
  double work = 0;
  (void)guide.step(guided(tip, target, true, dt));
  const double start = guide.stored_energy_J() - guide.injected_energy_J();
  for (int k = 0; k < 60000; ++k) {
    velocity += 1e-5 * Vec3(n(random), n(random), n(random)) - 0.01 * velocity;
    const Vec3 next = tip + velocity * dt;
    // The exact field between the ticks stands still in between: mid-point rule.
    const Vec3 mean = guide.gain() * cone_pull(params, kScale, guide.frame(), 0.5 * (tip + next)).force_N;
    work += mean.dot(next - tip) * kScale;
    tip = next;
    if (k % 9000 == 5000) {
      target.entry_m += 8e-6 * Vec3(n(random), n(random), n(random));
    }
    if (k % 7000 == 3000) {
      target.axis = (target.axis + 0.1 * Vec3(n(random), n(random), n(random))).normalized();
    }
    (void)guide.step(guided(tip, target, k % 20000 < 15000, dt));
  }
  const double balance = guide.stored_energy_J() - guide.injected_energy_J() - start + work;
  EXPECT_NEAR(balance, 0, 1e-8);
  EXPECT_GT(std::abs(work), 1e-5);
}

TEST(ConeGuide, moves_and_switches_without_a_step) {
  const ConeParams params;
  for (const double dt : {1e-3, 0.125e-3}) {
    ConeGuide guide(params, kSetup);
    FixtureFrame target = tilted_frame();
    const Vec3 tip = at(target, 10e-6, 15e-6, 0.3);
    Vec3 before = Vec3::Zero();
    double steepest = 0;
    for (int k = 0; k < static_cast<int>(3 / dt); ++k) {
      const double t = k * dt;
      if (t > 1) {
        target.entry_m.y() = -10e-6;
      }
      if (t > 1.5) {
        target.axis = -Vec3::UnitX();
      }
      const Vec3 force = guide.step(guided(tip, target, t < 2, dt)).storing_N;
      steepest = std::max(steepest, (force - before).norm() / dt);
      before = force;
    }
    EXPECT_EQ(before.norm(), 0);
    EXPECT_LT(steepest, 15.0) << "N/s";  // 15 mN per millisecond at most
  }
}

}  // namespace
}  // namespace punctum::rt
