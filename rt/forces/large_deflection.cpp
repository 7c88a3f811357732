#include "rt/forces/large_deflection.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::rt {
namespace {

// (1-nu) F/w, (1-nu) p, (1-nu) T.
struct Coefficients {
  double stiffness, pressure, tension;
};
constexpr std::array<Coefficients, kDeflectionTerms> kCoefficients{{
#include "rt/forces/large_deflection_coefficients.inc"
}};

// From the box to -1 .. 1, by a function that is even over it.
template <class Function>
[[nodiscard]] double mapped(double x, double low, double high, Function even) NONBLOCKING {
  const double from = even(low);
  return 2 * (even(std::clamp(x, low, high)) - from) / (even(high) - from) - 1;
}

[[nodiscard]] bool between(double x, double low, double high) NONBLOCKING { return x >= low && x <= high; }

constexpr double kDeepest = 1e100;  // over R; farther counts as this

}  // namespace

std::array<DeflectionTerm, kDeflectionTerms> deflection_terms(const DeflectionInput& at) NONBLOCKING {
  const DeflectionInput& low = kDeflectionMin;
  const DeflectionInput& high = kDeflectionMax;
  const auto log = [](double x) { return math::log(x); };
  const auto root = [](double x) { return std::sqrt(x); };
  const auto itself = [](double x) { return x; };
  const double u[] = {mapped(at.c, low.c, high.c, log),
                      mapped(at.prestrain, low.prestrain, high.prestrain, root),
                      mapped(at.seat, low.seat, high.seat, itself), mapped(at.nu, low.nu, high.nu, itself)};
  const auto& [top, c_top, prestrain_top, seat_top, nu_top] = kDeflectionDegrees;
  std::array<DeflectionTerm, kDeflectionTerms> terms;
  std::size_t i = 0;
  double of_c = 1;
  for (int b = 0; b <= c_top; ++b, of_c *= u[0]) {
    double of_prestrain = of_c;
    for (int c = 0; c <= prestrain_top && b + c <= kDeflectionDegree; ++c, of_prestrain *= u[1]) {
      double of_seat = of_prestrain;
      for (int d = 0; d <= seat_top && b + c + d <= kDeflectionDegree; ++d, of_seat *= u[2]) {
        double value = of_seat;
        for (int e = 0; e <= nu_top && b + c + d + e <= kDeflectionDegree; ++e, value *= u[3]) {
          for (int a = 0; a <= top && a + b + c + d + e <= kDeflectionDegree; ++a) {
            terms[i++] = {a, value};
          }
        }
      }
    }
  }
  return terms;
}

DeflectionCurve::DeflectionCurve(const DeflectionInput& of) NONBLOCKING
    : by_nu_(1 / std::clamp(1 - of.nu, 0.1, 2.0)) {
  const DeflectionInput& low = kDeflectionMin;
  const DeflectionInput& high = kDeflectionMax;
  const auto terms = deflection_terms(of);
  for (std::size_t i = 0; i < kDeflectionTerms; ++i) {
    const auto power = static_cast<std::size_t>(terms[i].w_power);
    G_[power] += kCoefficients[i].stiffness * terms[i].value;
    p_[power] += kCoefficients[i].pressure * terms[i].value;
    T_[power] += kCoefficients[i].tension * terms[i].value;
  }
  calibrated_ = between(of.c, low.c, high.c) && between(of.seat, low.seat, high.seat) &&
                between(of.nu, low.nu, high.nu) && between(of.prestrain, low.prestrain, high.prestrain);
}

Deflection DeflectionCurve::at(double depth) const NONBLOCKING {
  const double w_max = kDeflectionMax.w;
  const double w = std::min(depth, w_max);
  const double t = std::sqrt(w / w_max);
  Deflection out;
  double t_a = by_nu_;
  for (std::size_t a = 0; a < kPowers; ++a, t_a *= t) {
    const double half = 0.5 * static_cast<double>(a);
    out.force += G_[a] * t_a * w;
    out.stiffness += G_[a] * t_a * (1 + half);
    out.energy += G_[a] * t_a * w * w / (2 + half);
    out.pressure += p_[a] * t_a;
    out.tension += T_[a] * t_a;
  }
  const double beyond = std::min(depth, kDeepest) - w;
  out.energy += beyond * (out.force + 0.5 * beyond * out.stiffness);
  out.force += beyond * out.stiffness;
  out.calibrated = depth <= w_max && calibrated_;
  return out;
}

}  // namespace punctum::rt
