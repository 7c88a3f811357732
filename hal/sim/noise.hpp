// Seeded noise without a state: sample n of stream s is always the same number, on every machine.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::sim {

class Noise {
 public:
  // One stream per thing that is noisy.
  enum class Stream : std::uint64_t {
    force_sensor = 1,
    vacuum,
    tremor,
    aim,
    drift,
    tilt,
    hand_reading,
    stage_reading,
    estop_reading,
    injector_reading,
    lie,
    free_use = 64
  };

  constexpr Noise(std::uint64_t seed, Stream stream, std::uint64_t sub = 0) NONBLOCKING
      : key_(mix(mix(seed) ^ mix(static_cast<std::uint64_t>(stream) * 0x9E3779B97F4A7C15U + sub))) {}

  [[nodiscard]] constexpr std::uint64_t bits(std::uint64_t n) const NONBLOCKING {
    return mix(key_ + n * 0x9E3779B97F4A7C15U);
  }

  [[nodiscard]] constexpr double uniform(std::uint64_t n) const NONBLOCKING {  // [0, 1)
    return static_cast<double>(bits(n) >> 11) * 0x1.0p-53;
  }

  // Mean 0, variance 1, within +-6: the sum of twelve uniform numbers. Only additions, so the same digits
  // with any mathematical library; its kurtosis is 2.9 instead of 3.
  [[nodiscard]] constexpr double gaussian(std::uint64_t n) const NONBLOCKING {
    double sum = -6;
    for (std::uint64_t i = 0; i < 12; ++i) {
      sum += uniform(12 * n + i);
    }
    return sum;
  }

 private:
  // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
  [[nodiscard]] static constexpr std::uint64_t mix(std::uint64_t z) NONBLOCKING {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }

  std::uint64_t key_;
};

}  // namespace punctum::sim
