// What pulled glass keeps of its capillary.
#pragma once

#include <algorithm>
#include <cmath>

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

// The outer radius of a glass in relief, px, in a field smoothed by sigma: the outer flank of the line that a
// face is there is steepest one blur outside of it, 0.8 to 1.1 blurs for tubes of all usual walls.
inline constexpr double kLens_px = 1.2;  // blur of a lens in focus
[[nodiscard]] inline double radius_in_relief(double half_width, double sigma) {
  return half_width - std::sqrt(kLens_px * kLens_px + sigma * sigma);
}

}  // namespace punctum::vision
