#include "vision/image/periodic_smoothing.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

namespace {

using Two = double __attribute__((vector_size(16)));  // one of either half

// The normal matrix is cyclic and pentadiagonal: the last two unknowns are a border, the rest is a band of
// width 2. The band is L D L^T from both of its ends at once, which look alike, to two or three unknowns in
// its middle.
class CyclicBand {
 public:
  // right: of the equations to be solved; or empty.
  CyclicBand(const Vector<double>& weight, const Vector<double>& stiffness, double total_weight,
             const Vector<double>& right)
      : n_(weight.size()),
        m_(n_ - 2),
        half_(m_ / 2 - 1),
        tiny_(1e-9 * total_weight / static_cast<double>(n_)),  // keeps it positive definite
        weight_(weight),
        stiffness_(stiffness),
        row_(half_ + 2) {
    eliminate_halves(right);
    solve_middle(right);
    substitute_backwards();
    solve_border(right);
  }

  [[nodiscard]] bool solvable() const { return std::abs(det_) > 0; }
  [[nodiscard]] Vector<double> solution() const {
    Vector<double> x(n_);
    const double first = x[m_] = (b0_ * s11_ - b1_ * s01_) / det_,
                 second = x[m_ + 1] = (s00_ * b1_ - s01_ * b0_) / det_;
    for (std::size_t i = 0; i < half_; ++i) {
      const Two here = row_[i].x[2] - row_[i].x[0] * first - row_[i].x[1] * second;
      x[i] = here[0];
      x[m_ - 1 - i] = here[1];
    }
    for (std::size_t k = 0; k < middle(); ++k) {
      x[half_ + k] = middle_x_[k][2] - middle_x_[k][0] * first - middle_x_[k][1] * second;
    }
    return x;
  }
  // That of the band by the recursion of Takahashi, from its middle outwards.
  [[nodiscard]] Vector<double> diagonal_of_inverse() const {
    Vector<double> z(n_);
    const auto with_border = [this](auto of_band, auto u, auto v) {
      return of_band + (s11_ * u * u - 2 * s01_ * u * v + s00_ * v * v) / det_;
    };
    for (std::size_t k = 0; k < middle(); ++k) {
      z[half_ + k] = with_border(inverse_[k][k], middle_x_[k][0], middle_x_[k][1]);
    }
    const std::size_t last = middle() - 1;
    // Z(i,i) of the next two rows, Z(i,i+1) of the next.
    Two z0_next{inverse_[0][0], inverse_[last][last]}, z1_next{inverse_[0][1], inverse_[last][last - 1]},
        z0_after{inverse_[1][1], inverse_[last - 1][last - 1]};
    for (std::size_t i = half_; i-- > 0;) {
      const Two l1 = row_[i + 1].l1, l2 = row_[i + 2].l2;
      const Two z1 = -l1 * z0_next - l2 * z1_next, z2 = -l1 * z1_next - l2 * z0_after;
      z0_after = z0_next;
      z0_next = row_[i].per_d - l1 * z1 - l2 * z2;
      z1_next = z1;
      const Two here = with_border(z0_next, row_[i].x[0], row_[i].x[1]);
      z[i] = here[0];
      z[m_ - 1 - i] = here[1];
    }
    z[m_] = s11_ / det_;
    z[m_ + 1] = s00_ / det_;
    return z;
  }

 private:
  struct Row {
    Two d, per_d, l1, l2;  // D(i), its inverse, L(i,i-1), L(i,i-2)
    std::array<Two, 3> x;  // the band's inverse times the two columns of the border and the right side
    Row() {}               // NOLINT: every row is computed; to clear them takes as long as to solve them
  };
  static constexpr std::size_t kMiddleMost = 3;

  [[nodiscard]] std::size_t middle() const { return m_ - 2 * half_; }
  [[nodiscard]] double s(std::size_t i) const { return stiffness_[i < n_ ? i : i - n_]; }
  [[nodiscard]] double d0(std::size_t i) const {  // A(i,i), A(i,i+1), A(i,i+2), cyclic
    return weight_[i] + tiny_ + s(i + n_ - 1) + 4 * s(i) + s(i + 1);
  }
  [[nodiscard]] double d1(std::size_t i) const { return -2 * (s(i) + s(i + 1)); }

  // L and D row by row, and L's inverse times the right sides with them; of the two rows of the middle that
  // follow, what the half has of L.
  void eliminate_halves(const Vector<double>& right) {
    const auto at = [this](const Vector<double>& v, std::size_t i) { return Two{v[i], v[m_ - 1 - i]}; };
    Two before{stiffness_[n_ - 1], stiffness_[m_]}, here = at(stiffness_, 0);
    near0_ = -2 * (before + here);
    far0_ = before;
    near1_ = here;
    Two d1_last{}, d2_last{}, d2_before{};  // A(i-1,i), A(i-1,i+1), A(i-2,i)
    // Of the rows i - 1 and i - 2: the next row waits for them, and would wait longer for the memory.
    Two d_last{}, per_d_last{}, l1_last{}, d_before{}, per_d_before{};
    for (std::size_t i = 0; i < half_ + 2; ++i) {
      Row& row = row_[i];
      Two l1{}, l2{};
      if (i > 1) {
        l2 = d2_before * per_d_before;
      }
      if (i > 0 && i <= half_) {
        l1 = d1_last;
        if (i > 1) {
          l1 -= l2 * d_before * l1_last;
        }
        l1 *= per_d_last;
      }
      row.l1 = l1;
      row.l2 = l2;
      d2_before = d2_last;
      if (i >= half_) {  // of the middle
        d_before = d_last;
        per_d_before = per_d_last;
        continue;
      }
      const Two next = at(stiffness_, i + 1);
      Two d = at(weight_, i) + tiny_ + before + 4 * here + next;
      row.x = {};
      if (i == 0) {
        row.x[0] = Two{far0_[0], near0_[1]};
        row.x[1] = Two{near0_[0], far0_[1]};
      } else if (i == 1) {
        row.x[0] = Two{0, near1_[1]};
        row.x[1] = Two{near1_[0], 0};
      }
      if (!right.empty()) {
        row.x[2] = at(right, i);
      }
      if (i > 0) {
        d -= l1 * l1 * d_last;
        for (std::size_t c = 0; c < 3; ++c) {
          row.x[c] -= l1 * row_[i - 1].x[c];
        }
      }
      if (i > 1) {
        d -= l2 * l2 * d_before;
        for (std::size_t c = 0; c < 3; ++c) {
          row.x[c] -= l2 * row_[i - 2].x[c];
        }
      }
      row.d = d;
      row.per_d = 1 / d;
      d_before = d_last;
      per_d_before = per_d_last;
      d_last = d;
      per_d_last = row.per_d;
      l1_last = l1;
      d1_last = -2 * (here + next);
      d2_last = next;
      before = here;
      here = next;
    }
  }

  void solve_middle(const Vector<double>& right) {
    const std::size_t n = middle();
    std::array<std::array<double, kMiddleMost>, kMiddleMost> a{};
    for (std::size_t k = 0; k < n; ++k) {
      a[k][k] = d0(half_ + k);
      middle_x_[k] = {0, 0, right.empty() ? 0 : right[half_ + k]};
      if (k + 1 < n) {
        a[k][k + 1] = a[k + 1][k] = d1(half_ + k);
      }
      if (k + 2 < n) {
        a[k][k + 2] = a[k + 2][k] = s(half_ + k + 1);
      }
    }
    const Row &last = row_[half_ - 1], &before = row_[half_ - 2], &first = row_[half_],
              &second = row_[half_ + 1];
    for (int half = 0; half < 2; ++half) {
      const std::size_t p = half == 0 ? 0 : n - 1, q = half == 0 ? 1 : n - 2;
      const double l1 = first.l1[half], l2 = first.l2[half], far = second.l2[half];
      a[p][p] -= l1 * l1 * last.d[half] + l2 * l2 * before.d[half];
      a[q][q] -= far * far * last.d[half];
      a[p][q] -= l1 * far * last.d[half];
      a[q][p] = a[p][q];
      for (std::size_t c = 0; c < 3; ++c) {
        middle_x_[p][c] -= l1 * last.x[c][half] + l2 * before.x[c][half];
        middle_x_[q][c] -= far * last.x[c][half];
      }
    }
    for (std::size_t k = 0; k < n; ++k) {
      inverse_[k] = {};
      inverse_[k][k] = 1;
    }
    for (std::size_t k = 0; k < n; ++k) {  // positive definite: no row need be exchanged
      const double per = 1 / a[k][k];
      for (std::size_t j = 0; j < n; ++j) {
        a[k][j] *= per;
        inverse_[k][j] *= per;
      }
      for (std::size_t i = 0; i < n; ++i) {
        const double by = i == k ? 0 : a[i][k];
        for (std::size_t j = 0; j < n; ++j) {
          a[i][j] -= by * a[k][j];
          inverse_[i][j] -= by * inverse_[k][j];
        }
      }
    }
    const auto b = middle_x_;
    for (std::size_t k = 0; k < n; ++k) {
      middle_x_[k] = {};
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t c = 0; c < 3; ++c) {
          middle_x_[k][c] += inverse_[k][j] * b[j][c];
        }
      }
    }
  }

  void substitute_backwards() {
    const std::size_t n = middle();
    for (std::size_t c = 0; c < 3; ++c) {
      row_[half_].x[c] = Two{middle_x_[0][c], middle_x_[n - 1][c]};
      row_[half_ + 1].x[c] = Two{middle_x_[1][c], middle_x_[n - 2][c]};
    }
    for (std::size_t i = half_; i-- > 0;) {
      Row& here = row_[i];
      const Row &next = row_[i + 1], &after = row_[i + 2];
      for (std::size_t c = 0; c < 3; ++c) {
        here.x[c] = here.x[c] * here.per_d - (next.l1 * next.x[c] + after.l2 * after.x[c]);
      }
    }
  }

  void solve_border(const Vector<double>& right) {
    const std::array<Two, 3>&x0 = row_[0].x, &x1 = row_[1].x;
    // Schur complement of the band.
    s00_ = d0(m_) - far0_[0] * x0[0][0] - near0_[1] * x0[0][1] - near1_[1] * x1[0][1];
    s01_ = d1(m_) - far0_[0] * x0[1][0] - near0_[1] * x0[1][1] - near1_[1] * x1[1][1];
    s11_ = d0(m_ + 1) - near0_[0] * x0[1][0] - near1_[0] * x1[1][0] - far0_[1] * x0[1][1];
    if (!right.empty()) {
      b0_ = right[m_] - far0_[0] * x0[2][0] - near0_[1] * x0[2][1] - near1_[1] * x1[2][1];
      b1_ = right[m_ + 1] - near0_[0] * x0[2][0] - near1_[0] * x1[2][0] - far0_[1] * x0[2][1];
    }
    det_ = s00_ * s11_ - s01_ * s01_;
  }

  std::size_t n_, m_, half_;  // unknowns; of them in the band; in a half of it
  double tiny_;
  const Vector<double>&weight_, &stiffness_;
  Vector<Row> row_;  // from either end of the band inwards
  // The columns of the border where they are not 0: of the first row, for the nearer and the other unknown
  // of the border; of the second row.
  Two near0_{}, far0_{}, near1_{};
  std::array<std::array<double, 3>, kMiddleMost> middle_x_{};  // as Row::x
  std::array<std::array<double, kMiddleMost>, kMiddleMost> inverse_{};
  double s00_ = 0, s01_ = 0, s11_ = 0, det_ = 0, b0_ = 0, b1_ = 0;
};

double sum_of(const Vector<double>& v) {
  double sum = 0;
  for (double x : v) {
    sum += x;
  }
  return sum;
}

}  // namespace

Vector<double> smooth_periodic(const Vector<double>& r, const Vector<double>& weight,
                               const Vector<double>& stiffness) {
  const double total = sum_of(weight);
  if (r.size() < 8 || !(total > 0)) {
    return r;
  }
  Vector<double> right(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    right[i] = weight[i] * r[i];
  }
  const CyclicBand matrix(weight, stiffness, total, right);
  return matrix.solvable() ? matrix.solution() : r;
}

Vector<double> variance_of_smoothing(const Vector<double>& weight, const Vector<double>& stiffness) {
  return CyclicBand(weight, stiffness, sum_of(weight), {}).diagonal_of_inverse();
}

}  // namespace punctum::vision
