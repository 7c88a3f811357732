// The executive of the core with an empty tick, on this machine.
#pragma once

#include <tl/expected.hpp>

#include "tools/jitter/result.hpp"

namespace punctum::jitter {

struct Wanted {
  double rate_Hz = 1000;  // 1 .. 20 000
  double seconds = 10;    // 0.1 .. 604 800
  int cpu = -1;           // -1: where the scheduler puts it
  int priority = 80;      // SCHED_FIFO
};

// Runs the loop on this very thread; a stop signal ends it, and the result is that of the time until then.
// Ordinary priority is back at the end. The error says what cannot be measured so.
[[nodiscard]] tl::expected<Result, std::string> measure(const Wanted& wanted);

}  // namespace punctum::jitter
