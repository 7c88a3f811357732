// How far a needle is out of focus.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// Behind the range in which the end may lie, px: there the shaft tells how the walls look.
inline constexpr double kShaftFrom_px = 6, kShaftTo_px = 51;

// How far a point spreads, px, by the shaft from `back` px behind the tip: it spreads as far along the needle
// as across, and the shaft tells it from many more pixels than the end does. Empty where the shaft does not
// look like two equal walls and a lumen, as in relief.
[[nodiscard]] std::optional<double> blur_of_shaft(const GradientField& field, const NeedlePose& needle,
                                                  double back);

}  // namespace punctum::vision
