// The words of an error message: one line, whatever the file contained.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {

// Without control characters: whatever a file says, no terminal obeys it.
[[nodiscard]] std::string printable(std::string_view s, std::size_t max = 80);

// "unknown key (did you mean X?), allowed: ...".
[[nodiscard]] std::string unknown(std::string_view what, std::string_view given,
                                  const std::vector<std::string>& names);

}  // namespace punctum::tools
