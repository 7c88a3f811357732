// An edge inside another one, too faint for single rays and told by all of them together: equally far inside
// it everywhere but for a shift of its middle, as an ooplasm lies in its zona.
#pragma once

#include <optional>

#include "vision/config.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

// The closed path along it; outer: px per angle round the centre, of an edge of the same sign. Empty where
// there is none, or where granules and not the noise make it faint.
[[nodiscard]] std::optional<EdgePath> parallel_edge_within(const Vector<double>& outer, const Point& centre,
                                                           Polarity sign, const ClearedPicture& picture,
                                                           const VisionConfig& config);

}  // namespace punctum::vision
