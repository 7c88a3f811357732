#include "tools/shared/station_segments.hpp"

#include <fmt/format.h>

#include <charconv>

namespace punctum::tools {

std::string HandedSegments::text() const {
  std::string text;
  for (const auto& [name, descriptor] : list_) {
    text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, descriptor);
  }
  return text;
}

tl::expected<HandedSegments, std::string> HandedSegments::parse(std::string_view text) {
  HandedSegments handed;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    text.remove_prefix(one.size() < text.size() ? one.size() + 1 : one.size());
    const std::size_t equals = one.find('=');
    const std::string_view number =
        equals == std::string_view::npos ? std::string_view{} : one.substr(equals + 1);
    int descriptor = -1;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), descriptor);
    if (error != std::errc{} || end != number.data() + number.size() || descriptor < 0 || equals == 0) {
      return tl::unexpected(fmt::format("--segments: {}: not understood, allowed: NAME=DESCRIPTOR,...", one));
    }
    handed.add(one.substr(0, equals), descriptor);
  }
  return handed;
}

int HandedSegments::descriptor(std::string_view name) const {
  for (const auto& [known, descriptor] : list_) {
    if (known == name) {
      return descriptor;
    }
  }
  return -1;
}

std::vector<int> HandedSegments::descriptors() const {
  std::vector<int> all;
  for (const auto& [name, descriptor] : list_) {
    all.push_back(descriptor);
  }
  return all;
}

}  // namespace punctum::tools
