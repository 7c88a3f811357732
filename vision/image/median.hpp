// Median.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace punctum::vision {

// Times the median of the absolute values: the standard deviation of normally distributed numbers.
inline constexpr double kSdOfMedian = 1.4826;

// The upper one of the two middle values of an even number of values; 0 if there are none.
template <class T>
[[nodiscard]] double median_of(std::vector<T> v) {
  if (v.empty()) {
    return 0;
  }
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return static_cast<double>(v[v.size() / 2]);
}

}  // namespace punctum::vision
