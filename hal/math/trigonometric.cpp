#include "hal/math/elementary.hpp"
#include "hal/math/two.hpp"
#include "hal/realtime.hpp"

namespace punctum::math {
namespace {

__extension__ typedef unsigned __int128 Wide;

// x = quarter * pi/2 + angle, |angle| <= pi/4 (and a rounding); quarter counts modulo 4.
struct Reduced {
  Two angle;
  std::uint64_t quarter;
};

constexpr double kQuarterPi = 0x1.921fb54442d18p-1;
constexpr double kTiny = 0x1p-27;             // sin x = tan x = x, cos x = 1 to half an ulp
constexpr double kFewQuarters = 0x1.921fp20;  // below: fewer than 2^20 quarters

// Cody and Waite, with three exact products and a fourth.
[[nodiscard]] Reduced reduce_few(double x) NONBLOCKING {
  const Whole n = nearest_whole(x * kTwoOverPi);
  const double first = x - n.value * kHalfPiParts[0];
  const Two second = sum(first, -(n.value * kHalfPiParts[1]));
  const Two third = sum(second.high, -(n.value * kHalfPiParts[2]));
  return {ordered_sum(third.high, second.low + third.low - n.value * kHalfPiParts[3]),
          static_cast<std::uint64_t>(n.number) & 3U};
}

// Payne and Hanek, in integers. |x| = m 2^e: bits of 2/pi that make whole turns are left out, the next 192
// are multiplied by m; what is cut off is below 2^-137 of a quarter, and no double comes closer to one than
// 2^-63.
[[nodiscard]] Reduced reduce_many(double x) NONBLOCKING {
  const std::uint64_t m = (bits_of(x) & ((std::uint64_t{1} << 52) - 1)) | (std::uint64_t{1} << 52);
  const int e = exponent_of(x) - 52;
  const auto position = static_cast<unsigned>(e - 2 + 64);
  const unsigned word = position / 64, shift = position % 64;
  const auto window = [&](unsigned i) {
    const std::uint64_t head = kTwoOverPiBits[word + i];
    return shift == 0 ? head : (head << shift) | (kTwoOverPiBits[word + i + 1] >> (64 - shift));
  };
  const Wide low = static_cast<Wide>(m) * window(2);
  const Wide middle = static_cast<Wide>(m) * window(1) + static_cast<std::uint64_t>(low >> 64);
  const std::uint64_t high = m * window(0) + static_cast<std::uint64_t>(middle >> 64);

  std::uint64_t a =
      (high << 2) | (static_cast<std::uint64_t>(middle) >> 62);  // the part of a quarter, 128 bits
  std::uint64_t b = (static_cast<std::uint64_t>(middle) << 2) | (static_cast<std::uint64_t>(low) >> 62);
  auto quarter = static_cast<unsigned>(high >> 62);
  bool negative = (bits_of(x) >> 63) != 0;
  if (negative) {
    quarter = 0U - quarter;
  }
  if ((a >> 63) != 0) {  // nearer to the next quarter
    quarter += negative ? ~0U : 1U;
    negative = !negative;
    b = ~b + 1;
    a = ~a + (b == 0 ? 1 : 0);
  }
  const int zeros = a != 0 ? std::countl_zero(a) : 64;
  if (zeros == 64) {
    a = b;
    b = 0;
  } else if (zeros > 0) {
    a = (a << zeros) | (b >> (64 - zeros));
    b <<= zeros;
  }
  const double unit = power_of_two(-zeros - 53);
  const double f1 = static_cast<double>(static_cast<std::int64_t>(a >> 11)) * unit;
  const double f2 =
      static_cast<double>(static_cast<std::int64_t>(((a & 0x7FF) << 42) | (b >> 22))) * unit * 0x1p-53;
  const Two p = product(f1, kHalfPi.high);
  const Two angle = ordered_sum(p.high, p.low + (f1 * kHalfPi.low + f2 * kHalfPi.high));
  return {negative ? Two{-angle.high, -angle.low} : angle, quarter & 3U};
}

[[nodiscard]] Reduced reduce(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (size <= kQuarterPi) {
    return {{x, 0}, 0};
  }
  return size < kFewQuarters ? reduce_few(x) : reduce_many(x);
}

// Of an angle of at most pi/4 (and a rounding), as head and rest.
[[nodiscard, gnu::always_inline]] inline Two sin_parts(Two t) NONBLOCKING {
  const double z = t.high * t.high;
  const double head = leading<17>(t.high);
  const double cube = head * head * head;  // exact
  const double other_cube = (t.high - head) * (z + head * (t.high + head));
  return {t.high, cube * (-1.0 / 6) + (other_cube * (-1.0 / 6) + t.high * z * z * polynomial(kSin, z) +
                                       (t.low - 0.5 * z * t.low))};
}
[[nodiscard, gnu::always_inline]] inline Two cos_parts(Two t) NONBLOCKING {
  const double z = t.high * t.high;
  const double head = leading<26>(t.high);
  const double half_square = 0.5 * head * head;  // exact
  const double rest = 0.5 * (t.high - head) * (t.high + head);
  const Two w = ordered_sum(1, -half_square);
  return {w.high, w.low - rest + (z * z * polynomial(kCos, z) - t.high * t.low)};
}

}  // namespace

double sin(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size < kInfinity)) {
    return kNaN;
  }
  if (size < kTiny) {
    return x;
  }
  const Reduced r = reduce(x);
  const double s = rounded((r.quarter & 1U) != 0 ? cos_parts(r.angle) : sin_parts(r.angle));
  return (r.quarter & 2U) != 0 ? -s : s;
}

// As sin, without a branch: the processor takes two or more at once.
void sines(std::array<double, kTogether>& angles) NONBLOCKING {
  bool ordinary = true;
  for (const double a : angles) {
    ordinary = ordinary && std::fabs(a) >= kTiny && std::fabs(a) < kFewQuarters;
  }
  if (!ordinary) {
    for (double& a : angles) {
      a = sin(a);
    }
    return;
  }
  for (double& a : angles) {
    const Reduced r = reduce_few(a);
    const std::uint64_t s = bits_of(rounded(sin_parts(r.angle))), c = bits_of(rounded(cos_parts(r.angle)));
    const std::uint64_t odd = 0U - (r.quarter & 1U);
    a = double_of(((s & ~odd) | (c & odd)) ^ ((r.quarter & 2U) << 62));
  }
}

double cos(double x) NONBLOCKING {
  if (!(std::fabs(x) < kInfinity)) {
    return kNaN;
  }
  const Reduced r = reduce(x);
  const double c = rounded((r.quarter & 1U) != 0 ? sin_parts(r.angle) : cos_parts(r.angle));
  return ((r.quarter + 1) & 2U) != 0 ? -c : c;
}

SinCos sin_cos(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size < kInfinity)) {
    return {kNaN, kNaN};
  }
  if (size < kTiny) {
    return {x, 1};
  }
  const Reduced r = reduce(x);
  const double s = rounded(sin_parts(r.angle)), c = rounded(cos_parts(r.angle));
  const bool swap = (r.quarter & 1U) != 0;
  const double a = swap ? c : s, b = swap ? s : c;
  return {(r.quarter & 2U) != 0 ? -a : a, ((r.quarter + 1) & 2U) != 0 ? -b : b};
}

double tan(double x) NONBLOCKING {
  const double size = std::fabs(x);
  if (!(size < kInfinity)) {
    return kNaN;
  }
  if (size < kTiny) {
    return x;
  }
  const Reduced r = reduce(x);
  const Two s = sin_parts(r.angle), c = cos_parts(r.angle);
  const Two sine = ordered_sum(s.high, s.low), cosine = ordered_sum(c.high, c.low);
  // tan(t + pi/2) = -cos t / sin t
  const bool odd = (r.quarter & 1U) != 0;
  const double t = quotient(odd ? cosine : sine, odd ? sine : cosine);
  return odd ? -t : t;
}

}  // namespace punctum::math
