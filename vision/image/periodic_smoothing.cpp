#include "vision/image/periodic_smoothing.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

namespace {

// L D L^T of a symmetric positive definite band of width 2.
class BandFactors {
 public:
  // A(i,i), A(i,i+1), A(i,i+2); the first `size` rows count.
  BandFactors(const std::vector<double>& d0, const std::vector<double>& d1, const std::vector<double>& d2,
              std::size_t size)
      : d_(size), l1_(size), l2_(size) {
    for (std::size_t i = 0; i < size; ++i) {
      const double a2 = i >= 2 ? d2[i - 2] : 0, a1 = i >= 1 ? d1[i - 1] : 0;
      l2_[i] = i >= 2 ? a2 / d_[i - 2] : 0;
      l1_[i] = i >= 1 ? (a1 - (i >= 2 ? l2_[i] * d_[i - 2] * l1_[i - 1] : 0)) / d_[i - 1] : 0;
      d_[i] = d0[i] - (i >= 1 ? l1_[i] * l1_[i] * d_[i - 1] : 0) - (i >= 2 ? l2_[i] * l2_[i] * d_[i - 2] : 0);
    }
  }
  void solve(std::vector<double>& v) const {
    const std::size_t m = d_.size();
    for (std::size_t i = 0; i < m; ++i) {
      v[i] -= (i >= 1 ? l1_[i] * v[i - 1] : 0) + (i >= 2 ? l2_[i] * v[i - 2] : 0);
    }
    for (std::size_t i = 0; i < m; ++i) {
      v[i] /= d_[i];
    }
    for (std::size_t i = m; i-- > 0;) {
      v[i] -= (i + 1 < m ? l1_[i + 1] * v[i + 1] : 0) + (i + 2 < m ? l2_[i + 2] * v[i + 2] : 0);
    }
  }

 private:
  std::vector<double> d_, l1_, l2_;  // L(i,i-1), L(i,i-2)
};

}  // namespace

std::vector<double> smooth_periodic(const std::vector<double>& r, const std::vector<double>& weight,
                                    const std::vector<double>& stiffness) {
  const std::size_t n = r.size();
  if (n < 8) {
    return r;
  }
  double total = 0;
  for (double w : weight) {
    total += w;
  }
  if (!(total > 0)) {
    return r;
  }
  const double tiny = 1e-9 * total / static_cast<double>(n);  // keeps the matrix positive definite
  std::vector<double> d0(n), d1(n), d2(n);                    // A(i,i), A(i,i+1), A(i,i+2), cyclic
  for (std::size_t i = 0; i < n; ++i) {
    const double k0 = stiffness[(i + n - 1) % n], k1 = stiffness[i], k2 = stiffness[(i + 1) % n];
    d0[i] = weight[i] + tiny + k0 + 4 * k1 + k2;
    d1[i] = -2 * (k1 + k2);
    d2[i] = k2;
  }
  // The matrix is cyclic and pentadiagonal: the last two unknowns are a border, the rest is a band.
  const std::size_t m = n - 2;
  std::array<std::vector<double>, 3> rhs;  // the data, and the two columns of the border
  for (auto& v : rhs) {
    v.assign(m, 0.0);
  }
  for (std::size_t i = 0; i < m; ++i) {
    rhs[0][i] = weight[i] * r[i];
  }
  rhs[1][m - 2] += d2[m - 2];
  rhs[1][m - 1] += d1[m - 1];
  rhs[1][0] += d2[m];
  rhs[2][m - 1] += d2[m - 1];
  rhs[2][0] += d1[m + 1];
  rhs[2][1] += d2[m + 1];
  const std::vector<double> c0 = rhs[1], c1 = rhs[2];
  const BandFactors band(d0, d1, d2, m);
  for (auto& v : rhs) {
    band.solve(v);
  }
  // Schur complement of the band: two equations for the border's unknowns.
  double s00 = d0[m], s01 = d1[m], s11 = d0[m + 1];
  double b0 = weight[m] * r[m], b1 = weight[m + 1] * r[m + 1];
  for (std::size_t i = 0; i < m; ++i) {
    s00 -= c0[i] * rhs[1][i];
    s01 -= c0[i] * rhs[2][i];
    s11 -= c1[i] * rhs[2][i];
    b0 -= c0[i] * rhs[0][i];
    b1 -= c1[i] * rhs[0][i];
  }
  const double det = s00 * s11 - s01 * s01;
  if (!(std::abs(det) > 0)) {
    return r;
  }
  std::vector<double> x(n);
  x[m] = (b0 * s11 - b1 * s01) / det;
  x[m + 1] = (s00 * b1 - s01 * b0) / det;
  for (std::size_t i = 0; i < m; ++i) {
    x[i] = rhs[0][i] - rhs[1][i] * x[m] - rhs[2][i] * x[m + 1];
  }
  return x;
}

}  // namespace punctum::vision
