// What a measurement found: distributions, spikes, counters and the machine; as JSON, as cyclictest's
// histogram, and as a figure for the terminal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "tools/shared/witness.hpp"

namespace punctum::jitter {

// Counts of durations in bins of 1 us: count[k] holds [k, k+1) us. What is longer is counted in `longer`.
struct Distribution {
  std::vector<std::uint64_t> count;
  std::uint64_t longer = 0;
  double max_us = 0;

  [[nodiscard]] std::uint64_t entries() const;
  // The value that `part` (0 .. 1) of all entries does not exceed, between the edges of its bin; max_us where
  // it is longer than the bins. 0 without entries.
  [[nodiscard]] double quantile_us(double part) const;
  // Whether at least one entry lies beyond that quantile; else it only says how late the latest was.
  [[nodiscard]] bool tells(double part) const;
};

// What a growing distribution holds more than it held before; after: with all its bins, be they empty. Of
// what is longer than the bins but not than all before it is not told how long: max_us is the end of the
// bins then.
[[nodiscard]] Distribution since(const Distribution& before, const Distribution& after);

// A wake-up that was later than all before it.
struct Spike {
  double t_s = 0;  // of the release that it slept for, since the first one
  double wake_us = 0;
};

struct Result {
  double rate_Hz = 0, seconds = 0;
  int cpu = -1;
  int priority = 0;                  // of SCHED_FIFO; 0: none
  bool degraded = false;             // a right that real time needs is missing
  std::vector<std::string> missing;  // which
  std::uint64_t ticks = 0, missed = 0;
  Distribution wake;      // release -> wake-up
  Distribution tick;      // wake-up -> end of the tick
  Distribution interval;  // end of a tick -> end of the next one
  // From a change outside to the loop's answer outside, where that was measured; of so many no answer came.
  std::string answered;  // what to what
  Distribution answer;
  double answer_min_us = 0;
  std::uint64_t unanswered = 0;
  std::vector<Spike> spikes;
  // Of the loop's thread while it was measured, system management interrupts of the machine; empty where the
  // kernel or the processor does not tell.
  std::optional<std::uint64_t> minor_faults, major_faults, voluntary_switches, involuntary_switches;
  std::optional<std::uint64_t> migrations, smis;
  std::uint64_t allocations = 0;
  bool allocations_watched = false;
  // Wake-ups of equal parts of the measurement: what differs between them is not the machine's.
  std::vector<Distribution> parts;
  std::vector<std::uint64_t> missed_in_parts;               // releases, of each part; empty: not told
  std::vector<std::pair<std::string, Distribution>> slots;  // of a tick that does something: execution times
  // Ticks that ended too late, each with its cause; of so many more there was no room or no time to tell.
  std::vector<tools::late::Explained> explained;
  std::uint64_t unexplained = 0;
  std::int64_t first_release_ns = 0;  // CLOCK_MONOTONIC, as the kernel's log and trace tell it
  std::string untraced;               // why the kernel's trace could not be asked
  std::string trace;                  // of the last explained tick
  bool broke = false;                 // a wake-up was too late and ended it
  bool stopped_ticking = false;       // a running core that was looked at; seconds ends there
  std::string work;                   // that each tick did; empty: nothing
  std::string load;                   // that ran beside it; empty: none of ours
  std::string machine;  // kernel, processor, boot line: two results with the same text are comparable
};

[[nodiscard]] std::string json_of(const Result& result);
// The error is one line that says where and what is allowed.
[[nodiscard]] tl::expected<Result, std::string> result_of_json(std::string_view text);

// As `cyclictest -h` writes it.
[[nodiscard]] std::string histogram_text(const Distribution& wake);

// Quantiles and the figure, `columns` wide.
[[nodiscard]] std::string summary(const Result& result, int columns);

}  // namespace punctum::jitter
