// Where one frame shows a membrane, and how well it tells it.
#pragma once

#include <vector>

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct SeenOutline {
  Contour contour;
  std::vector<double> variance;  // px^2 across the contour, per point
  std::vector<double> lasting;   // the part of it that the next frames repeat: granules beside the membrane
};

}  // namespace punctum::vision
