// What is kept of a membrane from frame to frame.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "vision/image/closed_path.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/carried_outline.hpp"
#include "vision/membrane/edge_shape.hpp"
#include "vision/membrane/rest_shape.hpp"

namespace punctum::vision {

constexpr std::size_t kDimpleShapes = 10;

struct FollowedMembrane {
  bool known = false;
  Point centre;
  std::vector<double> r;  // px per angle
  Polarity polarity = Polarity::any;
  double level = 0;  // usual edge along it, grey levels per px
  Contour nodes;     // of the paper's snake
  RestOutline rest;
  CarriedOutline carried;
  EdgeLearnt edge;
  bool held = true;                                 // the needle pushes it, or would where it touched it
  double dimple_px = 0;                             // depth of its dimple
  std::array<double, kDimpleShapes> dimple_odds{};  // log odds of the shape of its dimple
  int lost_frames = 0;                              // in a row

  [[nodiscard]] Contour contour() const { return from_polar(centre, r); }
  [[nodiscard]] bool lost() const noexcept { return lost_frames >= 2; }  // one frame may fail
};

}  // namespace punctum::vision
