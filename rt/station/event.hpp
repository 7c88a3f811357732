// What happened, and when: the few things of a run that are told one by one, beside the telemetry of every
// tick. Plain data, lives in shared memory; it outlives the core.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/station/alarm.hpp"
#include "rt/station/command.hpp"
#include "rt/station/fault.hpp"
#include "rt/station/phase.hpp"
#include "rt/station/run_end.hpp"

namespace punctum::rt {

struct Event {
  enum Kind : std::uint64_t {
    none,
    fault,          // latched; what: Fault
    fault_cleared,  // by release and reset; what: the Fault it was
    alarm_on,       // what: bit of Alarm
    alarm_off,      // likewise
    phase,          // entered; what: Phase; value: number of the cell
    command,  // obeyed; what: Command::Kind; value and target as given; writer: place in kCommandWriters
    command_refused,  // likewise
    ended,            // the core's last word, after its shut-down; what: RunEnd
  };
  std::uint64_t tick = 0;  // of the absolute grid
  double t_s = 0;          // since the start of the run
  std::uint64_t kind = none;
  std::uint64_t what = 0;
  double value = 0;
  std::uint32_t writer = 0;
  std::uint32_t target = 0;
};
inline constexpr int kEventKinds = 9;

// As report.json has it.
[[nodiscard]] constexpr const char* name(Event::Kind kind) NONBLOCKING {
  constexpr const char* names[] = {"none",  "fault",   "fault_cleared",   "alarm_on", "alarm_off",
                                   "phase", "command", "command_refused", "ended"};
  static_assert(sizeof names == kEventKinds * sizeof names[0]);
  return names[static_cast<int>(kind)];
}

}  // namespace punctum::rt
