// Where the outer membrane crosses the two edges of the needle, by the grey level along the edges (fig. 5).
#pragma once

#include "vision/membrane/membrane_on_needle.hpp"

namespace punctum::vision {

// The first clear edge on a line beside each edge of the needle, coming from outside the cell. contour: of
// the membrane in the last frame, or its first circle. level: usual edge along it, grey levels per px.
[[nodiscard]] ContactPoints contact_points(const ClearedPicture& picture, const NeedlePose& needle,
                                           const Contour& contour, double level);

}  // namespace punctum::vision
