// What crosses the strip along a border of the picture.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

// The tube of total width width_min .. width_max px with the strongest edges in the first `strip` px from the
// border: side, root, axis, half_width and edge_share of the trace are set. noise: grey levels. Edges weaker
// than `relative` times the strongest one do not count. tilt_max_deg: of the tube against the horizontal.
[[nodiscard]] std::optional<TubeTrace> border_section(const GradientField& field, Side side, double width_min,
                                                      double width_max, double noise, double strip,
                                                      double relative, int tilt_max_deg);

// Across the tube, pointing down in the picture.
[[nodiscard]] Point across_tube(const Point& axis);

}  // namespace punctum::vision
