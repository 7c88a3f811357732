#include "rt/control/device_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "rt/control/velocity.hpp"

namespace punctum::rt {
namespace {

using std::numbers::pi;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// The library's drags in streams.
struct Complex {
  double re = 0, im = 0;

  friend Complex operator+(const Complex& p, const Complex& q) NONBLOCKING {
    return {p.re + q.re, p.im + q.im};
  }
  friend Complex operator+(const Complex& p, double q) NONBLOCKING { return {p.re + q, p.im}; }
  friend Complex operator-(const Complex& p, const Complex& q) NONBLOCKING {
    return {p.re - q.re, p.im - q.im};
  }
  friend Complex operator-(double p, const Complex& q) NONBLOCKING { return {p - q.re, -q.im}; }
  friend Complex operator-(const Complex& p) NONBLOCKING { return {-p.re, -p.im}; }
  friend Complex operator*(double a, const Complex& p) NONBLOCKING { return {a * p.re, a * p.im}; }
};
[[nodiscard]] Complex polar(double r, double angle) NONBLOCKING {
  return {r * math::cos(angle), r * math::sin(angle)};
}
[[nodiscard]] Complex times(const Complex& p, const Complex& q) NONBLOCKING {
  return {p.re * q.re - p.im * q.im, p.re * q.im + p.im * q.re};
}
[[nodiscard]] Complex over(const Complex& p, const Complex& q) NONBLOCKING {
  return 1 / (q.re * q.re + q.im * q.im) * times(p, {q.re, -q.im});
}
[[nodiscard]] Complex minus_one(double theta) NONBLOCKING {  // e^(j theta) - 1
  return polar(2 * math::sin(0.5 * theta), 0.5 * (theta + pi));
}

// Slope of the best-fit line through n + 1 samples, at theta = omega T and T = 1: j S e^(-j n theta/2),
// S = sum of 12 (n/2 - i) sin((n/2 - i) theta) / (n (n+1) (n+2)).
[[nodiscard]] Complex best_fit_slope(int n, double theta) NONBLOCKING {
  double sum = 0;
  const double half = 0.5 * n;
  if ((n + 1) * theta < 2) {
    for (int i = 0; 2 * i < n; ++i) {  // at most Foaw::kMaxWindow rounds
      sum += 2 * (half - i) * math::sin((half - i) * theta);
    }
  } else {
    // -d/dtheta of the Dirichlet kernel sin((n+1) theta/2) / sin(theta/2).
    const double u = 0.5 * (n + 1);
    const double s = math::sin(0.5 * theta);
    sum = (0.5 * math::sin(u * theta) * math::cos(0.5 * theta) - u * math::cos(u * theta) * s) / (s * s);
  }
  return polar(12.0 * sum / (static_cast<double>(n) * (n + 1) * (n + 2)), 0.5 * pi - half * theta);
}

// From position to estimated velocity, at T = 1.
class VelocityResponse {
 public:
  VelocityResponse(const VelocityParams& params, double T_s) NONBLOCKING
      : kalman_(params.method == VelocityParams::Method::kalman),
        windows_(kalman_ ? 1 : at_rate(params, 1 / T_s).window),
        left_(params.smooth_s > 0 ? math::exp(-T_s / params.smooth_s) : 0.0) {
    if (!kalman_) {
      return;
    }
    const KalmanGains g = settled_gains(params, T_s);
    gain_ = {g.position, g.velocity * T_s, g.acceleration * T_s * T_s};
  }

  // The limits are the worst over `windows` kinds of response, n = 1 .. windows.
  [[nodiscard]] int windows() const NONBLOCKING { return windows_; }

  [[nodiscard]] Complex at(double theta, int n) const NONBLOCKING {
    const Complex slope = kalman_ ? of_kalman(theta) : best_fit_slope(n, theta);
    // y += (1 - left) (u - y): (1 - left) / (1 - left e^(-j theta)).
    return left_ > 0 ? over((1 - left_) * slope, 1.0 - left_ * polar(1, -theta)) : slope;
  }

 private:
  // With w = 1/z, D = 1 - w and the innovation e: D a = g2 e, D v = w a + g1 e, D x = w v + w a/2 + g0 e,
  // y = e + w (x + v + a/2). Here times D^3 throughout.
  [[nodiscard]] Complex of_kalman(double theta) const NONBLOCKING {
    const Complex w = polar(1, -theta);
    const Complex D = times(minus_one(theta), w);
    const Complex D2 = times(D, D);
    const Complex v = gain_.acceleration * w + gain_.velocity * D;                                 // D^2 v/e
    const Complex half_a = 0.5 * gain_.acceleration * D2;                                          // D^3 a/2
    const Complex x = times(w, v) + 0.5 * gain_.acceleration * times(w, D) + gain_.position * D2;  // D^3 x
    return over(times(D, v), times(D, D2) + times(w, x + times(D, v) + half_a));
  }

  bool kalman_;
  int windows_;
  double left_;
  KalmanGains gain_;
};

// A handle of mass 1 at T = 1, whose force acts delay ticks late; a = b T/m.
class Handle {
 public:
  Handle(double a, int delay) NONBLOCKING : delay_(delay) {
    phi1_ = a > 1e-8 ? -math::expm1(-a) / a : 1 - a / 2;
    phi2_ = a > 1e-2 ? (1 - phi1_) / a : 0.5 - a / 6 + a * a / 24 - a * a * a / 120;
    left_ = a * phi1_;
  }
  // -z^d / P, P from force to position, at z = e^(j theta); infinite at theta = pi without damping.
  [[nodiscard]] Complex dynamic(double theta) const NONBLOCKING {
    const Complex step = minus_one(theta);
    const Complex inverse = over(times(step, step + left_), phi2_ * (step + left_) + phi1_ * phi1_);
    return -times(polar(1, delay_ * theta), inverse);
  }
  // -P / z^d.
  [[nodiscard]] Complex compliance(double theta) const NONBLOCKING {
    const Complex step = minus_one(theta);
    const Complex P = over(phi2_ * (step + left_) + phi1_ * phi1_, times(step, step + left_));
    return -times(polar(1, -delay_ * theta), P);
  }

 private:
  int delay_;
  double phi1_;  // (1 - e^-a)/a
  double phi2_;  // (1 - phi1)/a
  double left_;  // 1 - e^-a
};

// Calls visit(value) wherever curve(theta) is real for 0 < theta <= pi. `waves`: half-turns of its phase.
template <class Curve, class Visit>
void visit_real_values(int waves, Curve curve, Visit visit) NONBLOCKING {
  constexpr double kFirst = 1e-7;
  constexpr double kRatio = 1.1;  // near 0, then evenly
  constexpr int kPerWave = 24;
  const double widest = pi / (kPerWave * waves);
  double from = kFirst;
  bool below = curve(from).im < 0;
  // At most 200 + 24 * (Foaw::kMaxWindow + 16) rounds: up by a tenth from 1e-7, then evenly.
  while (from < pi) {
    const double to = std::min({from * kRatio, from + widest, pi});
    const bool next_below = curve(to).im < 0;
    if (next_below != below) {
      double a = from;
      double b = to;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (a + b);
        ((curve(middle).im < 0) == below ? a : b) = middle;
      }
      visit(curve(0.5 * (a + b)).re);
    }
    below = next_below;
    from = to;
  }
  visit(curve(pi).re);
}

// B for which z = e^(j theta) solves 1 + B V P/z^d = 0, largest 1/B.
[[nodiscard]] double largest_damping(int delay, const VelocityResponse& V, int n) NONBLOCKING {
  const Handle bare(0, delay);
  double inverse = 0;
  visit_real_values(
      n + delay + 2, [&](double t) { return times(bare.compliance(t), V.at(t, n)); },
      [&](double value) { inverse = std::max(inverse, value); });
  return inverse > 0 ? 1 / inverse : kInfinite;
}

// K for which z = e^(j theta) solves 1 + (K + B V) P/z^d = 0.
[[nodiscard]] double largest_stiffness(const Handle& handle, int delay, double B, const VelocityResponse& V,
                                       int n) NONBLOCKING {
  double least = kInfinite;
  visit_real_values(
      n + delay + 2, [&](double t) { return handle.dynamic(t) - B * V.at(t, n); },
      [&](double K) {
        if (K > 0) {
          least = std::min(least, K);
        }
      });
  return least;
}

}  // namespace

double passive_stiffness_N_m(const HandDevice& device, double T_s) NONBLOCKING {
  return device.damping_Ns_m / (T_s * (0.5 + device.delay_ticks));
}

double stable_damping_Ns_m(const HandDevice& device, double T_s, const VelocityParams& velocity) NONBLOCKING {
  const VelocityResponse V(velocity, T_s);
  double least = kInfinite;
  for (int n = 1; n <= V.windows(); ++n) {  // at most Foaw::kMaxWindow rounds
    least = std::min(least, largest_damping(device.delay_ticks, V, n));
  }
  return least * device.mass_kg / T_s;
}

double stable_stiffness_N_m(const HandDevice& device, double T_s, const VelocityParams& velocity,
                            double B_Ns_m) NONBLOCKING {
  const bool damped = B_Ns_m > 0;
  if (damped && !(B_Ns_m < stable_damping_Ns_m(device, T_s, velocity))) {
    return 0;
  }
  if (!damped && !(device.damping_Ns_m > 0)) {
    return 0;
  }
  const VelocityResponse V(velocity, T_s);
  const double unit = device.mass_kg / T_s;
  const Handle handle(device.damping_Ns_m / unit, device.delay_ticks);
  double least = kInfinite;
  for (int n = 1; n <= (damped ? V.windows() : 1); ++n) {  // at most Foaw::kMaxWindow rounds
    least = std::min(least, largest_stiffness(handle, device.delay_ticks, B_Ns_m / unit, V, n));
  }
  return least * unit / T_s;
}

}  // namespace punctum::rt
