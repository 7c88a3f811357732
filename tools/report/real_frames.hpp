// Real microscope pictures from the folder $PUNCTUM_DATA, or ../shared/data; they are not part of this tree.
#pragma once

#include <optional>
#include <string>

#include "tools/report/topic.hpp"

namespace punctum::report {

struct RealFrames {
  std::optional<Table> table;  // vision_real: times, and what of the scene was seen
  std::string summary;         // one sentence: how many were seen, or that there are none
};

[[nodiscard]] RealFrames see_real_frames(bool quick, Progress& progress);

}  // namespace punctum::report
