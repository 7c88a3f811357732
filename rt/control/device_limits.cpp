#include "rt/control/device_limits.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace punctum::rt {
namespace {

using std::numbers::pi;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Slope of the best-fit line through n + 1 samples, at theta = omega T: V = j S(theta)/T e^(-j n theta/2),
// S = sum of 12 (n/2 - i) sin((n/2 - i) theta) / (n (n+1) (n+2)).
[[nodiscard]] double window_gain(int n, double theta) noexcept {
  double sum = 0;
  const double half = 0.5 * n;
  if ((n + 1) * theta < 2) {
    for (int i = 0; 2 * i < n; ++i) sum += 2 * (half - i) * std::sin((half - i) * theta);
  } else {
    // -d/dtheta of the Dirichlet kernel sin((n+1) theta/2) / sin(theta/2).
    const double u = 0.5 * (n + 1);
    const double s = std::sin(0.5 * theta);
    sum = (0.5 * std::sin(u * theta) * std::cos(0.5 * theta) - u * std::cos(u * theta) * s) / (s * s);
  }
  return 12.0 * sum / (static_cast<double>(n) * (n + 1) * (n + 2));
}

// y += part (u - y): p / (1 - (1-p) e^(-j theta)).
struct LowPass {
  double left;  // 1 - p

  LowPass(double tau_s, double T_s) noexcept : left(tau_s > 0 ? std::exp(-T_s / tau_s) : 0.0) {}
  [[nodiscard]] double lag(double theta) const noexcept {
    return std::atan2(left * std::sin(theta), 1 - left * std::cos(theta));
  }
  [[nodiscard]] double gain(double theta) const noexcept {
    const double s = std::sin(0.5 * theta);
    return (1 - left) / std::sqrt((1 - left) * (1 - left) + 4 * left * s * s);
  }
};

// A zero of f between a and b, where its sign differs.
template <class F>
[[nodiscard]] double zero_between(double a, double b, F f) noexcept {
  const bool below = f(a) < 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (a + b);
    ((f(middle) < 0) == below ? a : b) = middle;
  }
  return 0.5 * (a + b);
}

// B T / m at which z = e^(j theta) solves 1 + B V z^-d P = 0, P = T^2 (z+1) / (2 m (z-1)^2):
// 1/B = T^2/(4m) cos(theta/2)/sin^2(theta/2) S/T |H| e^(j(pi/2 - phi)), real where the phase
// phi = theta (d + (n+1)/2) + lag is pi/2 + k pi. phi rises with theta: its lag falls by 1/2 at most.
[[nodiscard]] double largest_damping(int n, int d, const LowPass& H) noexcept {
  double least = kInfinite;
  const double slope = d + 0.5 * (n + 1);
  for (int k = 0; 0.5 + k < slope; ++k) {
    const double wanted = pi * (0.5 + k);
    const double theta = zero_between(0, pi, [&](double t) { return slope * t + H.lag(t) - wanted; });
    const double s = std::sin(0.5 * theta);
    const double inverse = std::cos(0.5 * theta) / (4 * s * s) * window_gain(n, theta) * H.gain(theta);
    const double B = (k % 2 == 0 ? 1 : -1) / inverse;
    if (B > 0) least = std::min(least, B);
  }
  return least;
}

// A handle of mass 1 at T = 1: a = b T/m, B and K in units of m/T and m/T^2.
class Handle {
 public:
  using Complex = std::complex<double>;

  Handle(double a, int d) noexcept : delay_(d) {
    phi1_ = a > 1e-8 ? -std::expm1(-a) / a : 1 - a / 2;
    phi2_ = a > 1e-2 ? (1 - phi1_) / a : 0.5 - a / 6 + a * a / 24 - a * a * a / 120;
    left_ = a * phi1_;
  }

  // K(theta) = -z^d / P - B V: where it is real, z = e^(j theta) is a pole with that K.
  [[nodiscard]] Complex stiffness(double theta, double B, int n, const LowPass& H) const noexcept {
    const Complex step = polar(2 * std::sin(0.5 * theta), 0.5 * (theta + pi));  // z - 1
    const Complex dynamic = over(times(step, step + left_), phi2_ * (step + left_) + phi1_ * phi1_);
    const Complex velocity =
        polar(B * window_gain(n, theta) * H.gain(theta), 0.5 * pi - 0.5 * n * theta - H.lag(theta));
    return -times(polar(1, delay_ * theta), dynamic) - velocity;
  }

 private:
  // As in the library, without its treatment of infinities and of negative radii.
  [[nodiscard]] static Complex polar(double r, double angle) noexcept {
    return {r * std::cos(angle), r * std::sin(angle)};
  }
  [[nodiscard]] static Complex times(Complex p, Complex q) noexcept {
    return {p.real() * q.real() - p.imag() * q.imag(), p.real() * q.imag() + p.imag() * q.real()};
  }
  [[nodiscard]] static Complex over(Complex p, Complex q) noexcept {
    return times(p, std::conj(q)) / (q.real() * q.real() + q.imag() * q.imag());
  }

  int delay_;
  double phi1_;  // (1 - e^-a)/a
  double phi2_;  // (1 - phi1)/a
  double left_;  // 1 - e^-a
};

constexpr double kFirstTheta = 1e-7;  // below: K under 1e-14 m/T^2
constexpr int kPerDecade = 24;
constexpr int kPerTurn = 24;  // samples of each half-wave of the phase

[[nodiscard]] double largest_stiffness(const Handle& handle, double B, int n, int d,
                                       const LowPass& H) noexcept {
  double least = kInfinite;
  const auto imaginary = [&](double t) { return handle.stiffness(t, B, n, H).imag(); };
  const double widest = pi / (kPerTurn * (n + d + 2));
  const double ratio = std::pow(10.0, 1.0 / kPerDecade);
  double from = kFirstTheta;
  bool below = imaginary(from) < 0;
  if (!below) return 0;  // nothing resists: b + B <= 0
  while (from < pi) {
    const double to = std::min({from * ratio, from + widest, pi});
    const bool now_below = imaginary(to) < 0;
    if (now_below != below) {
      const double K = handle.stiffness(zero_between(from, to, imaginary), B, n, H).real();
      if (K > 0) least = std::min(least, K);
    }
    below = now_below;
    from = to;
  }
  const double K = handle.stiffness(pi, B, n, H).real();  // z = -1 is real itself
  return K > 0 ? std::min(least, K) : least;
}

}  // namespace

double passive_stiffness_N_m(const HandDevice& device, double T_s) noexcept {
  return device.damping_Ns_m / (T_s * (0.5 + device.delay_ticks));
}

double stable_damping_Ns_m(const HandDevice& device, double T_s, const VelocityParams& velocity) noexcept {
  const LowPass H(velocity.smooth_s, T_s);
  double least = kInfinite;
  for (int n = 1; n <= velocity.window; ++n)
    least = std::min(least, largest_damping(n, device.delay_ticks, H));
  return least * device.mass_kg / T_s;
}

double stable_stiffness_N_m(const HandDevice& device, double T_s, const VelocityParams& velocity,
                            double B_Ns_m) noexcept {
  if (!(B_Ns_m < stable_damping_Ns_m(device, T_s, velocity))) return 0;
  const LowPass H(velocity.smooth_s, T_s);
  const double unit = device.mass_kg / T_s;
  const Handle handle(device.damping_Ns_m / unit, device.delay_ticks);
  double least = kInfinite;
  const int windows = B_Ns_m > 0 ? velocity.window : 1;
  for (int n = 1; n <= windows; ++n)
    least = std::min(least, largest_stiffness(handle, B_Ns_m / unit, n, device.delay_ticks, H));
  return least * unit / T_s;
}

}  // namespace punctum::rt
