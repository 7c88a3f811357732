// How obliquely the injection pipette is cut.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// The outer radius of glass whose steepest change of grey, spread by the blur, lies at half_width from the
// axis.
[[nodiscard]] double outer_radius_of_glass(double half_width, double blur);

// By how much further back the glass ends, per px across the axis; near 0 where an end at right angles
// explains the picture as well.
struct Bevel {
  double tangent = 0;
  double sd = 0;
};

// By likelihood, with an end from `back` px behind the tip of the pose to `ahead` px ahead of it. noise: grey
// levels. Empty where the walls do not stand out, or something else lies there.
[[nodiscard]] std::optional<Bevel> bevel_of_glass(const GradientField& field, double noise,
                                                  const NeedlePose& needle, double back, double ahead);

}  // namespace punctum::vision
