// A wide glass tube (the holding pipette), followed from the border to its end by its two outer edges.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/border_section.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

// Of a total width of width_min .. width_max px. noise: grey levels. Empty when nothing at that border is
// straight, has two continuous edges, and ends.
[[nodiscard]] std::optional<TubeTrace> trace_wide_tube(const GradientField& field, Border border,
                                                       double width_min, double width_max, double noise);

// The end face of a tube, sub-pixel: the shift along `axis` (px) from `guess`, where its walls end, with the
// strongest change of the mean grey across +-half_width, within +-reach; a change counts less where a face is
// not expected. Empty where nothing stands out of the noise (grey levels).
[[nodiscard]] std::optional<double> end_face(const GradientField& field, const Point& guess,
                                             const Point& axis, double half_width, double reach,
                                             double noise);

}  // namespace punctum::vision
