// Real microscope pictures, where they are at hand: $PUNCTUM_DATA or ../shared/data.
#pragma once

#include <optional>
#include <string>

#include "tools/report/topic.hpp"

namespace punctum::report {

struct RealFrames {
  std::optional<Table> table;  // vision_real: time, and what of the scene was seen
  std::string said;            // one sentence; why there is none
};

[[nodiscard]] RealFrames see_real_frames(bool quick, Progress& progress);

}  // namespace punctum::report
