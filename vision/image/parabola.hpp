// The top of a peak between samples.
#pragma once

#include <algorithm>

namespace punctum::vision {

// Place of the vertex of the parabola through three equally spaced samples, the highest in the middle: in
// steps from the middle one, -0.5 .. 0.5. 0 when the three do not bend downwards.
[[nodiscard]] inline double vertex_offset(double before, double top, double after) {
  const double curvature = before - 2 * top + after;
  return curvature < -1e-12 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
}

}  // namespace punctum::vision
