// Makes the calling thread a real-time one, as far as this machine and user allow, and says what is missing
// and how to get it. Set-up only: may block and allocate. It never refuses: without a right that real time
// needs, the core runs visibly degraded.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rt/platform/kernel_facts.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {

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
  // The same table without changing anything: what acquire() would get, for this user and these limits.
  [[nodiscard]] static RealTimeRights examine(const RightsWanted& wanted);

  RealTimeRights(RealTimeRights&& other) noexcept;
  RealTimeRights& operator=(RealTimeRights&&) = delete;
  ~RealTimeRights();  // lets the CPU sleep again

  [[nodiscard]] const std::vector<RightFound>& table() const { return table_; }
  [[nodiscard]] bool degraded() const;
  void publish(CoreStatus& status) const;  // into the station

 private:
  RealTimeRights() = default;
  static RealTimeRights go(const RightsWanted& wanted, bool apply);
  std::vector<RightFound> table_;
  int dma_latency_fd_ = -1;  // while open, no CPU enters a deep sleep
};

// Touches every page of a mapping, writing nothing that changes it.
void prefault(const void* data, std::size_t size);
void prefault_writable(void* data, std::size_t size);  // shared words are left as they are, atomically

// Of the calling thread (getrusage RUSAGE_THREAD), since it began. A system call: not for the tick.
struct ThreadCounters {
  std::uint64_t minor_faults = 0;
  std::uint64_t major_faults = 0;
  std::uint64_t voluntary_switches = 0;
  std::uint64_t involuntary_switches = 0;
};
[[nodiscard]] ThreadCounters read_thread_counters() noexcept;

// Around the loop: what the thread suffered between its two calls, and its heap calls.
void publish_counters(const ThreadCounters& before, const ThreadCounters& after, std::uint64_t allocations,
                      bool allocations_watched, CoreStatus& status);

}  // namespace punctum::rt
