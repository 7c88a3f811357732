// Median.
#pragma once

#include <algorithm>
#include <cstddef>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// Times the median of the absolute values: the standard deviation of normally distributed numbers.
inline constexpr double kSdOfMedian = 1.4826;

// The upper one of the two middle values of an even number of values; 0 if there are none. The order of the
// values is lost.
template <class T>
[[nodiscard]] double median_in_place(Vector<T>& v) {
  if (v.empty()) {
    return 0;
  }
  const std::size_t middle = v.size() / 2;
  constexpr std::size_t kFew = 16;
  if (v.size() > kFew) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(middle), v.end());
    return static_cast<double>(v[middle]);
  }
  // Of a few values the lowest to the front, one by one, as far as the middle: without a branch, of which a
  // processor guesses every other one wrong.
  for (std::size_t i = 0; i <= middle; ++i) {
    T least = v[i];
    for (std::size_t j = i + 1; j < v.size(); ++j) {
      const T here = v[j];
      v[j] = here < least ? least : here;
      least = here < least ? here : least;
    }
    v[i] = least;
  }
  return static_cast<double>(v[middle]);
}

template <class T>
[[nodiscard]] double median_of(Vector<T> v) {
  return median_in_place(v);
}

}  // namespace punctum::vision
