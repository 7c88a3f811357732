// Prints rt/forces/large_deflection_coefficients.inc: least squares of the corrected law's polynomials on
// solutions of the full equations, at places drawn over its box, denser towards the edges. Relative errors
// count for force and pressure; the tension's are taken against its mean, as it passes through a dip. To
// standard error: the fit's error at places of its own that the fit has not seen.
//
//     ninja membrane_calibration && tests/membrane_calibration > rt/forces/large_deflection_coefficients.inc
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include "hal/sim/plant/membrane_truth.hpp"
#include "rt/forces/large_deflection.hpp"

namespace {

using punctum::rt::DeflectionInput;
using punctum::rt::kDeflectionMax;
using punctum::rt::kDeflectionMin;
using punctum::rt::kDeflectionTerms;

struct Sample {
  DeflectionInput at;
  double y[3];  // (1-nu) F/w, (1-nu) p, (1-nu) T
};

std::vector<Sample> solve(unsigned seed, int places, double edges) {
  constexpr int kDepths = 28, kIntervals = 64;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  const auto draw = [&](double low, double high) {
    const double even = u(random);
    const double dense = 0.5 * (1 - std::cos(std::numbers::pi * even));
    return low + (high - low) * (edges * dense + (1 - edges) * even);
  };
  const DeflectionInput &low = kDeflectionMin, &high = kDeflectionMax;
  std::vector<Sample> samples;
  for (int i = 0; i < places; ++i) {
    DeflectionInput at;
    at.c = std::exp(draw(std::log(low.c), std::log(high.c)));
    at.seat = draw(low.seat, high.seat);
    at.nu = draw(low.nu, high.nu);
    at.prestrain = std::pow(draw(std::sqrt(low.prestrain), std::sqrt(high.prestrain)), 2);
    punctum::sim::MembraneSolution x;
    for (int k = 1; k <= kDepths; ++k) {
      at.w = high.w * std::pow(static_cast<double>(k) / kDepths, 2);
      if (!punctum::sim::solve_membrane({at.c, at.seat, at.nu, at.prestrain}, at.w, kIntervals, x)) {
        break;
      }
      const double by = 1 - at.nu;
      samples.push_back(
          {at, {by * x.force / at.w, by * x.pressure, by * x.tip_tension / (1 + at.prestrain)}});
    }
  }
  return samples;
}

Eigen::RowVectorXd terms(const DeflectionInput& at) {
  Eigen::RowVectorXd row(kDeflectionTerms);
  const auto values = punctum::rt::deflection_terms(at);
  const double t = std::sqrt(at.w / kDeflectionMax.w);
  for (std::size_t i = 0; i < kDeflectionTerms; ++i) {
    row[static_cast<Eigen::Index>(i)] = values[i].value * std::pow(t, values[i].w_power);
  }
  return row;
}

}  // namespace

int main() {
  const std::vector<Sample> seen = solve(1, 900, 1), unseen = solve(2, 300, 0);
  Eigen::MatrixXd fit(kDeflectionTerms, 3);
  for (int q = 0; q < 3; ++q) {
    double mean = 0;
    for (const Sample& s : seen) {
      mean += s.y[q] / static_cast<double>(seen.size());
    }
    const auto weight = [&](const Sample& s) { return 1 / (q == 2 ? std::max(s.y[q], mean) : s.y[q]); };
    Eigen::MatrixXd A(seen.size(), kDeflectionTerms);
    Eigen::VectorXd b(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      A.row(row) = weight(seen[i]) * terms(seen[i].at);
      b[row] = weight(seen[i]) * seen[i].y[q];
    }
    fit.col(q) = A.householderQr().solve(b);
    double square = 0, worst = 0;
    DeflectionInput where;
    for (const Sample& s : unseen) {
      const double error = weight(s) * (terms(s.at).dot(fit.col(q)) - s.y[q]);
      square += error * error;
      if (std::abs(error) > worst) {
        worst = std::abs(error), where = s.at;
      }
    }
    std::fprintf(stderr,
                 "%s: unseen rms %.2f %%, worst %.2f %% at w %.3f c %.3f seat %.2f nu %.2f prestrain %.3f\n",
                 q == 0   ? "force"
                 : q == 1 ? "pressure"
                          : "tension",
                 100 * std::sqrt(square / static_cast<double>(unseen.size())), 100 * worst, where.w, where.c,
                 where.seat, where.nu, where.prestrain);
  }
  std::puts("// (1-nu) F/w, (1-nu) p, (1-nu) T of each term; by membrane_calibration.cpp");
  for (Eigen::Index i = 0; i < fit.rows(); ++i) {
    std::printf("{%.9g, %.9g, %.9g},\n", fit(i, 0), fit(i, 1), fit(i, 2));
  }
}
