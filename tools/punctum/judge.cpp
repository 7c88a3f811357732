#include "tools/punctum/judge.hpp"

#include "tools/shared/station_values.hpp"

namespace punctum::tools {

rt::RunEnd judge(const RunFacts& facts, const rt::CoreStatus& core, const Measures& measures) {
  using rt::RunEnd;
  // A core that ends in order says how it ended.
  const auto end = run_end_in(core.run_end.load());
  const bool said_nothing = !end || *end == RunEnd::running;
  if (!facts.core_exited || (said_nothing && !facts.stop_was_asked)) {
    return RunEnd::core_died;
  }
  const auto fault = fault_in(core.fault.load());
  if (!fault) {
    return RunEnd::fault;  // a core that names no fault that exists is defective
  }
  if (*fault != rt::Fault::none && *fault != rt::Fault::command_stop) {
    return RunEnd::fault;
  }
  const auto phase = phase_in(core.phase.load());
  const bool clear = phase == rt::Phase::clear;
  if (facts.stop_was_asked || *fault == rt::Fault::command_stop) {
    // A scene without a task has no end of its own: whoever ends it outside a cell ends it well.
    const bool outside = clear || phase == rt::Phase::free;
    return facts.has_task || facts.vision_over || !outside ? RunEnd::stopped : RunEnd::done;
  }
  if (!facts.has_task) {
    return RunEnd::done;
  }
  if (measures.cells_lost > 0) {
    return RunEnd::cell_lost;
  }
  // The core knows that it opened the gate; the simulated world, whether anything came out.
  if (measures.cells_without_injection > 0) {
    return RunEnd::not_injected;
  }
  if (core.task_finished.load() != 0) {
    return RunEnd::done;
  }
  const bool at_limit = end == RunEnd::time_limit;
  return clear && !at_limit ? RunEnd::not_injected : RunEnd::time_limit;
}

}  // namespace punctum::tools
