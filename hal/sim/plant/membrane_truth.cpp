#include "hal/sim/plant/membrane_truth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "hal/math/elementary.hpp"

// Meridian by reference polar angle theta of the inflated sphere (R = 1); stress-free radius 1 / lambda_p.
// rho = sin(theta) / lambda_p; hoop stretch lambda2 = r / rho, meridional lambda1; strains eps = lambda - 1.
// Hookean in principal stretches, per reference area (hyperelastic, so work and energy must agree):
//   W = (eps1^2 + 2 nu eps1 eps2 + eps2^2) / (2 (1 - nu^2)),  P1 = dW/dlambda1,  P2 = dW/dlambda2.
// phi is the angle of the meridian below the horizontal; Q = rho P1 = r T1, H = Q cos(phi), V = Q sin(phi).
//   r' = lambda1 cos(phi),  z' = -lambda1 sin(phi),  H' = P2 - p r lambda1 sin(phi)          (horizontal)
//   V  = (p r^2 - F / pi) / 2                                                                  (vertical)
// Because arc length is the parameter, the profile may overhang. The patch under the tip moves rigidly (it
// sticks to the glass), the patch in the holder's fire-polished mouth stays. No bending, and hoop compression
// is carried without wrinkling: h / R of a zona is about 0.08. Lobatto IIIA collocation of fourth order, mesh
// graded towards the tip; Newton with exact derivatives; unknowns are r and H at the nodes, p and F; the
// meridian's height and the volume are conditions on integrals.

namespace punctum::sim {
namespace {

using std::numbers::pi;

constexpr double kTolerance = 1e-12;
constexpr int kNewtonSteps = 30;

// Forward differentiation over what one mesh interval depends on.
enum Partial { kRL, kHL, kRR, kHR, kP, kF, kPartials };

struct Dual {
  double v = 0;
  std::array<double, kPartials> d{};

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT(google-explicit-constructor): constants mix freely
  static Dual variable(double value, Partial which) {
    Dual x(value);
    x.d[which] = 1;
    return x;
  }
};

Dual chain(const Dual& a, double value, double slope) {
  Dual y(value);
  for (int i = 0; i < kPartials; ++i) {
    y.d[i] = slope * a.d[i];
  }
  return y;
}
Dual chain(const Dual& a, const Dual& b, double value, double slope_a, double slope_b) {
  Dual y(value);
  for (int i = 0; i < kPartials; ++i) {
    y.d[i] = slope_a * a.d[i] + slope_b * b.d[i];
  }
  return y;
}
Dual operator+(const Dual& a, const Dual& b) { return chain(a, b, a.v + b.v, 1, 1); }
Dual operator-(const Dual& a, const Dual& b) { return chain(a, b, a.v - b.v, 1, -1); }
Dual operator*(const Dual& a, const Dual& b) { return chain(a, b, a.v * b.v, b.v, a.v); }
Dual operator/(const Dual& a, const Dual& b) { return chain(a, b, a.v / b.v, 1 / b.v, -a.v / (b.v * b.v)); }
Dual sqrt(const Dual& a) { return chain(a, std::sqrt(a.v), 0.5 / std::sqrt(a.v)); }
// Derivatives over theta, and what else a node has.
template <typename Real>
struct Slope {
  Real r, H, z, volume;
  Real lambda1, lambda2, pull, sin_phi;
};

template <typename Real>
Slope<Real> slope(const MembraneShape& shape, double theta, const Real& r, const Real& H, const Real& p,
                  const Real& F) {
  using std::sqrt;
  const double nu = shape.nu;
  const double inverse_prestretch = 1 / (1 + shape.prestrain);
  const double rho = math::sin(theta) * inverse_prestretch;
  const Real V = (p * r * r - F * (1 / pi)) * 0.5;
  const Real Q = sqrt(H * H + V * V);
  const Real cos_phi = H / Q;
  const Real sin_phi = V / Q;
  const Real lambda2 = r * (1 / rho);
  const Real eps2 = lambda2 - 1.0;
  const Real P1 = Q * (1 / rho);
  const Real lambda1 = P1 * (1 - nu * nu) - eps2 * nu + 1.0;
  const Real P2 = eps2 + P1 * nu;
  Slope<Real> y;
  y.r = lambda1 * cos_phi * inverse_prestretch;
  y.z = lambda1 * sin_phi * -inverse_prestretch;
  y.H = (P2 - p * r * lambda1 * sin_phi) * inverse_prestretch;
  y.volume = r * r * y.z * -pi;
  y.lambda1 = lambda1;
  y.lambda2 = lambda2;
  y.pull = Q;
  y.sin_phi = sin_phi;
  return y;
}

// Two halves of n intervals: geometric from the rim of the tip to the equator, then narrowing towards the
// seat.
struct Mesh {
  double tip = 0;   // reference angle of the tip's rim
  double seat = 0;  // and of the edge of the holder's seat
  int n = 0;

  [[nodiscard]] int intervals() const { return 2 * n; }
  [[nodiscard]] double theta(double at) const {  // `at` intervals from the tip
    if (at <= n) {
      return tip * math::pow(pi / 2 / tip, at / n);
    }
    const double t = at / n - 1;
    return pi / 2 + (seat - pi / 2) * t * (1.5 - 0.5 * t);
  }
};

// One interval: ends, a point between them, and the quadrature that is exact for quadratics on these points.
struct Interval {
  double left, middle, right, h, s;  // s: where the middle lies, 0 .. 1
  double wl, wm, wr;                 // weights times h
  Interval(const Mesh& mesh, int i)
      : left(mesh.theta(i)),
        middle(mesh.theta(i + 0.5)),
        right(mesh.theta(i + 1)),
        h(right - left),
        s((middle - left) / h) {
    wm = h / (6 * s * (1 - s));
    wr = h / 2 - s * wm;
    wl = h - wm - wr;
  }
  template <typename Real>
  [[nodiscard]] Real sum(const Real& fl, const Real& fm, const Real& fr) const {
    return fl * wl + fm * wm + fr * wr;
  }
};

// Cubic through the ends of an interval with given values and derivatives.
struct Hermite {
  double a, b, c, d;
  Hermite(double h, double s)
      : a((2 * s - 3) * s * s + 1),
        b(h * ((s - 2) * s + 1) * s),
        c((3 - 2 * s) * s * s),
        d(h * (s - 1) * s * s) {}
  template <typename Real>
  [[nodiscard]] Real operator()(const Real& yl, const Real& dl, const Real& yr, const Real& dr) const {
    return yl * a + dl * b + yr * c + dr * d;
  }
};

double cap_volume(double theta) {
  const double height = 1 - math::cos(theta);
  return pi * height * height * (3 - height) / 3;
}

// Banded matrix, two diagonals below and two above, room for the fill-in of row exchanges.
class Banded {
 public:
  explicit Banded(int size) : n_(size), a_(static_cast<std::size_t>(size) * kWidth) {}

  void clear() { std::fill(a_.begin(), a_.end(), 0.0); }
  double& at(int row, int column) {
    return a_[static_cast<std::size_t>(row) * kWidth + static_cast<std::size_t>(column - row + kBelow)];
  }

  // Gauss elimination with row exchange; each right side is a column of length n. False when singular.
  template <std::size_t N>
  bool solve(std::array<std::vector<double>, N>& sides) {
    for (int k = 0; k < n_; ++k) {
      const int last = std::min(n_ - 1, k + kBelow);
      int pivot = k;
      for (int i = k + 1; i <= last; ++i) {
        if (std::abs(at(i, k)) > std::abs(at(pivot, k))) {
          pivot = i;
        }
      }
      if (!(std::abs(at(pivot, k)) > 1e-300)) {
        return false;
      }
      const int right = std::min(n_ - 1, k + kBelow + kAbove);
      if (pivot != k) {
        for (int j = k; j <= right; ++j) {
          std::swap(at(k, j), at(pivot, j));
        }
        for (auto& side : sides) {
          std::swap(side[k], side[pivot]);
        }
      }
      for (int i = k + 1; i <= last; ++i) {
        const double factor = at(i, k) / at(k, k);
        if (factor == 0) {
          continue;
        }
        for (int j = k; j <= right; ++j) {
          at(i, j) -= factor * at(k, j);
        }
        for (auto& side : sides) {
          side[i] -= factor * side[k];
        }
      }
    }
    for (auto& side : sides) {
      for (int k = n_ - 1; k >= 0; --k) {
        const int right = std::min(n_ - 1, k + kBelow + kAbove);
        double sum = side[k];
        for (int j = k + 1; j <= right; ++j) {
          sum -= at(k, j) * side[j];
        }
        side[k] = sum / at(k, k);
      }
    }
    return true;
  }

 private:
  static constexpr int kBelow = 2, kAbove = 2, kWidth = 2 * kBelow + kAbove + 1;
  int n_;
  std::vector<double> a_;
};

struct Unknowns {
  std::vector<double> y;  // r, H of each node
  double p = 0, F = 0;
};

class Newton {
 public:
  Newton(const MembraneShape& shape, double w, int n)
      : shape_(shape),
        w_(w),
        mesh_{math::asin(shape.c_over_R), pi - math::asin(shape.seat_over_R), n},
        size_(2 * mesh_.intervals() + 2),
        matrix_(size_) {
    for (auto& side : sides_) {
      side.resize(size_);
    }
    for (auto& row : row_) {
      row.resize(size_);
    }
  }

  [[nodiscard]] const Mesh& mesh() const { return mesh_; }

  bool run(Unknowns& x, double& residual) {
    assemble(x);
    double norm = norm_;
    for (int step = 0; step < kNewtonSteps; ++step) {
      if (norm < kTolerance) {
        break;
      }
      Unknowns dx;
      if (!solve(dx)) {
        return false;
      }
      double fraction = 1;
      Unknowns trial;
      for (;; fraction /= 2) {
        if (fraction < 1e-3) {
          return norm < 1e3 * kTolerance && (residual = norm, true);
        }
        trial = x;
        for (int i = 0; i < size_; ++i) {
          trial.y[i] -= fraction * dx.y[i];
        }
        trial.p -= fraction * dx.p;
        trial.F -= fraction * dx.F;
        if (!admissible(trial)) {
          continue;
        }
        assemble(trial);
        if (norm_ < norm || norm_ < kTolerance) {
          break;
        }
      }
      x = std::move(trial);
      const bool stalled = norm_ > 0.5 * norm && norm < 1e2 * kTolerance;
      norm = norm_;
      if (stalled) {
        break;
      }
    }
    residual = norm;
    return norm < 1e3 * kTolerance;
  }

 private:
  [[nodiscard]] bool admissible(const Unknowns& x) const {
    for (int i = 0; i < size_; i += 2) {
      if (!(x.y[i] > 0)) {
        return false;
      }
    }
    return true;
  }

  // Residuals at x, their derivatives, and the largest one.
  void assemble(const Unknowns& x) {
    matrix_.clear();
    for (auto& side : sides_) {
      std::fill(side.begin(), side.end(), 0.0);
    }
    for (auto& row : row_) {
      std::fill(row.begin(), row.end(), 0.0);
    }
    for (auto& c : corner_) {
      c.fill(0);
    }
    auto& rest = sides_[0];
    const Dual p = Dual::variable(x.p, kP);
    const Dual F = Dual::variable(x.F, kF);

    // Rim of the tip and edge of the seat keep their radius; in between the meridian falls by the rest of the
    // height, and the volume is the sphere's.
    const int last = size_ - 2;
    matrix_.at(0, 0) = 1;
    rest[0] = x.y[0] - shape_.c_over_R;
    matrix_.at(last + 1, last) = 1;
    rest[last + 1] = x.y[last] - shape_.seat_over_R;
    condition_[0] = math::cos(mesh_.tip) - w_ - math::cos(mesh_.seat);
    condition_[1] = cap_volume(mesh_.tip) + cap_volume(pi - mesh_.seat) - 4 * pi / 3;

    for (int i = 0; i < mesh_.intervals(); ++i) {
      const Interval on(mesh_, i);
      const Hermite cubic(on.h, on.s);
      const Dual rl = Dual::variable(x.y[2 * i], kRL), Hl = Dual::variable(x.y[2 * i + 1], kHL);
      const Dual rr = Dual::variable(x.y[2 * i + 2], kRR), Hr = Dual::variable(x.y[2 * i + 3], kHR);
      const auto l = slope(shape_, on.left, rl, Hl, p, F);
      const auto r = slope(shape_, on.right, rr, Hr, p, F);
      const auto m = slope(shape_, on.middle, cubic(rl, l.r, rr, r.r), cubic(Hl, l.H, Hr, r.H), p, F);
      put(2 * i + 1, i, rr - rl - on.sum(l.r, m.r, r.r));
      put(2 * i + 2, i, Hr - Hl - on.sum(l.H, m.H, r.H));
      add(0, i, on.sum(l.z, m.z, r.z));
      add(1, i, on.sum(l.volume, m.volume, r.volume));
    }

    norm_ = 0;
    for (const double v : rest) {
      norm_ = std::isfinite(v) ? std::max(norm_, std::abs(v)) : 1e300;
    }
    for (const double v : condition_) {
      norm_ = std::isfinite(v) ? std::max(norm_, std::abs(v)) : 1e300;
    }
  }

  void put(int row, int node, const Dual& residual) {
    sides_[0][row] = residual.v;
    for (int j = 0; j < 4; ++j) {
      matrix_.at(row, 2 * node + j) = residual.d[j];
    }
    for (int j = 0; j < 2; ++j) {
      sides_[1 + j][row] = residual.d[kP + j];
    }
  }
  void add(int condition, int node, const Dual& term) {
    condition_[condition] += term.v;
    for (int j = 0; j < 4; ++j) {
      row_[condition][2 * node + j] += term.d[j];
    }
    for (int j = 0; j < 2; ++j) {
      corner_[condition][j] += term.d[kP + j];
    }
  }

  // Newton step from what assemble() left: banded part first, then the two global unknowns.
  bool solve(Unknowns& dx) {
    if (!matrix_.solve(sides_)) {
      return false;
    }
    std::array<std::array<double, 2>, 2> s{};
    std::array<double, 2> b{};
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        s[i][j] = corner_[i][j] - dot(row_[i], sides_[1 + j]);
      }
      b[i] = condition_[i] - dot(row_[i], sides_[0]);
    }
    const double determinant = s[0][0] * s[1][1] - s[0][1] * s[1][0];
    if (!(std::abs(determinant) > 0)) {
      return false;
    }
    dx.p = (b[0] * s[1][1] - b[1] * s[0][1]) / determinant;
    dx.F = (s[0][0] * b[1] - s[1][0] * b[0]) / determinant;
    dx.y.resize(size_);
    for (int i = 0; i < size_; ++i) {
      dx.y[i] = sides_[0][i] - dx.p * sides_[1][i] - dx.F * sides_[2][i];
    }
    return true;
  }

  static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += a[i] * b[i];
    }
    return sum;
  }

  MembraneShape shape_;
  double w_;
  Mesh mesh_;
  int size_;
  Banded matrix_;
  std::array<std::vector<double>, 3> sides_;       // residual, and its derivatives over p and F
  std::array<std::vector<double>, 2> row_;         // integral conditions: derivatives over the nodes
  std::array<std::array<double, 2>, 2> corner_{};  // and over p and F
  std::array<double, 2> condition_{};
  double norm_ = 0;
};

double energy_density(double nu, double eps1, double eps2) {
  return (eps1 * eps1 + 2 * nu * eps1 * eps2 + eps2 * eps2) / (2 * (1 - nu * nu));
}

// Place of a material point on the deformed meridian.
std::array<double, 2> place(const MembraneSolution& x, double theta) {
  auto it = std::upper_bound(x.theta.begin(), x.theta.end(), theta);
  std::size_t i = it == x.theta.begin() ? 0 : static_cast<std::size_t>(it - x.theta.begin()) - 1;
  i = std::min(i, x.theta.size() - 2);
  const double h = x.theta[i + 1] - x.theta[i];
  const Hermite cubic(h, (theta - x.theta[i]) / h);
  return {cubic(x.r[i], x.dr[i], x.r[i + 1], x.dr[i + 1]), cubic(x.z[i], x.dz[i], x.z[i + 1], x.dz[i + 1])};
}

double depth_below_sphere(const std::array<double, 2>& rz) {
  return rz[0] < 1 ? std::sqrt((1 - rz[0]) * (1 + rz[0])) - rz[1] : -rz[1];
}

double half_width_of(const MembraneSolution& x) {
  const double wanted = 0.01 * x.w;
  std::size_t i = 1;
  while (i + 1 < x.theta.size() && depth_below_sphere({x.r[i], x.z[i]}) > wanted) {
    ++i;
  }
  double inside = x.theta[i - 1], outside = x.theta[i];
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (inside + outside);
    (depth_below_sphere(place(x, middle)) > wanted ? inside : outside) = middle;
  }
  return place(x, inside)[0];
}

// The highest circle round the dimple; the rim of the tip while the membrane falls away from it.
void find_rim(double c, MembraneSolution& x) {
  x.rim_radius = c;
  x.rim_depth = 0;
  std::size_t i = 0;
  while (i + 1 < x.theta.size() && x.sin_phi[i + 1] < 0) {
    ++i;
  }
  if (x.sin_phi[0] >= 0 || i + 1 == x.theta.size()) {
    return;
  }
  x.rim_radius = std::sqrt(x.force / (pi * x.pressure));  // no tension pulls it up or down
  double below = x.theta[i], above = x.theta[i + 1];
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (below + above);
    (place(x, middle)[0] < x.rim_radius ? below : above) = middle;
  }
  x.rim_depth = std::max(0.0, place(x, below)[1] - (1 - x.w));
}

// Everything that follows from the unknowns.
void fill(const MembraneShape& shape, const Mesh& mesh, double w, const Unknowns& x, MembraneSolution& out) {
  const int nodes = mesh.intervals() + 1;
  out.w = w;
  out.force = x.F;
  out.pressure = x.p;
  for (auto* column :
       {&out.theta, &out.r, &out.z, &out.dr, &out.dz, &out.pull, &out.sin_phi, &out.lambda1, &out.lambda2}) {
    column->resize(static_cast<std::size_t>(nodes));
  }
  const double at_rest = energy_density(shape.nu, shape.prestrain, shape.prestrain);
  const double inverse_prestretch = 1 / (1 + shape.prestrain);
  const auto stored = [&](double theta, const Slope<double>& s) {
    return 2 * pi * (energy_density(shape.nu, s.lambda1 - 1, s.lambda2 - 1) - at_rest) * math::sin(theta) *
           inverse_prestretch * inverse_prestretch;
  };
  out.energy = 0;
  out.volume = cap_volume(mesh.tip) + cap_volume(pi - mesh.seat);
  out.strain = shape.prestrain;
  double z = math::cos(mesh.tip) - w;
  for (int i = 0; i < mesh.intervals(); ++i) {
    const Interval on(mesh, i);
    const Hermite cubic(on.h, on.s);
    const double rl = x.y[2 * i], Hl = x.y[2 * i + 1], rr = x.y[2 * i + 2], Hr = x.y[2 * i + 3];
    const auto l = slope(shape, on.left, rl, Hl, x.p, x.F);
    const auto r = slope(shape, on.right, rr, Hr, x.p, x.F);
    const auto m = slope(shape, on.middle, cubic(rl, l.r, rr, r.r), cubic(Hl, l.H, Hr, r.H), x.p, x.F);
    const auto node = [&](int at, double theta, double radius, double height, const Slope<double>& y) {
      const auto k = static_cast<std::size_t>(at);
      out.theta[k] = theta;
      out.r[k] = radius;
      out.z[k] = height;
      out.dr[k] = y.r;
      out.dz[k] = y.z;
      out.pull[k] = y.pull;
      out.sin_phi[k] = y.sin_phi;
      out.lambda1[k] = y.lambda1;
      out.lambda2[k] = y.lambda2;
      out.strain = std::max({out.strain, y.lambda1 - 1, y.lambda2 - 1});
    };
    if (i == 0) {
      node(0, on.left, rl, z, l);
      out.tip_tension = l.pull / (math::sin(on.left) * inverse_prestretch);
    }
    z += on.sum(l.z, m.z, r.z);
    out.volume += on.sum(l.volume, m.volume, r.volume);
    out.energy += on.sum(stored(on.left, l), stored(on.middle, m), stored(on.right, r));
    node(i + 1, on.right, rr, z, r);
  }
  out.half_width = half_width_of(out);
  find_rim(shape.c_over_R, out);
}

}  // namespace

bool solve_membrane(const MembraneShape& shape, double w, int intervals, MembraneSolution& out) {
  Newton newton(shape, w, intervals);
  const Mesh& mesh = newton.mesh();
  const auto nodes = static_cast<std::size_t>(mesh.intervals()) + 1;
  Unknowns x;
  x.y.resize(2 * nodes);
  if (out.r.size() == nodes) {
    for (std::size_t i = 0; i < nodes; ++i) {
      x.y[2 * i] = out.r[i];
      x.y[2 * i + 1] = (out.dr[i] < 0 ? -1 : 1) * out.pull[i] *
                       std::sqrt(std::max(0.0, 1 - out.sin_phi[i] * out.sin_phi[i]));
    }
    x.p = out.pressure;
    x.F = out.force;
  } else {
    // The sphere under its own tension T0 and pressure p0 = 2 T0.
    const double T0 = shape.prestrain / (1 - shape.nu) / (1 + shape.prestrain);
    x.p = 2 * T0;
    for (int i = 0; i < static_cast<int>(nodes); ++i) {
      const double theta = mesh.theta(i);
      x.y[2 * i] = math::sin(theta);
      x.y[2 * i + 1] = T0 * math::sin(theta) * math::cos(theta);
    }
  }
  const bool converged = newton.run(x, out.residual);
  if (converged) {
    fill(shape, mesh, w, x, out);
  }
  return converged;
}

namespace {

constexpr int kDepths = 64;
constexpr int kButton = 4;  // profile intervals from the axis to the rim of the tip
constexpr int kSeat = 32;   // and from the edge of the seat to the far pole

// Reference angle of a profile node: closer together near the tip, where the membrane is stretched most, and
// one at each edge, where the profile has a corner.
double profile_theta(const MembraneShape& shape, int node) {
  const double tip = math::asin(shape.c_over_R), seat = pi - math::asin(shape.seat_over_R);
  if (node <= kButton) {
    return tip * node / kButton;
  }
  constexpr int kFree = MembraneTruth::kProfile - 1 - kButton - kSeat;
  if (node >= kButton + kFree) {
    return seat + (pi - seat) * (node - kButton - kFree) / kSeat;
  }
  const double t = static_cast<double>(node - kButton) / kFree;
  return tip + (seat - tip) * t * (0.5 + 0.5 * t);
}

std::array<double, 2> profile_place(const MembraneSolution& x, double theta) {
  if (theta <= x.theta.front()) {
    return {math::sin(theta), math::cos(theta) - x.w};
  }
  if (theta >= x.theta.back()) {
    return {math::sin(theta), math::cos(theta)};
  }
  return place(x, theta);
}

// Fritsch & Butland (1984): weighted harmonic means, so that the cubic is monotone where the data are.
std::vector<double> monotone_slopes(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t n = x.size();
  std::vector<double> slopes(n, 0.0);
  const auto secant = [&](std::size_t i) { return (y[i + 1] - y[i]) / (x[i + 1] - x[i]); };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = secant(i - 1), after = secant(i);
    if (before * after <= 0) {
      continue;
    }
    const double h0 = x[i] - x[i - 1], h1 = x[i + 1] - x[i];
    const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
    slopes[i] = (w0 + w1) / (w0 / before + w1 / after);
  }
  const auto end = [](double h0, double h1, double d0, double d1) {  // three points, kept monotone
    const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if (slope * d0 <= 0) {
      return 0.0;
    }
    return d0 * d1 <= 0 && std::abs(slope) > 3 * std::abs(d0) ? 3 * d0 : slope;
  };
  if (n >= 3) {
    slopes[0] = end(x[1] - x[0], x[2] - x[1], secant(0), secant(1));
    slopes[n - 1] = end(x[n - 1] - x[n - 2], x[n - 2] - x[n - 3], secant(n - 2), secant(n - 3));
  } else if (n == 2) {
    slopes[0] = slopes[1] = secant(0);
  }
  return slopes;
}

MembraneShape admissible(MembraneShape shape) {
  shape.c_over_R = std::clamp(shape.c_over_R, 0.005, 0.3);
  shape.seat_over_R = std::clamp(shape.seat_over_R, 0.1, 0.9);
  shape.nu = std::clamp(shape.nu, 0.0, 0.5);
  shape.prestrain = std::clamp(shape.prestrain, 2e-3, 1.0);
  return shape;
}

}  // namespace

MembraneTruth::MembraneTruth(const MembraneShape& wanted, int intervals) : shape_(admissible(wanted)) {
  MembraneSolution x;
  // Undeformed.
  const double T0 = shape_.prestrain / (1 - shape_.nu);
  w_.push_back(0);
  force_.y.push_back(0);
  pressure_.y.push_back(2 * T0 / (1 + shape_.prestrain));
  strain_.y.push_back(shape_.prestrain);
  tip_tension_.y.push_back(T0);
  half_width_.y.push_back(0);  // replaced by the limit below
  rim_radius_.y.push_back(shape_.c_over_R);
  rim_depth_.y.push_back(0);
  for (int j = 0; j < kProfile; ++j) {
    const double theta = profile_theta(shape_, j);
    rows_.push_back({math::sin(theta), math::cos(theta)});
  }
  for (int k = 1; k <= kDepths; ++k) {
    const double reach = static_cast<double>(k) / kDepths;
    const double w = kDepthMax * reach * std::sqrt(reach);
    // Smaller steps where a whole one does not converge.
    const double from = w_.back();
    bool reached = false;
    for (int parts = 1; parts <= 16 && !reached; parts *= 4) {
      MembraneSolution trial = x;
      reached = true;
      for (int part = 1; part <= parts && reached; ++part) {
        reached = solve_membrane(shape_, from + (w - from) * part / parts, intervals, trial);
      }
      if (reached) {
        x = std::move(trial);
      }
    }
    if (!reached) {
      break;
    }
    w_.push_back(w);
    force_.y.push_back(x.force);
    pressure_.y.push_back(x.pressure);
    strain_.y.push_back(std::max(x.strain, strain_.y.back()));
    tip_tension_.y.push_back(x.tip_tension);
    half_width_.y.push_back(x.half_width);
    rim_radius_.y.push_back(x.rim_radius);
    rim_depth_.y.push_back(x.rim_depth);
    for (int j = 0; j < kProfile; ++j) {
      rows_.push_back(profile_place(x, profile_theta(shape_, j)));
    }
  }
  if (w_.size() > 2) {
    half_width_.y[0] = half_width_.y[1] - (half_width_.y[2] - half_width_.y[1]) * w_[1] / (w_[2] - w_[1]);
  }
  for (Curve* curve :
       {&force_, &pressure_, &strain_, &tip_tension_, &half_width_, &rim_radius_, &rim_depth_}) {
    curve->slope = monotone_slopes(w_, curve->y);
  }
  work_.push_back(0);
  for (std::size_t i = 0; i + 1 < w_.size(); ++i) {
    work_.push_back(work_[i] + work_within(i, w_[i + 1]));
  }
  // Slopes of the profile over depth: parabola through three depths.
  row_slopes_.resize(rows_.size());
  const std::size_t depths = w_.size();
  for (std::size_t k = 0; depths > 2 && k < depths; ++k) {
    const std::size_t m = std::clamp<std::size_t>(k, 1, depths - 2);
    const double a = w_[m - 1], b = w_[m], c = w_[m + 1], at = w_[k];
    const double da = (2 * at - b - c) / ((a - b) * (a - c));
    const double db = (2 * at - a - c) / ((b - a) * (b - c));
    const double dc = (2 * at - a - b) / ((c - a) * (c - b));
    for (std::size_t j = 0; j < kProfile; ++j) {
      for (std::size_t i = 0; i < 2; ++i) {
        row_slopes_[k * kProfile + j][i] = da * rows_[(m - 1) * kProfile + j][i] +
                                           db * rows_[m * kProfile + j][i] +
                                           dc * rows_[(m + 1) * kProfile + j][i];
      }
    }
  }
}

std::size_t MembraneTruth::interval(double w) const NONBLOCKING {
  const auto above = static_cast<std::size_t>(std::upper_bound(w_.begin(), w_.end(), w) - w_.begin());
  return std::clamp<std::size_t>(above, 1, w_.size() - 1) - 1;
}

double MembraneTruth::at(const Curve& curve, double w) const NONBLOCKING {
  if (!(w > 0) || w_.size() < 2) {
    return curve.y.front();
  }
  if (w >= w_.back()) {
    return curve.y.back() + curve.slope.back() * (w - w_.back());
  }
  const std::size_t i = interval(w);
  const double h = w_[i + 1] - w_[i];
  const Hermite cubic(h, (w - w_[i]) / h);
  return cubic(curve.y[i], curve.slope[i], curve.y[i + 1], curve.slope[i + 1]);
}

MembraneTruth::Reading MembraneTruth::read(double w) const NONBLOCKING {
  if (!(w > 0) || w >= w_.back()) {
    return {force(w), pressure(w), strain(w), tip_tension(w), half_width(w), rim_radius(w), rim_depth(w)};
  }
  const std::size_t i = interval(w);
  const double h = w_[i + 1] - w_[i];
  const Hermite cubic(h, (w - w_[i]) / h);
  const auto of = [&](const Curve& c) { return cubic(c.y[i], c.slope[i], c.y[i + 1], c.slope[i + 1]); };
  return {of(force_),      of(pressure_),   of(strain_),   of(tip_tension_),
          of(half_width_), of(rim_radius_), of(rim_depth_)};
}

double MembraneTruth::force(double w) const NONBLOCKING { return at(force_, w); }
double MembraneTruth::pressure(double w) const NONBLOCKING { return at(pressure_, w); }
double MembraneTruth::strain(double w) const NONBLOCKING { return at(strain_, w); }

// From w_[i] to w, no further than w_[i + 1]: the integral of the force's cubic there.
double MembraneTruth::work_within(std::size_t i, double w) const NONBLOCKING {
  const double h = w_[i + 1] - w_[i], s = (w - w_[i]) / h, s2 = s * s, s3 = s2 * s, s4 = s2 * s2;
  const double left = s4 / 2 - s3 + s, right = s3 - s4 / 2;
  const double left_slope = s4 / 4 - 2 * s3 / 3 + s2 / 2, right_slope = s4 / 4 - s3 / 3;
  return h * (force_.y[i] * left + force_.y[i + 1] * right) +
         h * h * (force_.slope[i] * left_slope + force_.slope[i + 1] * right_slope);
}

double MembraneTruth::energy(double w) const NONBLOCKING {
  if (!(w > 0) || w_.size() < 2) {
    return 0;
  }
  if (w >= w_.back()) {
    const double past = w - w_.back();
    return work_.back() + past * (force_.y.back() + 0.5 * force_.slope.back() * past);
  }
  const std::size_t i = interval(w);
  return work_[i] + work_within(i, w);
}

double MembraneTruth::tip_tension(double w) const NONBLOCKING { return at(tip_tension_, w); }
double MembraneTruth::half_width(double w) const NONBLOCKING {
  return at(half_width_, std::min(w, w_.back()));
}

double MembraneTruth::rim_radius(double w) const NONBLOCKING { return at(rim_radius_, w); }
double MembraneTruth::rim_depth(double w) const NONBLOCKING { return at(rim_depth_, w); }

double MembraneTruth::depth_at_strain(double wanted) const NONBLOCKING {
  if (wanted <= strain_.y.front()) {
    return 0;
  }
  if (wanted >= strain_.y.back()) {
    const double slope = strain_.slope.back();
    return slope > 0 ? w_.back() + (wanted - strain_.y.back()) / slope : w_.back();
  }
  double low = 0, high = w_.back();
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (strain(middle) < wanted ? low : high) = middle;
  }
  return high;
}

void MembraneTruth::profile(double w, std::span<std::array<double, 2>> rz) const NONBLOCKING {
  if (rz.size() < kProfile) {
    return;
  }
  const double depth = std::clamp(w, 0.0, w_.back());
  if (w_.size() < 3) {
    std::copy_n(rows_.begin(), kProfile, rz.begin());
    return;
  }
  const std::size_t i = interval(depth);
  const double h = w_[i + 1] - w_[i];
  const Hermite cubic(h, (depth - w_[i]) / h);
  const std::size_t a = i * kProfile, b = a + kProfile;
  for (std::size_t j = 0; j < kProfile; ++j) {
    for (std::size_t k = 0; k < 2; ++k) {
      rz[j][k] = cubic(rows_[a + j][k], row_slopes_[a + j][k], rows_[b + j][k], row_slopes_[b + j][k]);
    }
  }
}

double MembraneTruth::undeformed_theta(int node) const NONBLOCKING { return profile_theta(shape_, node); }

}  // namespace punctum::sim
