#include "tools/shared/suggestion.hpp"

#include <algorithm>
#include <cstddef>

namespace punctum::tools {
namespace {

constexpr std::size_t kLongestSuggested = 60;

// Letters to insert, remove or replace; two neighbours that changed places count as one.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> above(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      next[j] = std::min({row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] != b[j - 1] ? 1U : 0U)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        next[j] = std::min(next[j], above[j - 2] + 1);
      }
    }
    above.swap(row);
    row.swap(next);
  }
  return row[b.size()];
}

}  // namespace

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

}  // namespace punctum::tools
