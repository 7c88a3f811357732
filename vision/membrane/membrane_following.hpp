// One membrane, followed from frame to frame: the sub-pixel edge in a band round the last contour, and
// whether that is still the same edge.
#pragma once

#include <string>

#include "vision/config.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/membrane_search.hpp"

namespace punctum::vision {

// What one frame shows of a membrane.
struct Membrane {
  bool ok = false;
  Contour nodes;           // of the paper's snake
  Contour contour;         // at least 128 points
  Vector<double> sd_px;    // of each of them, across the contour; empty when not ok
  double support = 0;      // share of the visible angles with an edge above the noise
  double visible = 0;      // share of the angles that neither pipettes nor the border of the picture hide
  double residual_px = 0;  // robust standard deviation of the single edges about the contour
  std::string reason;      // when not ok

  [[nodiscard]] double rms_sd_px() const;
};

[[nodiscard]] Membrane follow(FollowedMembrane& m, const ClearedPicture& picture, const VisionConfig& config,
                              const Surroundings& surroundings);

}  // namespace punctum::vision
