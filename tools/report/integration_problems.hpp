// The problems that the integrators are measured on: stiff and discontinuous motions of the plant, each with
// an independent reference.
//
//   Handle    a mass held by an arm whose intention moves, dry friction: it stops, turns, sticks, breaks away
//   Wall      a mass under a held force against a damped spring: contact, and away again
//   Puncture  a pipette on the stage's drive in a viscous medium, pushed into a membrane until it gives way
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hal/sim/plant/cell.hpp"
#include "hal/sim/plant/hand.hpp"
#include "tools/report/integration_methods.hpp"

namespace punctum::report {

struct Reference {
  double stiffness_N_m, x_m, v_m_s;
  std::vector<double> events_s;
};
#include "tools/report/integrators_reference.inc"

// Times of the changes of the mode; the first eight.
struct EventLog {
  std::array<double, 8> at_s{};
  std::int64_t count = 0;
  void add(double t_s) {
    if (count < static_cast<std::int64_t>(at_s.size())) {
      at_s[static_cast<std::size_t>(count)] = t_s;
    }
    ++count;
  }
};

// What the program ships, in double: closed forms between events (hal/sim/plant/hand.cpp), and a needle that
// is where its drive is (hal/sim/plant/cell.cpp).
struct ClosedForm {
  static constexpr const char* name = "closed form";
  template <class Law>
  static Motion<double> step(const Law& law, double t, Motion<double> s, double h) {
    return law.closed_form(t, s, h);
  }
};
struct QuasiStatic {
  static constexpr const char* name = "quasi-static";
  template <class Law>
  static Motion<double> step(const Law& law, double t, Motion<double>, double h) {
    return {law.drive_m(t + h), law.drive_m_s(t + h)};
  }
};

template <class Real>
struct Handle {
  static constexpr double end_s = 0.6;
  static constexpr double mass_kg = 0.075, damping_Ns_m = 0.1, coulomb_N = 0.3;
  static constexpr double arm_N_m = 250, arm_Ns_m = 0.2, force_N = 1, intention_m_s = -0.004;
  static constexpr Motion<Real> start{Real(0.01), 0};

  EventLog events{};
  int sign = -1;  // of the velocity; 0 sticks

  [[nodiscard]] Real pull(Real t, Motion<Real> s) const {
    constexpr Real moving = Real(force_N + arm_Ns_m * intention_m_s);
    return moving + Real(arm_N_m) * (Real(intention_m_s) * t - s.x);
  }
  [[nodiscard]] Real a(Real t, Motion<Real> s) const {
    if (sign == 0) {
      return 0;
    }
    return (pull(t, s) - Real(sign * coulomb_N) - Real(damping_Ns_m + arm_Ns_m) * s.v) / Real(mass_kg);
  }
  [[nodiscard]] Slopes<Real> slopes(Real, Motion<Real>) const {
    if (sign == 0) {
      return {};
    }
    return {Real(-arm_N_m / mass_kg), Real(-(damping_Ns_m + arm_Ns_m) / mass_kg),
            Real(arm_N_m * intention_m_s / mass_kg)};
  }
  // Rounding near standstill is no motion.
  [[nodiscard]] Real gap(Real t, Motion<Real> s) const {
    return sign == 0 ? Real(coulomb_N) - std::abs(pull(t, s))
                     : Real(sign) * s.v + 4 * std::numeric_limits<Real>::epsilon();
  }
  void change(Real t, Motion<Real>& s) {
    events.add(static_cast<double>(t));
    const Real p = pull(t, s);
    if (sign == 0) {
      sign = p > 0 ? 1 : -1;
      return;
    }
    sign = std::abs(p) <= Real(coulomb_N) ? 0 : -sign;
    s.v = 0;
  }
  // sim::advance() locates stops, turns and breaking away by itself.
  [[nodiscard]] static Motion<double> closed_form(double t, Motion<double> s, double h) {
    sim::HandParams hand;
    hand.mass_kg = mass_kg;
    hand.damping_Ns_m = damping_Ns_m;
    hand.coulomb_N = coulomb_N;
    sim::HandAxis axis{s.x, s.v};
    sim::advance(axis, hand, {arm_N_m, arm_Ns_m}, force_N, intention_m_s * t, intention_m_s, h);
    return {axis.x_m, axis.v_m_s};
  }
};

template <class Real>
struct Wall {
  static constexpr double end_s = 0.06;
  static constexpr double mass_kg = 0.075, force_N = 1;
  static constexpr Motion<Real> start{Real(-0.001), Real(0.2)};

  Real stiffness_N_m;
  Real handle_Ns_m = Real(0.1);
  Real wall_Ns_m = std::sqrt(stiffness_N_m * Real(mass_kg)) / 10;  // damping ratio 0.05
  EventLog events{};
  bool inside = false;

  [[nodiscard]] Real a(Real, Motion<Real> s) const {
    const Real free = Real(force_N) - handle_Ns_m * s.v;
    return (inside ? free - stiffness_N_m * s.x - wall_Ns_m * s.v : free) / Real(mass_kg);
  }
  [[nodiscard]] Slopes<Real> slopes(Real, Motion<Real>) const {
    constexpr Real m = Real(mass_kg);
    return inside ? Slopes<Real>{-stiffness_N_m / m, -(handle_Ns_m + wall_Ns_m) / m, 0}
                  : Slopes<Real>{0, -handle_Ns_m / m, 0};
  }
  [[nodiscard]] Real gap(Real, Motion<Real> s) const { return inside ? s.x : -s.x; }
  void change(Real t, Motion<Real>&) {
    events.add(static_cast<double>(t));
    inside = !inside;
  }
  // Within one mode. Contact is located by step_located, as for the other methods.
  [[nodiscard]] Motion<double> closed_form(double, Motion<double> s, double h) const {
    sim::HandParams hand;
    hand.mass_kg = mass_kg;
    hand.damping_Ns_m = handle_Ns_m;
    hand.coulomb_N = 0;
    sim::HandAxis axis{s.x, s.v};
    sim::advance(axis, hand, {inside ? stiffness_N_m : 0, inside ? wall_Ns_m : 0}, force_N, 0, 0, h);
    return {axis.x_m, axis.v_m_s};
  }
  [[nodiscard]] Real energy_J(Motion<Real> s) const {  // kinetic, and stored in the wall and the held force
    const Real spring = inside ? stiffness_N_m * s.x * s.x / 2 : Real(0);
    return Real(mass_kg) * s.v * s.v / 2 + spring - Real(force_N) * s.x;
  }
};

// The simulated cell's force over depth, in metres and newtons: the table's own cubics, with their slope.
template <class Real>
class MembraneForce {
 public:
  explicit MembraneForce(const sim::Cell& cell) {
    const sim::MembraneTruth& table = cell.table(sim::Membrane::outer);
    const double R = cell.R_m(), N = cell.outer_Eh_N_m() * R;
    for (int k = 0; k < kIntervals; ++k) {
      const double from = depth(k), h = depth(k + 1) - from;
      const auto at = [&](double part) { return N * table.force(from + part * h); };
      const double f0 = at(0), f1 = at(1.0 / 3) - f0, f2 = at(2.0 / 3) - f0, f3 = at(1) - f0;
      const double c1 = 9 * f1 - 4.5 * f2 + f3, c2 = -22.5 * f1 + 18 * f2 - 4.5 * f3;
      const double s = 1 / (h * R);
      cubics_.push_back(
          {Real(from * R), Real(f0), Real(c1 * s), Real(c2 * s * s), Real((f3 - c1 - c2) * s * s * s)});
    }
  }

  struct Value {
    Real force_N, slope_N_m;
  };
  // Starts the search for the interval at the last one.
  [[nodiscard]] Value operator()(Real x_m) const {
    while (last_ > 0 && x_m < cubics_[last_].from) {
      --last_;
    }
    while (last_ + 1 < cubics_.size() && x_m >= cubics_[last_ + 1].from) {
      ++last_;
    }
    const Cubic& c = cubics_[last_];
    const Real d = x_m - c.from;
    return {c.c0 + d * (c.c1 + d * (c.c2 + d * c.c3)), c.c1 + d * (2 * c.c2 + d * 3 * c.c3)};
  }

 private:
  static constexpr int kIntervals = 64;
  static double depth(int k) {  // of the table's rows
    return sim::MembraneTruth::kDepthMax * std::pow(static_cast<double>(k) / kIntervals, 1.5);
  }
  struct Cubic {
    Real from, c0, c1, c2, c3;
  };
  std::vector<Cubic> cubics_;
  mutable std::size_t last_ = 0;
};

// x is the depth of the tip past the undeformed membrane.
template <class Real>
struct Puncture {
  static constexpr double end_s = 8e-3;
  static constexpr double mass_kg = 8e-10, drag_Ns_m = 2e-3, pipette_N_m = 500;
  static constexpr double start_m = -1e-6, set_point_m = 26e-6, lag_s = 4e-3;
  static constexpr Motion<Real> start{Real(start_m), 0};  // at rest; its drive moves

  const MembraneForce<Real>* membrane;
  Real puncture_m;
  EventLog events{};
  enum { outside, intact, punctured } mode = outside;

  // The drive, as SimStage moves it below its speed limit.
  [[nodiscard]] static Real drive_m(Real t) {
    return Real(set_point_m) - Real(set_point_m - start_m) * std::exp(-t / Real(lag_s));
  }
  [[nodiscard]] static Real drive_m_s(Real t) {
    return Real((set_point_m - start_m) / lag_s) * std::exp(-t / Real(lag_s));
  }
  [[nodiscard]] Real a(Real t, Motion<Real> s) const {
    const Real drive = Real(pipette_N_m) * (drive_m(t) - s.x) - Real(drag_Ns_m) * s.v;
    return (mode == intact ? drive - (*membrane)(s.x).force_N : drive) / Real(mass_kg);
  }
  [[nodiscard]] Slopes<Real> slopes(Real t, Motion<Real> s) const {
    const Real stiffness = Real(pipette_N_m) + (mode == intact ? (*membrane)(s.x).slope_N_m : Real(0));
    return {-stiffness / Real(mass_kg), Real(-drag_Ns_m / mass_kg),
            Real(pipette_N_m / mass_kg) * drive_m_s(t)};
  }
  [[nodiscard]] Real gap(Real, Motion<Real> s) const {
    if (mode == outside) {
      return -s.x;
    }
    return mode == intact ? puncture_m - s.x : Real(1);
  }
  void change(Real t, Motion<Real>&) {
    events.add(static_cast<double>(t));
    mode = mode == outside ? intact : punctured;
  }
};

// Runs a whole problem in equal steps. step: step_located<Method>, step_unlocated<Method> or a like function.
template <class Real, class Law, class Step>
Motion<Real> integrate(Law& law, std::int64_t steps, Step step) {
  const Real h = Real(Law::end_s) / static_cast<Real>(steps);
  Motion<Real> s = Law::start;
  for (std::int64_t i = 0; i < steps; ++i) {
    s = step(law, static_cast<Real>(i) * h, s, h);
  }
  return s;
}

// For the reference: the modified midpoint rule extrapolated over 2, 4 .. 12 parts of a step, order 12.
struct Extrapolated {
  static constexpr const char* name = "extrapolated midpoint";
  template <class Real, class Law>
  static Motion<Real> step(const Law& law, Real t, Motion<Real> s, Real h) {
    constexpr int rows = 6;
    std::array<Motion<Real>, rows> table;
    for (int j = 0; j < rows; ++j) {
      const int parts = 2 * (j + 1);
      const Real d = h / Real(parts);
      Motion<Real> before = s, now{s.x + d * s.v, s.v + d * law.a(t, s)};
      for (int k = 1; k < parts; ++k) {
        const Motion<Real> next{before.x + 2 * d * now.v, before.v + 2 * d * law.a(t + Real(k) * d, now)};
        before = now;
        now = next;
      }
      const Real a = law.a(t + h, now);
      Motion<Real> row{(before.x + now.x + d * now.v) / 2, (before.v + now.v + d * a) / 2};
      for (int k = 1; k <= j; ++k) {  // Neville in the square of the part
        const Real ratio = Real(parts) / Real(2 * (j + 1 - k));
        const Real weight = 1 / (ratio * ratio - 1);
        const Motion<Real> old = table[static_cast<std::size_t>(k - 1)];
        table[static_cast<std::size_t>(k - 1)] = row;
        row = {row.x + (row.x - old.x) * weight, row.v + (row.v - old.v) * weight};
      }
      table[static_cast<std::size_t>(j)] = row;
    }
    return table[rows - 1];
  }
};

}  // namespace punctum::report
