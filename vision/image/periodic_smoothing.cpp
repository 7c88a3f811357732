#include "vision/image/periodic_smoothing.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

namespace {

// The normal matrix is cyclic and pentadiagonal: the last two unknowns are a border, the rest is a band of
// width 2. The band is L D L^T.
class CyclicBand {
 public:
  // right: of the equations to be solved; or empty.
  CyclicBand(const std::vector<double>& weight, const std::vector<double>& stiffness, double total_weight,
             const std::vector<double>& right)
      : n_(weight.size()), m_(n_ - 2), row_(n_) {
    const double tiny = 1e-9 * total_weight / static_cast<double>(n_);  // keeps it positive definite
    const auto next = [&](std::size_t i) { return stiffness[i + 1 < n_ ? i + 1 : 0]; };
    const auto d0 = [&](std::size_t i) {  // A(i,i), A(i,i+1), A(i,i+2), cyclic
      return weight[i] + tiny + stiffness[i > 0 ? i - 1 : n_ - 1] + 4 * stiffness[i] + next(i);
    };
    const auto d1 = [&](std::size_t i) { return -2 * (stiffness[i] + next(i)); };
    const auto d2 = [&](std::size_t i) { return next(i); };
    border_ = {{{0, d2(m_), d1(m_ + 1)},
                {1, 0, d2(m_ + 1)},
                {m_ - 2, d2(m_ - 2), 0},
                {m_ - 1, d1(m_ - 1), d2(m_ - 1)}}};
    for (const Border& b : border_) {
      row_[b.row].x[0] = b.first;
      row_[b.row].x[1] = b.second;
    }
    for (std::size_t i = 0; i < right.size(); ++i) {
      row_[i].x[2] = right[i];
    }
    // L and D row by row, and L's inverse times the right sides with them.
    row_[0].d = d0(0);
    row_[1].l1 = d1(0) / row_[0].d;
    row_[1].d = d0(1) - row_[1].l1 * row_[1].l1 * row_[0].d;
    for (std::size_t c = 0; c < 3; ++c) {
      row_[1].x[c] -= row_[1].l1 * row_[0].x[c];
    }
    for (std::size_t i = 2; i < m_; ++i) {
      const Row &last = row_[i - 1], &before = row_[i - 2];
      Row& here = row_[i];
      here.l2 = d2(i - 2) / before.d;
      here.l1 = (d1(i - 1) - here.l2 * before.d * last.l1) / last.d;
      here.d = d0(i) - here.l1 * here.l1 * last.d - here.l2 * here.l2 * before.d;
      for (std::size_t c = 0; c < 3; ++c) {
        here.x[c] -= here.l1 * last.x[c] + here.l2 * before.x[c];
      }
    }
    const std::array<double, 2> border_right = {row_[m_].x[2], row_[m_ + 1].x[2]};
    row_[m_].x = row_[m_ + 1].x = {};
    for (std::size_t i = m_; i-- > 0;) {
      Row& here = row_[i];
      const Row &next_row = row_[i + 1], &after = row_[i + 2];
      for (std::size_t c = 0; c < 3; ++c) {
        here.x[c] = here.x[c] / here.d - (next_row.l1 * next_row.x[c] + after.l2 * after.x[c]);
      }
    }
    // Schur complement of the band.
    s00_ = d0(m_);
    s01_ = d1(m_);
    s11_ = d0(m_ + 1);
    b0_ = border_right[0];
    b1_ = border_right[1];
    for (const Border& b : border_) {
      const std::array<double, 3>& x = row_[b.row].x;
      s00_ -= b.first * x[0];
      s01_ -= b.first * x[1];
      s11_ -= b.second * x[1];
      b0_ -= b.first * x[2];
      b1_ -= b.second * x[2];
    }
    det_ = s00_ * s11_ - s01_ * s01_;
  }

  [[nodiscard]] bool solvable() const { return std::abs(det_) > 0; }
  [[nodiscard]] std::vector<double> solution() const {
    std::vector<double> x(n_);
    x[m_] = (b0_ * s11_ - b1_ * s01_) / det_;
    x[m_ + 1] = (s00_ * b1_ - s01_ * b0_) / det_;
    for (std::size_t i = 0; i < m_; ++i) {
      x[i] = row_[i].x[2] - row_[i].x[0] * x[m_] - row_[i].x[1] * x[m_ + 1];
    }
    return x;
  }
  // That of the band by the recursion of Takahashi, from the last row upwards within the band.
  [[nodiscard]] std::vector<double> diagonal_of_inverse() const {
    std::vector<double> z(n_);
    double z0_next = 0, z0_after = 0, z1_next = 0;  // Z(i,i) of the next two rows, Z(i,i+1) of the next
    for (std::size_t i = m_; i-- > 0;) {
      const double l1 = row_[i + 1].l1, l2 = i + 2 < m_ ? row_[i + 2].l2 : 0;
      const double z1 = -l1 * z0_next - l2 * z1_next, z2 = -l1 * z1_next - l2 * z0_after;
      z0_after = z0_next;
      z0_next = 1 / row_[i].d - l1 * z1 - l2 * z2;
      z1_next = z1;
      const double u = row_[i].x[0], v = row_[i].x[1];
      z[i] = z0_next + (s11_ * u * u - 2 * s01_ * u * v + s00_ * v * v) / det_;
    }
    z[m_] = s11_ / det_;
    z[m_ + 1] = s00_ / det_;
    return z;
  }

 private:
  struct Row {
    double d = 0, l1 = 0, l2 = 0;  // D(i), L(i,i-1), L(i,i-2); 0 outside of the band
    std::array<double, 3> x{};  // the band's inverse times the two columns of the border and the right side
  };
  struct Border {
    std::size_t row;
    double first, second;
  };
  std::size_t n_, m_;  // unknowns; of them in the band
  std::vector<Row> row_;
  std::array<Border, 4> border_;  // the columns of the border where they are not 0
  double s00_ = 0, s01_ = 0, s11_ = 0, det_ = 0, b0_ = 0, b1_ = 0;
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
  std::vector<double> right(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    right[i] = weight[i] * r[i];
  }
  const CyclicBand matrix(weight, stiffness, total, right);
  return matrix.solvable() ? matrix.solution() : r;
}

std::vector<double> variance_of_smoothing(const std::vector<double>& weight,
                                          const std::vector<double>& stiffness) {
  return CyclicBand(weight, stiffness, sum_of(weight), {}).diagonal_of_inverse();
}

}  // namespace punctum::vision
