// The inputs of a recorded run through today's servo again, tick by tick, and what it makes of them beside
// what was recorded.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

struct Difference {
  std::uint64_t tick = 0;
  double t_s = 0;
  std::string field, recorded, now;
  std::size_t more = 0;  // further fields that differ at this tick
};

struct Replayed {
  std::uint64_t ticks = 0;            // compared, bit by bit; the one that differs included
  double end_s = 0;                   // of the run, at the last of them
  std::uint64_t not_told = 0;         // ticks whose telemetry is not in the recording
  std::uint64_t not_known = 0;        // whose phase, fault, stop or time is none that this build knows
  std::uint64_t not_given = 0;        // recorded ticks whose input is not in the recording
  std::optional<Difference> differs;  // the first one; nothing is replayed after it
  std::string ends;                   // why it ends before the run did, in a line; empty if it does not
};

// The error is one line: no recording, or none that holds the inputs of a run from its first tick on.
[[nodiscard]] tl::expected<Replayed, std::string> replay_inputs(const std::string& recording);

}  // namespace punctum::tools
