// The task: the phase of the injection, the cells that were entered and injected, and when the run ends.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/cell_observer.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/phases.hpp"
#include "rt/control/requests.hpp"
#include "rt/forces/fixture.hpp"

namespace punctum::rt {

struct TaskFacts {
  Phase phase = Phase::free;
  bool inside_cell = false;                 // from the puncture until the needle is clear
  bool punctured = false;                   // from the puncture until the next cell
  bool contact_or_puncture_begins = false;  // on this tick
  bool new_cell = false;                    // on this tick
  bool may_inject = false;                  // inside, and the innermost membrane is seen to be through
  FixtureFrame insertion;                   // tip and axis at the puncture
  std::uint32_t cell = 0;                   // counts cells of this run from 0
  bool done = false;  // every cell was entered and left, and injected where there is an injector
  std::uint32_t alarms = 0;

  // Outside, a needle may turn, and a run may end.
  [[nodiscard]] bool outside() const NONBLOCKING { return phase == Phase::free || phase == Phase::clear; }
};

class Task {
 public:
  explicit Task(const ServoConfig& config) NONBLOCKING;

  const TaskFacts& step(const Readings& readings, const CellFacts& cell, double dt_s) NONBLOCKING;

  // The task is over, or an end was requested and the needle is where the run may end.
  [[nodiscard]] bool ending(const Requested& requested) const NONBLOCKING {
    return over_ || requested.end_here || (requested.end && facts_.outside());
  }
  [[nodiscard]] std::uint32_t cells_done() const NONBLOCKING { return cells_done_; }
  [[nodiscard]] const TaskFacts& facts() const NONBLOCKING { return facts_; }

 private:
  void count_cells(const Phases& phases) NONBLOCKING;

  std::optional<Phases> phases_;
  std::uint32_t cells_wanted_;  // 0: no end
  bool has_injector_;
  bool has_inner_membrane_;
  TaskFacts facts_;
  bool press_begins_here_ = false;  // of the inject button: it was up where an injection may begin
  bool injected_ = false;           // this cell, as the injector reported
  std::uint32_t cells_done_ = 0;
  std::uint32_t cells_injected_ = 0;
  std::uint32_t cells_begun_ = 0;  // after the first one
  bool over_ = false;
};

}  // namespace punctum::rt
