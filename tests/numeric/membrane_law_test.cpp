// Eq. 5 and eq. 4 against 60-digit values of the printed formula (membrane_law_reference.py, mpmath).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/forces/membrane.hpp"

namespace punctum::rt {
namespace {

struct Reference {
  double E_Pa, nu, h_m, c_m, wd_m, a_m;
  double force_N, sigma_d_Pa, pressure_Pa, slope;
};
constexpr Reference kReference[] = {
#include "membrane_law_reference.inc"
};

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
    if (r.a_m - r.c_m > 1e-8 * r.c_m) worst = std::max(worst, relative(f, exact));
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
    MembraneParams params;
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
  const MembraneParams params;
  for (const double w : {0.0, -0.0, -1e-300, -1e-6, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const MembraneState s = membrane_law(params, w, 60e-6, 0.6);
    EXPECT_EQ(s.force_N, 0) << w;
    EXPECT_EQ(s.a_m, 0) << w;
    EXPECT_EQ(s.sigma_d_Pa, 0) << w;
    EXPECT_TRUE(s.valid) << w;
    EXPECT_EQ(membrane_force(35.3e3, 0.5, 4.6e-6, 3.8e-6, w, 25e-6), 0) << w;
  }
}

TEST(MembraneLaw, knows_its_own_stiffness) {
  // w, scale of the closure, dF/dw: mpmath.diff of the printed formula in 60 digits.
  constexpr double reference[][3] = {{1e-11, 0.6, 0.0053277159319823256}, {1e-9, 0.6, 0.005920319753638435},
                                     {1e-7, 0.6, 0.01259227955281439},    {1e-6, 0.6, 0.032615900481338264},
                                     {5e-6, 0.3, 0.584266185019442},      {20e-6, 0.6, 0.18554616150470585},
                                     {20e-6, 1.0, 0.047488363141344608},  {60e-6, 0.38, 1.3009518139111886}};
  for (const auto& [w, scale, stiffness] : reference) {
    EXPECT_NEAR(membrane_law(MembraneParams{}, w, 60e-6, scale).stiffness_N_m / stiffness, 1, 1e-13) << w;
  }
}

TEST(MembraneLaw, vanishes_at_contact_in_proportion_to_the_depth) {
  const MembraneParams params;
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

TEST(MembraneLaw, rises_with_depth_and_is_finite_however_extreme_the_depth) {
  const MembraneParams params;
  double before = 0;
  for (double w = 1e-320; w < 1e-3; w *= 1.37) {
    const MembraneState s = membrane_law(params, w, 60e-6, 0.6);
    ASSERT_TRUE(std::isfinite(s.force_N) && std::isfinite(s.sigma_d_Pa) && std::isfinite(s.slope)) << w;
    ASSERT_GE(s.force_N, before) << w;
    before = s.force_N;
  }
}

TEST(MembraneLaw, says_when_it_is_outside_its_assumptions) {
  MembraneParams thin;
  thin.h_m = 2e-6;
  EXPECT_TRUE(membrane_law(thin, 1e-6, 60e-6, 0.6).valid);
  EXPECT_FALSE(membrane_law(thin, 12e-6, 60e-6, 0.6).small_slope);
  EXPECT_FALSE(membrane_law(thin, 12e-6, 60e-6, 0.6).valid);
  const MembraneParams thick;  // the paper's: h > c
  EXPECT_FALSE(membrane_law(thick, 1e-6, 60e-6, 0.6).valid);
  EXPECT_TRUE(membrane_law(thick, 1e-6, 60e-6, 0.6).small_slope);
}

}  // namespace
}  // namespace punctum::rt
