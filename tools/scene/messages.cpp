#include "tools/scene/messages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/shared/suggestion.hpp"

namespace punctum::tools {

std::string printable(std::string_view s, std::size_t max) {
  // Some terminals also obey the control characters U+0080 to U+009F, in UTF-8 the bytes c2 80 to c2 9f.
  std::string out;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const auto c = static_cast<unsigned char>(s[i]);
    const auto next = static_cast<unsigned char>(i + 1 < s.size() ? s[i + 1] : 0);
    if (out.size() >= max) {
      return out + "...";
    }
    if (c == 0xc2 && next >= 0x80 && next < 0xa0) {
      ++i;
      out += ' ';
    } else {
      out += (c < 0x20 || c == 0x7f) ? ' ' : s[i];
    }
  }
  return out;
}

std::string unknown(std::string_view what, std::string_view given, const std::vector<std::string>& names) {
  return fmt::format("unknown {}{}, allowed: {}", what, suggestion(given, names), fmt::join(names, ", "));
}

}  // namespace punctum::tools
