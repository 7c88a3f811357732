// One membrane followed from frame to frame: the greedy snake from the last contour, then the sub-pixel edge
// in a band round it, pushed in by the needle or free of it, and whether it is still the same edge.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vision/cleared_picture.hpp"
#include "vision/config.hpp"
#include "vision/rest_shape.hpp"

namespace punctum::vision {

// What one frame shows of it.
struct Membrane {
  bool ok = false;
  Contour nodes;           // of the greedy snake
  Contour contour;         // >= 128 ordered points
  double support = 0;      // share of the visible angles with an edge above the noise
  double visible = 0;      // share of the angles not hidden by pipettes or the picture's border
  double residual_px = 0;  // robust sd of single edges about the contour
  int snake_iterations = 0;
  std::string why;  // when not ok
};

// What is kept of it between frames.
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

// What else is where the membrane is looked for.
struct Surroundings {
  const NeedleFix& needle;
  std::optional<Point> last_tip;  // one frame ago
  bool punctured = false;
  bool outermost = true;                     // it is the outer membrane
  const FollowedMembrane* around = nullptr;  // the one outside it, where this frame shows it
  const FollowedMembrane* within = nullptr;  // the one inside it, one frame ago
  const Undeformed* undeformed = nullptr;    // of the outer membrane, where known
};

[[nodiscard]] Membrane follow(FollowedMembrane& m, const ClearedPicture& picture, const VisionConfig& config,
                              const Surroundings& surroundings);

}  // namespace punctum::vision
