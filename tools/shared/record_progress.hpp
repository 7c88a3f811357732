// How far the recording of a run has come, in shared memory: up to when it is whole if it ends early, in
// virtual time what the station waits for, and whether it has come to the run's end.
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
  static constexpr std::uint64_t kVersion = 3;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  std::atomic<std::uint64_t> taken{0};      // ticks, from the first on
  std::atomic<std::uint64_t> lost_from{0};  // 1 more than the ticks before the first that was lost; 0: none
  std::atomic<std::uint64_t> ended{0};      // 1: the core was over, and all that it had told was taken
};
inline constexpr std::uint64_t RecordProgress::kLayout =
    hal::fingerprint(RecordProgress::kVersion, sizeof(RecordProgress), offsetof(RecordProgress, taken),
                     offsetof(RecordProgress, lost_from), offsetof(RecordProgress, ended));

}  // namespace punctum::tools
