// A narrow glass tube (the injection pipette), followed from the border to its end by its cross profile.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

// Of a total width of width_min .. width_max px. noise: grey levels. Empty when nothing at that border is
// straight, has the same profile along its length, and ends.
[[nodiscard]] std::optional<TubeTrace> trace_narrow_tube(const GradientField& field, Side side,
                                                         double width_min, double width_max, double noise);

}  // namespace punctum::vision
