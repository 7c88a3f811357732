// One-step methods for one body, x'' = a(t, x, v), whose law changes at events, over float or double.
//
// A law offers
//   Real a(t, s), Slopes<Real> slopes(t, s)   acceleration and its derivatives in the present mode
//   Real gap(t, s)                            the mode lasts until this falls below 0
//   void change(t, s)                         to the next mode, at an event; may put s on the surface
// Within a step the mode is constant. With located events the step ends on the event and a new one begins;
// without, the mode changes at the end of the step in which the event was.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

namespace punctum::report {

template <class Real>
struct Motion {
  Real x = 0, v = 0;
};

template <class Real>
struct Slopes {
  Real x = 0, v = 0, t = 0;
};

// v uses the old acceleration, x the old velocity.
struct ExplicitEuler {
  static constexpr const char* name = "explicit Euler";
  static constexpr int order = 1;
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    return {s.x + h * s.v, s.v + h * law.a(t, s)};
  }
};

// v first, then x with the new v. Velocity and all explicit in v.
struct SemiImplicitEuler {
  static constexpr const char* name = "semi-implicit Euler";
  static constexpr int order = 1;
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    const Real v = s.v + h * law.a(t, s);
    return {s.x + h * v, v};
  }
};

struct RungeKutta4 {
  static constexpr const char* name = "RK4";
  static constexpr int order = 4;
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    const Real half = h / 2;
    const Real a1 = law.a(t, s);
    const Motion<Real> s2{s.x + half * s.v, s.v + half * a1};
    const Real a2 = law.a(t + half, s2);
    const Motion<Real> s3{s.x + half * s2.v, s.v + half * a2};
    const Real a3 = law.a(t + half, s3);
    const Motion<Real> s4{s.x + h * s3.v, s.v + h * a3};
    const Real a4 = law.a(t + h, s4);
    return {s.x + h / 6 * (s.v + 2 * (s2.v + s3.v) + s4.v), s.v + h / 6 * (a1 + 2 * (a2 + a3) + a4)};
  }
};

// Newton on the mid velocity; one iteration is exact for a linear law.
struct ImplicitMidpoint {
  static constexpr const char* name = "implicit midpoint";
  static constexpr int order = 2;
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    const Real half = h / 2;
    Real v = s.v;  // at the middle
    for (int i = 0; i < 8; ++i) {
      const Motion<Real> middle{s.x + half * v, v};
      const Slopes<Real> d = law.slopes(t + half, middle);
      const Real change = (s.v + half * law.a(t + half, middle) - v) / (1 - half * (half * d.x + d.v));
      v += change;
      if (std::abs(change) <= 8 * std::numeric_limits<Real>::epsilon() * std::abs(v)) {
        break;
      }
    }
    return {s.x + h * v, s.v + 2 * (v - s.v)};
  }
};

// Rosenbrock-Euler: the law linearised at the start of the step, solved exactly,
//   y + h phi1(hJ) y' + h^2 phi2(hJ) f_t,   phi1(z) = (e^z - 1)/z,  phi2(z) = (phi1(z) - 1)/z.
struct ExponentialRosenbrock {
  static constexpr const char* name = "exponential Rosenbrock";
  static constexpr int order = 2;
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    const Slopes<Real> d = law.slopes(t, s);
    const Real a = law.a(t, s);
    // phi_k(hJ) = c_k + d_k hJ, through the eigenvalues mean +- sqrt(square) of hJ = h [0 1; d.x d.v].
    const Real mean = h * d.v / 2;
    const Real square = mean * mean + h * h * d.x;
    const Real root = std::sqrt(std::abs(square));
    Real c1, d1, c2, d2;
    if (root < Real(1e-3)) {  // nearly equal: Taylor in `square`, phi_k' = phi_k - k phi_(k+1)
      const auto [p1, p2, p3, p4, p5] = phi(mean);
      d1 = p1 - p2 + square / 6 * (p1 - 3 * p2 + 6 * p3 - 6 * p4);
      d2 = p2 - 2 * p3 + square / 6 * (p2 - 6 * p3 + 18 * p4 - 24 * p5);
      c1 = p1 + square / 2 * (p1 - 2 * p2 + 2 * p3) - d1 * mean;
      c2 = p2 + square / 2 * (p2 - 4 * p3 + 6 * p4) - d2 * mean;
    } else if (square > 0) {
      // The smaller one without cancellation, since their product is -h^2 d.x.
      const Real large = mean < 0 ? mean - root : mean + root;
      const Real small = -h * h * d.x / large;
      const auto l = phi(large), n = phi(small);
      d1 = (l[0] - n[0]) / (large - small);
      d2 = (l[1] - n[1]) / (large - small);
      c1 = n[0] - d1 * small;
      c2 = n[1] - d2 * small;
    } else {
      const auto z = phi(std::complex<Real>(mean, root));
      d1 = z[0].imag() / root;
      d2 = z[1].imag() / root;
      c1 = z[0].real() - d1 * mean;
      c2 = z[1].real() - d2 * mean;
    }
    const auto times_J = [&](Motion<Real> y) { return Motion<Real>{y.v, d.x * y.x + d.v * y.v}; };
    const Motion<Real> f{s.v, a}, Jf = times_J(f);
    const Motion<Real> g{0, d.t}, Jg = times_J(g);
    return {s.x + h * (c1 * f.x + d1 * h * Jf.x) + h * h * (c2 * g.x + d2 * h * Jg.x),
            s.v + h * (c1 * f.v + d1 * h * Jf.v) + h * h * (c2 * g.v + d2 * h * Jg.v)};
  }

 private:
  static float expm1_of(float z) { return std::expm1(z); }
  static double expm1_of(double z) { return std::expm1(z); }
  static long double expm1_of(long double z) { return std::expm1(z); }
  template <class Real>
  static std::complex<Real> expm1_of(std::complex<Real> z) {
    const Real e = std::exp(z.real()), half = std::sin(z.imag() / 2);
    return {std::expm1(z.real()) * std::cos(z.imag()) - 2 * half * half, e * std::sin(z.imag())};
  }
  // phi_1 .. phi_5.
  template <class Number>
  static std::array<Number, 5> phi(Number z) {
    using Real = decltype(std::abs(z));
    if (std::abs(z) < 1) {  // phi_5 = sum of z^k/(k+5)!, the others from it
      Number term = Number(Real(1) / 120), p5 = term;
      for (int k = 6; k < 22; ++k) {
        term *= z / Real(k);
        p5 += term;
      }
      const Number p4 = Real(1) / 24 + z * p5;
      const Number p3 = Real(1) / 6 + z * p4;
      const Number p2 = Real(1) / 2 + z * p3;
      return {Real(1) + z * p2, p2, p3, p4, p5};
    }
    const Number p1 = expm1_of(z) / z;
    const Number p2 = (p1 - Real(1)) / z;
    const Number p3 = (p2 - Real(1) / 2) / z;
    const Number p4 = (p3 - Real(1) / 6) / z;
    return {p1, p2, p3, p4, (p4 - Real(1) / 24) / z};
  }
};

inline constexpr int kEventsPerStep = 16;

// One step h from t and s, with a step of the method up to each event.
template <class Method, class Real, class Law>
Motion<Real> step_located(Law& law, Real t, Motion<Real> s, Real h) {
  for (int event = 0; event < kEventsPerStep && h > 0; ++event) {
    const Motion<Real> end = Method::step(law, t, s, h);
    Real gap_high = law.gap(t + h, end);
    if (!(gap_high < 0)) {
      return end;
    }
    // Regula falsi on the length of the step (Illinois); bisection while the step starts on the surface.
    Real low = 0, high = h, gap_low = law.gap(t, s);
    int side = 0;
    const Real fine = std::numeric_limits<Real>::epsilon() * (t + h);
    for (int i = 0; i < 100 && high - low > 2 * fine; ++i) {
      Real at = gap_low > 0 ? low + (high - low) * gap_low / (gap_low - gap_high) : (low + high) / 2;
      at = std::clamp(at, low + fine, high - fine);
      const Real gap = law.gap(t + at, Method::step(law, t, s, at));
      if (gap == 0) {
        high = at;
        break;
      }
      if (gap < 0) {
        high = at;
        gap_high = gap;
        if (side == -1) {
          gap_low /= 2;
        }
        side = -1;
      } else {
        low = at;
        gap_low = gap;
        if (side == 1) {
          gap_high /= 2;
        }
        side = 1;
      }
    }
    s = Method::step(law, t, s, high);
    t += high;
    h -= high;
    law.change(t, s);
  }
  return s;
}

template <class Method, class Real, class Law>
Motion<Real> step_unlocated(Law& law, Real t, Motion<Real> s, Real h) {
  s = Method::step(law, t, s, h);
  if (law.gap(t + h, s) < 0) {
    law.change(t + h, s);
  }
  return s;
}

}  // namespace punctum::report
