#include "tools/shared/witness.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <utility>

namespace punctum::tools::late {
namespace {

constexpr const char* kProc = "/proc";
constexpr const char* kScheduler = "/sys/kernel/debug/sched/debug";
constexpr std::size_t kMostExplained = 256, kCountersKept = 64;
constexpr std::int64_t kLookAgain_ns = 20'000'000;
constexpr std::int64_t kBetweenTraces_ns = 100'000'000;  // reading one takes a while

bool in_virtual_machine() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("flags") && line.find(" hypervisor") != std::string::npos) {
      return true;
    }
  }
  return false;
}

}  // namespace

Witness::Witness(const rt::CoreStatus& status, int pid, int tid, bool traced)
    : status_(status), pid_(pid), tid_(tid), late_(status.late, status.late.head()) {
  surroundings_.virtual_machine = in_virtual_machine();
  if (traced) {
    auto trace = KernelTrace::start(tid);
    if (trace) {
      trace_.emplace(std::move(*trace));
      scheduler_ = surroundings_.virtual_machine ? kScheduler : "";
    } else {
      untraced_ = trace.error();
    }
  }
  counters_.push_back(read_counters(pid_, tid_, kProc, scheduler_));
}

void Witness::look() {
  const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  if (now_ns >= next_look_ns_) {
    next_look_ns_ = now_ns + kLookAgain_ns;
    look_at(read_counters(pid_, tid_, kProc, scheduler_), false);
  }
}

Explanations Witness::end() {
  look_at(read_counters(pid_, tid_, kProc, scheduler_), true);
  found_.more += late_.lost();
  return std::move(found_);
}

void Witness::look_at(const Counters& now, bool last) {
  const bool late = status_.late.head() > late_.position();
  const bool wait = trace_ && !last && now.t_ns < next_trace_ns_;
  if (late && !wait && found_.ticks.size() < kMostExplained) {
    std::vector<TraceEvent> events;
    traced_until_ns_ = std::chrono::steady_clock::now().time_since_epoch().count();
    if (trace_) {
      found_.trace = trace_->take();
      events = read_trace(found_.trace);
    }
    // One that ended after the trace did is explained by the next trace.
    rt::LateTick tick;
    while (status_.late.read(late_.position(), tick) != hal::Read::ok || last || !trace_ ||
           tick.end_ns <= traced_until_ns_) {
      if (late_.next(tick) != hal::Read::ok) {
        break;
      }
      if (found_.ticks.size() < kMostExplained) {
        found_.ticks.push_back(explain_one(tick, events, now));
      } else {
        ++found_.more;
      }
    }
    if (trace_) {
      next_trace_ns_ = std::chrono::steady_clock::now().time_since_epoch().count() + kBetweenTraces_ns;
    }
  } else if (late && !wait) {
    for (rt::LateTick tick; late_.next(tick) == hal::Read::ok;) {
      ++found_.more;
    }
  }
  counters_.push_back(now);
  if (counters_.size() > kCountersKept) {
    counters_.erase(counters_.begin());
  }
}

Explained Witness::explain_one(const rt::LateTick& late, const std::vector<TraceEvent>& events,
                               const Counters& now) const {
  Explained out;
  out.tick = late;
  if (late.longest_slot < std::min<std::uint64_t>(status_.slot_count.load(), rt::kMaxSlots)) {
    out.slot = status_.slots[late.longest_slot].name.text;
  }
  Episode tick{late.release_ns, late.wake_ns, late.end_ns, tid_, out.slot, late.longest_slot_ns};
  // Before this tick the others ran about as much as beside it.
  const Counters& oldest = counters_.front();
  const auto usual = [&](const Counters& before) {
    const std::int64_t t_ns = before.t_ns - oldest.t_ns;
    return t_ns > 0 ? static_cast<double>(rise(oldest.ran_ns, before.ran_ns).value_or(0)) /
                          static_cast<double>(t_ns)
                    : 1.0;  // nothing is known of them: they may have done all of it
  };
  // The narrowest pair around it that is there.
  const Counters* before = &counters_.front();
  const Counters* after = &now;
  for (const Counters& c : counters_) {
    if (c.t_ns <= late.release_ns) {
      before = &c;
    } else if (c.t_ns >= late.end_ns) {
      after = &c;
      break;
    }
  }
  tick.usual_share = usual(*before);
  out.verdict = trace_ && late.end_ns <= traced_until_ns_
                    ? explain(tick, events, *before, *after, surroundings_)
                    : explain(tick, *before, *after);
  return out;
}

}  // namespace punctum::tools::late
