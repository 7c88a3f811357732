// The machine that a program runs on, as a report names it.
#pragma once

#include <string>

namespace punctum::tools {

struct MachineDescription {
  std::string host, processor, architecture, kernel;
  unsigned cores = 0;
  bool real_time_kernel = false;  // built with PREEMPT_RT
};

[[nodiscard]] MachineDescription this_machine();

}  // namespace punctum::tools
