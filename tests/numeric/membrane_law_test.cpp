// The paper's law, eq. 5 and eq. 4, against the printed formula: 60-digit values by mpmath
// (membrane_law_reference.py) and 120 digits by MPFR (printed_law.hpp).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "rt/control/local_membrane_model.hpp"
#include "rt/forces/membrane.hpp"
#include "tests/support/printed_law.hpp"

namespace punctum::rt {
namespace {

struct Reference {
  double E_Pa, nu, h_m, c_m, wd_m, a_m;
  double force_N, sigma_d_Pa, pressure_Pa, slope;
};
constexpr Reference kReference[] = {
#include "membrane_law_reference.inc"
};

MembraneParams paper() {
  MembraneParams params;
  params.law = MembraneParams::Law::paper;
  return params;
}

double relative(double value, double reference) { return std::abs(value - reference) / std::abs(reference); }

TEST(MembraneLaw, agrees_with_sixty_digits_in_double_from_zeta_1e_minus_6_to_1_minus_1e_minus_9) {
  double worst = 0;
  for (const Reference& r : kReference) {
    const double force = membrane_force(r.E_Pa, r.nu, r.h_m, r.c_m, r.wd_m, r.a_m);
    const double error = relative(force, r.force_N);
    worst = std::max(worst, error);
    EXPECT_LT(error, 4e-15) << "zeta = " << r.c_m / r.a_m;
  }
  RecordProperty("worst_relative_error", std::to_string(worst));
  std::printf("worst relative error, double: %.2e\n", worst);
}

TEST(MembraneLaw, agrees_with_the_printed_formula_at_1e5_random_places) {
  PrintedLaw printed;
  // The two references against each other: mpmath's values are rounded to double.
  for (const Reference& r : kReference) {
    EXPECT_LT(printed.relative_error(r.force_N, r.E_Pa, r.nu, r.h_m, r.c_m, r.wd_m, r.a_m), 1.2e-16);
  }
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  const auto between = [&](double low, double high) { return low * std::pow(high / low, u(random)); };
  double worst = 0, worst_zeta = 0, worst_w = 0;
  for (int i = 0; i < 100'000;) {
    const double c = between(1e-7, 1e-4);
    const double a = i % 2 == 0 ? c / between(1e-6, 1) : c / (1 - between(1e-9, 1));
    if (!(c / a >= 1e-6 && (a - c) / a >= 1e-9)) {
      continue;
    }
    const double w = i % 4 < 2 ? 10 * a * u(random) : between(1e-12, 10) * a;
    const double E = between(1e2, 1e9), h = between(1e-8, 1e-4), nu = 0.5 * u(random);
    if (!(w > 0)) {
      continue;
    }
    const double error = printed.relative_error(membrane_force(E, nu, h, c, w, a), E, nu, h, c, w, a);
    if (!(error <= worst)) {
      worst = error, worst_zeta = c / a, worst_w = w / a;
    }
    ++i;
  }
  EXPECT_LE(worst, 4e-15);
  std::printf("worst relative error, double: %.2e at zeta = 1 - %.2e, w = %.2g a\n", worst, 1 - worst_zeta,
              worst_w);
}

TEST(MembraneLaw, keeps_float_within_float_rounding) {
  double worst = 0;
  for (const Reference& r : kReference) {
    // The difference itself is handed over: a and c rounded to float know nothing of 1 - zeta = 1e-9.
    const auto c = static_cast<float>(r.c_m);
    const auto reach = static_cast<float>(r.a_m - r.c_m);
    const double f = static_cast<double>(membrane_shape(c, reach).f);
    const double exact = r.force_N * r.a_m * r.a_m * (1 - r.nu) /
                         (2 * std::acos(-1.0) * r.E_Pa * r.h_m * r.wd_m * r.wd_m * r.wd_m);
    // f ~ (1-zeta)^-4: rounding c and the reach to float costs up to 4 half-ulps each.
    if (r.a_m - r.c_m > 1e-8 * r.c_m) {
      worst = std::max(worst, relative(f, exact));
    }
  }
  EXPECT_LT(worst, 2e-6);
  std::printf("worst relative error, float: %.2e\n", worst);
}

TEST(MembraneLaw, gives_the_published_scale_of_micronewtons) {
  // Check values of the physics notes, two digits.
  const auto at = [](double E, double a) { return 1e6 * membrane_force(E, 0.5, 4.6e-6, 3.8e-6, 20e-6, a); };
  EXPECT_NEAR(at(17.9e3, 25e-6), 2.9, 0.05);
  EXPECT_NEAR(at(35.3e3, 25e-6), 5.7, 0.05);
  EXPECT_NEAR(at(42.2e3, 25e-6), 6.8, 0.05);
  EXPECT_NEAR(at(17.9e3, 20e-6), 6.2, 0.05);
  EXPECT_NEAR(at(35.3e3, 20e-6), 12.2, 0.05);
  EXPECT_NEAR(at(42.2e3, 20e-6), 14.6, 0.05);
}

TEST(MembraneLaw, follows_its_limit_1_over_3_times_1_minus_zeta_to_the_4th) {
  for (const double one_minus_zeta : {1e-4, 1e-6, 1e-8, 1e-12}) {
    const double reach = one_minus_zeta / (1 - one_minus_zeta);
    const double f = membrane_shape(1.0, reach).f;
    EXPECT_NEAR(f * 3 * std::pow(one_minus_zeta, 4), 1, 6 * one_minus_zeta);
  }
}

TEST(MembraneLaw, satisfies_the_force_balance_of_eq_4) {
  // F = pi c^2 p + 2 pi c h sigma_d tan(theta), every term from the table's independent evaluation.
  const double pi = std::acos(-1.0);
  for (const Reference& r : kReference) {
    const double balance =
        pi * r.c_m * r.c_m * r.pressure_Pa + 2 * pi * r.c_m * r.h_m * r.sigma_d_Pa * r.slope;
    EXPECT_LT(relative(balance, r.force_N), 1e-12);
  }
}

TEST(MembraneLaw, reports_stress_pressure_and_slope_of_eq_4) {
  // membrane_law() finds a by the closure; choose the scale so that it finds the table's a.
  const double R = 60e-6;
  for (const Reference& r : kReference) {
    MembraneParams params = paper();
    params.E_Pa = r.E_Pa;
    params.nu = r.nu;
    params.h_m = r.h_m;
    params.c_m = r.c_m;
    const double scale = (r.a_m - r.c_m) / std::sqrt(2 * R * r.wd_m);
    const MembraneState s = membrane_law(params, r.wd_m, R, scale);
    // The scale is rounded once: conditioning 4 in a - c.
    EXPECT_LT(relative(s.force_N, r.force_N), 2e-14);
    EXPECT_LT(relative(s.sigma_d_Pa, r.sigma_d_Pa), 2e-14);
    EXPECT_LT(relative(s.pressure_Pa, r.pressure_Pa), 2e-14);
    EXPECT_LT(relative(s.slope, r.slope), 2e-14);
    EXPECT_LT(relative(s.a_m, r.a_m), 1e-15);
  }
}

TEST(MembraneLaw, is_exactly_zero_without_a_dimple) {
  for (const auto& params : {paper(), MembraneParams{}}) {
    for (const double w : {0.0, -0.0, -1e-320, -1e-300, -1e-6, -1.0, -1e300}) {
      const MembraneState s = membrane_law(params, w, 60e-6, 0.6);
      EXPECT_EQ(s.force_N, 0) << w;
      EXPECT_EQ(s.stiffness_N_m, 0) << w;
      EXPECT_EQ(s.energy_J, 0) << w;
      EXPECT_EQ(s.a_m, 0) << w;
      EXPECT_EQ(s.sigma_d_Pa, 0) << w;
      EXPECT_TRUE(s.valid) << w;
      EXPECT_EQ(membrane_force(35.3e3, 0.5, 4.6e-6, 3.8e-6, w, 25e-6), 0) << w;
    }
  }
}

bool finite(const MembraneState& s) {
  for (const double x :
       {s.force_N, s.a_m, s.sigma_d_Pa, s.pressure_Pa, s.slope, s.pull_N, s.stiffness_N_m, s.energy_J}) {
    if (!std::isfinite(x)) {
      return false;
    }
  }
  return s.force_N >= 0 && s.stiffness_N_m >= 0 && s.energy_J >= 0;
}

// Denormals, the largest numbers, nothing, the wrong sign, and what is usual in between.
constexpr double kAnything[] = {0,
                                5e-324,
                                2e-310,
                                1e-300,
                                1e-150,
                                1e-12,
                                3.8e-6,
                                60e-6,
                                0.49,
                                35.3e3,
                                1e150,
                                1e300,
                                std::numeric_limits<double>::max(),
                                -1e-300,
                                -3.8e-6,
                                -1e300};

TEST(MembraneLaw, is_finite_for_any_finite_arguments) {
  std::mt19937_64 random(6);
  std::uniform_int_distribution<std::size_t> any(0, std::size(kAnything) - 1);
  const auto pick = [&] { return kAnything[any(random)]; };
  for (int i = 0; i < 1'000'000; ++i) {
    const double x[] = {pick(), pick(), pick(), pick(), pick(), pick()};
    const double F = membrane_force(x[0], x[1], x[2], x[3], x[4], x[5]);
    ASSERT_TRUE(std::isfinite(F) && F >= 0)
        << x[0] << ' ' << x[1] << ' ' << x[2] << ' ' << x[3] << ' ' << x[4] << ' ' << x[5];
  }
  for (int i = 0; i < 1'000'000; ++i) {
    MembraneParams params = i % 2 == 0 ? paper() : MembraneParams{};
    for (double* x :
         {&params.E_Pa, &params.nu, &params.h_m, &params.c_m, &params.prestrain, &params.seat_m}) {
      if (random() % 2 == 0) {
        *x = pick();
      }
    }
    const double w = pick(), R = pick(), scale = pick();
    ASSERT_TRUE(finite(membrane_law(params, w, R, scale)))
        << "law " << i % 2 << " E " << params.E_Pa << " nu " << params.nu << " h " << params.h_m << " c "
        << params.c_m << " prestrain " << params.prestrain << " seat " << params.seat_m << " w " << w << " R "
        << R << " scale " << scale;
  }
}

TEST(MembraneLaw, loses_nothing_on_the_way_when_only_a_partial_product_overflows) {
  PrintedLaw printed;
  constexpr double c = 3.8e-6, a = 25e-6;
  for (const auto& [E, h, w] :
       {std::array{1e300, 1e-300, 20e-6}, {1e-305, 1e300, 20e-6}, {1e300, 1e300, 1e-190}}) {
    EXPECT_LT(printed.relative_error(membrane_force(E, 0.5, h, c, w, a), E, 0.5, h, c, w, a), 4e-15) << E;
  }
}

TEST(MembraneLaw, answers_what_is_not_a_number_with_a_force_that_is_none) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const auto& good : {paper(), MembraneParams{}}) {
      for (double MembraneParams::* field :
           {&MembraneParams::E_Pa, &MembraneParams::nu, &MembraneParams::h_m, &MembraneParams::c_m,
            &MembraneParams::prestrain, &MembraneParams::seat_m}) {
        MembraneParams params = good;
        params.*field = bad;
        EXPECT_TRUE(std::isnan(membrane_law(params, 20e-6, 60e-6, 0.6).force_N));
        EXPECT_FALSE(membrane_law(params, 20e-6, 60e-6, 0.6).valid);
      }
      EXPECT_TRUE(std::isnan(membrane_law(good, bad, 60e-6, 0.6).force_N));
      EXPECT_TRUE(std::isnan(membrane_law(good, 20e-6, bad, 0.6).force_N));
      EXPECT_TRUE(std::isnan(membrane_law(good, 20e-6, 60e-6, bad).force_N));
      EXPECT_FALSE(membrane_law(good, bad, 60e-6, 0.6).valid);
    }
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  double x[] = {35.3e3, 0.5, 4.6e-6, 3.8e-6, 20e-6, 25e-6};
  for (double& argument : x) {
    const double good = std::exchange(argument, nan);
    EXPECT_TRUE(std::isnan(membrane_force(x[0], x[1], x[2], x[3], x[4], x[5])));
    argument = good;
  }
}

TEST(MembraneLaw, knows_its_own_stiffness) {
  // w, scale of the closure, dF/dw: mpmath.diff of the printed formula in 60 digits.
  constexpr double reference[][3] = {{1e-11, 0.6, 0.0053277159319823256}, {1e-9, 0.6, 0.005920319753638435},
                                     {1e-7, 0.6, 0.01259227955281439},    {1e-6, 0.6, 0.032615900481338264},
                                     {5e-6, 0.3, 0.584266185019442},      {20e-6, 0.6, 0.18554616150470585},
                                     {20e-6, 1.0, 0.047488363141344608},  {60e-6, 0.38, 1.3009518139111886}};
  for (const auto& [w, scale, stiffness] : reference) {
    EXPECT_NEAR(membrane_law(paper(), w, 60e-6, scale).stiffness_N_m / stiffness, 1, 1e-13) << w;
  }
}

TEST(MembraneLaw, vanishes_at_contact_in_proportion_to_the_depth) {
  const MembraneParams params = paper();
  const double R = 60e-6;
  for (const double scale : {0.3, 0.6, 1.0}) {
    // dF/dw at contact: 2 pi E h c^2 / (3 (1-nu) 4 R^2 scale^4), by 1-zeta -> sqrt(2 R w) scale / c.
    const double exact = 2 * std::acos(-1.0) * params.E_Pa * params.h_m * params.c_m * params.c_m /
                         (12 * (1 - params.nu) * R * R * std::pow(scale, 4));
    for (double w = 1e-13; w > 1e-300; w /= 31) {
      const double slope = membrane_law(params, w, R, scale).force_N / w;
      EXPECT_NEAR(slope / exact, 1, 5e-3) << w;
    }
  }
}

TEST(MembraneLaw, rises_without_a_jump_from_first_contact_with_the_shipped_closure) {
  const LocalModelParams shipped;
  for (const double scale : {shipped.dimple_scale, 0.38}) {
    const MembraneParams params = paper();
    constexpr double step = 1e-3;
    double before = 0;
    for (double w = 1e-16; w < 1e-3; w *= 1 + step) {
      const MembraneState s = membrane_law(params, w, 60e-6, scale);
      ASSERT_TRUE(finite(s)) << w;
      // F w^-1 never falls, F w^-3 never rises.
      if (before > 0) {
        ASSERT_GE(s.force_N / before, 1 + step - 1e-12) << w;
        ASSERT_LE(s.force_N / before, std::pow(1 + step, 3) + 1e-12) << w;
      }
      before = s.force_N;
    }
    for (double w = 5e-324; w < 1e-300; w *= 1.5) {
      EXPECT_GE(membrane_law(params, w, 60e-6, scale).force_N, 0);
    }
  }
}

TEST(MembraneLaw, stores_the_work_that_made_the_dimple) {
  // w, scale, integral of F dw: mpmath.quad of the printed formula.
  constexpr double reference[][3] = {
      {1e-09, 0.6, 2.805780236787826e-21}, {1e-07, 0.6, 4.507146431188104e-17},
      {3e-06, 0.3, 1.199268642778163e-12}, {2e-05, 0.6, 1.758795671170953e-11},
      {2e-05, 1.0, 4.319127199026833e-12}, {6e-05, 0.38, 1.100916977505737e-9},
  };
  for (const auto& [w, scale, energy] : reference) {
    EXPECT_NEAR(membrane_law(paper(), w, 60e-6, scale).energy_J / energy, 1, 1e-5) << w << " " << scale;
  }
}

TEST(MembraneLaw, says_when_it_is_outside_its_assumptions) {
  MembraneParams thin = paper();
  thin.h_m = 2e-6;
  EXPECT_TRUE(membrane_law(thin, 1e-6, 60e-6, 0.6).valid);
  EXPECT_FALSE(membrane_law(thin, 12e-6, 60e-6, 0.6).shallow);
  EXPECT_FALSE(membrane_law(thin, 12e-6, 60e-6, 0.6).valid);
  const MembraneParams thick = paper();  // the paper's: h > c
  EXPECT_FALSE(membrane_law(thick, 1e-6, 60e-6, 0.6).valid);
  EXPECT_TRUE(membrane_law(thick, 1e-6, 60e-6, 0.6).shallow);
}

}  // namespace
}  // namespace punctum::rt
