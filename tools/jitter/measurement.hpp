// The executive of the core on this machine, with an empty tick or with the slots that it is given.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/executive/executive.hpp"
#include "tools/jitter/result.hpp"

namespace punctum::jitter {

struct Wanted {
  double rate_Hz = 1000;  // 1 .. 20 000
  double seconds = 10;    // 0.1 .. 604 800
  int cpu = -1;           // -1: where the scheduler puts it
  int priority = 80;      // SCHED_FIFO
  // A tick that ends later than this after its release is explained, by the kernel's trace; 0: one that ends
  // later than a period, by counters alone.
  double explain_us = 0;
  double break_us = 0;  // the first wake-up later than this ends the measurement and is explained; 0: none
};

// What a tick does.
struct Work {
  std::vector<rt::Slot> slots = {};  // in their order; none: nothing
  // Called when memory is locked and priority is taken, before the first release.
  std::function<tl::expected<void, std::string>(std::int64_t first_release_ns, bool degraded)> start = {};
};

// Runs the loop on this very thread; a stop signal ends it, and the result is that of the time until then.
// Ordinary priority is back at the end. The error says what cannot be measured so.
[[nodiscard]] tl::expected<Result, std::string> measure(const Wanted& wanted, const Work& work = {});

// The core of the station of this name, which runs and is only looked at: what its histograms hold more after
// wanted.seconds than before. Its rate, CPU and priority are its own.
[[nodiscard]] tl::expected<Result, std::string> attach(const std::string& station, const Wanted& wanted);

}  // namespace punctum::jitter
