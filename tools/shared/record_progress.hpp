// How far the recording of a run has come, in shared memory: up to when it is whole if it ends early, and in
// virtual time what the station waits for.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/ipc/segment.hpp"

namespace punctum::tools {

// Written by punctum-record alone.
struct RecordProgress {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x0064726f63655250ULL;  // "PRecord"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  std::atomic<std::uint64_t> taken{0};  // ticks, from the first on
};
inline constexpr std::uint64_t RecordProgress::kLayout =
    hal::fingerprint(RecordProgress::kVersion, sizeof(RecordProgress), offsetof(RecordProgress, taken));

}  // namespace punctum::tools
