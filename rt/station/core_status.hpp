// What the core says of itself beside its telemetry: plain words that may be read at any time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "hal/ipc/exchange.hpp"
#include "hal/realtime.hpp"
#include "rt/station/late_tick.hpp"

namespace punctum::rt {

using hal::Word;

// A short text that is written before its table is announced and never changed afterwards.
template <std::size_t N>
struct Text {
  char text[N] = {};
  void set(const char* from) NONBLOCKING {
    std::size_t n = 0;
    while (n + 1 < N && from[n] != '\0') {  // at most N rounds
      ++n;
    }
    std::memcpy(text, from, n);
    text[n] = '\0';
  }
};

// One right that real-time work needs: got or not, and how to get it.
struct Right {
  Text<32> name;
  Text<192> detail;  // what was found
  Text<280> remedy;  // how to get it; empty when got
  std::uint32_t got = 0;
  std::uint32_t required = 0;  // 1: without it the core runs visibly degraded; 0: advice
};

inline constexpr std::size_t kMaxRights = 16;
inline constexpr std::size_t kMaxSlots = 8;
inline constexpr std::size_t kHistogramBins = 2000;  // of 1 us
using TimeHistogram = hal::Histogram<kHistogramBins>;

// One slot of the executive.
struct SlotStatus {
  Text<32> name;
  Word divisor{};
  Word runs{};
  Word skipped{};           // its releases that passed without a run
  TimeHistogram wake;       // release on the grid -> start of the slot
  TimeHistogram execution;  // start -> end of the slot
};

// Written by the core alone, may be read live.
struct CoreStatus {
  Word pid{};
  Word started{};            // 1 from the first tick on
  Word start_ns{};           // release of tick 0, station clock
  Word period_ns{};          // of the base tick
  Word ticks{};              // executed
  Word tick_index{};         // of the newest tick on the grid
  Word missed{};             // releases skipped, since the start
  Word missed_in_window{};   // of them inside the sliding window
  Word worst_lateness_ns{};  // wake-up after the release
  Word degraded{};           // 1: a required right is missing
  Word fault{};              // rt::Fault, the latched first cause
  Word faults_latched{};     // bit f: rt::Fault f was latched in this run
  Word phase{};              // rt::Phase
  Word task_finished{};      // 1: `clear` of the last cell was reached, all injected
  Word run_end{};            // rt::RunEnd
  Word commands_refused{};   // out of range, or not the writer's to ask

  // Of the real-time thread, from the start of the loop to its end (getrusage RUSAGE_THREAD).
  Word minor_faults{};
  Word major_faults{};
  Word voluntary_switches{};
  Word involuntary_switches{};
  Word allocations{};          // heap calls of the real-time thread within the loop
  Word allocations_watched{};  // 1: the trap was there
  Word counters_final{};       // 1: the loop has ended and the six words above are whole

  Word rights_count{};  // stored last: the table before it is then whole
  Right rights[kMaxRights];

  TimeHistogram wake;  // release -> wake-up of the thread
  TimeHistogram tick;  // wake-up -> end of the last slot
  Word slot_count{};   // stored last: the names before it are then whole
  SlotStatus slots[kMaxSlots];

  LateRing late;  // the newest ticks that ended too late
};

}  // namespace punctum::rt
