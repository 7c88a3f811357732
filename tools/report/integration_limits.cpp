#include "tools/report/integration_limits.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <utility>

#include "tools/report/integration_problems.hpp"
#include "tools/report/integration_runs.hpp"

namespace punctum::report {

namespace {

// Largest w h at which a linear oscillator of damping ratio zeta does not grow; infinity when it never grows.
template <class Method>
double stable_wh(double zeta) {
  struct Oscillator {
    double zeta;
    [[nodiscard]] double a(double, Motion<double> s) const { return -s.x - 2 * zeta * s.v; }
    [[nodiscard]] Slopes<double> slopes(double, Motion<double>) const { return {-1, -2 * zeta, 0}; }
  };
  const auto radius = [&](double h) {
    const Oscillator law{zeta};
    const auto p = Method::step(law, 0.0, Motion<double>{1, 0}, h),
               q = Method::step(law, 0.0, Motion<double>{0, 1}, h);
    const double half = (p.x + q.v) / 2, det = p.x * q.v - q.x * p.v, square = half * half - det;
    return square < 0 ? std::sqrt(det) : std::abs(half) + std::sqrt(square);
  };
  constexpr double slack = 1 + 1e-12;
  if (radius(1e6) <= slack) {
    return std::numeric_limits<double>::infinity();
  }
  double low = 0, high = 1e6;
  for (double h = 1e-3; h < 1e6; h *= 1.01) {
    if (radius(h) > slack) {
      high = h;
      break;
    }
    low = h;
  }
  if (low == 0) {
    return 0;
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (radius(middle) > slack ? high : low) = middle;
  }
  return low;
}

template <class Method>
void sweep(StiffnessSweep& out) {
  Series s{.name = Method::name, .style = Style::line_points};
  for (const Reference& r : kWallReference) {
    Wall<double> law{r.stiffness_N_m};
    const auto end =
        integrate<double>(law, steps_of<Wall<double>>(1), step_located<Method, double, Wall<double>>);
    const double error = std::max(std::abs(end.x - r.x_m), kRounding);
    out.table.add({Method::name, r.stiffness_N_m,
                   std::sqrt(r.stiffness_N_m / Wall<double>::mass_kg) * kTick_s,
                   std::isfinite(error) ? error : std::nan("")});
    s.x.push_back(r.stiffness_N_m);
    s.y.push_back(std::min(error, 1e3));
  }
  out.panel.series.push_back(std::move(s));
}

template <class Method>
void drift(EnergyDrift& out, std::int64_t steps) {
  Wall<double> law{.stiffness_N_m = 1e4, .handle_Ns_m = 0, .wall_Ns_m = 0};
  constexpr double h = 0.25e-3;
  Motion<double> s = Wall<double>::start;
  const double start = law.energy_J(s);
  Series line{.name = Method::name, .style = Style::line_points};
  std::int64_t next = 1;
  for (std::int64_t i = 1; i <= steps; ++i) {
    s = step_located<Method>(law, 0.0, s, h);
    if (i != next && i != steps) {
      continue;
    }
    next = std::max(next + 1, next * 178 / 100);
    const double error = std::abs(law.energy_J(s) / start - 1);
    out.table.add({Method::name, i, error});
    if (!(error < 1e3)) {
      break;
    }
    line.x.push_back(static_cast<double>(i));
    line.y.push_back(std::max(error, 1e-16));
    if (std::is_same_v<Method, ClosedForm> && i == steps) {
      out.shipped = error;
    }
  }
  out.panel.series.push_back(std::move(line));
}

}  // namespace

Table stability_limits() {
  Table t{.name = "integrators_limits", .columns = {"method", "zeta", "stable_wh", "published_wh"}};
  constexpr double none = std::numeric_limits<double>::infinity();
  const auto text = [](double wh) { return std::isinf(wh) ? Cell("unlimited") : Cell(wh); };
  for (const double zeta : {0.0, 0.05, 0.2, 0.7}) {
    t.add({ExplicitEuler::name, zeta, text(stable_wh<ExplicitEuler>(zeta)), 2 * zeta});
    t.add({SemiImplicitEuler::name, zeta, text(stable_wh<SemiImplicitEuler>(zeta)),
           2 * (std::sqrt(1 + zeta * zeta) - zeta)});
    t.add({RungeKutta4::name, zeta, text(stable_wh<RungeKutta4>(zeta)), 2 * std::numbers::sqrt2});
    t.add({ImplicitMidpoint::name, zeta, text(stable_wh<ImplicitMidpoint>(zeta)), text(none)});
    t.add({ExponentialRosenbrock::name, zeta, text(stable_wh<ExponentialRosenbrock>(zeta)), text(none)});
  }
  return t;
}

StiffnessSweep over_stiffness() {
  StiffnessSweep out;
  sweep<ExplicitEuler>(out);
  sweep<SemiImplicitEuler>(out);
  sweep<RungeKutta4>(out);
  sweep<ImplicitMidpoint>(out);
  sweep<ExponentialRosenbrock>(out);
  sweep<ClosedForm>(out);
  constexpr double zeta = 0.05;
  for (const auto& [name, wh] : {std::pair{"explicit Euler's limit", 2 * zeta},
                                 {"semi-implicit Euler's", 2 * (std::sqrt(1 + zeta * zeta) - zeta)},
                                 {"RK4's", 2 * std::numbers::sqrt2}}) {
    const double K = Wall<double>::mass_kg * wh * wh / (kTick_s * kTick_s);
    out.panel.series.push_back({.name = name, .x = {K, K}, .y = {1e-15, 1e0}, .style = Style::limit});
  }
  const Series& closed = out.panel.series[5];
  out.panel.marks.push_back({closed.x[2], closed.y[2], "shipped"});
  return out;
}

EnergyDrift energy_drift(std::int64_t steps) {
  EnergyDrift out;
  drift<ExplicitEuler>(out, steps);
  drift<SemiImplicitEuler>(out, steps);
  drift<RungeKutta4>(out, steps);
  drift<ImplicitMidpoint>(out, steps);
  drift<ExponentialRosenbrock>(out, steps);
  drift<ClosedForm>(out, steps);
  out.panel.series.push_back({.name = "wanted: 1e-6 after 1e6 steps",
                              .x = {1, static_cast<double>(steps)},
                              .y = {1e-6, 1e-6},
                              .style = Style::limit});
  const Series& closed = out.panel.series[5];
  out.panel.marks.push_back({closed.x[closed.x.size() / 2], closed.y[closed.y.size() / 2], "shipped"});
  return out;
}

}  // namespace punctum::report
