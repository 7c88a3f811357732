// A step as a Gaussian blur shows it.
#pragma once

#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

// erfc(-t), from 0 to 2, to 3e-7; a step that was blurred by sigma at t = distance / (sqrt(2) sigma).
// Abramowitz and Stegun, 7.1.26. The C library's function differs between processors.
[[nodiscard]] inline double blurred_step(double t) {
  const double z = std::abs(t), k = 1 / (1 + 0.3275911 * z);
  const double tail =
      k * (0.254829592 + k * (-0.284496736 + k * (1.421413741 + k * (-1.453152027 + k * 1.061405429)))) *
      math::exp(-z * z);
  return t < 0 ? tail : 2 - tail;
}

}  // namespace punctum::vision
