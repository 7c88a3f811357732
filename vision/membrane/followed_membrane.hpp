// What is kept of a membrane from frame to frame.
#pragma once

#include <vector>

#include "vision/image/closed_path.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/rest_shape.hpp"

namespace punctum::vision {

struct FollowedMembrane {
  bool known = false;
  Point centre;
  std::vector<double> r;  // px per angle
  Polarity polarity = Polarity::any;
  double level = 0;  // usual edge along it, grey levels per px
  Contour nodes;     // of the snake
  RestOutline rest;
  int lost_frames = 0;  // in a row

  [[nodiscard]] Contour contour() const { return from_polar(centre, r); }
  [[nodiscard]] bool lost() const noexcept { return lost_frames >= 2; }  // one frame may fail
};

}  // namespace punctum::vision
