#include "hal/sim/plant/cell.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <numbers>
#include <vector>

#include "tests/support/plain_cell.hpp"

namespace {
bool g_heap_forbidden = false;
}  // namespace

// Not inlined: g++ 12 takes malloc and free inside them for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (g_heap_forbidden) {
    std::abort();
  }
  if (void* p = std::malloc(size)) {
    return p;
  }
  throw std::bad_alloc{};
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace punctum::sim {
namespace {

using std::numbers::pi;
using test::plain_cell;
using test::uniform_cell;
using Points = std::vector<std::array<double, 2>>;

// Moves the needle in a straight line, in steps of dt.
struct Needle {
  const Cell& cell;
  Vec3 tip, axis = -Vec3::UnitX();
  CellState state{};
  CellForce force{};
  double vacuum_Pa = -1;

  void go(const Vec3& to, double seconds, double dt) {
    const Vec3 from = tip;
    const int steps = static_cast<int>(std::lround(seconds / dt));
    for (int i = 1; i <= steps; ++i) {
      const Vec3 next = from + (to - from) * (static_cast<double>(i) / steps);
      force = cell.step(state, {tip, next, axis, axis, vacuum_Pa}, dt);
      tip = next;
    }
  }
  void wait(double seconds, double dt) { go(tip, seconds, dt); }
};

Points contour(const Cell& cell, const CellState& state, Membrane which) {
  Points out(Cell::kContour);
  EXPECT_EQ(cell.contour(state, which, out), Cell::kContour);
  return out;
}

double area(const Points& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto &a = p[i], &b = p[(i + 1) % p.size()];
    sum += a[0] * b[1] - a[1] * b[0];
  }
  return std::abs(sum) / 2;
}

bool inside(const Points& p, double x, double y) {
  bool in = false;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++) {
    if ((p[i][1] > y) != (p[j][1] > y) &&
        x < (p[j][0] - p[i][0]) * (y - p[i][1]) / (p[j][1] - p[i][1]) + p[i][0]) {
      in = !in;
    }
  }
  return in;
}

constexpr double um = 1e-6;

TEST(Cell, locates_the_first_contact_inside_a_step) {
  for (const double dt : {1e-3, 0.125e-3, 0.25}) {
    Needle needle{plain_cell(), {73.21 * um, 0, 0}};
    needle.go({53.21 * um, 0, 0}, 2, dt);  // 10 um/s, surface at 60 um
    EXPECT_TRUE(needle.state.contact);
    EXPECT_NEAR(needle.state.first_contact_time_s, 1.321, 1e-9) << dt;
  }
}

TEST(Cell, gives_way_when_the_strain_at_the_tip_is_reached_whatever_the_step) {
  const Cell& cell = plain_cell();
  EXPECT_NEAR(cell.table(Membrane::outer).strain(cell.puncture_depth_m() / cell.R_m()), 0.5, 1e-9);
  EXPECT_GT(cell.puncture_depth_m(), 18 * um);
  EXPECT_LT(cell.puncture_depth_m(), 25 * um);
  for (const double dt : {1e-3, 0.125e-3, 0.1}) {
    Needle needle{cell, {61 * um, 0, 0}};
    needle.go({31 * um, 0, 0}, 3, dt);
    ASSERT_TRUE(needle.state.outer.punctured);
    EXPECT_NEAR(needle.state.outer.puncture_time_s, 0.1 + cell.puncture_depth_m() / (10 * um), 1e-9) << dt;
    EXPECT_NEAR(needle.state.outer.puncture_depth_m, cell.puncture_depth_m(), 1e-12) << dt;
    // The inner membrane lies zona and gap further in, and only gives way to the naked tip.
    ASSERT_TRUE(needle.state.inner.punctured);
    const double inner_at = 7.6 * um + cell.inner_puncture_depth_m();
    EXPECT_NEAR(needle.state.inner.puncture_time_s, 0.1 + inner_at / (10 * um), 1e-9) << dt;
  }
}

TEST(Cell, recoils_exponentially_whatever_the_step) {
  const Cell& cell = plain_cell();
  const double tau = CellParams{}.recoil_s;
  std::array<double, 3> dimple{};
  int k = 0;
  for (const double dt : {1e-3, 0.125e-3, 0.01}) {
    Needle needle{cell, {61 * um, 0, 0}};
    needle.go({61 * um - 1 * um - cell.puncture_depth_m() - 1e-12, 0, 0}, 2, dt);
    const double since = needle.state.time_s - needle.state.outer.puncture_time_s;
    needle.wait(0.1, dt);
    dimple[k++] = needle.state.outer.dimple_m;
    const double lip = 0.8 * um;
    EXPECT_NEAR(needle.state.outer.dimple_m,
                lip + (cell.puncture_depth_m() - lip) * std::exp(-(0.1 + since) / tau), 1e-12)
        << dt;
    EXPECT_EQ(needle.force.outer_N, 0);
  }
  EXPECT_NEAR(dimple[0], dimple[1], 1e-12);
  EXPECT_NEAR(dimple[0], dimple[2], 1e-12);
}

TEST(Cell, pushes_back_with_the_tabled_force_of_both_membranes) {
  const Cell& cell = plain_cell();
  Needle needle{cell, {61 * um, 0, 0}};
  for (const double w : {1.0, 4.0, 10.0, 20.0}) {
    needle.go({(60 - w) * um, 0, 0}, 0.2, 1e-3);
    const double outer = cell.table(Membrane::outer).force(w / 60) * 35.3e3 * 4.6e-6 * 60e-6;
    const double inner = cell.table(Membrane::inner).force((w - 3) / 52.4) * 10e3 * 0.5e-6 * 52.4e-6;
    EXPECT_NEAR(needle.force.outer_N, outer, 1e-15) << w;
    EXPECT_NEAR(needle.force.inner_N, inner, 1e-15) << w;  // engaged once the 3 um gap is closed
    EXPECT_NEAR(needle.force.force_N.x(), outer + inner, 1e-15) << w;
    EXPECT_NEAR(needle.force.membrane_N, outer + inner, 1e-15) << w;
    EXPECT_NEAR(needle.force.wd_m, w * um, 1e-15) << w;
    EXPECT_NEAR(needle.force.depth_m, w * um, 1e-15) << w;
  }
}

TEST(Cell, pushes_an_off_centre_needle_outwards_along_the_local_normal) {
  Needle needle{plain_cell(), {70 * um, 6 * um, 0}};
  needle.go({45 * um, 6 * um, 0}, 1, 1e-3);
  const double entry_x = std::sqrt(60.0 * 60 - 36) * um;
  EXPECT_NEAR(needle.force.entry_m.x(), entry_x, 1e-12);
  EXPECT_NEAR(needle.force.wd_m, entry_x - 45 * um, 1e-12);
  EXPECT_GT(needle.force.force_N.y(), 0);
  EXPECT_NEAR(needle.force.outer_N * 0.1, needle.force.force_N.y(),
              0.05 * needle.force.outer_N);  // e / R = 0.1
  EXPECT_NEAR(needle.force.membrane_N, needle.force.force_N.x(), 1e-15);
}

TEST(Cell, lets_the_needle_out_again_and_is_kept) {
  Needle needle{plain_cell(), {61 * um, 1 * um, 0}};
  needle.go({20 * um, 1 * um, 0}, 4, 1e-3);
  needle.wait(1, 1e-3);
  needle.go({80 * um, 1 * um, 0}, 2, 1e-3);
  EXPECT_FALSE(needle.state.lost());
  EXPECT_FALSE(needle.state.contact);
  EXPECT_GT(needle.state.clear_time_s, needle.state.outer.puncture_time_s);
  needle.wait(1, 1e-3);
  EXPECT_NEAR(needle.state.outer.dimple_m, 0, 1e-12);
  EXPECT_NEAR(needle.state.inner.dimple_m, 0, 1e-12);
}

TEST(Cell, is_torn_off_by_a_fast_withdrawal_once_suction_is_gone) {
  Needle needle{plain_cell(), {61 * um, 0, 0}};
  needle.go({20 * um, 0, 0}, 4, 1e-3);
  needle.vacuum_Pa = 0;
  needle.wait(0.5, 1e-3);
  EXPECT_TRUE(needle.state.attached);
  needle.go({80 * um, 0, 0}, 2, 1e-3);
  EXPECT_FALSE(needle.state.attached);
  EXPECT_TRUE(needle.state.lost());
  EXPECT_GT(needle.cell.centre_m(needle.state).x(), 1 * um);  // the needle carried it along
}

TEST(Cell, is_torn_off_by_sideways_force_beyond_suction_and_friction) {
  // Entry far off the axis: the normal there leans by more than the friction cone can hold.
  Needle needle{plain_cell(), {61 * um, 45 * um, 0}};
  needle.go({25 * um, 45 * um, 0}, 4, 1e-3);
  EXPECT_FALSE(needle.state.attached);
}

TEST(Cell, tears_when_a_needle_inside_moves_sideways) {
  Needle needle{plain_cell(), {61 * um, 0, 0}};
  needle.go({20 * um, 0, 0}, 4, 1e-3);
  needle.go({20 * um, 8.9 * um, 0}, 10, 1e-3);
  EXPECT_FALSE(needle.state.lost());
  needle.go({20 * um, 9.1 * um, 0}, 1, 1e-3);
  EXPECT_TRUE(needle.state.torn);
  needle.wait(2, 1e-3);
  EXPECT_GT(needle.state.leak, 0.5);
}

TEST(Cell, loses_the_far_wall_to_a_needle_pushed_through) {
  Needle needle{plain_cell(), {61 * um, 0, 0}};
  needle.go({-63.9 * um, 0, 0}, 12, 1e-3);
  EXPECT_FALSE(needle.state.far_wall_pierced);
  EXPECT_NEAR(needle.force.chord_m, 120 * um, 1e-12);
  needle.go({-64.1 * um, 0, 0}, 1, 1e-3);
  EXPECT_TRUE(needle.state.far_wall_pierced);
  EXPECT_TRUE(needle.state.lost());
}

TEST(Cell, undeformed_contours_are_the_concentric_circles) {
  const CellState state{};
  for (const Membrane which : {Membrane::outer, Membrane::inner}) {
    const double R = which == Membrane::outer ? 60 * um : 52.4 * um;
    const Points p = contour(plain_cell(), state, which);
    for (const auto& [x, y] : p) {
      EXPECT_NEAR(std::hypot(x, y), R, 1e-13);
    }
    EXPECT_NEAR(area(p) / (pi * R * R), 1, 1e-4);
  }
}

TEST(Cell, contour_meets_the_tip_also_off_centre_and_tilted) {
  Needle needle{plain_cell(), {75 * um, 5 * um, 0}, Vec3(-std::cos(0.1), std::sin(0.1), 0)};
  needle.go(needle.tip + 32 * um * needle.axis, 3, 1e-3);
  ASSERT_GT(needle.force.wd_m, 10 * um);
  ASSERT_FALSE(needle.state.outer.punctured);
  const Points p = contour(needle.cell, needle.state, Membrane::outer);
  EXPECT_NEAR(p[0][0], needle.tip.x(), 1e-12);
  EXPECT_NEAR(p[0][1], needle.tip.y(), 1e-12);
  const Points q = contour(needle.cell, needle.state, Membrane::inner);  // one zona further along the normal
  EXPECT_NEAR(std::hypot(q[0][0] - p[0][0], q[0][1] - p[0][1]), 4.6 * um, 0.3 * um);
}

TEST(Cell, inner_membrane_stays_inside_the_zona_through_a_whole_injection) {
  Needle needle{plain_cell(), {61 * um, 3 * um, 0}, Vec3(-std::cos(0.05), -std::sin(0.05), 0)};
  const Vec3 start = needle.tip;
  for (int leg = 0; leg < 120; ++leg) {
    const double depth = leg < 60 ? leg * 0.75 : (120 - leg) * 0.75;
    needle.go(start + depth * um * needle.axis, 0.03, 1e-3);
    const Points outer = contour(needle.cell, needle.state, Membrane::outer);
    const Points inner = contour(needle.cell, needle.state, Membrane::inner);
    for (const auto& [x, y] : inner) {
      ASSERT_TRUE(inside(outer, x, y)) << "leg " << leg;
    }
    for (std::size_t i = 0; i < outer.size(); ++i) {  // ordered and without gaps
      const auto &a = outer[i], &b = outer[(i + 1) % outer.size()];
      ASSERT_LT(std::hypot(a[0] - b[0], a[1] - b[1]), 2 * um) << "leg " << leg << " point " << i;
    }
  }
  EXPECT_FALSE(needle.state.lost());
}

TEST(Cell, bulges_elsewhere_when_it_is_dented) {
  Needle needle{plain_cell(), {61 * um, 0, 0}};
  needle.go({41 * um, 0, 0}, 2, 1e-3);
  double widest = 0;
  for (const auto& point : contour(needle.cell, needle.state, Membrane::outer)) {
    widest = std::max(widest, point[1]);
  }
  EXPECT_GT(widest, 61 * um);
  EXPECT_LT(widest, 64 * um);
}

TEST(Cell, individuals_differ_and_are_the_same_for_the_same_seed) {
  CellParams params;
  Cell cell(params, NeedleParams{}, HolderParams{}, 7, 0);
  const double R = cell.R_m(), Eh = cell.outer_Eh_N_m(), puncture = cell.puncture_depth_m();
  double sum = 0, squares = 0;
  constexpr int kMany = 2000;
  for (int i = 1; i <= kMany; ++i) {
    cell.renew(7, i);
    const double x = cell.R_m() / params.R_m - 1;
    sum += x;
    squares += x * x;
    // The holder's mouth does not move; the cell's left pole sits in it.
    EXPECT_NEAR(cell.centre_m({}).x() - cell.R_m(), params.centre_m.x() - params.R_m, 1e-15);
    EXPECT_EQ(cell.holder_mouth_m().x(), params.centre_m.x() - params.R_m);
  }
  EXPECT_NEAR(sum / kMany, 0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / kMany), 0.1, 0.01);
  cell.renew(7, 0);
  EXPECT_EQ(cell.R_m(), R);
  EXPECT_EQ(cell.outer_Eh_N_m(), Eh);
  EXPECT_EQ(cell.puncture_depth_m(), puncture);
  cell.renew(8, 0);
  EXPECT_NE(cell.R_m(), R);
}

TEST(Cell, goes_on_from_a_copied_state_exactly) {
  Needle first{plain_cell(), {61 * um, 2 * um, 0}};
  first.go({38 * um, 2 * um, 0}, 2.3, 1e-3);
  Needle second = first;
  std::memcpy(&second.state, &first.state, sizeof(CellState));
  first.go({20 * um, 3 * um, 0}, 1, 1e-3);
  second.go({20 * um, 3 * um, 0}, 1, 1e-3);
  EXPECT_EQ(first.state.outer.dimple_m, second.state.outer.dimple_m);
  EXPECT_EQ(first.force.force_N, second.force.force_N);
  EXPECT_EQ(first.state.inner.puncture_time_s, second.state.inner.puncture_time_s);
}

TEST(Cell, needs_no_heap_after_its_construction) {
  Cell cell(CellParams{}, NeedleParams{}, HolderParams{}, 1, 0);
  Needle needle{cell, {40 * um, 0, 0}};
  Points out(Cell::kContour);
  g_heap_forbidden = true;
  needle.go({-40 * um, 0, 0}, 3, 1e-3);
  cell.contour(needle.state, Membrane::outer, out);
  cell.contour(needle.state, Membrane::inner, out);
  cell.renew(3, 4);
  g_heap_forbidden = false;
  EXPECT_TRUE(needle.state.outer.punctured);
}

TEST(Cell, survives_a_tip_that_is_not_a_number) {
  Needle needle{plain_cell(), {61 * um, 0, 0}};
  needle.go({50 * um, 0, 0}, 1, 1e-3);
  CellState state = needle.state;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const CellForce force = needle.cell.step(state, {needle.tip, {nan, nan, nan}}, 1e-3);
  EXPECT_TRUE(force.force_N.allFinite());
  EXPECT_TRUE(std::isfinite(state.outer.dimple_m));
  EXPECT_FALSE(force.aims_at_cell);
}

TEST(Cell, without_inner_membrane_has_no_inner_contour) {
  CellParams params = uniform_cell();
  params.inner = false;
  const Cell cell(params, NeedleParams{}, std::nullopt, 1, 0);
  Points out(Cell::kContour);
  EXPECT_EQ(cell.contour({}, Membrane::inner, out), 0);
  EXPECT_EQ(cell.contour({}, Membrane::outer, std::span(out).first(100)), 0);
  EXPECT_EQ(cell.contour({}, Membrane::outer, out), Cell::kContour);
  Needle needle{cell, {61 * um, 0, 0}};  // adherent: nothing behind it but its dish
  needle.go({20 * um, 0, 0}, 4, 1e-3);
  EXPECT_TRUE(needle.state.outer.punctured);
  EXPECT_FALSE(needle.state.lost());
}

}  // namespace
}  // namespace punctum::sim
