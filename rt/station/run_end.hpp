// How a run ended: one word for all programs. The core writes what it knows of it into its segment; the
// parent, which also sees the simulated truth and the fate of the processes, says the rest.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

enum class RunEnd : std::uint8_t {
  running,
  done,           // the task ended well: all cells injected and clear, hand force at zero, stage at rest
                  // and nothing happened on the way that somebody should look into
  cell_lost,      // in truth: torn, pierced through or off the pipette; the parent knows
  not_injected,   // the end was reached but something was not injected; the parent knows
  time_limit,     // the limit came before the task was done
  stopped,        // by command or signal, before the task was done
  fault,          // latched
  core_died,      // the core was killed or crashed; the parent knows
  invalid_setup,  // bad input: nothing has moved
  underdosed,     // every cell got something, but one of them clearly less than was asked; the parent knows
  after_fault,    // the task ended well, but a fault was latched, and reset, on the way; the parent knows
  blind,  // a run without a task that rests on vision, which saw nothing for most of it; the parent knows
};
inline constexpr int kRunEnds = 12;

// As report.json has it.
[[nodiscard]] constexpr const char* name(RunEnd e) NONBLOCKING {
  constexpr const char* names[] = {"running",
                                   "done",
                                   "cell lost",
                                   "not injected",
                                   "time limit",
                                   "stopped",
                                   "fault",
                                   "core died",
                                   "invalid set-up",
                                   "injected in part",
                                   "done after a fault",
                                   "without vision"};
  static_assert(sizeof names == kRunEnds * sizeof names[0]);
  return names[static_cast<int>(e)];
}

}  // namespace punctum::rt
