// Where one frame shows a membrane, and how well it tells it.
#pragma once

#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

struct SeenOutline {
  Contour contour;
  Vector<double> variance;  // px^2 across the contour, per point
  Vector<double> lasting;   // the part of it that the next frames repeat: granules beside the membrane
};

}  // namespace punctum::vision
