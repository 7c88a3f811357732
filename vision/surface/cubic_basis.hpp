// The cubic B-splines on clamped, equally spaced knots of 0 .. 1.
#pragma once

#include <array>

namespace punctum::vision {

// Four of them are not zero at one place.
struct CubicBasis {
  int first = 0;  // their control points are first .. first + 3
  std::array<double, 4> value{}, slope{};
};

// control_points: at least 5. u: 0 .. 1. Source: The NURBS Book, algorithms A2.2 and A2.3.
[[nodiscard]] CubicBasis cubic_basis(int control_points, double u);

// The i-th knot, 0 .. control_points + 3.
[[nodiscard]] double cubic_knot(int control_points, int i);

}  // namespace punctum::vision
