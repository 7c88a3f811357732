// What pulled glass keeps of its capillary.
#pragma once

#include <algorithm>

namespace punctum::vision {

// Half the thickness of the glass over the radius of its middle: the ratio of inner to outer diameter of a
// capillary is usually 0.7.
inline constexpr double kHalfOfWall = 0.17;

// The radius of the middle of the glass whose steepest change of grey, spread by the blur, lies at half_width
// from the axis, px.
[[nodiscard]] inline double middle_radius_of_glass(double half_width, double blur) {
  return std::max(half_width - blur, 0.6 * half_width);
}
[[nodiscard]] inline double outer_radius_of_glass(double half_width, double blur) {
  return (1 + kHalfOfWall) * middle_radius_of_glass(half_width, blur);
}

}  // namespace punctum::vision
