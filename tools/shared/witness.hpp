// Watches a loop and explains its late ticks, for an ordinary thread that looks from time to time. The loop
// itself does nothing for it but to note them in its status.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/station/core_status.hpp"
#include "tools/shared/cause.hpp"
#include "tools/shared/kernel_trace.hpp"

namespace punctum::tools::late {

struct Explained {
  rt::LateTick tick;
  std::string slot;  // that took longest
  Verdict verdict;
};

// What an end of the watch leaves.
struct Explanations {
  std::vector<Explained> ticks;  // the first kMostExplained
  std::uint64_t more = 0;        // late ticks beyond them, or overwritten before they were read
  std::string trace;             // of the last one, as the kernel tells it; empty: there was none
};

class Witness {
 public:
  // Of the loop that writes `status`, whose thread is `tid` of process `pid`. traced: by the kernel's trace,
  // which costs every processor some microseconds per event; the reason why not stands in untraced().
  Witness(const rt::CoreStatus& status, int pid, int tid, bool traced);

  [[nodiscard]] const std::string& untraced() const { return untraced_; }
  // To be called every few milliseconds; it does something at most every 20 ms.
  void look();
  // Explains what has not been explained yet.
  [[nodiscard]] Explanations end();

 private:
  void look_at(const Counters& now, bool last);
  [[nodiscard]] Explained explain_one(const rt::LateTick& late, const std::vector<TraceEvent>& events,
                                      const Counters& now) const;

  const rt::CoreStatus& status_;
  int pid_, tid_;
  Surroundings surroundings_;
  std::string scheduler_;  // where it tells the stolen time to the nanosecond
  std::optional<KernelTrace> trace_;
  std::string untraced_;
  hal::Follower<rt::LateRing> late_;
  std::vector<Counters> counters_;  // the newest last
  Explanations found_;
  std::int64_t next_look_ns_ = 0, next_trace_ns_ = 0, traced_until_ns_ = 0;
};

}  // namespace punctum::tools::late
