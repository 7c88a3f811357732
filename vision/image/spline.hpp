// Periodic cubic spline through the nodes of a contour.
#pragma once

#include <span>

#include "vision/image/contour.hpp"

namespace punctum::vision {

// `points` points at equal distances along the periodic cubic spline through the nodes, whose parameter is
// the length of the chords. Empty for fewer than three different nodes.
[[nodiscard]] Contour spline_through(std::span<const Point> nodes, int points);

}  // namespace punctum::vision
