// Runs a scene: starts the core and vision, watches and restarts, drains what they tell, and writes the
// report. The parent itself is an ordinary process: it may be slow, swap or die without moving the needle.
#pragma once

#include <cstdint>
#include <string>

#include "tools/scene.hpp"

namespace punctum::tools {

struct RunSettings {
  std::string report;               // folder; empty: reports/SCENE-DATE here
  std::uint64_t samples_every = 0;  // 0: every tick, of long runs every n-th
  bool frames = true;               // annotated frames
  bool figure = true;
  bool quiet = false;  // the summary only
};

// 0 the task ended well, 1 it ended without fault but is not done, 2 bad input, 3 a latched fault or a dead
// core.
[[nodiscard]] int run_scene(const Scene& scene, const RunSettings& settings);

}  // namespace punctum::tools
