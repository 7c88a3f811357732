// A glass tube that enters the picture through its left or right border: followed from the border to its end.
#pragma once

#include <optional>
#include <vector>

#include "vision/config.hpp"
#include "vision/gradient.hpp"

namespace punctum::vision {

struct TubeTrace {
  Side side = Side::right;
  Point root;                 // on the border, middle of the tube
  Point axis;                 // unit, from the border into the picture
  double length = 0;          // from root to the tube's end, px along the axis
  double half_width = 0;      // at the border, between its outermost edges
  double end_half_width = 0;  // near the end
  double clarity = 0;         // share of the strip's edges that belong to it, 0 .. 1
  double likeness = 0;        // mean correlation of its cross profile along it

  [[nodiscard]] Point end() const { return root + length * axis; }
  [[nodiscard]] double half_width_at(double s) const {  // s from the root
    return length > 0 ? half_width + (end_half_width - half_width) * s / length : half_width;
  }
};

// A narrow tube (injection pipette) of total width width_min .. width_max px at that border, followed by its
// cross profile. noise: grey levels. Empty when nothing there is straight, alike along its length, and ends.
[[nodiscard]] std::optional<TubeTrace> trace_narrow_tube(const GradientField& field, Side side,
                                                         double width_min, double width_max, double noise);

// A wide one (holding pipette), followed by its two outer edges.
[[nodiscard]] std::optional<TubeTrace> trace_wide_tube(const GradientField& field, Side side,
                                                       double width_min, double width_max, double noise);

// Shift along `axis` (px) at which the tube's lumen and walls end, by the strongest change of the mean grey
// across +-half_width within +-reach of `guess`; sub-pixel. Empty where nothing stands out.
[[nodiscard]] std::optional<double> end_face(const GradientField& field, const Point& guess,
                                             const Point& axis, double half_width, double reach,
                                             double noise);

}  // namespace punctum::vision
