// What the executive tells the servo of a tick. Plain data; it lies in no segment.
#pragma once

#include <cstdint>

namespace punctum::rt {

struct TickInfo {
  std::uint64_t tick = 0;              // of the absolute grid, from 0; gaps are missed releases
  std::int64_t release_ns = 0;         // of this tick on the grid
  std::int64_t start_ns = 0;           // when it really began; devices are read at this time
  double period_s = 0;                 // really elapsed since the previous tick
  std::uint64_t missed_in_window = 0;  // missed releases in the last ServoConfig::overrun_window_s
};

}  // namespace punctum::rt
