#pragma once

#include <cstdint>

namespace punctum::rt::test {

// The servo's default tick.
inline constexpr double kTick_s = 1e-3;
inline constexpr std::int64_t kTick_ns = 1'000'000;

}  // namespace punctum::rt::test
