// A recording as tables, message by message, in bounded memory. What was recorded before the recording was
// cut off or damaged is exported all the same, and the words say where it ends.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

struct Exported {
  std::uint64_t ticks = 0, events = 0, observations = 0;
  std::uint64_t unknown_ticks = 0;  // left out: of a phase, fault, stop or time that this build does not know
  std::string ends;                 // why the tables are not the whole run, in a line; empty if they are
};

// samples.csv and events.csv as the run wrote them, scene.toml, and observations.csv, into a folder that may
// be there and holds none of them. The error is one line: nothing could be read or written.
[[nodiscard]] tl::expected<Exported, std::string> export_csv(const std::string& recording,
                                                             const std::string& folder);

}  // namespace punctum::tools
