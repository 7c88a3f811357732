#include "tools/scene/messages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace punctum::tools {
namespace {

constexpr std::size_t kLongestSuggested = 60;

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t next =
          std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1] ? 1U : 0U)});
      diagonal = row[j];
      row[j] = next;
    }
  }
  return row[b.size()];
}

}  // namespace

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

std::string suggestion(std::string_view given, const std::vector<std::string>& names) {
  if (given.size() > kLongestSuggested) {
    return {};
  }
  std::string nearest;
  std::size_t best = std::max<std::size_t>(2, given.size() / 3) + 1;
  for (const auto& name : names) {
    std::size_t distance = edit_distance(given, name);
    if (!given.empty() && (name.starts_with(given) || given.starts_with(name))) {
      distance = std::min<std::size_t>(distance, 2);
    }
    if (distance < best) {
      best = distance;
      nearest = name;
    }
  }
  return nearest.empty() ? std::string{} : " (did you mean " + nearest + "?)";
}

std::string unknown(std::string_view what, std::string_view given, const std::vector<std::string>& names) {
  return fmt::format("unknown {}{}, allowed: {}", what, suggestion(given, names), fmt::join(names, ", "));
}

}  // namespace punctum::tools
