// Why a tick was late: from the kernel's trace of its processor, else from counters. What the evidence does
// not show is unknown; nothing is guessed.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools::late {

enum class Cause : std::uint8_t {
  unknown,
  interrupt,      // a hard or soft interrupt, or the thread of one
  preemption,     // another thread ran
  page_fault,     // of the loop's own thread
  own_computing,  // of a slot
  device_or_bus,  // a system call of the tick
  stolen_time,    // by the hypervisor
  smi,            // system management interrupt: the firmware
  sleeping_cpu,   // the processor's way out of a deep sleep
  frequency,      // the processor's frequency changed
  stopped,        // somebody stopped the process
};
[[nodiscard]] const char* name_of(Cause cause);

enum class Proof : std::uint8_t {
  none,
  counted,  // a counter rose in the interval that holds the tick
  traced,   // the kernel's trace shows it within the tick
};
[[nodiscard]] const char* name_of(Proof proof);

struct Verdict {
  Cause cause = Cause::unknown;
  std::string what;  // which interrupt, by whom, which slot; of an unknown one: what is known
  double us = 0;     // how much of the tick it took
  Proof proof = Proof::none;
};

// A late tick: from its release to the end of its last slot, in ns of CLOCK_MONOTONIC.
struct Episode {
  std::int64_t release_ns = 0, wake_ns = 0, end_ns = 0;
  int tid = 0;       // the loop's thread
  std::string slot;  // that took longest
  std::int64_t slot_ns = 0;
  // Of a processor, which the thread's other ticks take on average: counters hold theirs, too.
  double usual_share = 0;
};

struct TraceEvent {
  std::int64_t t_ns = 0;
  int cpu = 0, pid = 0;
  bool in_hard_interrupt = false;
  std::string comm, name, args;
};

// A line of the file `trace` of tracefs each (Documentation/trace/ftrace.rst); others are left out.
[[nodiscard]] std::vector<TraceEvent> read_trace(std::string_view text);

// Of the loop's thread and its machine, at one moment.
struct Counters {
  std::int64_t t_ns = 0;  // CLOCK_MONOTONIC
  std::uint64_t minor_faults = 0, major_faults = 0;
  std::optional<std::uint64_t> ran_ns, waited_ns;   // on a processor; runnable, but another ran: schedstat
  int cpu = -1;                                     // where it ran last
  std::optional<std::uint64_t> stolen_ms;           // of that processor, in steps of 10 ms
  std::optional<std::uint64_t> stolen_ns;           // the same to the nanosecond
  std::optional<std::uint64_t> smis;                // of processor 0
  std::map<std::string, std::uint64_t> interrupts;  // by name, all processors together
};
// Below `proc` ("/proc"). Takes some 0.1 ms: for an ordinary thread. `scheduler`: the kernel's account of its
// run queues, whose two clocks differ by the stolen time; root's, and another 0.6 ms. Empty: it is not asked.
[[nodiscard]] Counters read_counters(int pid, int tid, const std::string& proc = "/proc",
                                     const std::string& scheduler = "");

// By how much a count rose; empty where either is not told, or it fell.
[[nodiscard]] std::optional<std::uint64_t> rise(const std::optional<std::uint64_t>& before,
                                                const std::optional<std::uint64_t>& after);
// System management interrupts of processor 0 so far, where an Intel processor shows them to root.
[[nodiscard]] std::optional<std::uint64_t> smi_count();

// What does not change while one looks.
struct Surroundings {
  bool virtual_machine = false;
};

// Events of all processors in the order of their time. `before` and `after` enclose the tick.
[[nodiscard]] Verdict explain(const Episode& tick, const std::vector<TraceEvent>& events,
                              const Counters& before, const Counters& after,
                              const Surroundings& surroundings);
// Without a trace.
[[nodiscard]] Verdict explain(const Episode& tick, const Counters& before, const Counters& after);

}  // namespace punctum::tools::late
