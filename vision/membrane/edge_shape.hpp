// What a membrane's edge looks like in this picture, learnt all round the cell, and the contour moved to
// where each part of it looks so: the noise of many pixels averages out, and neither blur nor another edge
// nearby shifts it.
#pragma once

#include <cstdint>
#include <optional>

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/seen_outline.hpp"

namespace punctum::vision {

// Another edge beside the membrane's: its other face, or the next membrane.
struct NearbyEdge {
  double at = 0;            // px from the contour, positive outwards
  double tolerance_px = 0;  // standard deviation of `at`; 0: exact
};

struct EdgeShape {
  double inside = 8, outside = 6;  // px of the picture that are looked at on either side of the contour
  double modes = 12;               // finer waves round the contour are noise
  bool granular = false;           // out of focus what lies beside the edge makes longer waves
  double lasting = 0;      // of the places' scatter at least this share is the same in the next frames
  double per_blur = 0.25;  // px by which the own step may be off for each px of blur beyond focus: sd
  std::optional<NearbyEdge> nearby;
  Contour nearby_face;  // where it lies, per point, if it is not equally far everywhere; or empty
  Point relief;         // unit, from where the light seems to come: see CommonShape; or zero
  std::optional<double> other_flatness;  // of the other membrane, a body of the same form: see ReliefSteps
  // Per point, 1: beside a line that is not its own; in relief so near to the holding pipette that its line,
  // ten times as clear, hides the edge. Or empty.
  Vector<std::uint8_t> beside_line, in_shadow;
};

// What is learnt of an edge over the frames.
struct EdgeLearnt {
  // By how much the places of single points scatter about the contour: mean square of what they are off, and
  // of half of what neighbours differ by, px^2.
  double square = 0, difference = 0;
  int frames = 0;                         // of these two
  bool halo = false;                      // in the last frame
  double nearby_height = 0, blur_px = 0;  // of the nearby edge: half of its change of grey, outwards
  double own_blur_px = 0;                 // 0: not known
  double blur_now_px = 0;                 // of the last frame
  // What all profiles had in common in the last frame, and how single ones differed from it.
  Vector<double> shape, spread;
  Vector<double> turning;  // what they show the more of the more they face `relief`; empty: not in relief
  Point relief;            // as in EdgeShape
  double flatness = 0;     // see ReliefSteps
  double inside = 0,
         face = 0;  // px within the contour that the shape begins; outwards, where the step is in it
  std::optional<cv::Vec4d> steps;  // in it: see BlurredSteps
};

// What the membrane adds to the picture's grey so far outside of its face, where that is the way outwards
// (unit); with a shape.
[[nodiscard]] double grey_beside_face(const EdgeLearnt& edge, const Point& outwards, double outside_px);

// soft: per point of the contour, 1 where the membrane may have any shape (beside the needle), 0 elsewhere.
// Empty where too little is seen, or where the edge does not look alike all round. learnt: takes this frame
// in.
[[nodiscard]] std::optional<SeenOutline> shaped_edge(const ClearedPicture& picture, const Contour& contour,
                                                     const Vector<double>& soft, const EdgeShape& edge,
                                                     EdgeLearnt& learnt);

}  // namespace punctum::vision
