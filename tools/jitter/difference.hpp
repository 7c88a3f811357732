// Whether two measurements differ, and where.
#pragma once

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
};

inline constexpr std::size_t kLeastParts = 8;  // of either measurement

// By blocks of as many neighbouring parts as hang together, which are taken for independent of each other.
// Six blocks of each are the fewest: what drifts more slowly is taken for a difference. The error: too few
// parts.
[[nodiscard]] tl::expected<std::vector<QuantileDifference>, std::string> difference(const Result& a,
                                                                                    const Result& b);

[[nodiscard]] std::string difference_text(const std::vector<QuantileDifference>& found, const Result& a,
                                          const Result& b);

}  // namespace punctum::jitter
