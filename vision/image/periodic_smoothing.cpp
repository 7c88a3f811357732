#include "vision/image/periodic_smoothing.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

namespace {

// L D L^T of a symmetric positive definite band of width 2.
class BandFactors {
 public:
  BandFactors() = default;
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

  // Of the inverse, by the recursion of Takahashi: from the last row upwards within the band.
  [[nodiscard]] std::vector<double> diagonal_of_inverse() const {
    const std::size_t m = d_.size();
    std::vector<double> z0(m + 2, 0.0), z1(m + 2, 0.0), z2(m + 2, 0.0);  // Z(i,i), Z(i,i+1), Z(i,i+2)
    for (std::size_t i = m; i-- > 0;) {
      const double l1 = i + 1 < m ? l1_[i + 1] : 0, l2 = i + 2 < m ? l2_[i + 2] : 0;
      z1[i] = -l1 * z0[i + 1] - l2 * z1[i + 1];
      z2[i] = -l1 * z1[i + 1] - l2 * z0[i + 2];
      z0[i] = 1 / d_[i] - l1 * z1[i] - l2 * z2[i];
    }
    z0.resize(m);
    return z0;
  }

 private:
  std::vector<double> d_, l1_, l2_;  // L(i,i-1), L(i,i-2)
};

// The normal matrix is cyclic and pentadiagonal: the last two unknowns are a border, the rest is a band.
class CyclicBand {
 public:
  CyclicBand(const std::vector<double>& weight, const std::vector<double>& stiffness, double total_weight)
      : n_(weight.size()), m_(n_ - 2), d0_(n_), d1_(n_), d2_(n_) {
    const double tiny = 1e-9 * total_weight / static_cast<double>(n_);  // keeps it positive definite
    for (std::size_t i = 0; i < n_; ++i) {
      const double k0 = stiffness[(i + n_ - 1) % n_], k1 = stiffness[i], k2 = stiffness[(i + 1) % n_];
      d0_[i] = weight[i] + tiny + k0 + 4 * k1 + k2;
      d1_[i] = -2 * (k1 + k2);
      d2_[i] = k2;
    }
    for (auto& column : column_) {
      column.assign(m_, 0.0);
    }
    column_[0][m_ - 2] += d2_[m_ - 2];
    column_[0][m_ - 1] += d1_[m_ - 1];
    column_[0][0] += d2_[m_];
    column_[1][m_ - 1] += d2_[m_ - 1];
    column_[1][0] += d1_[m_ + 1];
    column_[1][1] += d2_[m_ + 1];
    solved_ = column_;
    band_ = BandFactors(d0_, d1_, d2_, m_);
    for (auto& column : solved_) {
      band_.solve(column);
    }
    // Schur complement of the band.
    s00_ = d0_[m_];
    s01_ = d1_[m_];
    s11_ = d0_[m_ + 1];
    for (std::size_t i = 0; i < m_; ++i) {
      s00_ -= column_[0][i] * solved_[0][i];
      s01_ -= column_[0][i] * solved_[1][i];
      s11_ -= column_[1][i] * solved_[1][i];
    }
    det_ = s00_ * s11_ - s01_ * s01_;
  }

  [[nodiscard]] bool solvable() const { return std::abs(det_) > 0; }
  [[nodiscard]] std::vector<double> solve(const std::vector<double>& right) const {
    std::vector<double> x(right.begin(), right.end() - 2);
    band_.solve(x);
    double b0 = right[m_], b1 = right[m_ + 1];
    for (std::size_t i = 0; i < m_; ++i) {
      b0 -= column_[0][i] * x[i];
      b1 -= column_[1][i] * x[i];
    }
    x.push_back((b0 * s11_ - b1 * s01_) / det_);
    x.push_back((s00_ * b1 - s01_ * b0) / det_);
    for (std::size_t i = 0; i < m_; ++i) {
      x[i] = x[i] - solved_[0][i] * x[m_] - solved_[1][i] * x[m_ + 1];
    }
    return x;
  }
  [[nodiscard]] std::vector<double> diagonal_of_inverse() const {
    std::vector<double> z = band_.diagonal_of_inverse();
    for (std::size_t i = 0; i < m_; ++i) {
      const double u = solved_[0][i], v = solved_[1][i];
      z[i] += (s11_ * u * u - 2 * s01_ * u * v + s00_ * v * v) / det_;
    }
    z.push_back(s11_ / det_);
    z.push_back(s00_ / det_);
    return z;
  }

 private:
  std::size_t n_, m_;                                   // unknowns; of them in the band
  std::vector<double> d0_, d1_, d2_;                    // A(i,i), A(i,i+1), A(i,i+2), cyclic
  std::array<std::vector<double>, 2> column_, solved_;  // of the border; and the band's inverse times them
  BandFactors band_;
  double s00_ = 0, s01_ = 0, s11_ = 0, det_ = 0;
};

double sum_of(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) {
    sum += x;
  }
  return sum;
}

}  // namespace

std::vector<double> smooth_periodic(const std::vector<double>& r, const std::vector<double>& weight,
                                    const std::vector<double>& stiffness) {
  const double total = sum_of(weight);
  if (r.size() < 8 || !(total > 0)) {
    return r;
  }
  const CyclicBand matrix(weight, stiffness, total);
  std::vector<double> right(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    right[i] = weight[i] * r[i];
  }
  return matrix.solvable() ? matrix.solve(right) : r;
}

std::vector<double> variance_of_smoothing(const std::vector<double>& weight,
                                          const std::vector<double>& stiffness) {
  return CyclicBand(weight, stiffness, sum_of(weight)).diagonal_of_inverse();
}

}  // namespace punctum::vision
