// Penalised least squares on a closed line.
#pragma once

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// The x that minimise  sum w_i (r_i - x_i)^2 + sum stiffness_i (x_{i-1} - 2 x_i + x_{i+1})^2,  cyclic. Fewer
// than 8 values, and values without any weight, come back unchanged.
[[nodiscard]] Vector<double> smooth_periodic(const Vector<double>& r, const Vector<double>& weight,
                                             const Vector<double>& stiffness);
// Variance of each of them, where the r_i have the variances 1 / w_i: the diagonal of the inverse of the
// normal matrix. weight and stiffness as above, at least 8 of them, not all weights 0.
[[nodiscard]] Vector<double> variance_of_smoothing(const Vector<double>& weight,
                                                   const Vector<double>& stiffness);

}  // namespace punctum::vision
