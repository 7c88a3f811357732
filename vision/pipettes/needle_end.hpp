// Where the glass of the injection pipette ends in clear medium, by likelihood: its walls stop there, and a
// line of glass may close it. Nothing is assumed of the optics but a point spread: walls and line may be dark
// or bright, and the two walls may differ, as in relief contrast.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

struct GlassEnd {
  double ahead = 0;  // of the tip of the pose, px; sub-pixel
  double sd = 0;     // of it, px
  double blur = 0;   // of walls and line, px
};

// The outermost glass, from `back` px behind the tip of the pose to `ahead` px ahead of it. noise: grey
// levels. bevel: by how much further back the glass ends, per px across the axis. Empty where the walls do
// not stand out, or do not end.
[[nodiscard]] std::optional<GlassEnd> end_of_glass(const GradientField& field, double noise,
                                                   const NeedlePose& needle, double bevel, double back,
                                                   double ahead, bool in_relief);

}  // namespace punctum::vision
