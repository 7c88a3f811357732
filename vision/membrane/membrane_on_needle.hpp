// Where the membrane meets the injection pipette, by the grey level along the pipette's edges (fig. 5).
#pragma once

#include <array>
#include <optional>

#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

// One point on each edge of the needle: left and right, seen along its axis.
struct ContactPoints {
  std::array<std::optional<Point>, 2> point;
  std::array<double, 2> behind_tip{};  // distance behind the tip, px; where there is a point
};

struct MembraneOnNeedle {
  ContactPoints points;
  // px, mean of both sides; by the contour where no point is seen. Empty where the contour does not cross the
  // needle.
  std::optional<double> behind_tip;
};

// level: usual edge along the membrane, grey levels per px.
[[nodiscard]] MembraneOnNeedle membrane_on_needle(const ClearedPicture& picture, const NeedlePose& needle,
                                                  const Contour& outer, Polarity polarity, double level);

// While the needle pushes, the outer face of the membrane lies on its end face and blurs into the ends of the
// walls. Across the mouth of the lumen the membrane is seen by itself: it tells how many px ahead of the tip
// the end face is. 0 when nothing is seen there.
[[nodiscard]] double membrane_ahead_of_tip(const GradientField& field, const NeedlePose& needle,
                                           Polarity polarity, double level);

}  // namespace punctum::vision
