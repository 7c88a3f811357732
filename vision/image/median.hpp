// Median.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// Times the median of the absolute values: the standard deviation of normally distributed numbers.
inline constexpr double kSdOfMedian = 1.4826;

// The value at that place in the rising order of all; their order is lost. No branch depends on a comparison
// of single values: of those a processor guesses every other one wrong, which takes longer than all the rest.
template <class T>
[[nodiscard]] T value_at_place(Vector<T>& v, std::size_t place) {
  constexpr std::size_t kFew = 16;
  Vector<T> room(v.size() > kFew ? v.size() : 0);
  T *from = v.data(), *to = room.data();
  std::size_t n = v.size();
  // What is less than a pivot to the front, the rest to the back.
  const auto part = [&](const auto& is_less) {
    std::size_t less = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const T here = from[i];
      to[less] = here;
      to[n - 1 - i + less] = here;
      less += is_less(here) ? 1 : 0;
    }
    std::swap(from, to);
    return less;
  };
  while (n > kFew) {
    const auto of_three = [](T a, T b, T c) { return std::max(std::min(a, b), std::min(std::max(a, b), c)); };
    const std::size_t apart = n / 9;
    const T* at = from + apart / 2;
    const T pivot = of_three(of_three(at[0], at[apart], at[2 * apart]),
                             of_three(at[3 * apart], at[4 * apart], at[5 * apart]),
                             of_three(at[6 * apart], at[7 * apart], at[8 * apart]));
    std::size_t less = part([pivot](T x) { return x < pivot; });
    if (less == 0) {  // it is the least: those that equal it go to the front
      less = part([pivot](T x) { return x <= pivot; });
      if (place < less || less == 0) {
        return pivot;
      }
    }
    if (place < less) {
      n = less;
    } else {
      place -= less;
      n -= less;
      from += less;
      to += less;
    }
  }
  // Of a few the lowest to the front, one by one, as far as the place.
  for (std::size_t i = 0; i <= place; ++i) {
    T least = from[i];
    for (std::size_t j = i + 1; j < n; ++j) {
      const T here = from[j];
      from[j] = here < least ? least : here;
      least = here < least ? here : least;
    }
    from[i] = least;
  }
  return from[place];
}

// The upper one of the two middle values of an even number of values; 0 if there are none. The order of the
// values is lost.
template <class T>
[[nodiscard]] double median_in_place(Vector<T>& v) {
  return v.empty() ? 0 : static_cast<double>(value_at_place(v, v.size() / 2));
}

template <class T>
[[nodiscard]] double median_of(Vector<T> v) {
  return median_in_place(v);
}

}  // namespace punctum::vision
