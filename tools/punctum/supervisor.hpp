// Runs a scene: starts core and vision, watches and restarts them, records their telemetry and writes the
// report. The parent itself is an ordinary process: it may be slow, swap or die without moving the needle.
#pragma once

#include <cstdint>
#include <string>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

struct RunSettings {
  std::string report;               // folder; empty: reports/SCENE-DATE here
  std::uint64_t samples_every = 0;  // 0: every tick, of long runs every n-th
  bool frames = true;               // annotated frames
  bool figure = true;
  bool overwrite = false;  // an earlier report in the folder
  bool quiet = false;      // the summary only
  bool pictures = false;   // likewise, the pictures that vision looks at
  bool record = false;     // recording.mcap beside the report
  bool console = false;    // with punctum-console beside it
};

// Returns an ExitCode.
[[nodiscard]] int run_scene(const Scene& scene, const RunSettings& settings);

}  // namespace punctum::tools
