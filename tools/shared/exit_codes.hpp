// What a program's exit code says, the same for all programs.
#pragma once

#include "rt/station/run_end.hpp"

namespace punctum::tools {

enum ExitCode : int {
  exit_done = 0,       // the task ended well
  exit_not_done = 1,   // it ended without fault, but is not done, or what it leaves is not complete
  exit_bad_input = 2,  // nothing was started
  exit_fault = 3,      // a latched fault, also one that was reset, or a core that died
};

[[nodiscard]] constexpr ExitCode exit_code(rt::RunEnd e) noexcept {
  switch (e) {
    case rt::RunEnd::done:
      return exit_done;
    case rt::RunEnd::running:
    case rt::RunEnd::cell_lost:
    case rt::RunEnd::not_injected:
    case rt::RunEnd::time_limit:
    case rt::RunEnd::stopped:
    case rt::RunEnd::underdosed:
    case rt::RunEnd::blind:
      return exit_not_done;
    case rt::RunEnd::invalid_setup:
      return exit_bad_input;
    case rt::RunEnd::fault:
    case rt::RunEnd::core_died:
    case rt::RunEnd::after_fault:
      return exit_fault;
  }
  return exit_fault;
}

}  // namespace punctum::tools
