// Whether two measurements differ, and where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tools/jitter/result.hpp"

namespace punctum::jitter {

struct QuantileDifference {
  double part = 0;                 // 0.5, 0.99, 0.999
  double a_us = 0, b_us = 0;       // of either measurement
  double low_us = 0, high_us = 0;  // b - a lies between these with 95 % confidence for all parts together
  bool differs = false;
  bool told = true;  // at least one wake-up of either lies beyond it
};

// Releases that nobody woke for. One stop of the machine misses many in one part, and so parts are what
// counts: `chance` of a difference as large where the parts of both are dealt out anew, 1 where either does
// not tell them.
struct MissedDifference {
  std::uint64_t a = 0, b = 0;
  std::size_t parts_a = 0, parts_b = 0;  // in which some were missed
  double chance = 1;
  bool differs = false;  // with 95 % confidence of its own
};

struct Difference {
  std::vector<QuantileDifference> quantiles;
  MissedDifference missed;
  [[nodiscard]] bool any() const;
};

inline constexpr std::size_t kLeastParts = 8;  // of either measurement

// By blocks of as many neighbouring parts as hang together, which are taken for independent of each other.
// Six blocks of each are the fewest: what drifts more slowly is taken for a difference. The error: too few
// parts.
[[nodiscard]] tl::expected<Difference, std::string> difference(const Result& a, const Result& b);

[[nodiscard]] std::string difference_text(const Difference& found, const Result& a, const Result& b);

}  // namespace punctum::jitter
