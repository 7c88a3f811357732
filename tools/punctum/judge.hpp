// How a run ended, from what the core says, what the processes came to and what is so in the simulated world.
#pragma once

#include "rt/station/core_status.hpp"
#include "rt/station/run_end.hpp"
#include "tools/punctum/measures.hpp"

namespace punctum::tools {

struct RunFacts {
  bool core_exited = false;     // by itself; otherwise it was killed or crashed
  bool stop_was_asked = false;  // by a signal to the parent
  bool vision_over = false;     // it ended before the core did
  bool has_task = false;        // of the scene
  bool has_vision = false;      // of the scene
  bool found_nothing = false;   // in more than half of the pictures
  bool samples_lost = false;    // a dose that was given may lie in them
};

[[nodiscard]] rt::RunEnd judge(const RunFacts& facts, const rt::CoreStatus& core, const Measures& measures);

}  // namespace punctum::tools
