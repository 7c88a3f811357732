// Makes the calling thread a real-time one, as far as this machine and user allow, and says what is missing
// and how to get it. Set-up only: may block and allocate. It never refuses: without a right that real time
// needs, the core runs visibly degraded.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rt/platform/kernel_facts.hpp"
#include "rt/station/core_status.hpp"

namespace punctum::rt {

// A thread with real-time priority that spins for so long without sleeping gets SIGXCPU, and SIGKILL after
// the longer time: it must not keep everybody else from its CPU for good. A tick that is merely late is a
// matter of the overrun window, which acts after some 20 ms.
inline constexpr double kSpinLimit_s = 0.1;
inline constexpr double kSpinKill_s = 0.5;

struct RightsWanted {
  int priority = 80;  // SCHED_FIFO, 1 .. 98; the interrupt threads of its devices belong above
  int cpu = -1;       // the CPU the thread is bound to; -1: none
  std::size_t stack_bytes = 512 << 10;  // touched before the loop
};

struct RightFound {
  std::string name;
  std::string detail = {};  // what was found
  std::string remedy = {};  // how to get it; empty when got
  bool got = false;
  bool required = false;  // without it: degraded
};

class RealTimeRights {
 public:
  // Takes what it can get; for the thread that will run the loop, after all else is set up and mapped. Not
  // for a virtual clock, which never sleeps: a real-time priority would keep everyone else from the CPU.
  [[nodiscard]] static RealTimeRights acquire(const RightsWanted& wanted);
  // The same table: what acquire() would get, for this user and these limits. Nothing is changed at its end;
  // the calling thread is on the CPU for a moment.
  [[nodiscard]] static RealTimeRights examine(const RightsWanted& wanted);

  RealTimeRights(RealTimeRights&& other) noexcept;
  RealTimeRights& operator=(RealTimeRights&&) = delete;
  ~RealTimeRights();  // lets the CPUs sleep again

  [[nodiscard]] const std::vector<RightFound>& table() const { return table_; }
  [[nodiscard]] bool degraded() const;
  void publish(CoreStatus& status) const;  // into the station

 private:
  RealTimeRights() = default;
  static RealTimeRights find(const RightsWanted& wanted, bool apply);
  std::vector<RightFound> table_;
  int dma_latency_fd_ = -1;  // while it is open, no CPU enters a deep sleep
};

// Gives up every capability of the calling thread, for good: once priority, locked memory and devices are
// there, the loop needs none. A device's own threads that started before keep theirs.
[[nodiscard]] bool drop_capabilities() noexcept;

// The calling thread has ordinary priority again: what a process does at its end may take long and wait for
// threads that a real-time one would keep from running.
void leave_real_time() noexcept;

// Touches every page of a mapping and changes nothing in it.
void prefault(const void* data, std::size_t size);
void prefault_writable(void* data, std::size_t size);  // atomically: others may write meanwhile

// Of the calling thread (getrusage RUSAGE_THREAD), since it began. A system call: not for the tick.
struct ThreadCounters {
  std::uint64_t minor_faults = 0;
  std::uint64_t major_faults = 0;
  std::uint64_t voluntary_switches = 0;
  std::uint64_t involuntary_switches = 0;
};
[[nodiscard]] ThreadCounters read_thread_counters() noexcept;

// What the thread counted between the two calls, which stand around the loop, and its heap calls.
void publish_counters(const ThreadCounters& before, const ThreadCounters& after, std::uint64_t allocations,
                      bool allocations_watched, CoreStatus& status);

}  // namespace punctum::rt
