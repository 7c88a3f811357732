// A needle that widens so steeply that only its tip is in focus: its shaft has no edges that narrow_tube
// could follow. A cone that rises evenly out of the plane of focus is blurred in proportion to the distance
// from its tip. So it looks the same at every scale, and all lines of equal grey run towards the tip.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// Between the straight outer faces of the two walls next to its end; ok, score and sd are not set. Empty
// unless both walls come from the border, and the glass ends in clear medium and is in focus there. noise:
// grey levels. The field is that of the whole picture.
[[nodiscard]] std::optional<NeedlePose> steep_glass(const GradientField& field, double noise);

}  // namespace punctum::vision
