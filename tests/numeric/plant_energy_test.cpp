// The plant's energy: what is put in is kinetic, stored or dissipated, to 1e-6 of what flows, over 1e6 steps.
// What is dissipated is integrated here, by Gauss's rule along the motion, and not by the plant. Then the
// plant in its extremes: stiffness 10 N/m .. 1 MN/m, membranes of 1 GPa, steps of 1 ns .. 50 ms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "hal/sim/noise.hpp"
#include "hal/sim/plant/cell.hpp"
#include "hal/sim/plant/hand.hpp"
#include "tests/support/plain_cell.hpp"

namespace punctum::sim {
namespace {

using std::numbers::pi;
using test::plain_cell;
using test::uniform_cell;

struct Drive {  // of one axis over one step
  double force_N, p0_m, u_m_s;
};

// Over a step of the handle: squared speeds and ways.
struct Flow {
  double v2 = 0;     // of v^2
  double rel2 = 0;   // of (u - v)^2
  double way = 0;    // of |v|
  double place = 0;  // of x

  Flow& operator+=(const Flow& o) {
    v2 += o.v2, rel2 += o.rel2, way += o.way, place += o.place;
    return *this;
  }
};

Flow flow(const HandParams& hand, const ArmImpedance& arm, const Drive& d, const HandAxis& start, double from,
          double to, int depth = 0) {
  const auto at = [&](double t) {
    HandAxis a = start;
    advance(a, hand, arm, d.force_N, d.p0_m, d.u_m_s, t);
    return a;
  };
  // Three-point Gauss, exact enough where the motion is smooth; halves where it turns or stops.
  const HandAxis begin = at(from), end = at(to);
  const double half = (to - from) / 2, node = std::sqrt(0.6);
  const std::array<double, 3> weights{5.0 / 9, 8.0 / 9, 5.0 / 9};
  Flow sum;
  bool smooth = begin.v_m_s * end.v_m_s > 0;
  bool still = begin.v_m_s == 0 && end.v_m_s == 0;
  for (int k = 0; k < 3; ++k) {
    const HandAxis a = at(from + half * (1 + node * (k - 1)));
    const double rel = d.u_m_s - a.v_m_s, w = half * weights[static_cast<std::size_t>(k)];
    sum.v2 += w * a.v_m_s * a.v_m_s;
    sum.rel2 += w * rel * rel;
    sum.place += w * a.x_m;
    smooth = smooth && a.v_m_s * begin.v_m_s > 0;
    still = still && a.v_m_s == 0;
  }
  sum.way = std::abs(end.x_m - begin.x_m);
  if (hand.coulomb_N == 0 || smooth || still || depth == 12) {
    return sum;
  }
  Flow parts = flow(hand, arm, d, start, from, from + half, depth + 1);
  return parts += flow(hand, arm, d, start, from + half, to, depth + 1);
}

TEST(PlantEnergy, of_the_handle_closes_over_a_million_steps) {
  constexpr double dt = 1e-3;
  constexpr int kSteps = 1'000'000;
  const HandParams hand;
  const ArmImpedance arm{250, 6};
  const double wall_N_m = 1500;  // felt in ticks: it lets the handle in and out and bounces it
  SimHand device(hand, arm);
  const Noise noise(3, Noise::Stream::free_use);

  const auto intention = [](double t) {
    return 0.012 * std::sin(2 * pi * 0.31 * t) + 0.0004 * std::sin(2 * pi * 9 * t);
  };
  double in = 0, dissipated = 0, contacts = 0, stuck = 0;
  bool touched = false;
  HandAxis axis;
  double stored = 0, worst = 0, before_J = 0;
  const auto store = [&](double p) {
    return 0.5 * hand.mass_kg * axis.v_m_s * axis.v_m_s +
           0.5 * arm.stiffness_N_m * (axis.x_m - p) * (axis.x_m - p);
  };
  stored = store(intention(0));
  const double stored_at_start = stored;
  for (int k = 0; k < kSteps; ++k) {
    const double p0 = intention(k * dt), p1 = intention((k + 1) * dt);
    const Drive d{device.state().commanded_N.x, p0, (p1 - p0) / dt};
    const HandAxis start = axis;
    device.step((k + 1) * 1'000'000LL, dt, {p0, 0, 0}, {p1, 0, 0}, true, Failure::none);
    axis = {device.state().position_m.x, device.state().velocity_m_s.x};

    const Flow f = flow(hand, arm, d, start, 0, dt);
    // The arm's hand side moves with u against K (p - x) + B (u - x').
    const double u = d.u_m_s, way = axis.x_m - start.x_m;
    const double arm_pull =
        arm.stiffness_N_m * ((p0 + p1) / 2 * dt - f.place) + arm.damping_Ns_m * (u * dt - way);
    in += device.state().work_J - before_J + u * arm_pull;
    before_J = device.state().work_J;
    dissipated += hand.damping_Ns_m * f.v2 + arm.damping_Ns_m * f.rel2 + hand.coulomb_N * f.way;
    stored = store(p1);
    worst = std::max(worst, std::abs(in - (stored - stored_at_start) - dissipated) / (dissipated + 1e-6));

    const double depth = axis.x_m - 0.004;
    if ((depth > 0) != touched) {
      contacts += 1;
    }
    touched = depth > 0;
    if (axis.v_m_s == 0) {
      stuck += 1;
    }
    ASSERT_EQ(device.write_force({-wall_N_m * std::max(0.0, depth) + 0.02 * noise.gaussian(k), 0, 0}),
              hal::Status::ok);
  }
  const double error = std::abs(in - (stored - stored_at_start) - dissipated) / dissipated;
  RecordProperty("relative_error", std::to_string(error * 1e12) + "e-12");
  RecordProperty("worst_on_the_way", std::to_string(worst * 1e12) + "e-12");
  EXPECT_LT(worst, 1e-6);
  EXPECT_LT(error, 1e-6);
  EXPECT_GT(contacts, 600);  // in and out, some 310 times
  EXPECT_GT(stuck, 1000);
  EXPECT_GT(dissipated, 1);  // J: nothing of this is at rest
}

// Needle that moves straight along its axis or beside it; work on the cell by Simpson's rule on the force.
struct Needle {
  const Cell& cell;
  Vec3 tip, axis = -Vec3::UnitX();
  CellState state{};
  CellForce force{};
  double work_J = 0, flow_J = 0;
  int steps = 0;

  void go(const Vec3& to, int count, double dt) {
    const Vec3 from = tip;
    for (int i = 1; i <= count; ++i, ++steps) {
      const Vec3 next = from + (to - from) * (static_cast<double>(i) / count);
      const Vec3 middle = (tip + next) / 2;
      const Vec3 begin_N = force.force_N;
      const CellForce half = cell.step(state, {tip, middle, axis, axis, -1}, dt / 2);
      force = cell.step(state, {middle, next, axis, axis, -1}, dt / 2);
      const double done = -(begin_N + 4 * half.force_N + force.force_N).dot(next - tip) / 6;
      work_J += done;
      flow_J += std::abs(done);
      tip = next;
    }
  }
};

double stored_J(const Cell& cell, const CellState& s) {
  const auto of = [](const MembraneTruth& table, double w, double E_h, double R) {
    return table.energy(w / R) * E_h * R * R;
  };
  const double inner_Eh = 10e3 * 0.5e-6;
  double sum = 0;
  if (!s.outer.punctured) {
    sum += of(cell.table(Membrane::outer), s.outer.dimple_m, cell.outer_Eh_N_m(), cell.R_m());
  }
  if (!s.inner.punctured) {
    sum += of(cell.table(Membrane::inner), s.inner.dimple_m, inner_Eh, cell.R_inner_m());
  }
  return sum;
}

TEST(PlantEnergy, of_the_table_is_the_work_of_its_force) {
  const MembraneTruth& table = plain_cell().table(Membrane::outer);
  double work = 0, at = 0;
  constexpr double h = 1e-5;
  for (int i = 0; i < 170'000; ++i, at = i * h) {  // past the last tabled depth too
    work += h / 6 * (table.force(at) + 4 * table.force(at + h / 2) + table.force(at + h));
    if (i % 1000 == 999) {
      EXPECT_NEAR(table.energy(at + h) / work, 1, 1e-10) << at;
    }
  }
}

TEST(PlantEnergy, of_intact_membranes_comes_back_over_a_million_steps) {
  // Needle on the axis and beside it, in, sideways while inside, and out again, short of any puncture.
  constexpr double um = 1e-6;
  Needle needle{plain_cell(), {61.3 * um, 0, 0}};
  constexpr int kLeg = 1000;
  double worst = 0;
  for (int cycle = 0; cycle < 250; ++cycle) {
    const double y = 3 * std::sin(1.7 * cycle) * um, y2 = y + 2.5 * std::cos(2.9 * cycle) * um;
    const double depth = (6 + 12 * std::abs(std::sin(0.37 * cycle))) * um;
    // The force has a kink at the surface: a step of the quadrature ends there.
    needle.go({61.3 * um, y, 0}, 1, 1e-3);
    needle.go({std::sqrt(3600 * um * um - y * y), y, 0}, 9, 1e-3);
    needle.go({60 * um - depth, y, 0}, kLeg - 10, 1e-3);
    EXPECT_TRUE(needle.state.contact);
    worst = std::max(worst, std::abs(needle.work_J / stored_J(needle.cell, needle.state) - 1));
    needle.go({60 * um - depth, y2, 0}, kLeg, 1e-3);
    worst = std::max(worst, std::abs(needle.work_J / stored_J(needle.cell, needle.state) - 1));
    needle.go({60 * um - depth / 2, y, 0.5 * y2}, kLeg, 1e-3);
    worst = std::max(worst, std::abs(needle.work_J / stored_J(needle.cell, needle.state) - 1));
    const double z = 0.5 * y2;
    needle.go({std::sqrt(3600 * um * um - y * y - z * z), y, z}, kLeg - 10, 1e-3);
    needle.go({61.3 * um, y, z}, 10, 1e-3);
    EXPECT_FALSE(needle.state.contact);
  }
  EXPECT_FALSE(needle.state.outer.punctured);
  EXPECT_TRUE(needle.state.attached);
  EXPECT_EQ(needle.steps, 1'000'000);
  RecordProperty("left_over", std::to_string(1e12 * needle.work_J / needle.flow_J) + "e-12");
  RecordProperty("worst_stored", std::to_string(1e12 * worst) + "e-12");
  EXPECT_LT(std::abs(needle.work_J), 1e-6 * needle.flow_J);
  EXPECT_LT(worst, 1e-6);
}

// Through both membranes and out again at constant speeds, a million steps: the needle's work is what the
// membranes had stored when they gave way, what the inner one lost when the zona let it go, and drag and
// grip, written down here in closed form.
TEST(PlantEnergy, of_a_puncture_is_dropped_and_never_given_back) {
  constexpr double um = 1e-6, speed = 20 * um;
  constexpr double viscosity = 2e-3, grip = 0.05e-6, grip_speed = 5 * um, drag_length = 20 * um;
  const Cell& cell = plain_cell();
  const double R = cell.R_m(), Ri = cell.R_inner_m();
  const double outer_at = cell.puncture_depth_m();
  const double inner_at = (R - Ri) + cell.inner_puncture_depth_m();  // of the tip past the zona
  const double deepest = 35 * um;
  ASSERT_LT(outer_at, inner_at);
  ASSERT_LT(inner_at, deepest);

  // The force jumps where a membrane gives way: a step of the quadrature ends just before and after it.
  Needle needle{cell, {61 * um, 0, 0}};
  constexpr double just = 1e-15;
  double depth = -1 * um;
  for (const auto& [to, steps] : {std::pair{outer_at - just, 299'998},
                                  {outer_at + just, 2},
                                  {inner_at - just, 149'998},
                                  {inner_at + just, 2},
                                  {deepest, 150'000},
                                  {-1 * um, 400'000}}) {
    needle.go({R - to, 0, 0}, steps, std::abs(to - depth) / speed / steps);
    depth = to;
  }
  ASSERT_TRUE(needle.state.inner.punctured);
  EXPECT_FALSE(needle.state.lost());
  EXPECT_EQ(needle.steps, 1'000'000);

  const auto outer_J = [&](double w) {
    return cell.table(Membrane::outer).energy(w / R) * cell.outer_Eh_N_m() * R * R;
  };
  const auto inner_J = [&](double w) {
    return cell.table(Membrane::inner).energy(w / Ri) * (10e3 * 0.5e-6) * Ri * Ri;
  };
  // When the zona gives way the inner dimple is as deep as it pushed it, and recoils until the naked tip
  // meets it: w0 e^(-t/tau) = w1 + speed t.
  const double gap = R - Ri, thickness = 4.6 * um, tau = CellParams{}.recoil_s;
  const double w0 = outer_at - gap + thickness, w1 = outer_at - gap;
  double low = 0, high = tau;
  for (int i = 0; i < 100; ++i) {
    const double t = (low + high) / 2;
    (w0 * std::exp(-t / tau) > w1 + speed * t ? low : high) = t;
  }
  const double met = w1 + speed * low;
  // Immersed length min(1, depth / drag length), over the ways with the zona open.
  const auto immersed_way = [&](double from, double to) {
    const auto F = [&](double d) {
      return d < drag_length ? d * d / (2 * drag_length) : drag_length / 2 + (d - drag_length);
    };
    return F(to) - F(from);
  };
  const double pull = grip * std::tanh(speed / grip_speed);
  const double drag = viscosity * speed * (immersed_way(outer_at, deepest) + immersed_way(0, deepest));
  const double held = pull * ((deepest - outer_at) + (deepest - inner_at)  // one hole, then two
                              + deepest + (deepest - gap));
  const double expected =
      outer_J(outer_at) + inner_J(w0) + (inner_J(inner_at - gap) - inner_J(met)) + drag + held;
  RecordProperty("relative_error", std::to_string(1e9 * (needle.work_J / expected - 1)) + "e-9");
  EXPECT_NEAR(needle.work_J / expected, 1, 1e-6);
  EXPECT_GT(outer_J(outer_at), 0.5 * expected);  // the puncture is what it is about
}

TEST(PlantExtremes, the_handle_stays_bounded_for_any_stiffness_and_step) {
  for (const double K : {10.0, 1e2, 1e3, 1e4, 1e5, 1e6}) {
    for (const double m : {0.01, 0.075, 2.0}) {
      for (const double B : {0.0, 0.1, 50.0}) {
        for (const double friction : {0.0, 0.04, 2.0}) {
          for (const double dt : {1e-9, 1e-6, 1e-3, 0.05}) {
            HandParams hand;
            hand.mass_kg = m;
            hand.coulomb_N = friction;
            const ArmImpedance arm{K, B};
            const double force = 8.5, x0 = 0.08, v0 = -1;
            HandAxis axis{x0, v0};
            const double start = 0.5 * m * v0 * v0 + 0.5 * K * x0 * x0;
            for (int i = 0; i < 40; ++i) {
              advance(axis, hand, arm, force, 0, 0, dt);
            }
            // A held force is a potential: H = kinetic + spring - f x only falls, from below start + f |x0|.
            ASSERT_TRUE(std::isfinite(axis.x_m) && std::isfinite(axis.v_m_s));
            const double H =
                0.5 * m * axis.v_m_s * axis.v_m_s + 0.5 * K * axis.x_m * axis.x_m - force * axis.x_m;
            EXPECT_LE(H, (start - force * x0) + 1e-9 * (start + force * x0))
                << "K " << K << " m " << m << " B " << B << " friction " << friction << " dt " << dt;
            if (dt == 1e-9) {  // 40 ns: x0 + v0 t + a t^2 / 2
              const double t = 40 * dt;
              const double a = (force - K * x0 - (0.1 + B) * v0 + friction) / m;
              EXPECT_NEAR(axis.x_m, x0 + v0 * t + a * t * t / 2, 1e-12 + 1e-6 * std::abs(a) * t * t);
            }
          }
        }
      }
    }
  }
}

TEST(PlantExtremes, the_handle_is_where_shorter_steps_bring_it_after_fifty_milliseconds) {
  for (const double K : {10.0, 1e4, 1e6}) {
    for (const double friction : {0.0, 0.3}) {
      HandParams hand;
      hand.coulomb_N = friction;
      const ArmImpedance arm{K, 1};
      HandAxis once{0.01, 0.3}, often = once;
      advance(once, hand, arm, -2, 0.001, 0.02, 0.05);
      for (int i = 0; i < 500; ++i) {
        advance(often, hand, arm, -2, 0.001 + 0.02 * 1e-4 * i, 0.02, 1e-4);
      }
      EXPECT_NEAR(once.x_m, often.x_m, 1e-12) << K << " " << friction;
      EXPECT_NEAR(once.v_m_s, often.v_m_s, 1e-9) << K << " " << friction;
    }
  }
}

TEST(PlantExtremes, a_membrane_of_a_gigapascal_pushes_as_its_table_says_whatever_the_step) {
  constexpr double um = 1e-6;
  for (const double E : {1.0, 35.3e3, 1e9}) {
    CellParams p = uniform_cell();
    p.zona_E_Pa = p.inner_E_Pa = E;
    const Cell cell(p, NeedleParams{}, HolderParams{}, 1, 0);
    for (const double dt : {1e-9, 1e-6, 1e-3, 0.05}) {
      // 10 mm/s through the whole cell or 20 000 steps of it, whichever is shorter.
      CellState state;
      Vec3 tip(61 * um, 0.5 * um, 0);
      double largest = 0;
      const Vec3 axis = -Vec3::UnitX();
      const double bound_N = 2 * cell.table(Membrane::outer).force(2.2) * E * p.zona_h_m * cell.R_m() +
                             2 * cell.table(Membrane::inner).force(2.5) * E * p.inner_h_m * cell.R_m() + 1e-3;
      for (int i = 0; i < 20'000 && tip.x() > -70 * um; ++i) {
        const Vec3 next = tip - Vec3(0.01 * dt, 0, 0);
        const CellForce f = cell.step(state, {tip, next, axis, axis, -1}, dt);
        ASSERT_TRUE(f.force_N.allFinite() && std::isfinite(f.wd_m) && std::isfinite(f.pressure_Pa));
        largest = std::max(largest, f.force_N.norm());
        tip = next;
      }
      EXPECT_LT(largest, bound_N) << "E " << E << " dt " << dt;
      if (dt == 0.05) {  // one step from before the cell to far behind it: every event inside it
        EXPECT_NEAR(state.first_contact_time_s, 1e-4, 2e-6)
            << E;  // 1 um, and what 0.5 um beside the axis adds
        EXPECT_TRUE(state.outer.punctured && state.inner.punctured && state.far_wall_pierced);
        EXPECT_NEAR(state.outer.puncture_time_s, state.first_contact_time_s + cell.puncture_depth_m() / 0.01,
                    1e-7)
            << E;
      }
    }
  }
}

}  // namespace
}  // namespace punctum::sim
