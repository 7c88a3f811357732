#include "tools/punctum/judge.hpp"

#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

using rt::RunEnd;

// A run that came to its end: whether something happened on the way that somebody should look into.
RunEnd ended_well(const rt::CoreStatus& core) {
  constexpr std::uint64_t kNoFaults =
      1ULL << static_cast<unsigned>(rt::Fault::none) | 1ULL << static_cast<unsigned>(rt::Fault::command_stop);
  return (core.faults_latched.load() & ~kNoFaults) != 0 ? RunEnd::after_fault : RunEnd::done;
}

// Without a task a run shows what vision sees, or it shows nothing.
RunEnd ended_without_task(const RunFacts& facts, const rt::CoreStatus& core, const Measures& measures) {
  const bool blind = facts.has_vision && (facts.found_nothing || 2 * measures.blind_ticks > measures.ticks);
  const RunEnd end = ended_well(core);
  return end == RunEnd::done && blind ? RunEnd::blind : end;
}

}  // namespace

RunEnd judge(const RunFacts& facts, const rt::CoreStatus& core, const Measures& measures) {
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
    return facts.has_task || facts.vision_over || !outside ? RunEnd::stopped
                                                           : ended_without_task(facts, core, measures);
  }
  if (!facts.has_task) {
    return ended_without_task(facts, core, measures);
  }
  if (measures.cells_lost > 0) {
    return RunEnd::cell_lost;
  }
  // At the limit the needle is drawn out, and the cell is clear although nobody has tried to inject it.
  if (core.run_end.load() == static_cast<std::uint64_t>(RunEnd::time_limit)) {
    return RunEnd::time_limit;
  }
  // The core knows that it opened the gate; the simulated world, whether anything came out, and how much.
  if (!facts.samples_lost && measures.cells_without_injection > 0) {
    return RunEnd::not_injected;
  }
  if (!facts.samples_lost && measures.cells_underdosed > 0) {
    return RunEnd::underdosed;
  }
  if (core.task_finished.load() != 0) {
    return ended_well(core);
  }
  const bool at_limit = end == RunEnd::time_limit;
  return clear && !at_limit ? RunEnd::not_injected : RunEnd::time_limit;
}

}  // namespace punctum::tools
