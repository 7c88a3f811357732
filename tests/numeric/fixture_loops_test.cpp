// The fixtures' fields round closed loops while they stand still. The force alone is integrated along random
// polygons, panel by panel between the surfaces where its second derivative jumps; the potentials are never
// asked, except for the scale that the rest is measured by.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "rt/forces/cone_guide.hpp"
#include "rt/forces/repulsive_region.hpp"
#include "rt/forces/withdrawal_axis.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
constexpr double kScale = 500;
constexpr int kLoops = 100'000;
constexpr double kTolerance = 1e-12;  // of the largest stored energy

// Gauss-Legendre on 0 .. 1, by Newton on the Legendre polynomial.
struct Gauss {
  static constexpr int n = 14;
  std::array<double, n> x{}, w{};
  Gauss() {
    for (int i = 0; i < n; ++i) {
      long double z = std::cos(3.14159265358979323846L * (i + 0.75L) / (n + 0.5L));
      long double slope = 0;
      for (int k = 0; k < 50; ++k) {
        long double p = 1, before = 0;
        for (int j = 0; j < n; ++j) {
          const long double next = ((2 * j + 1) * z * p - j * before) / (j + 1);
          before = p;
          p = next;
        }
        slope = n * (z * p - before) / (z * z - 1);
        z -= p / slope;
      }
      x[static_cast<std::size_t>(i)] = static_cast<double>((1 + z) / 2);
      w[static_cast<std::size_t>(i)] = static_cast<double>(1 / ((1 - z * z) * slope * slope));
    }
  }
};

// Zeros in 0 .. 1: sign changes between samples, and dips between them that cross and come back.
template <class G>
void zeros(const G& g, std::vector<double>& out) {
  constexpr int kSamples = 16;
  std::array<double, kSamples + 1> at;
  for (int i = 0; i <= kSamples; ++i) {
    at[static_cast<std::size_t>(i)] = g(static_cast<double>(i) / kSamples);
  }
  const auto bisect = [&](double a, double b) {
    const bool below = g(a) < 0;
    for (int k = 0; k < 52 && b - a > 1e-15; ++k) {
      const double m = (a + b) / 2;
      ((g(m) < 0) == below ? a : b) = m;
    }
    out.push_back((a + b) / 2);
  };
  const double step = 1.0 / kSamples;
  const auto positive = [&at](std::size_t i) { return !(at[i] < 0); };
  for (std::size_t i = 0; i <= kSamples; ++i) {
    const double here = static_cast<double>(i) * step;
    const bool first = i == 0;
    const bool last = i == kSamples;
    if (!last && positive(i) != positive(i + 1)) {
      bisect(here, here + step);
    }
    if ((!first && positive(i - 1) != positive(i)) || (!last && positive(i + 1) != positive(i))) {
      continue;
    }
    const double sign = positive(i) ? 1 : -1;
    if (!first && sign * at[i] > sign * at[i - 1]) {
      continue;
    }
    if (!last && sign * at[i] > sign * at[i + 1]) {
      continue;
    }
    double low = first ? 0 : here - step, high = last ? 1 : here + step;
    for (int k = 0; k < 44; ++k) {  // golden section
      const double m1 = high - 0.618033988749895 * (high - low), m2 = low + 0.618033988749895 * (high - low);
      if (sign * g(m1) < sign * g(m2)) {
        high = m2;
      } else {
        low = m1;
      }
    }
    const double dip = (low + high) / 2;
    if ((g(dip) < 0) == (at[i] < 0)) {
      continue;
    }
    if (dip > 0) {
      bisect(first ? 0 : here - step, dip);
    }
    if (dip < 1) {
      bisect(dip, last ? 1 : here + step);
    }
  }
}

// Closest point of a straight way to the fixture's axis.
double closest(const Vec3& entry, const Vec3& axis, const Vec3& a, const Vec3& b) {
  const Vec3 V = (a - entry) - axis.dot(a - entry) * axis;
  const Vec3 way = (b - a) - axis.dot(b - a) * axis;
  return std::clamp(-V.dot(way) / way.squaredNorm(), 0.0, 1.0);
}

struct Loops {
  double worst = 0;         // |work| over the largest energy stored on that loop
  double worst_of_all = 0;  // and over the largest stored on any
  double largest_J = 0;
  std::vector<Vec3> worst_loop;
};

// field(tip) -> Pull; knots(from, to, zeros): where along a straight way its second derivative jumps;
// corner(): a random point.
template <class Field, class Knots, class Corner>
Loops run(const Field& field, const Knots& knots, const Corner& corner, std::mt19937_64& random,
          int loops = kLoops) {
  static const Gauss gauss;
  Loops out;
  std::vector<double> work_of, energy_of;
  std::vector<double> cuts;
  std::vector<Vec3> loop;
  double energy = 0;
  double rounding = 0;  // of the last panel
  const auto panel = [&](const Vec3& a, const Vec3& way, double from, double to) {
    double sum = 0;
    rounding = 0;
    for (std::size_t i = 0; i < Gauss::n; ++i) {
      const PotentialForce p = field(a + (from + (to - from) * gauss.x[i]) * way);
      energy = std::max(energy, p.energy_J);
      sum += gauss.w[i] * p.force_N.dot(way);
      rounding += gauss.w[i] * p.force_N.norm();
    }
    rounding *= 1e-15 * way.norm() * (to - from) * kScale;
    return sum * (to - from) * kScale;
  };
  // Halved until both halves agree with the whole, or rounding is all that is left.
  const std::function<double(const Vec3&, const Vec3&, double, double, double, int)> integral =
      [&](const Vec3& a, const Vec3& way, double from, double to, double whole, int depth) -> double {
    const double middle = (from + to) / 2;
    const double left = panel(a, way, from, middle);
    const double right = panel(a, way, middle, to);
    const double off = std::abs(left + right - whole);
    if (depth == 0 || off <= 1e-15 * energy || off <= rounding) {
      return left + right;
    }
    return integral(a, way, from, middle, left, depth - 1) + integral(a, way, middle, to, right, depth - 1);
  };
  for (int n = 0; n < loops; ++n) {
    loop.clear();
    const int corners = 3 + n % 2;
    for (int i = 0; i < corners; ++i) {
      loop.push_back(corner(random));
    }
    energy = 0;
    double work = 0;
    for (int i = 0; i < corners; ++i) {
      const Vec3& a = loop[static_cast<std::size_t>(i)];
      const Vec3& b = loop[static_cast<std::size_t>((i + 1) % corners)];
      cuts.assign({0, 1});
      knots(a, b, cuts);
      std::sort(cuts.begin(), cuts.end());
      for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
        if (!(cuts[k + 1] > cuts[k])) {
          continue;
        }
        work += integral(a, b - a, cuts[k], cuts[k + 1], panel(a, b - a, cuts[k], cuts[k + 1]), 14);
      }
    }
    work_of.push_back(std::abs(work));
    energy_of.push_back(energy);
    out.largest_J = std::max(out.largest_J, energy);
    if (energy > 0 && std::abs(work) / energy > out.worst) {
      out.worst = std::abs(work) / energy;
      out.worst_loop = loop;
    }
  }
  out.worst_of_all = *std::max_element(work_of.begin(), work_of.end()) / out.largest_J;
  return out;
}

void tell(const char* name, const Loops& l) {
  std::printf("%s: worst work %.1e of the loop's largest stored energy, %.1e of the largest (%.2g mJ)\n",
              name, l.worst, l.worst_of_all, l.largest_J * 1e3);
  for (const Vec3& v : l.worst_loop) {
    std::printf("  (%.3f, %.3f, %.3f) um\n", v.x() * 1e6, v.y() * 1e6, v.z() * 1e6);
  }
}

const FixtureFrame kFrame{Vec3(21e-6, -4e-6, 2e-6), Vec3(-0.97, 0.15, -0.2).normalized()};

double distance(const Vec3& tip) { return -kFrame.axis.dot(tip - kFrame.entry_m); }
double off_axis(const Vec3& tip) {
  const Vec3 V = tip - kFrame.entry_m;
  return (V - kFrame.axis.dot(V) * kFrame.axis).norm();
}

// In front of and behind the membrane, from the axis to beyond the reach.
Vec3 near_the_cell(std::mt19937_64& random) {
  std::uniform_real_distribution<double> d(-100e-6, 150e-6), u(0, 1), phi(0, 6.283185307179586);
  const Vec3 e1 = kFrame.axis.cross(Vec3::UnitZ()).normalized();
  const Vec3 e2 = kFrame.axis.cross(e1);
  const double r = 80e-6 * std::pow(u(random), 2);
  const double at = phi(random);
  return kFrame.entry_m - d(random) * kFrame.axis + r * (std::cos(at) * e1 + std::sin(at) * e2);
}

TEST(FixtureLoops, cone_does_no_work_round_a_hundred_thousand_loops) {
  const ConeParams params;
  const double tan_alpha = std::tan(params.alpha_rad);
  const double e = params.d0_m / 4;  // the free core widens smoothly over this
  const auto core = [&](double d) {
    if (d <= 0) {
      return params.r0_m;
    }
    const double t = d / e;
    const double widened =
        t >= 1 ? d - e / 2 : e * (2.5 * std::pow(t, 4) - 3 * std::pow(t, 5) + std::pow(t, 6));
    return params.r0_m + tan_alpha * widened;
  };
  std::mt19937_64 random(101);
  const Loops l = run([&](const Vec3& tip) { return cone_pull(params, kScale, kFrame, tip); },
                      [&](const Vec3& a, const Vec3& b, std::vector<double>& cuts) {
                        const double da = distance(a), db = distance(b);
                        for (const double plane : {-2 * params.d0_m, -params.d0_m, 0.0, e}) {
                          if ((da < plane) != (db < plane)) {
                            cuts.push_back((plane - da) / (db - da));
                          }
                        }
                        for (const double edge : {0.0, params.eps_m / std::cos(params.alpha_rad)}) {
                          zeros(
                              [&](double t) {
                                const Vec3 p = a + t * (b - a);
                                return off_axis(p) - core(distance(p)) - edge;
                              },
                              cuts);
                        }
                      },
                      near_the_cell, random);
  tell("cone", l);
  EXPECT_LE(l.worst_of_all, kTolerance);
}

TEST(FixtureLoops, withdrawal_axis_does_no_work_round_a_hundred_thousand_loops) {
  const AxisParams params;
  std::mt19937_64 random(102);
  const Loops l = run([&](const Vec3& tip) { return axis_pull(params, kScale, kFrame, tip); },
                      [&](const Vec3& a, const Vec3& b, std::vector<double>& cuts) {
                        cuts.push_back(closest(kFrame.entry_m, kFrame.axis, a, b));
                        zeros([&](double t) { return off_axis(a + t * (b - a)) - params.eps_m; }, cuts);
                      },
                      near_the_cell, random);
  tell("axis", l);
  EXPECT_LE(l.worst_of_all, kTolerance);
}

TEST(FixtureLoops, repulsive_region_does_no_work_round_a_hundred_thousand_loops) {
  const RepulsiveParams params;
  const Vec3 centre(3e-6, -37e-6, 1e-6);
  std::mt19937_64 random(103);
  std::normal_distribution<double> n;
  const Loops l = run(
      [&](const Vec3& tip) { return repulsive_push(params, kScale, centre, tip); },
      [&](const Vec3& a, const Vec3& b, std::vector<double>& cuts) {
        zeros(
            [&](double t) {
              return (a + t * (b - a) - centre).squaredNorm() * 1e6 - params.radius_m * params.radius_m * 1e6;
            },
            cuts);
      },
      [&](std::mt19937_64& r) { return Vec3(centre + 14e-6 * Vec3(n(r), n(r), n(r))); }, random);
  tell("repulsive region", l);
  EXPECT_LE(l.worst_of_all, kTolerance);
}

// The yardstick itself: the printed law's loops do give work, as the closed form says.
TEST(FixtureLoops, the_printed_cone_does_work_round_the_same_kind_of_loop) {
  ConeParams params;
  params.method = ConeParams::Method::paper;
  std::mt19937_64 random(104);
  const Loops l = run([&](const Vec3& tip) { return cone_pull(params, kScale, kFrame, tip); },
                      [&](const Vec3& a, const Vec3& b, std::vector<double>& cuts) {
                        const double da = distance(a), db = distance(b);
                        if ((da < 0) != (db < 0)) {
                          cuts.push_back(da / (da - db));
                        }
                      },
                      near_the_cell, random, 2000);
  tell("printed cone", l);
  EXPECT_GT(l.worst_of_all, 0.1);
}

}  // namespace
}  // namespace punctum::rt
