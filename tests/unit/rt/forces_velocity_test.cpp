// FOAW against a textbook implementation that tries every window from scratch; what both methods do with
// late, missing and impossible samples. Their accuracy: numeric/velocity_test.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rt/control/velocity.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

// Janabi-Sharifi 2000, best-fit: n grows from 1; slope by least squares over y[k-n..k], drawn through y[k];
// the first n that leaves a sample outside +-d ends the search. Newest sample last.
double textbook(const std::vector<double>& t, const std::vector<double>& y, int window, double d) {
  const int k = static_cast<int>(y.size()) - 1;
  double slope = 0;
  for (int n = 1; n <= std::min(window, k); ++n) {
    double mt = 0, my = 0;
    for (int i = 0; i <= n; ++i) {
      mt += t[k - i];
      my += y[k - i];
    }
    mt /= n + 1;
    my /= n + 1;
    double top = 0, bottom = 0;
    for (int i = 0; i <= n; ++i) {
      top += (t[k - i] - mt) * (y[k - i] - my);
      bottom += (t[k - i] - mt) * (t[k - i] - mt);
    }
    const double b = top / bottom;
    bool fits = true;
    for (int i = 1; i <= n; ++i) {
      fits = fits && std::abs(y[k - i] - (y[k] + b * (t[k - i] - t[k]))) <= d * (1 + 1e-9);
    }
    if (!fits && n > 1) {
      break;
    }
    slope = b;
  }
  return slope;
}

TEST(Foaw, agrees_with_the_textbook_on_noise_motion_and_uneven_ticks) {
  for (const int window : {1, 2, 8, 16, 64}) {
    VelocityParams params;
    params.window = window;
    params.d_m = 0.03e-3;
    Foaw foaw(params);
    std::mt19937_64 random(static_cast<unsigned>(window));
    std::uniform_real_distribution<double> u(0, 1);
    std::vector<double> t, y[3];
    double now = 0;
    for (int k = 0; k < 1500; ++k) {
      const double dt = u(random) < 0.1 ? 1e-3 * (1 + std::floor(4 * u(random))) : 1e-3;
      now += dt;
      const double x[3] = {0.01 * std::sin(9 * now), 0.002 * now, 0.03 * std::sin(60 * now * now)};
      Vec3 quantised;
      for (int i = 0; i < 3; ++i) {
        // An odd offset: no sample lies exactly on the border of the band, where rounding decides.
        quantised[i] = 0.03e-3 * std::round(x[i] / 0.03e-3) + 1e-7 * u(random);
        y[i].push_back(quantised[i]);
      }
      t.push_back(now);
      const Vec3 v = foaw.step(quantised, dt);
      for (int i = 0; i < 3; ++i) {
        const double expected = k == 0 ? 0 : textbook(t, y[i], window, params.d_m);
        ASSERT_NEAR(v[i], expected, 1e-9 + 1e-9 * std::abs(expected))
            << "window " << window << " sample " << k;
      }
    }
  }
}

TEST(Foaw, is_exact_on_uniform_motion_and_zero_at_rest) {
  Foaw foaw(VelocityParams{});
  for (int k = 0; k < 100; ++k) {
    const Vec3 v = foaw.step(Vec3(0.1 * k * 1e-3, 0.25, -3e-3 * k), 1e-3);
    if (k > 0) {
      EXPECT_LT((v - Vec3(0.1, 0, -3)).norm(), 1e-9);
    }
  }
}

TEST(Kalman, does_not_lag_behind_constant_acceleration_however_uneven_the_ticks) {
  const Vec3 acceleration(2, -0.5, 0);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  for (const double T : {1e-3, 0.125e-3}) {
    Kalman kalman(VelocityParams{}, T);
    double t = 0;
    while (t < 0.6) {
      const double dt = u(random) < 0.05 ? T * (1 + std::floor(10 * u(random))) : T * (0.9 + 0.2 * u(random));
      t += dt;
      const Vec3 v = kalman.step(0.5 * t * t * acceleration, dt);
      if (t > 0.3) {
        ASSERT_LT((v - t * acceleration).norm(), 1e-9) << "t = " << t;
      }
    }
  }
}

TEST(Kalman, is_zero_at_rest_from_the_first_sample) {
  Kalman kalman(VelocityParams{}, 1e-3);
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(kalman.step(Vec3(0.02, -0.03, 0.01), 1e-3), Vec3::Zero());
  }
}

template <class Estimator>
Estimator estimator();
template <>
Foaw estimator<Foaw>() {
  return Foaw(VelocityParams{});
}
template <>
Kalman estimator<Kalman>() {
  return Kalman(VelocityParams{}, 1e-3);
}

template <class Estimator>
class EitherMethod : public ::testing::Test {};
using Methods = ::testing::Types<Foaw, Kalman>;
TYPED_TEST_SUITE(EitherMethod, Methods);

TYPED_TEST(EitherMethod, repeats_its_value_when_no_time_has_passed_or_the_position_is_not_finite) {
  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();
  auto disturbed = estimator<TypeParam>(), quiet = estimator<TypeParam>();
  for (int k = 0; k < 300; ++k) {
    const Vec3 x(0.01 * std::sin(0.01 * k), 1e-5 * k, 0);
    const Vec3 v = disturbed.step(x, 1e-3);
    EXPECT_EQ(v, quiet.step(x, 1e-3));
    EXPECT_EQ(disturbed.step(Vec3(5, 5, 5), 0), v);
    EXPECT_EQ(disturbed.step(Vec3(5, 5, 5), -1e-3), v);
    EXPECT_EQ(disturbed.step(Vec3(5, 5, 5), nan), v);
    EXPECT_EQ(disturbed.step(Vec3(nan, 0, 0), 1e-3), v);
    EXPECT_EQ(disturbed.step(Vec3(0, 0, -inf), 1e-3), v);
  }
}

TYPED_TEST(EitherMethod, takes_the_mean_velocity_over_a_gap) {
  auto method = estimator<TypeParam>();
  double x = 0;
  for (int k = 0; k < 100; ++k) {
    method.step(Vec3(x += 1e-4, 0, 0), 1e-3);
  }
  EXPECT_NEAR(method.step(Vec3(x - 3e-3, 0, 0), 0.06).x(), -0.05, 1e-3);
}

TYPED_TEST(EitherMethod, stays_bounded_when_samples_drop_out_for_a_while) {
  // A trembling hand of at most 44 mm/s whose samples come singly or after gaps of up to 40 ms.
  auto method = estimator<TypeParam>();
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(0, 1);
  double t = 0;
  for (int k = 0; k < 20000; ++k) {
    const double dt = u(random) < 0.1 ? 1e-3 * (1 + std::floor(39 * u(random))) : 1e-3;
    t += dt;
    const double x = 0.7e-3 * std::sin(62.8 * t);
    const Vec3 v = method.step(Vec3(0.03e-3 * std::round(x / 0.03e-3), 0, 0), dt);
    ASSERT_LT(v.norm(), 0.2) << "t = " << t;
  }
}

}  // namespace
}  // namespace punctum::rt
