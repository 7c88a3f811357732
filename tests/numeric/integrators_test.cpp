// The integrators that the report compares: order, stability limits, exactness, located events; and the
// shipped plant against the same references. References: closed forms, integrators_reference.py (matrix
// exponentials in 40 digits), an extrapolation of order 12 in long double.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "hal/sim/plant/stage.hpp"
#include "tools/report/integration_problems.hpp"

namespace punctum::report {
namespace {

// x'' = 2 x^3 + what time adds; x = 1/(1 - t) + t^3 solves it.
struct Smooth {
  [[nodiscard]] static double added(double t) {
    const double p = 1 / (1 - t), x = p + t * t * t;
    return 2 * p * p * p + 6 * t - 2 * x * x * x;
  }
  [[nodiscard]] double a(double t, Motion<double> s) const { return 2 * s.x * s.x * s.x + added(t); }
  [[nodiscard]] Slopes<double> slopes(double t, Motion<double> s) const {
    const double p = 1 / (1 - t), x = p + t * t * t, xt = p * p + 3 * t * t;
    return {6 * s.x * s.x, 0, 6 * p * p * p * p + 6 - 6 * x * x * xt};
  }
};

template <class Method>
double smooth_error(int steps) {
  const double end = 0.5, h = end / steps;
  Motion<double> s{1, 1};
  for (int i = 0; i < steps; ++i) {
    s = Method::step(Smooth{}, i * h, s, h);
  }
  return std::abs(s.x - 2.125) + std::abs(s.v - 4.75);
}

template <class Method>
void expect_order(double order, double within) {
  const double seen = std::log2(smooth_error<Method>(64) / smooth_error<Method>(128));
  EXPECT_NEAR(seen, order, within) << Method::name;
}

TEST(Integrators, converge_with_their_order) {
  expect_order<ExplicitEuler>(1, 0.1);
  expect_order<SemiImplicitEuler>(1, 0.1);
  expect_order<ImplicitMidpoint>(2, 0.05);
  expect_order<ExponentialRosenbrock>(2, 0.05);
  expect_order<RungeKutta4>(4, 0.1);
  EXPECT_LT(smooth_error<Extrapolated>(16), 1e-12);
}

// w = 1.
struct Oscillator {
  double zeta;
  [[nodiscard]] double a(double, Motion<double> s) const { return -s.x - 2 * zeta * s.v; }
  [[nodiscard]] Slopes<double> slopes(double, Motion<double>) const { return {-1, -2 * zeta, 0}; }
};

template <class Method>
double after_many(double zeta, double wh) {
  const Oscillator law{zeta};
  Motion<double> s{1, 0.3};
  for (int i = 0; i < 200'000; ++i) {
    s = Method::step(law, 0.0, s, wh);
  }
  return std::abs(s.x) + std::abs(s.v);
}

// Near the limit from both sides.
template <class Method>
void expect_limit(double zeta, double wh) {
  EXPECT_LT(after_many<Method>(zeta, wh * 0.98), 10) << Method::name << " " << zeta;
  EXPECT_FALSE(after_many<Method>(zeta, wh * 1.02) < 1e3) << Method::name << " " << zeta;
}

TEST(Integrators, are_stable_up_to_their_published_limits) {
  for (const double zeta : {0.05, 0.2, 0.7}) {
    expect_limit<ExplicitEuler>(zeta, 2 * zeta);
    expect_limit<SemiImplicitEuler>(zeta, 2 * (std::sqrt(1 + zeta * zeta) - zeta));
  }
  expect_limit<RungeKutta4>(0, 2 * std::numbers::sqrt2);
  for (const double zeta : {0.0, 0.05, 1.0, 3.0}) {
    for (const double wh : {0.2, 3.0, 100.0, 1e5}) {
      EXPECT_LT(after_many<ImplicitMidpoint>(zeta, wh), 10) << zeta << " " << wh;
      EXPECT_LT(after_many<ExponentialRosenbrock>(zeta, wh), 10) << zeta << " " << wh;
    }
  }
}

// One period of an undamped oscillator: explicit Euler multiplies its energy by 1 + (wh)^2 a step, implicit
// midpoint turns by 2 atan(wh/2), RK4 is Taylor's polynomial; semi-implicit Euler turns by acos(1 -
// (wh)^2/2).
TEST(Integrators, err_as_theory_of_the_linear_oscillator_says) {
  const double wh = 0.2;
  const int n = 31;
  const auto run = [&](auto method) {
    Motion<double> s{1, 0};
    for (int i = 0; i < n; ++i) {
      s = decltype(method)::step(Oscillator{0}, 0.0, s, wh);
    }
    return s;
  };
  const auto euler = run(ExplicitEuler{});
  EXPECT_NEAR(euler.x * euler.x + euler.v * euler.v, std::pow(1 + wh * wh, n), 1e-12);
  const auto midpoint = run(ImplicitMidpoint{});
  EXPECT_NEAR(midpoint.x, std::cos(n * 2 * std::atan(wh / 2)), 1e-13);
  const auto semi = run(SemiImplicitEuler{});
  const double turn = std::acos(1 - wh * wh / 2);
  EXPECT_NEAR(semi.x, std::cos(n * turn) - wh / 2 * std::sin(n * turn) / std::sqrt(1 - wh * wh / 4), 1e-12);
  const std::complex<double> z(0, wh);
  const auto rk = std::pow(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))), n);
  const auto four = run(RungeKutta4{});
  EXPECT_NEAR(four.x, rk.real(), 1e-13);
  EXPECT_NEAR(-four.v, rk.imag(), 1e-13);
  const auto exact = run(ExponentialRosenbrock{});
  EXPECT_NEAR(exact.x, std::cos(n * wh), 1e-13);
}

template <class Law>
void expect_reference(const Law& law, Motion<double> end, const Reference& r, double within) {
  EXPECT_NEAR(end.x, r.x_m, within) << r.stiffness_N_m;
  ASSERT_EQ(law.events.count, static_cast<std::int64_t>(r.events_s.size())) << r.stiffness_N_m;
  for (std::size_t i = 0; i < r.events_s.size(); ++i) {
    EXPECT_NEAR(law.events.at_s[i], r.events_s[i], within) << r.stiffness_N_m;
  }
}

TEST(Integrators, exponential_method_is_exact_on_the_piecewise_linear) {
  for (const int steps : {60, 960}) {
    for (const Reference& r : kWallReference) {
      Wall<double> law{r.stiffness_N_m};
      const auto end =
          integrate<double>(law, steps, step_located<ExponentialRosenbrock, double, Wall<double>>);
      expect_reference(law, end, r, 1e-14);
    }
    Handle<double> law;
    const auto end =
        integrate<double>(law, 10 * steps, step_located<ExponentialRosenbrock, double, Handle<double>>);
    expect_reference(law, end, kHandleReference, 1e-13);
  }
}

TEST(Integrators, shipped_closed_form_is_exact_for_stiffnesses_of_five_decades_whatever_the_step) {
  for (const int steps : {60, 960}) {
    for (const Reference& r : kWallReference) {
      Wall<double> law{r.stiffness_N_m};
      const auto end = integrate<double>(law, steps, step_located<ClosedForm, double, Wall<double>>);
      expect_reference(law, end, r, 1e-14);
    }
    Handle<double> law;
    const auto end = integrate<double>(law, 10 * steps, [](auto& l, double t, Motion<double> s, double h) {
      return ClosedForm::step(l, t, s, h);
    });
    EXPECT_NEAR(end.x, kHandleReference.x_m, 1e-14);
    EXPECT_NEAR(end.v, kHandleReference.v_m_s, 1e-12);
  }
}

// Errors of the last contact with the wall, over halved steps.
template <class Method, bool located>
double contact_order() {
  const Reference& r = kWallReference[3];
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int steps = 240; steps <= 15'360; steps *= 2) {
    Wall<double> law{r.stiffness_N_m};
    (void)integrate<double>(
        law, steps,
        located ? step_located<Method, double, Wall<double>> : step_unlocated<Method, double, Wall<double>>);
    EXPECT_EQ(law.events.count, 4) << Method::name << " " << steps;
    const double x = -std::log2(steps), y = std::log2(std::abs(law.events.at_s[3] - r.events_s[3]));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TEST(Integrators, keep_their_order_through_contact_only_when_it_is_located) {
  EXPECT_GT((contact_order<RungeKutta4, true>()), 3.5);
  EXPECT_NEAR((contact_order<ImplicitMidpoint, true>()), 2, 0.15);
  EXPECT_NEAR((contact_order<RungeKutta4, false>()), 1, 0.4);
  EXPECT_NEAR((contact_order<ImplicitMidpoint, false>()), 1, 0.4);
}

const sim::Cell& plain_cell() {
  static const sim::Cell cell = [] {
    sim::CellParams p;
    p.spread = 0;
    p.inner = false;
    return sim::Cell(p, sim::NeedleParams{}, sim::HolderParams{}, 1, 0);
  }();
  return cell;
}

template <class Method, class Real>
Puncture<Real> punctured(std::int64_t steps, bool located = true) {
  static const MembraneForce<Real> force(plain_cell());
  Puncture<Real> law{&force, static_cast<Real>(plain_cell().puncture_depth_m())};
  (void)integrate<Real>(
      law, steps,
      located ? step_located<Method, Real, Puncture<Real>> : step_unlocated<Method, Real, Puncture<Real>>);
  return law;
}

TEST(Puncture, takes_its_force_from_the_cells_table) {
  const sim::Cell& cell = plain_cell();
  const MembraneForce<double> force(cell);
  const double N = cell.outer_Eh_N_m() * cell.R_m();
  for (int i = 0; i <= 5000; ++i) {
    const double w = 1e-4 * i;
    EXPECT_NEAR(force(w * cell.R_m()).force_N, N * cell.table(sim::Membrane::outer).force(w), 1e-15 * N) << w;
  }
  const double h = 1e-10, x = 17.3e-6;
  EXPECT_NEAR(force(x).slope_N_m, (force(x + h).force_N - force(x - h).force_N) / (2 * h), 1e-7);
}

TEST(Puncture, is_where_three_methods_meet) {
  const auto best = punctured<Extrapolated, long double>(16'000);
  ASSERT_EQ(best.events.count, 2);
  const auto halves = punctured<Extrapolated, long double>(8'000);
  const auto rk = punctured<RungeKutta4, double>(80'000);
  const auto coarse = punctured<ImplicitMidpoint, double>(20'000),
             fine = punctured<ImplicitMidpoint, double>(40'000);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(halves.events.at_s[i], best.events.at_s[i], 1e-14);
    EXPECT_NEAR(rk.events.at_s[i], best.events.at_s[i], 1e-13);
    const double richardson = fine.events.at_s[i] + (fine.events.at_s[i] - coarse.events.at_s[i]) / 3;
    EXPECT_NEAR(richardson, best.events.at_s[i], 1e-12);
  }
}

TEST(Puncture, not_located_is_late_by_up_to_a_step) {
  const double at = punctured<Extrapolated, long double>(16'000).events.at_s[1];
  for (const std::int64_t steps : {80, 800, 8000}) {
    const double h = Puncture<double>::end_s / static_cast<double>(steps);
    const double late = punctured<ImplicitMidpoint, double>(steps, false).events.at_s[1] - at;
    EXPECT_GT(late, 0) << steps;
    EXPECT_LT(late, 1.01 * h) << steps;
  }
}

// The quasi-static needle leaves out bending and drag: it is early by (F + c v) / (k v), to first order.
TEST(Puncture, quasi_static_errs_by_the_force_that_it_leaves_out) {
  using Law = Puncture<double>;
  const auto exact = punctured<Extrapolated, long double>(16'000);
  for (const std::int64_t steps : {8, 64, 4096}) {
    const auto shipped = punctured<QuasiStatic, double>(steps);
    ASSERT_EQ(shipped.events.count, 2);
    for (std::size_t i = 0; i < 2; ++i) {
      const double v = Law::drive_m_s(shipped.events.at_s[i]);
      const double F =
          i == 0 ? 0 : MembraneForce<double>(plain_cell())(plain_cell().puncture_depth_m()).force_N;
      const double early = (F + Law::drag_Ns_m * v) / (Law::pipette_N_m * v);
      EXPECT_NEAR((exact.events.at_s[i] - shipped.events.at_s[i]) / early, 1, 0.02) << steps << " " << i;
    }
    // And its own events are those of its drive: X(t) = depth.
    const double at = Law::lag_s * std::log((Law::set_point_m - Law::start_m) /
                                            (Law::set_point_m - plain_cell().puncture_depth_m()));
    EXPECT_NEAR(shipped.events.at_s[1], at, 1e-16);
  }
}

// Stage and cell as shipped: through the stage's speed limit, then as a lag; whatever the step.
TEST(Puncture, of_the_whole_station_comes_when_its_drive_reaches_it_whatever_the_step) {
  const sim::Cell& cell = plain_cell();
  sim::StageParams p;
  p.start_m = cell.centre_m({}) + sim::Vec3(cell.R_m() + 3e-6, 0, 0);
  p.resolution_m = 0;
  p.registration_m.setZero();
  const double depth = 26e-6, knee = p.velocity_max_m_s * p.lag_s;
  ASSERT_LT(knee, depth);
  const double limited = (depth + 3e-6 - knee) / p.velocity_max_m_s;  // at constant speed
  const double contact = 3e-6 / p.velocity_max_m_s;
  const double puncture = limited + p.lag_s * std::log(knee / (depth - cell.puncture_depth_m()));
  ASSERT_GT(puncture, limited);
  for (const double dt : {0.125e-3, 1e-3, 0.7e-3, 7e-3, 0.05}) {
    sim::SimStage stage(p);
    stage.enable(true);
    stage.step(0, 0, true, sim::Failure::none);
    hal::StageCommand to;
    to.tip_m = cell.centre_m({}) + sim::Vec3(cell.R_m() - depth, 0, 0);
    to.axis = -sim::Vec3::UnitX();
    ASSERT_EQ(stage.command(to), hal::Status::ok);
    sim::CellState s;
    for (int i = 0; s.time_s < 0.04; ++i) {
      const sim::StagePlantState before = stage.state();
      stage.step(i + 1, dt, true, sim::Failure::none);
      sim::TipMotion motion;
      motion.tip_begin_m = before.tip_m;
      motion.tip_end_m = stage.state().tip_m;
      motion.left_m = (stage.state().set_point_m.vec() - before.tip_m.vec()).norm();
      motion.knee_m = knee;
      motion.lag_s = p.lag_s;
      (void)cell.step(s, motion, dt);
    }
    EXPECT_NEAR(s.first_contact_time_s, contact, 1e-12) << dt;
    ASSERT_TRUE(s.outer.punctured) << dt;
    EXPECT_NEAR(s.outer.puncture_time_s, puncture, 1e-11) << dt;
  }
}

}  // namespace
}  // namespace punctum::report
