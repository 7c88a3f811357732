// What a device can render, against the eigenvalues of the closed loop (device_limits_reference.py), the
// closed forms of the literature, and the loop itself stepped in time.
#include "rt/control/device_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <deque>

namespace punctum::rt {
namespace {

constexpr double kT = 1e-3;

HandDevice device(double mass_kg, double damping_Ns_m, int delay_ticks) {
  HandDevice d;
  d.mass_kg = mass_kg;
  d.damping_Ns_m = damping_Ns_m;
  d.delay_ticks = delay_ticks;
  return d;
}

VelocityParams slope_of(int window, double smooth_s = 0) {
  VelocityParams v;
  v.method = VelocityParams::Method::foaw;
  v.window = window;
  v.smooth_s = smooth_s;
  return v;
}

struct Row {
  double m, b, T;
  int delay;
  double smooth_s;
  int window;  // 0: Kalman
  double jerk, B;
  double B_max, K_max;
};

// Printed by device_limits_reference.py.
constexpr Row kRows[] = {
    {0.074999999999999997, 0.10000000000000001, 0.001, 0, 0, 1, 0, 0, 150, 200.044454322},
    {0.074999999999999997, 0.10000000000000001, 0.001, 0, 0.0030000000000000001, 16, 0, 4, 13.7884486637,
     919.739183911},
    {0.074999999999999997, 0.10000000000000001, 0.001, 1, 0.0030000000000000001, 16, 0, 4, 12.1154520114,
     584.185838299},
    {0.074999999999999997, 0.10000000000000001, 0.001, 2, 0.0030000000000000001, 16, 0, 1, 10.8265223927,
     288.035393021},
    {0.074999999999999997, 0.10000000000000001, 0.00025000000000000001, 0, 0.0030000000000000001, 4, 0, 4,
     43.6694636357, 6004.75054203},
    {0.074999999999999997, 0.10000000000000001, 0.00025000000000000001, 2, 0.0030000000000000001, 8, 0, 4,
     21.419878743, 1747.34218882},
    {0.074999999999999997, 0.10000000000000001, 0.000125, 5, 0.0030000000000000001, 8, 0, 1, 20.7982588912,
     983.542627647},
    {0.044999999999999998, 0.02, 0.001, 0, 0, 4, 0, 13.5, 36.2927022752, 6572.41107127},
    {0.20000000000000001, 1.5, 0.001, 3, 0.001, 8, 0, 10.000000000000002, 42.7695727464, 2068.39871089},
    {0.02, 5, 0.001, 1, 0, 2, 0, 4, 13.66563146, 4569.24412903},
    {0.02, 5, 0.001, 0, 0, 1, 0, 0, 40, 10434.3107424},
    {1, 0.5, 0.002, 5, 0.02, 3, 0, 10, 84.4351004201, 581.395343119},
    {0.074999999999999997, 0.10000000000000001, 0.001, 0, 0, 0, 5, 4, 17.3527619442, 3700.2722884},
    {0.074999999999999997, 0.10000000000000001, 0.001, 2, 0, 0, 5, 1, 11.3856698706, 489.705940563},
    {0.074999999999999997, 0.10000000000000001, 0.00025000000000000001, 1, 0.0030000000000000001, 0, 5, 4,
     15.7727016912, 3262.61225169},
    {0.074999999999999997, 0.10000000000000001, 0.000125, 5, 0, 0, 50, 4, 34.5602621808, 7067.85756223},
    {0.20000000000000001, 1.5, 0.001, 3, 0, 0, 500, 10.000000000000002, 75.5013192394, 3136.26112859},
};

TEST(DeviceLimits, are_where_an_eigenvalue_leaves_the_unit_circle) {
  double worst_B = 0;
  double worst_K = 0;
  for (const Row& r : kRows) {
    const HandDevice d = device(r.m, r.b, r.delay);
    VelocityParams v = slope_of(r.window, r.smooth_s);
    if (r.window == 0) {
      v.method = VelocityParams::Method::kalman;
      v.jerk_m_s3_rtHz = r.jerk;
    }
    const double B = stable_damping_Ns_m(d, r.T, v);
    const double K = stable_stiffness_N_m(d, r.T, v, r.B);
    EXPECT_NEAR(B / r.B_max, 1, 1e-6) << "delay " << r.delay << " window " << r.window;
    EXPECT_NEAR(K / r.K_max, 1, 1e-6) << "delay " << r.delay << " window " << r.window;
    worst_B = std::max(worst_B, std::abs(B / r.B_max - 1));
    worst_K = std::max(worst_K, std::abs(K / r.K_max - 1));
  }
  std::printf("worst relative difference: damping %.1e, stiffness %.1e\n", worst_B, worst_K);
}

TEST(DeviceLimits, damping_of_a_bare_mass_is_the_literatures) {
  // In units of m/T: no delay, one tick, two ticks.
  const double unit = 0.075 / kT;
  EXPECT_NEAR(stable_damping_Ns_m(device(0.075, 0.1, 0), kT, slope_of(1)) / unit, 2, 1e-12);
  EXPECT_NEAR(stable_damping_Ns_m(device(0.075, 0.1, 1), kT, slope_of(1)) / unit, 0.828, 1e-3);
  EXPECT_NEAR(stable_damping_Ns_m(device(0.075, 0.1, 2), kT, slope_of(1)) / unit, 0.535, 1e-3);
  // A window of n intervals lowers it. For the line through its ends 4 sin^2(t/2) n / (2 cos(t/2) sin(n t/2))
  // at t = pi/(n+1): 1.33 / 0.84 / 0.50 / 0.27 for n = 2/4/8/16; the best-fit line is a little worse.
  const int windows[] = {2, 4, 8, 16};
  const double of_best_fit[] = {1.33333, 0.80650, 0.45001, 0.23860};  // device_limits_reference.py
  for (int i = 0; i < 4; ++i) {
    const int n = windows[i];
    const double B = stable_damping_Ns_m(device(0.075, 0.1, 0), kT, slope_of(n)) / unit;
    EXPECT_NEAR(B, of_best_fit[i], 1e-5);
    const double t = 3.14159265358979 / (n + 1);
    const double of_ends = 2 * n * std::pow(std::sin(t / 2), 2) / (std::cos(t / 2) * std::sin(n * t / 2));
    EXPECT_LE(B, of_ends * (1 + 1e-9));
    EXPECT_GT(B, 0.85 * of_ends);
  }
}

TEST(DeviceLimits, stiffness_of_a_bare_mass_is_the_closed_form) {
  // K T^2/m < 2 beta (2 - beta) / (2 + beta) for a finite difference without delay.
  const HandDevice bare = device(0.075, 0, 0);
  const double unit = 0.075 / (kT * kT);
  for (double beta = 0.01; beta < 2; beta += 0.0371) {
    const double K = stable_stiffness_N_m(bare, kT, slope_of(1), beta * 0.075 / kT);
    EXPECT_NEAR(K / unit, 2 * beta * (2 - beta) / (2 + beta), 1e-9) << "beta " << beta;
  }
  EXPECT_NEAR(stable_stiffness_N_m(bare, kT, slope_of(1), 0.828 * 75) / unit, 0.686, 5e-4);
  EXPECT_NEAR(stable_stiffness_N_m(device(0.075, 0, 1), kT, slope_of(1), 0.42 * 75) / unit, 0.1445, 1e-4);
  EXPECT_NEAR(stable_stiffness_N_m(device(0.075, 0, 2), kT, slope_of(1), 0.29 * 75) / unit, 0.062, 5e-4);
  EXPECT_EQ(stable_stiffness_N_m(bare, kT, slope_of(1), 2.001 * 75), 0);
  EXPECT_EQ(stable_stiffness_N_m(bare, kT, slope_of(1), 0), 0);
}

TEST(DeviceLimits, passive_stiffness_is_that_of_a_hold_and_a_delay) {
  // b = 0.1: 200/800/1600 N/m at 1/4/8 kHz without delay, 67/267/533 with one tick.
  const double no_delay[] = {200, 800, 1600};
  const double one_tick[] = {67, 267, 533};
  const double rate[] = {1000, 4000, 8000};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(passive_stiffness_N_m(device(0.075, 0.1, 0), 1 / rate[i]), no_delay[i], 1e-9);
    EXPECT_NEAR(passive_stiffness_N_m(device(0.075, 0.1, 1), 1 / rate[i]), one_tick[i], 0.5);
  }
}

// A handle with spring K and damping B, stepped tick by tick: largest swing in the last tenth over that of
// the first.
double growth(const HandDevice& d, double K, double B, double smooth_s, int ticks) {
  const double e = std::exp(-d.damping_Ns_m * kT / d.mass_kg);
  double x = 1e-3;
  double v = 0;
  double filtered = 0;
  double before = x;
  const double part = smooth_s > 0 ? 1 - std::exp(-kT / smooth_s) : 1.0;
  std::deque<double> under_way(static_cast<std::size_t>(d.delay_ticks), 0.0);
  double first = 0;
  double last = 0;
  for (int k = 0; k < ticks; ++k) {
    filtered += part * ((x - before) / kT - filtered);
    before = x;
    under_way.push_back(-K * x - B * filtered);
    const double f = under_way.front();
    under_way.pop_front();
    const double terminal = f / d.damping_Ns_m;
    x += terminal * kT + (v - terminal) * d.mass_kg / d.damping_Ns_m * (1 - e);
    v = terminal + (v - terminal) * e;
    if (k < ticks / 10) {
      first = std::max(first, std::abs(x));
    }
    if (k >= ticks - ticks / 10) {
      last = std::max(last, std::abs(x));
    }
  }
  return last / first;
}

TEST(DeviceLimits, a_loop_steps_stable_below_and_unstable_above) {
  for (const int delay : {0, 1, 3}) {
    for (const double B : {0.0, 1.0, 4.0}) {
      for (const double smooth_s : {0.0, 0.003}) {
        const HandDevice d = device(0.075, 0.1, delay);
        const double K = stable_stiffness_N_m(d, kT, slope_of(1, smooth_s), B);
        EXPECT_LT(growth(d, 0.97 * K, B, smooth_s, 20000), 0.99) << delay << " ticks, B " << B;
        EXPECT_GT(growth(d, 1.03 * K, B, smooth_s, 20000), 1.01) << delay << " ticks, B " << B;
      }
    }
  }
}

}  // namespace
}  // namespace punctum::rt
