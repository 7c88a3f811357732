// The outer membrane as it is, or would be, without the needle; and where the needle enters it.
#pragma once

#include <optional>
#include <span>

#include "vision/image/circle.hpp"

namespace punctum::vision {

struct Undeformed {
  Circle circle;      // fitted to the undeformed part
  bool round = true;  // the circle describes it; if not, only `shape` does: a closed curve of low order
  Contour shape;
};

// Fitted to the contour's points with weight > 0. A dimple, arcs that are hidden and arcs that a pipette
// presses have weight 0.
[[nodiscard]] std::optional<Undeformed> fit_undeformed(const Contour& contour,
                                                       std::span<const double> weights);

// Where the line through `through` along `axis` first meets the closed contour.
[[nodiscard]] std::optional<Point> entry_point(const Contour& shape, const Point& through, const Point& axis);

}  // namespace punctum::vision
