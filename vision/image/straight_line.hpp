// Weighted least squares of a straight line.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

struct StraightLine {
  double offset = 0, slope = 0;  // y = offset + slope x
  [[nodiscard]] double residual(double x, double y) const { return y - offset - slope * x; }
};

// Empty when the points do not determine a line.
[[nodiscard]] inline std::optional<StraightLine> fit_line(const Vector<double>& x, const Vector<double>& y,
                                                          const Vector<double>& weight) {
  double s0 = 0, s1 = 0, s2 = 0, y0 = 0, y1 = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    s0 += weight[i];
    s1 += weight[i] * x[i];
    s2 += weight[i] * x[i] * x[i];
    y0 += weight[i] * y[i];
    y1 += weight[i] * y[i] * x[i];
  }
  const double determinant = s0 * s2 - s1 * s1;
  if (!(s0 > 0) || std::abs(determinant) < 1e-9) {
    return std::nullopt;
  }
  return StraightLine{(y0 * s2 - y1 * s1) / determinant, (s0 * y1 - s1 * y0) / determinant};
}

}  // namespace punctum::vision
