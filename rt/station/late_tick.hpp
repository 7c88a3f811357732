// A tick that ended too long after its release. Plain data, lives in shared memory.
#pragma once

#include <cstdint>

#include "hal/ipc/exchange.hpp"

namespace punctum::rt {

// Times are of the station's clock. Who reads it explains it (tools/shared/cause.hpp).
struct LateTick {
  std::uint64_t index = 0;  // of the release that it slept for
  std::int64_t release_ns = 0;
  std::int64_t wake_ns = 0;
  std::int64_t end_ns = 0;         // of its last slot
  std::uint64_t missed = 0;        // releases that passed meanwhile
  std::uint64_t longest_slot = 0;  // its place in CoreStatus::slots
  std::int64_t longest_slot_ns = 0;
};

using LateRing = hal::SeqRing<LateTick, 128>;

}  // namespace punctum::rt
