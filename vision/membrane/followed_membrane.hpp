// What is kept of a membrane from frame to frame.
#pragma once

#include <array>
#include <cstddef>

#include "vision/image/closed_path.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/carried_outline.hpp"
#include "vision/membrane/edge_shape.hpp"
#include "vision/membrane/membrane_recoil.hpp"
#include "vision/membrane/rest_shape.hpp"

namespace punctum::vision {

constexpr std::size_t kDimpleShapes = 15;

struct FollowedMembrane {
  bool known = false;
  Point centre;
  Vector<double> r;  // px per angle
  Polarity polarity = Polarity::any;
  Relief relief;     // for Polarity::relief
  double level = 0;  // usual edge along it, grey levels per px
  Contour nodes;     // of the paper's snake
  RestOutline rest;
  CarriedOutline carried;
  EdgeLearnt edge;
  double path_outside_px = 0;  // of an outer one in relief: by which its path and `rest` lie outside its face
  bool held = true;            // the needle pushes it, or would where it touched it
  double dimple_px = 0;        // depth of its dimple
  std::array<double, kDimpleShapes> dimple_odds{};  // log odds of the shape of its dimple
  MembraneRecoil recoil;                            // of the outer one in relief
  double recoil_odds = 0;                           // log odds that it has gone back since the last frame
  int lost_frames = 0;                              // in a row

  // Of an edge of that direction, outwards.
  [[nodiscard]] Polarity polarity_at(const Point& normal) const {
    constexpr double kTold = 0.6;
    const double sign = polarity == Polarity::relief ? relief.sign_at(normal) : 0;
    return polarity != Polarity::relief ? polarity
           : sign > kTold               ? Polarity::brighter_out
           : sign < -kTold              ? Polarity::darker_out
                                        : Polarity::any;
  }
  // All that the picture shows of the cell lies elsewhere, by that.
  void jump_with_picture(const Point& by) {
    centre += by;
    rest.centre += by;
    carried.jump_with_picture(by);
    recoil.forget();
  }
  [[nodiscard]] Contour contour() const { return from_polar(centre, r); }
  [[nodiscard]] bool lost() const noexcept { return lost_frames >= 2; }  // one frame may fail
};

}  // namespace punctum::vision
