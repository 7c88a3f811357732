// Where the injection pipette is in the picture.
#pragma once

#include <algorithm>
#include <string>

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct NeedlePose {
  bool ok = false;
  Point tip;               // sub-pixel: the middle of the end face
  double sd = 0;           // standard deviation of the tip along the axis, px
  double constant_sd = 0;  // the part of it that is the same in every frame
  Point axis{-1, 0};       // unit, pointing out of the tip
  double half_width = 0;   // at the tip, px
  double point_aside = 0;  // of the axis, px: where the outermost glass is of a needle that is ground sharp
  double taper = 0;        // growth of the half-width per px away from the tip
  double score = 0;        // centred correlation of the tip; 1 in the frame that the template was cut from
  std::string reason;      // when not ok

  // Half-width of the outside at the distance s behind the tip.
  [[nodiscard]] double half_width_at(double s) const { return half_width + taper * std::max(0.0, s); }
  // Place at the distance s behind the tip (negative: ahead of it) and u across the axis.
  [[nodiscard]] Point at(double s, double u) const { return tip - s * axis + u * Point(-axis.y, axis.x); }
  // What touches a membrane first.
  [[nodiscard]] Point point() const { return at(0, point_aside); }
};

}  // namespace punctum::vision
