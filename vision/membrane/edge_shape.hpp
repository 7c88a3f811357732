// What a membrane's edge looks like in this picture, learnt all round the cell, and the contour moved to
// where each part of it looks so: the noise of many pixels averages out, and neither blur nor another edge
// nearby shifts it.
#pragma once

#include <optional>
#include <vector>

#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

// Another edge beside the membrane's: its other face, or the next membrane.
struct NearbyEdge {
  double at = 0;            // px from the contour, positive outwards
  double tolerance_px = 0;  // standard deviation of `at`; 0: exact
};

struct EdgeShape {
  double inside = 8, outside = 6;  // px of the picture that are looked at on either side of the contour
  double modes = 12;               // finer waves round the contour are noise
  std::optional<NearbyEdge> nearby;
};

// soft: per point of the contour, 1 where the membrane may have any shape (beside the needle), 0 elsewhere.
// Empty where too little is seen, or where the edge does not look alike all round.
[[nodiscard]] std::optional<Contour> shaped_edge(const ClearedPicture& picture, const Contour& contour,
                                                 const std::vector<double>& soft, const EdgeShape& edge);

}  // namespace punctum::vision
