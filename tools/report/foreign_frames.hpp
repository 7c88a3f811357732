// Injections as another renderer draws them, which is no part of this project: other people's optics, noise
// and dimple.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "tools/report/simulated_frames.hpp"

namespace punctum::report {

struct ForeignPlan {
  int seed = 0;
  double noise = 0;  // grey levels
  int frames = 0;    // of the whole injection
};

// Drawn by $PUNCTUM_DATA/../frames/render.py, or ../shared/frames/render.py, with Python's numpy and OpenCV.
// An error says what of it is missing. Neither the width of a dimple nor the radius of the cell is told.
[[nodiscard]] tl::expected<DrawnInjection, std::string> foreign_injection(const ForeignPlan& plan);

}  // namespace punctum::report
