// Text that others wrote, inside a page or a file.
#pragma once

#include <string>
#include <string_view>

namespace punctum::tools {

// What is no text (control characters, broken UTF-8), replaced.
[[nodiscard]] std::string readable(std::string_view text);

// Letters that mean something to HTML and XML replaced, too: what a file or a person wrote stays text, in
// elements and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

// For data: URIs.
[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace punctum::tools
