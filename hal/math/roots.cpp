#include "hal/math/elementary.hpp"
#include "hal/math/two.hpp"
#include "hal/realtime.hpp"

namespace punctum::math {

double cbrt(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size < kInfinity)) {
    return size == kInfinity ? x : kNaN;
  }
  if (size == 0) {
    return x;
  }
  // size = 2^(3 third + m) z, 1 <= z < 2
  const bool small = size < 0x1p-1022;
  const double normal = small ? size * 0x1p54 : size;
  const int exponent = exponent_of(normal) - (small ? 54 : 0);
  const int third = (exponent + 1200) / 3 - 400;
  const int m = exponent - 3 * third;
  const double z = double_of((bits_of(normal) & ((std::uint64_t{1} << 52) - 1)) | bits_of(1.0));
  // A first value of 17 bits: its cube y^3 is exact, and so is what is missing to it.
  const double y = leading<17>(polynomial(kCbrtStart, z - 1) * kCbrtOfPower[m] * (1 + 0x1p-18));
  const double cube = y * y * y;
  const double part = (z * power_of_two(m) - cube) / cube;
  return std::copysign(
      (y + y * part * (1.0 / 3 + part * (-1.0 / 9 + part * (5.0 / 81)))) * power_of_two(third), x);
}

double hypot(double x, double y) NONBLOCKING {
  const double along = std::fabs(x), up = std::fabs(y);
  if (along == kInfinity || up == kInfinity) {
    return kInfinity;
  }
  if (!(along < kInfinity) || !(up < kInfinity)) {
    return kNaN;
  }
  double a = along > up ? along : up, b = along > up ? up : along;
  if (exponent_of(a) - exponent_of(b) > 60) {
    return a;
  }
  double unit = 1, scale = 1;
  if (a > 0x1p510) {
    unit = 0x1p600, scale = 0x1p-600;
  } else if (b < 0x1p-450) {
    unit = 0x1p-600, scale = 0x1p600;
  }
  a *= scale;
  b *= scale;
  const Two aa = product(a, a), bb = product(b, b);
  const Two s = ordered_sum(aa.high, bb.high);
  if (s.high == 0) {
    return 0;
  }
  const double root = std::sqrt(s.high);
  const Two square = product(root, root);
  const double missing = ((s.high - square.high) - square.low) + (s.low + (aa.low + bb.low));
  return (root + missing / (2 * root)) * unit;
}

}  // namespace punctum::math
