// The name that was probably meant, for whoever mistyped a scene, a key, an option or a command.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {

// " (did you mean X?)" for the name nearest to `given`; nothing if none is near.
[[nodiscard]] std::string suggestion(std::string_view given, const std::vector<std::string>& names);

}  // namespace punctum::tools
