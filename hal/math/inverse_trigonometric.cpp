#include "hal/math/elementary.hpp"
#include "hal/math/two.hpp"
#include "hal/realtime.hpp"

namespace punctum::math {
namespace {

constexpr double kTiny = 0x1p-27;  // asin x = atan x = x to half an ulp
constexpr double kHuge = 0x1p60;   // atan x = pi/2

// Up to here atan is a polynomial; beyond it the nearest of c = j/32 is taken out.
constexpr double kDirect = 4.5 / 32;

// atan(a / b) for 0 <= a <= b as head and rest, q = a / b rounded:
// atan(c) + atan((a - c b) / (b + c a)), the second at most 1/64.
[[nodiscard]] Two angle_beyond(double a, double b, double q) NONBLOCKING {
  const auto j = static_cast<unsigned>(q * 32 + 0.5);
  const double c = 0.03125 * j;
  const double b1 = leading<32>(b);
  const double t = ((a - c * b1) - c * (b - b1)) / (b + c * a);
  const double z = t * t;
  const Two s = ordered_sum(kAtanTable[2 * j], t);
  return {s.high, s.low + (kAtanTable[2 * j + 1] + t * z * polynomial(kAtanNear, z))};
}
[[nodiscard]] Two angle_direct(double q) NONBLOCKING {
  const double z = q * q;
  return {q, q * z * polynomial(kAtan, z)};
}

// turn - a
[[nodiscard]] double minus(Two turn, Two a) NONBLOCKING {
  const Two s = ordered_sum(turn.high, -a.high);
  return s.high + (s.low + (turn.low - a.low));
}

// asin(s) of 0 <= s <= 1/sqrt 2 with s^2 = z, as head and rest; s = sqrt(z) of z <= 1/4.
[[nodiscard]] Two asin_of_root(double z) NONBLOCKING {
  const double s = std::sqrt(z);
  if (s == 0) {
    return {0, 0};
  }
  const Two square = product(s, s);
  const double low = ((z - square.high) - square.low) / (2 * s);
  return {s, low + s * z * polynomial(kAsin, z)};
}

}  // namespace

double asin(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size <= 1)) {
    return kNaN;
  }
  if (size < kTiny) {
    return x;
  }
  if (size < 0.5) {
    const double z = x * x;
    return x + x * z * polynomial(kAsin, z);
  }
  const Two half = asin_of_root(0.5 * (1 - size));
  return std::copysign(minus(kHalfPi, {2 * half.high, 2 * half.low}), x);
}

double acos(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size <= 1)) {
    return kNaN;
  }
  if (size < 0.5) {
    const double z = x * x;
    return minus(kHalfPi, {x, x * z * polynomial(kAsin, z)});
  }
  const Two half = asin_of_root(0.5 * (1 - size));
  const Two whole{2 * half.high, 2 * half.low};
  return x > 0 ? rounded(whole) : minus(kPi, whole);
}

double atan(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size <= kInfinity)) {
    return kNaN;
  }
  if (size < kTiny) {
    return x;
  }
  if (size > kHuge) {
    return std::copysign(kHalfPi.high, x);
  }
  if (size <= 1) {
    return std::copysign(rounded(size < kDirect ? angle_direct(size) : angle_beyond(size, 1, size)), x);
  }
  const double q = 1 / size;
  return std::copysign(minus(kHalfPi, q < kDirect ? angle_direct(q) : angle_beyond(1, size, q)), x);
}

double atan2(double y, double x) NONBLOCKING {
  const double up = std::fabs(y), along = std::fabs(x);
  if (!(up <= kInfinity) || !(along <= kInfinity)) {
    return kNaN;
  }
  const bool left = (bits_of(x) >> 63) != 0;
  if (up == 0) {
    return std::copysign(left ? kPi.high : 0, y);
  }
  const bool steep = up > along;
  double a = steep ? along : up, b = steep ? up : along;
  Two value{0, 0};  // atan(a / b)
  if (b == kInfinity) {
    value.high = a == kInfinity ? 0.5 * kHalfPi.high : 0;
    value.low = a == kInfinity ? 0.5 * kHalfPi.low : 0;
  } else if (exponent_of(b) - exponent_of(a) > 62) {
    value.high = a / b;
  } else {
    // b to [1, 2), or as near to it as a scale of 2^1022 brings the smallest.
    const int e = exponent_of(b);
    const double scale = power_of_two(e >= 1023 ? -1022 : e <= -1022 ? 1022 : -e);
    a *= scale;
    b *= scale;
    const double q = a / b;
    if (q < kDirect) {
      const Two p = product(q, b);
      value = angle_direct(q);
      value.low += ((a - p.high) - p.low) / b;
    } else {
      value = angle_beyond(a, b, q);
    }
  }
  if (steep) {
    return std::copysign(minus(kHalfPi, left ? Two{-value.high, -value.low} : value), y);
  }
  return std::copysign(left ? minus(kPi, value) : rounded(value), y);
}

}  // namespace punctum::math
