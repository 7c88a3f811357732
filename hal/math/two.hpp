// Numbers of twice the precision as unevaluated sums of two doubles, polynomials, and the bits of a double.
#pragma once

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#if defined(__FAST_MATH__) || FLT_EVAL_METHOD != 0
#error "hal/math needs IEEE arithmetic in double as it is written"
#endif

namespace punctum::math {

struct Two {
  double high, low;
};

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

[[nodiscard]] constexpr std::uint64_t bits_of(double x) NONBLOCKING {
  return std::bit_cast<std::uint64_t>(x);
}
[[nodiscard]] constexpr double double_of(std::uint64_t bits) NONBLOCKING {
  return std::bit_cast<double>(bits);
}
// -1023 for zero and subnormal numbers, 1024 for infinities and NaN.
[[nodiscard]] constexpr int exponent_of(double x) NONBLOCKING {
  return static_cast<int>((bits_of(x) >> 52) & 0x7FF) - 1023;
}
// 2^n for -1022 <= n <= 1023.
[[nodiscard]] constexpr double power_of_two(int n) NONBLOCKING {
  return double_of(static_cast<std::uint64_t>(n + 1023) << 52);
}
// x 2^n, rounded once, where neither half of the scaling leaves the range of normal numbers: |n| <= 2044.
[[nodiscard]] constexpr double scaled(double x, int n) NONBLOCKING {
  return x * power_of_two(n / 2) * power_of_two(n - n / 2);
}

// The leading `kept` bits of x, with the implicit one: x - leading<k>(x) is exact.
template <int kept>
[[nodiscard]] constexpr double leading(double x) NONBLOCKING {
  return double_of(bits_of(x) & (~std::uint64_t{0} << (53 - kept)));
}

// a + b exactly (Knuth).
[[nodiscard]] constexpr Two sum(double a, double b) NONBLOCKING {
  const double s = a + b;
  const double b_in_s = s - a;
  return {s, (a - (s - b_in_s)) + (b - b_in_s)};
}
// The same for |a| >= |b| or a = 0 (Dekker).
[[nodiscard]] constexpr Two ordered_sum(double a, double b) NONBLOCKING {
  const double s = a + b;
  return {s, b - (s - a)};
}
// a b to 2^-105 of it.
[[nodiscard]] constexpr Two product(double a, double b) NONBLOCKING {
  const double p = a * b;
  const double a1 = leading<26>(a), b1 = leading<26>(b);
  const double a2 = a - a1, b2 = b - b1;
  return {p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2};
}
// a / b: a first quotient of 26 bits, whose product with b.high is exact in two parts, and what is missing to
// it.
[[nodiscard]] constexpr double quotient(Two a, Two b) NONBLOCKING {
  const double inverse = 1 / b.high;
  const double q = leading<26>(a.high * inverse);
  const double b1 = leading<27>(b.high);
  return q + (((a.high - q * b1) - q * (b.high - b1)) + (a.low - q * b.low)) * inverse;
}
[[nodiscard]] constexpr double rounded(Two a) NONBLOCKING { return a.high + a.low; }

// c[0] + c[1] x + ..., neighbours first, so that the processor has several sums at once.
template <std::size_t n>
[[nodiscard]] constexpr double polynomial(const double (&c)[n], double x) NONBLOCKING {
  if constexpr (n == 1) {
    return c[0];
  } else if constexpr (n == 2) {
    return c[0] + c[1] * x;
  } else {
    static_assert(n <= 32);
    double pairs[(n + 1) / 2]{};
    for (std::size_t i = 0; i < n / 2; ++i) {  // at most 16 rounds
      pairs[i] = c[2 * i] + c[2 * i + 1] * x;
    }
    if constexpr (n % 2 == 1) {
      pairs[n / 2] = c[n - 1];
    }
    return polynomial(pairs, x * x);
  }
}

// x to the nearest whole number for |x| < 2^51; the number itself stands in the lowest bits of `shifted`.
struct Whole {
  double value;
  std::int64_t number;
};
[[nodiscard]] inline Whole nearest_whole(double x) NONBLOCKING {
  constexpr double shift = 0x1.8p52;
  const double shifted = x + shift;
  return {shifted - shift, static_cast<std::int64_t>(bits_of(shifted) - bits_of(shift))};
}

#include "hal/math/coefficients.inc"
#include "hal/realtime.hpp"

}  // namespace punctum::math
