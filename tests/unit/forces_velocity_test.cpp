// FOAW against a textbook implementation that tries every window from scratch, and its noise against the
// notes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "rt/forces/velocity.hpp"

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
    for (int i = 1; i <= n; ++i)
      fits = fits && std::abs(y[k - i] - (y[k] + b * (t[k - i] - t[k]))) <= d * (1 + 1e-9);
    if (!fits && n > 1) break;
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

TEST(Foaw, is_as_quiet_as_the_notes_say) {
  // dx = 0.03 mm, 1 kHz: finite difference 10.8 mm/s rms, FOAW-16 1.25 mm/s (figures of the physics notes,
  // for a hand that moves by centimetres within a second).
  Foaw foaw(VelocityParams{});
  double sum = 0, difference = 0, last = 0;
  const int n = 20000;
  for (int k = 0; k < n; ++k) {
    const double t = k * 1e-3;
    const double x = 0.02 * std::sin(2 * 3.14159265 * 0.5 * t);
    const double v = 0.02 * 3.14159265 * std::cos(2 * 3.14159265 * 0.5 * t);
    const double q = 0.03e-3 * std::round(x / 0.03e-3);
    const double e = foaw.step(Vec3(q, 0, 0), 1e-3).x() - v;
    if (k > 100) sum += e * e;
    if (k > 100) difference += ((q - last) / 1e-3 - v) * ((q - last) / 1e-3 - v);
    last = q;
  }
  const double rms = 1e3 * std::sqrt(sum / n);
  EXPECT_LT(rms, 2.0);
  EXPECT_GT(1e3 * std::sqrt(difference / n), 9.0);
  std::printf("FOAW-16: %.2f mm/s rms, finite difference: %.2f\n", rms, 1e3 * std::sqrt(difference / n));
}

TEST(Foaw, repeats_its_value_when_no_time_has_passed) {
  Foaw foaw(VelocityParams{});
  foaw.step(Vec3::Zero(), 1e-3);
  const Vec3 v = foaw.step(Vec3(1e-3, 0, 0), 1e-3);
  EXPECT_EQ(foaw.step(Vec3(5, 5, 5), 0), v);
}

}  // namespace
}  // namespace punctum::rt
