// What the fingers of whoever holds the hand on the operator's page do, as the console tells it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/ipc/exchange.hpp"

namespace punctum::browser {

struct Fingers {
  double moved_m[3] = {};     // since they took the hand; device frame: x right, y up, z towards the operator
  std::int64_t told_ns = 0;   // monotonic clock
  std::uint64_t session = 0;  // another number each time that somebody takes the hand; 0: nobody has it
  std::uint32_t buttons = 0;  // hal::kButton...
  std::uint32_t reserved = 0;
};

// Written by the console alone.
struct FingersSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x7265676e69665050ULL;  // "PPfinger"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  hal::SeqRing<Fingers, 4> newest;
};
inline constexpr std::uint64_t FingersSegment::kLayout = hal::fingerprint(
    FingersSegment::kVersion, sizeof(FingersSegment), sizeof(Fingers), offsetof(FingersSegment, newest));

}  // namespace punctum::browser
