// The words of an error message: one line, whatever the file contained, and the name that was probably meant.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {

// Without control characters: whatever a file says, no terminal obeys it.
[[nodiscard]] std::string printable(std::string_view s, std::size_t max = 80);

// " (did you mean X?)" for the name nearest to `given`; nothing if none is near.
[[nodiscard]] std::string suggestion(std::string_view given, const std::vector<std::string>& names);

[[nodiscard]] std::string unknown(std::string_view what, std::string_view given,
                                  const std::vector<std::string>& names);

}  // namespace punctum::tools
