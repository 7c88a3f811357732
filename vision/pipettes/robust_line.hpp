// A straight line through stations along a tube.
#pragma once

#include <optional>

#include "vision/image/kept_vector.hpp"
#include "vision/image/straight_line.hpp"

namespace punctum::vision {

struct RobustLine {
  StraightLine line;
  double rms = 0;  // of the residuals, with the given weights
};

// Points further than `scale` from the line count less (Cauchy's weights). Where the points do not determine
// a line, it is y = 0 without residuals.
[[nodiscard]] RobustLine fit_robust_line(const Vector<double>& x, const Vector<double>& y,
                                         const Vector<double>& weight, double scale);

}  // namespace punctum::vision
