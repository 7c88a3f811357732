// A glass tube that enters the picture through its border.
#pragma once

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct TubeTrace {
  Point root;                 // on the border, in the middle of the tube
  Point axis;                 // unit, from the border into the picture
  double length = 0;          // from the root to the tube's end, px along the axis
  double sure_length = 0;     // to where a narrow tube is interrupted first
  double half_width = 0;      // at the border, between the outermost edges
  double end_half_width = 0;  // near the end
  double edge_share = 0;      // of the edges along the border those that belong to the tube, 0 .. 1
  double similarity = 0;      // mean agreement of the cross profile along the tube, at most 1

  [[nodiscard]] Point end() const { return root + length * axis; }
};

}  // namespace punctum::vision
