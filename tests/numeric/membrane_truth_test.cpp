#include "hal/sim/plant/membrane_truth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

namespace punctum::sim {
namespace {

using std::numbers::pi;

constexpr MembraneShape kDefault{3.8 / 60, 29.5 / 60, 0.5, 0.2};

MembraneSolution solved(const MembraneShape& shape, double w, int intervals) {
  MembraneSolution x;
  const int steps = static_cast<int>(std::ceil(w / 0.05));
  for (int i = 1; i <= steps; ++i) {
    EXPECT_TRUE(solve_membrane(shape, w * i / steps, intervals, x)) << "w = " << w * i / steps;
  }
  return x;
}

double cap(double theta) {
  const double h = 1 - std::cos(theta);
  return pi * h * h * (3 - h) / 3;
}

// Derivative at node i of the polynomial through five nodes.
double derivative(const std::vector<double>& x, const std::vector<double>& y, std::size_t i) {
  const std::size_t first = std::min(i < 2 ? 0 : i - 2, x.size() - 5);
  double sum = 0;
  for (std::size_t j = first; j < first + 5; ++j) {
    double weight = 0;
    for (std::size_t m = first; m < first + 5; ++m) {
      if (m == j) {
        continue;
      }
      double product = 1 / (x[j] - x[m]);
      for (std::size_t l = first; l < first + 5; ++l) {
        if (l != j && l != m) {
          product *= (x[i] - x[l]) / (x[j] - x[l]);
        }
      }
      weight += product;
    }
    sum += weight * y[j];
  }
  return sum;
}

struct Reference {
  double c_over_R, seat_over_R, nu, prestrain, w, force, pressure, tip_strain;
};
// Printed by membrane_truth_reference.py beside this file (scipy 1.10.1, solve_bvp at 1e-9): other equations,
// other unknowns, other mesh.
constexpr Reference kReference[] = {
    {0.0625, 0.5, 0.5, 0.2, 0.005, 0.00374892275, 0.66721481318, 0.1967553465},
    {0.0625, 0.5, 0.5, 0.2, 0.03125, 0.02294748426, 0.67013591288, 0.1852678200},
    {0.0625, 0.5, 0.5, 0.2, 0.125, 0.08799309422, 0.68162489015, 0.2164992838},
    {0.0625, 0.5, 0.5, 0.2, 0.375, 0.27014301859, 0.72419092915, 0.5423723865},
    {0.0625, 0.5, 0.5, 0.2, 0.75, 0.59264208702, 0.82009128634, 1.2377827249},
    {0.0625, 0.5, 0.5, 0.01, 0.005, 0.00048940608, 0.03966112754, 0.0080585235},
    {0.0625, 0.5, 0.5, 0.01, 0.03125, 0.00236647776, 0.04013519202, 0.0081719072},
    {0.0625, 0.5, 0.5, 0.01, 0.125, 0.00993382722, 0.04451190925, 0.0332768157},
    {0.0625, 0.5, 0.5, 0.01, 0.375, 0.04740241509, 0.07543089412, 0.1282061105},
    {0.0625, 0.5, 0.5, 0.01, 0.75, 0.17050863860, 0.16529835315, 0.3700026236},
    {0.1, 0.4, 0.3, 0.05, 0.005, 0.00140309381, 0.13622160279, 0.0471762621},
    {0.1, 0.4, 0.3, 0.05, 0.03125, 0.00792315380, 0.13713179689, 0.0368653950},
    {0.1, 0.4, 0.3, 0.05, 0.125, 0.02705501576, 0.14171112101, 0.0512483608},
    {0.1, 0.4, 0.3, 0.05, 0.375, 0.08676060960, 0.16553030349, 0.1557182901},
    {0.1, 0.4, 0.3, 0.05, 0.75, 0.21346768279, 0.23379010588, 0.3573460236},
};

TEST(MembraneTruth, agrees_with_an_independent_solution_by_scipy) {
  for (const Reference& ref : kReference) {
    const MembraneSolution x = solved({ref.c_over_R, ref.seat_over_R, ref.nu, ref.prestrain}, ref.w, 512);
    EXPECT_NEAR(x.force / ref.force, 1, 1e-7) << ref.prestrain << " " << ref.w;
    EXPECT_NEAR(x.pressure / ref.pressure, 1, 1e-7) << ref.prestrain << " " << ref.w;
    EXPECT_NEAR(x.lambda1.front() - 1, ref.tip_strain, 1e-7) << ref.prestrain << " " << ref.w;
  }
}

TEST(MembraneTruth, converges_with_the_fourth_power_of_the_mesh) {
  for (const double w : {0.05, 0.333, 0.7}) {
    const double exact = solved(kDefault, w, 1024).force;
    double before = 0;
    for (const int n : {32, 64, 128}) {
      const double error = std::abs(solved(kDefault, w, n).force - exact) / exact;
      if (n > 32) {
        EXPECT_GT(std::log2(before / error), 3.5) << "w " << w << " n " << n;
      }
      before = error;
      RecordProperty("force_error_ppb_n" + std::to_string(n) + "_w" + std::to_string(w),
                     std::to_string(1e9 * error));
    }
    EXPECT_LT(before, 1e-6) << w;
  }
}

TEST(MembraneTruth, keeps_its_volume) {
  for (const double prestrain : {0.01, 0.2}) {
    for (const double w : {0.01, 0.2, 0.5, 0.8}) {
      MembraneShape shape = kDefault;
      shape.prestrain = prestrain;
      const MembraneSolution x = solved(shape, w, 256);
      EXPECT_NEAR(x.volume, 4 * pi / 3, 1e-11);
      // Again from the places of the nodes alone: Gauss's rule on the cubics between them.
      double volume = cap(std::asin(shape.c_over_R)) + cap(std::asin(shape.seat_over_R));
      for (std::size_t i = 0; i + 1 < x.r.size(); ++i) {
        const double h = x.theta[i + 1] - x.theta[i];
        for (const auto& [s, weight] :
             {std::pair{-std::sqrt(0.6), 5.0 / 9}, {0.0, 8.0 / 9}, {std::sqrt(0.6), 5.0 / 9}}) {
          const double t = 0.5 * (1 + s);
          const auto cubic = [&](const std::vector<double>& y, const std::vector<double>& d, bool slope) {
            return slope ? (y[i + 1] - y[i]) * 6 * t * (1 - t) / h + d[i] * (1 - t) * (1 - 3 * t) -
                               d[i + 1] * t * (2 - 3 * t)
                         : y[i] * (1 + 2 * t) * (1 - t) * (1 - t) + y[i + 1] * t * t * (3 - 2 * t) +
                               h * t * (1 - t) * (d[i] * (1 - t) - d[i + 1] * t);
          };
          const double r = cubic(x.r, x.dr, false);
          volume -= 0.5 * weight * h * pi * r * r * cubic(x.z, x.dz, true);
        }
      }
      EXPECT_NEAR(volume / (4 * pi / 3), 1, 1e-9) << "prestrain " << prestrain << " w " << w;
    }
  }
}

// From the places of the nodes alone: stretches by numerical differentiation, tensions by Hooke's law.
TEST(MembraneTruth, balances_forces_at_every_cut) {
  for (const double prestrain : {0.01, 0.2}) {
    for (const double w : {0.05, 0.333, 0.8}) {
      MembraneShape shape = kDefault;
      shape.prestrain = prestrain;
      const double stretch = 1 + prestrain, nu = shape.nu;
      const MembraneSolution x = solved(shape, w, 512);
      std::vector<double> across(x.r.size()), P2(x.r.size()), outward(x.r.size());
      for (std::size_t i = 0; i < x.r.size(); ++i) {
        const double dr = derivative(x.theta, x.r, i), dz = derivative(x.theta, x.z, i);
        const double lambda1 = stretch * std::hypot(dr, dz);
        const double lambda2 = x.r[i] * stretch / std::sin(x.theta[i]);
        const double P1 = (lambda1 - 1 + nu * (lambda2 - 1)) / (1 - nu * nu);
        P2[i] = (lambda2 - 1 + nu * (lambda1 - 1)) / (1 - nu * nu);
        const double T1 = P1 / lambda2, sine = -dz / std::hypot(dr, dz), cosine = dr / std::hypot(dr, dz);
        const double axial = x.pressure * pi * x.r[i] * x.r[i] - 2 * pi * x.r[i] * T1 * sine;
        EXPECT_NEAR(axial, x.force, 2e-6 * std::max(x.force, x.pressure)) << "w " << w << " node " << i;
        across[i] = x.r[i] * T1 * cosine;
        outward[i] = P2[i] / stretch + x.pressure * x.r[i] * dz;
      }
      // And the radial balance, integrated between cuts: r T1 cos(phi) grows by the hoop tension less the
      // pressure.
      for (std::size_t i = 8; i + 8 < x.r.size(); i += 8) {
        double gained = 0;
        for (std::size_t j = i; j < i + 8; ++j) {
          gained += 0.5 * (outward[j] + outward[j + 1]) * (x.theta[j + 1] - x.theta[j]);
        }
        EXPECT_NEAR(across[i + 8] - across[i], gained, 3e-6) << "w " << w << " node " << i;
      }
    }
  }
}

TEST(MembraneTruth, stores_exactly_the_work_of_the_needle) {
  for (const double w : {0.05, 0.333, 0.7}) {
    // dU/dw by central differences of the solver's energies, error w^4 small: F of the same mesh.
    constexpr double h = 1e-3;
    const auto energy = [&](double at) { return solved(kDefault, at, 256).energy; };
    const double slope =
        (8 * (energy(w + h) - energy(w - h)) - (energy(w + 2 * h) - energy(w - 2 * h))) / (12 * h);
    EXPECT_NEAR(slope / solved(kDefault, w, 256).force, 1, 1e-6) << w;
  }
}

TEST(MembraneTruth, starts_linearly_from_nothing) {
  const MembraneTruth table(kDefault);
  EXPECT_EQ(table.force(0), 0);
  EXPECT_EQ(table.force(-1), 0);
  EXPECT_NEAR(table.pressure(0), 2 * 0.2 / 0.5 / 1.2, 1e-14);  // Laplace
  const double stiffness = solved(kDefault, 1e-4, 256).force / 1e-4;
  EXPECT_NEAR(solved(kDefault, 2e-4, 256).force / 2e-4 / stiffness, 1, 1e-3);
  EXPECT_NEAR(table.force(1e-4) / 1e-4 / stiffness, 1, 1e-2);
}

TEST(MembraneTruth, table_reproduces_the_solver_between_its_points) {
  const auto before = std::chrono::steady_clock::now();
  const MembraneTruth table(kDefault);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  RecordProperty("table_ms", std::to_string(1e3 * seconds));
  ASSERT_EQ(table.depth_max(), MembraneTruth::kDepthMax);
  std::vector<std::array<double, 2>> rz(MembraneTruth::kProfile);
  for (const double w : {0.004, 0.031, 0.1, 0.2222, 0.3456, 0.5, 0.7, 0.84}) {
    const MembraneSolution x = solved(kDefault, w, 256);
    EXPECT_NEAR(table.force(w) / x.force, 1, 2e-4) << w;
    EXPECT_NEAR(table.pressure(w) / x.pressure, 1, 1e-5) << w;
    EXPECT_NEAR(table.energy(w), x.energy, 1e-6 + 1e-4 * x.energy) << w;
    EXPECT_NEAR(table.half_width(w), x.half_width, 1e-3) << w;
    if (w > 0.2) {
      EXPECT_NEAR(table.strain(w), x.strain, 1e-3) << w;
    }
    // The profile goes through the solver's nodes: distance of each to the polyline, below 0.03 um of 60 um.
    table.profile(w, rz);
    for (std::size_t i = 0; i < x.r.size(); i += 7) {
      double nearest = 1e9;
      for (std::size_t j = 0; j + 1 < rz.size(); ++j) {
        const double dx = rz[j + 1][0] - rz[j][0], dy = rz[j + 1][1] - rz[j][1];
        const double t =
            std::clamp(((x.r[i] - rz[j][0]) * dx + (x.z[i] - rz[j][1]) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
        nearest = std::min(nearest, std::hypot(x.r[i] - rz[j][0] - t * dx, x.z[i] - rz[j][1] - t * dy));
      }
      EXPECT_LT(nearest, 5e-4) << "w " << w << " theta " << x.theta[i];
    }
    EXPECT_NEAR(rz.front()[1], 1 - w, 1e-12);  // the membrane under the tip is where the tip is
    EXPECT_NEAR(rz.front()[0], 0, 1e-15);
    EXPECT_NEAR(rz.back()[1], -1, 1e-15);
  }
}

TEST(MembraneTruth, force_strain_and_pressure_only_grow_with_depth) {
  const MembraneTruth table(kDefault);
  double F = 0, strain = 0, p = 0, U = 0;
  for (int i = 1; i <= 4000; ++i) {
    const double w = 1e-3 * i / 4;  // past the last tabled depth too
    EXPECT_GT(table.force(w), F);
    EXPECT_GE(table.strain(w), strain);
    EXPECT_GT(table.pressure(w), p);
    EXPECT_GT(table.energy(w), U);
    F = table.force(w), strain = table.strain(w), p = table.pressure(w), U = table.energy(w);
  }
  for (const double wanted : {0.25, 0.5, 1.0, 1.6}) {
    EXPECT_NEAR(table.strain(table.depth_at_strain(wanted)), wanted, 1e-12);
  }
  EXPECT_EQ(table.depth_at_strain(0.1), 0);
}

TEST(MembraneTruth, half_width_is_where_the_depth_has_fallen_to_one_per_cent) {
  const MembraneTruth table(kDefault);
  std::vector<std::array<double, 2>> rz(MembraneTruth::kProfile);
  for (const double w : {0.05, 0.3, 0.8}) {
    table.profile(w, rz);
    double a = 0;
    for (std::size_t j = 0; j + 1 < rz.size() && a == 0; ++j) {
      const auto rest = [&](std::size_t k) {
        return std::sqrt(1 - rz[k][0] * rz[k][0]) - rz[k][1] - 0.01 * w;
      };
      if (rest(j + 1) <= 0) {
        a = rz[j][0] + (rz[j + 1][0] - rz[j][0]) * rest(j) / (rest(j) - rest(j + 1));
      }
    }
    EXPECT_NEAR(table.half_width(w), a, 1e-3) << w;
  }
}

TEST(MembraneTruth, rim_is_the_highest_circle_of_the_profile) {
  const MembraneTruth table(kDefault);
  std::vector<std::array<double, 2>> rz(MembraneTruth::kProfile);
  for (const double w : {0.1, 0.333, 0.8}) {
    table.profile(w, rz);
    const auto top = *std::max_element(rz.begin(), rz.end(), [](auto& a, auto& b) { return a[1] < b[1]; });
    EXPECT_NEAR(table.rim_radius(w), top[0], 0.02) << w;
    EXPECT_NEAR(table.rim_depth(w), top[1] - rz.front()[1], 1e-3) << w;
  }
}

TEST(MembraneTruth, reaches_its_last_depth_for_any_sensible_cell) {
  for (const double prestrain : {0.002, 0.05, 0.3}) {
    for (const double c : {0.0125, 0.3}) {
      for (const double seat : {0.1, 0.85}) {
        for (const double nu : {0.0, 0.5}) {
          const MembraneTruth table({c, seat, nu, prestrain});
          EXPECT_EQ(table.depth_max(), MembraneTruth::kDepthMax)
              << prestrain << " " << c << " " << seat << " " << nu;
        }
      }
    }
  }
}

}  // namespace
}  // namespace punctum::sim
