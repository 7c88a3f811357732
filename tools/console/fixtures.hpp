// What of a scene's guidance has a shape, for whoever draws it.
#pragma once

#include <string>

#include "rt/control/config.hpp"

namespace punctum::console {

// JSON, in metres and radians; what the scene does not have is null. Regions stand in the stage's frame.
[[nodiscard]] std::string fixtures_json(const rt::ServoConfig& config);

}  // namespace punctum::console
