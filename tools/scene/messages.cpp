#include "tools/scene/messages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/shared/suggestion.hpp"

namespace punctum::tools {

std::string printable(std::string_view s, std::size_t max) {
  std::string out;
  for (const char ch : s) {
    const auto c = static_cast<unsigned char>(ch);
    if (out.size() >= max) {
      return out + "...";
    }
    out += (c < 0x20 || c == 0x7f) ? ' ' : ch;
  }
  return out;
}

std::string unknown(std::string_view what, std::string_view given, const std::vector<std::string>& names) {
  return fmt::format("unknown {}{}, allowed: {}", what, suggestion(given, names), fmt::join(names, ", "));
}

}  // namespace punctum::tools
