// What an edge and a line show beside them, from tables.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/quad.hpp"

namespace punctum::vision {

// A table of a function of the distance in blurs.
class OfBlurs {
 public:
  template <typename Function>
  explicit OfBlurs(Function of) {
    for (int k = 0; k < kCount; ++k) {
      values_[static_cast<std::size_t>(k)] = of((k - kZero) / kPerBlur);
    }
  }
  [[nodiscard]] double operator()(double blurs) const {
    const int k = static_cast<int>(blurs * kPerBlur + kZero + 0.5);
    return values_[static_cast<std::size_t>(std::clamp(k, 0, kCount - 1))];
  }
  // The same, of four: the places in the table, and what is there.
  using Places = int __attribute__((vector_size(kQuad * sizeof(int))));
  [[gnu::always_inline]] static Places places(const Quad& blurs) {
    const Places k = __builtin_convertvector(blurs * kPerBlur + kZero + 0.5, Places);
    const Places low = k < 0 ? 0 : k;
    return low > kCount - 1 ? kCount - 1 : low;
  }
  [[nodiscard]] double at_place(int place) const { return values_[static_cast<std::size_t>(place)]; }
  static constexpr double kFar = 5;  // beyond so many blurs it does not change

 private:
  static constexpr double kPerBlur = 32;
  static constexpr int kZero = static_cast<int>(kFar * kPerBlur), kCount = 2 * kZero + 1;
  std::array<double, kCount> values_{};
};

inline const OfBlurs kStepOfBlurs([](double z) { return 0.5 * blurred_step(z / std::numbers::sqrt2); });
inline const OfBlurs kBumpOfBlurs([](double z) { return math::exp(-0.5 * z * z); });

}  // namespace punctum::vision
