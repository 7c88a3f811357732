// The elementary functions by name, a fixed grid of arguments for each, and a hash over the bits of the
// results. All in integers besides the functions themselves, so that a difference between two machines can
// only be the functions'.
#pragma once

#include <bit>
#include <cstdint>

#include "hal/math/elementary.hpp"

namespace punctum::math {

struct Unary {
  const char* name;
  double (*ours)(double) noexcept;
  int lowest_exponent, highest_exponent;  // of the arguments in the grid, as powers of two
  bool negative;                          // the grid takes both signs
};
inline constexpr Unary kUnary[] = {
    {"sin", sin, -40, 1023, true},    {"cos", cos, -40, 1023, true},        {"tan", tan, -40, 1023, true},
    {"asin", asin, -40, -1, true},    {"acos", acos, -40, -1, true},        {"atan", atan, -60, 70, true},
    {"exp", exp, -60, 9, true},       {"expm1", expm1, -60, 9, true},       {"log", log, -1074, 1023, false},
    {"log1p", log1p, -60, 80, false}, {"log10", log10, -1074, 1023, false}, {"tanh", tanh, -40, 4, true},
    {"atanh", atanh, -40, -1, true},  {"cbrt", cbrt, -1074, 1023, true},
};

struct Binary {
  const char* name;
  double (*ours)(double, double) noexcept;
  int lowest_exponent, highest_exponent;
  bool negative;
};
inline constexpr Binary kBinary[] = {
    {"atan2", atan2, -80, 80, true},
    {"pow", pow, -8, 7, false},
    {"hypot", hypot, -600, 600, true},
};

// The splitmix64 generator.
class GridRandom {
 public:
  explicit GridRandom(std::uint64_t seed) noexcept : state_(seed) {}
  std::uint64_t bits() noexcept {
    state_ += 0x9e3779b97f4a7c15;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  // A double whose exponent is uniform between these, of random digits. Below -1022 it is subnormal.
  double number(int lowest, int highest, bool negative) noexcept {
    const auto span = static_cast<std::uint64_t>(highest - lowest + 1);
    const int exponent = lowest + static_cast<int>(bits() % span);
    const std::uint64_t digits = bits();
    const std::uint64_t sign = negative ? digits & (std::uint64_t{1} << 63) : 0;
    const std::uint64_t fraction = digits & ((std::uint64_t{1} << 52) - 1);
    const std::uint64_t size = exponent >= -1022
                                   ? (static_cast<std::uint64_t>(exponent + 1023) << 52) | fraction
                                   : (fraction | (std::uint64_t{1} << 52)) >> (-1022 - exponent);
    return std::bit_cast<double>(sign | size);
  }

 private:
  std::uint64_t state_;
};

// FNV-1a over the bytes of each result, from the lowest.
class BitsHash {
 public:
  void add(double result) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(result);
    for (unsigned i = 0; i < 64; i += 8) {
      value_ = (value_ ^ ((bits >> i) & 0xFF)) * 0x100000001b3;
    }
  }
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

inline constexpr int kGridPoints = 100'000;

inline std::uint64_t hash_of(const Unary& f) noexcept {
  GridRandom random(1);
  BitsHash hash;
  for (int i = 0; i < kGridPoints; ++i) {
    hash.add(f.ours(random.number(f.lowest_exponent, f.highest_exponent, f.negative)));
  }
  return hash.value();
}
inline std::uint64_t hash_of(const Binary& f) noexcept {
  GridRandom random(1);
  BitsHash hash;
  for (int i = 0; i < kGridPoints; ++i) {
    const double a = random.number(f.lowest_exponent, f.highest_exponent, f.negative);
    // An exponent of either sign is what pow is for.
    hash.add(f.ours(a, random.number(f.lowest_exponent, f.highest_exponent, true)));
  }
  return hash.value();
}

}  // namespace punctum::math
