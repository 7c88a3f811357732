#include "hal/math/elementary.hpp"
#include "hal/math/two.hpp"
#include "hal/realtime.hpp"

namespace punctum::math {
namespace {

// exp(x) = scale (1 + part) 2^power with 1 <= scale < 2, |part| < 0.0028
struct Power {
  double scale, part;
  int power;
};

// Of x + low for |x| < 800: x = k ln 2 / 128 + r.
[[nodiscard]] Power exp_parts(double x, double low) NONBLOCKING {
  const Whole k = nearest_whole(x * kExpStepsPerUnit);
  const double r = (x - k.value * kExpStep.high) - (k.value * kExpStep.low - low);
  const auto j = static_cast<unsigned>(k.number) % 128;
  return {kPowerOfTwo[2 * j], kPowerOfTwo[2 * j + 1] + (r + r * r * polynomial(kExp, r)),
          static_cast<int>(k.number >> 7)};
}

[[nodiscard]] double value_of(const Power& p) NONBLOCKING {
  const double significand = p.scale + p.scale * p.part;
  return p.power > -1022 && p.power < 1023 ? significand * power_of_two(p.power)
                                           : scaled(significand, p.power);
}

// exp(x) - 1 for 1/16 <= |x| <= 64, to about 2^-58 of it.
[[nodiscard]] Two expm1_parts(double x) NONBLOCKING {
  const Power p = exp_parts(x, 0);
  const double scale = p.scale * power_of_two(p.power);
  const Two s = sum(scale, -1);
  return ordered_sum(s.high, s.low + scale * p.part);
}

// x (1 + r) of the tables: log(x + low) = base.high + base.low + log(1 + r), r = step.high + step.low.
struct Logarithm {
  Two base, step;
};

// x + low = 2^k z, 0.687 <= z < 1.375. x is positive and normal; `extra` is added to k.
template <bool has_low>
[[nodiscard]] Logarithm log_parts(double x, double low, int extra) NONBLOCKING {
  const std::uint64_t above = bits_of(x) - kLogFirst;
  const auto exponent = static_cast<std::int64_t>(above) >> 52;
  const auto i = static_cast<std::size_t>((above >> 45) % 128);
  const double z = double_of(bits_of(x) - (static_cast<std::uint64_t>(exponent) << 52));
  const double c = kLogTable[3 * i];
  const double z1 = leading<32>(z);
  double z2 = z - z1;
  if constexpr (has_low) {
    z2 += low * power_of_two(static_cast<int>(-exponent));
  }
  const double r1 = z1 * c - 1, r2 = z2 * c;  // both exact without `low`
  const double r = r1 + r2;
  const auto k = static_cast<double>(exponent + extra);
  return {{k * kLn2.high + kLogTable[3 * i + 1], k * kLn2.low + kLogTable[3 * i + 2]}, {r, (r1 - r) + r2}};
}

[[nodiscard]] double value_of(const Logarithm& l) NONBLOCKING {
  const double r = l.step.high;
  const Two s = ordered_sum(l.base.high, r);
  return s.high + (s.low + (l.base.low + l.step.low) + r * r * (r * polynomial(kLog, r) - 0.5));
}

// To about 2^-68 of it.
[[nodiscard]] Two exact_value_of(const Logarithm& l) NONBLOCKING {
  const double r = l.step.high;
  const Two square = product(r, r);
  const Two s = ordered_sum(l.base.high, r);
  const Two t = sum(s.high, -0.5 * square.high);
  const double cubic = r * square.high * polynomial(kLog, r);
  return ordered_sum(
      t.high, t.low + (s.low + ((l.base.low + (l.step.low - r * l.step.low)) + (cubic - 0.5 * square.low))));
}

// The number made normal, and what that adds to its exponent.
struct Normal {
  double value;
  int extra;
};
[[nodiscard]] Normal normal(double x) NONBLOCKING {
  return x < 0x1p-1022 ? Normal{x * 0x1p54, -54} : Normal{x, 0};
}

// What log, log1p and log10 are of zero, of infinity and beyond the domain.
[[nodiscard]] double log_outside(double x) NONBLOCKING {
  return x == 0 ? -kInfinity : x > 0 ? kInfinity : kNaN;
}

enum class Parity : std::uint8_t { fraction, even, odd };
// Of a finite y.
[[nodiscard]] Parity parity(double y) NONBLOCKING {
  const int e = exponent_of(y);
  if (e < 0) {
    return y == 0 ? Parity::even : Parity::fraction;
  }
  if (e > 52) {
    return Parity::even;
  }
  const std::uint64_t unit = std::uint64_t{1} << (52 - e);
  const std::uint64_t bits = bits_of(y) | (std::uint64_t{1} << 52);
  if ((bits & (unit - 1)) != 0) {
    return Parity::fraction;
  }
  return e == 0 || (bits & unit) != 0 ? Parity::odd : Parity::even;
}

// x^y where one of them is 0, infinite or NaN, or x is 1.
[[nodiscard]] double special_pow(double x, double y) NONBLOCKING {
  if (x == 1 || y == 0) {
    return 1;
  }
  const double size = std::fabs(x);
  if (!(size <= kInfinity) || !(std::fabs(y) <= kInfinity)) {
    return kNaN;
  }
  if (std::fabs(y) == kInfinity) {
    return size == 1 ? 1 : (size > 1) == (y > 0) ? kInfinity : 0;
  }
  const double value = (size == 0) == (y > 0) ? 0 : kInfinity;
  return parity(y) == Parity::odd ? std::copysign(value, x) : value;
}

}  // namespace

double exp(double x) NONBLOCKING {
  if (!(std::fabs(x) < 746)) {
    return x > 0 ? kInfinity : x < 0 ? 0 : kNaN;
  }
  return value_of(exp_parts(x, 0));
}

double expm1(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size <= 40)) {
    return x < 0 ? -1 : exp(x);
  }
  if (size < 0x1p-54) {
    return x;
  }
  if (size <= 0.0625) {
    const double square = x * x;
    return x + (0.5 * square + x * square * polynomial(kExpm1, x));
  }
  return rounded(expm1_parts(x));
}

double tanh(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size <= kInfinity)) {
    return kNaN;
  }
  if (size < 0x1p-27) {
    return x;
  }
  if (size <= 0.125) {
    const double z = x * x;
    return x + x * z * polynomial(kTanh, z);
  }
  if (size > 20) {
    return std::copysign(1.0, x);
  }
  const Two e = expm1_parts(2 * size);  // tanh x = e / (e + 2)
  const Two d = sum(e.high, 2);
  return std::copysign(quotient(e, ordered_sum(d.high, d.low + e.low)), x);
}

double log(double x) NONBLOCKING {
  if (!(x > 0) || !(x < kInfinity)) {
    return log_outside(x);
  }
  const Normal n = normal(x);
  return value_of(log_parts<false>(n.value, 0, n.extra));
}

double log10(double x) NONBLOCKING {
  if (!(x > 0) || !(x < kInfinity)) {
    return log_outside(x);
  }
  const Normal n = normal(x);
  const Two l = exact_value_of(log_parts<false>(n.value, 0, n.extra));
  const Two p = product(l.high, kLog10e.high);
  return p.high + (p.low + (l.high * kLog10e.low + l.low * kLog10e.high));
}

double log1p(double x) NONBLOCKING {
  if (!(x > -1) || !(x < kInfinity)) {
    return x == -1 ? -kInfinity : x > 0 ? kInfinity : kNaN;
  }
  const double size = std::fabs(x);
  if (size < 0x1p-54) {
    return x;
  }
  if (size <= 0x1p-8) {
    return x + x * x * (x * polynomial(kLog, x) - 0.5);
  }
  if (x > 0x1p60) {
    return log(x);
  }
  const Two u = sum(1, x);
  return value_of(log_parts<true>(u.high, u.low, 0));
}

double atanh(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size < 1)) {
    return size == 1 ? std::copysign(kInfinity, x) : kNaN;
  }
  if (size < 0x1p-27) {
    return x;
  }
  if (size <= 0.125) {
    const double z = x * x;
    return x + x * z * polynomial(kAtanh, z);
  }
  const Two above = ordered_sum(1, size), below = ordered_sum(1, -size);
  const Two a = exact_value_of(log_parts<true>(above.high, above.low, 0));
  const Two b = exact_value_of(log_parts<true>(below.high, below.low, 0));
  const Two s = sum(a.high, -b.high);
  return std::copysign(0.5 * (s.high + (s.low + (a.low - b.low))), x);
}

double pow(double x, double y) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size > 0) || !(size < kInfinity) || y == 0 || !(std::fabs(y) < kInfinity) || x == 1) {
    return special_pow(x, y);
  }
  double sign = 1;
  if (x < 0) {
    const Parity p = parity(y);
    if (p == Parity::fraction) {
      return kNaN;
    }
    sign = p == Parity::odd ? -1 : 1;
  }
  const Normal n = normal(size);
  const Two l = exact_value_of(log_parts<false>(n.value, 0, n.extra));
  const double rough = y * l.high;
  if (!(std::fabs(rough) < 746)) {
    return sign * (rough > 0 ? kInfinity : 0);
  }
  if (std::fabs(rough) < 0x1p-54) {
    return sign;
  }
  const Two p = product(y, l.high);
  return sign * value_of(exp_parts(p.high, p.low + y * l.low));
}

}  // namespace punctum::math
