// Elementary functions whose results are the same bits on every machine: IEEE additions, multiplications,
// divisions and square roots in double, in a fixed order, without contraction; nothing is asked of the C
// library.
//
// Every function: error below 1 ulp on its whole domain (README.md has the measured figures), special values
// as in Annex F of the C standard. Every NaN that is returned is the same one, whatever came in. No errno,
// and no promise about floating-point flags. The rounding mode must be to nearest, and subnormal numbers must
// not be flushed. Real-time safe: no heap, no lock, no system call, no loop without a bound.
#pragma once

#include <array>
#include <cstddef>

#include "hal/realtime.hpp"

namespace punctum::math {

struct SinCos {
  double sin, cos;
};

// Angles in rad; any finite argument, however large.
[[nodiscard]] double sin(double x) NONBLOCKING;
[[nodiscard]] double cos(double x) NONBLOCKING;
// Each becomes its sine: the bits of sin(x) in half the time.
inline constexpr std::size_t kTogether = 8;
void sines(std::array<double, kTogether>& angles) NONBLOCKING;
[[nodiscard]] SinCos sin_cos(double x)
    NONBLOCKING;  // the bits of sin(x) and cos(x) for little more than one of them
[[nodiscard]] double tan(double x) NONBLOCKING;

[[nodiscard]] double asin(double x) NONBLOCKING;
[[nodiscard]] double acos(double x) NONBLOCKING;
[[nodiscard]] double atan(double x) NONBLOCKING;
[[nodiscard]] double atan2(double y, double x) NONBLOCKING;

[[nodiscard]] double exp(double x) NONBLOCKING;
[[nodiscard]] double expm1(double x) NONBLOCKING;
[[nodiscard]] double log(double x) NONBLOCKING;
[[nodiscard]] double log1p(double x) NONBLOCKING;
[[nodiscard]] double log10(double x) NONBLOCKING;
[[nodiscard]] double pow(double x, double y) NONBLOCKING;
[[nodiscard]] double tanh(double x) NONBLOCKING;
[[nodiscard]] double atanh(double x) NONBLOCKING;

[[nodiscard]] double cbrt(double x) NONBLOCKING;
[[nodiscard]] double hypot(double x, double y) NONBLOCKING;

}  // namespace punctum::math
