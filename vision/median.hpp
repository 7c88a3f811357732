// The value in the middle.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace punctum::vision {

// The upper one of an even number; 0 for none.
[[nodiscard]] inline double median_of(std::vector<double> v) {
  if (v.empty()) {
    return 0;
  }
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

}  // namespace punctum::vision
