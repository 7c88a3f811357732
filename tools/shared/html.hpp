// Text inside a page of HTML.
#pragma once

#include <string>
#include <string_view>

namespace punctum::tools {

// Letters that mean something to HTML, and what is no text (control characters, broken UTF-8), replaced: what
// a file or a person wrote stays text, in elements and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

// For data: URIs.
[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace punctum::tools
