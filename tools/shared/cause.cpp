#include "tools/shared/cause.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <fstream>
#include <sstream>
#include <utility>

namespace punctum::tools::late {

std::optional<std::uint64_t> rise(const std::optional<std::uint64_t>& before,
                                  const std::optional<std::uint64_t>& after) {
  if (!before || !after || *after < *before) {
    return std::nullopt;
  }
  return *after - *before;
}

namespace {

constexpr std::int64_t kNs = 1000;           // the trace tells whole microseconds
constexpr int kFifoPriority = 99;            // the kernel's priority of SCHED_FIFO p is 99 - p
constexpr int kLowestRealTime = 98;          // above it: ordinary
constexpr std::int64_t kWithin_ns = 50'000;  // between the handlers of one interrupt
constexpr std::int64_t kFault_ns = 20'000;   // a fault in so much of computing explains it

// ---- the text of the trace ----

template <class Number>
bool take(std::string_view& text, Number& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc{}) {
    return false;
  }
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

void skip_blanks(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
}

// "  comm-123     [001] d.h1.  2694.092014: name: args"; a comm may hold blanks, dashes and brackets.
std::optional<TraceEvent> read_line(std::string_view line) {
  TraceEvent e;
  for (std::size_t at = line.find(" ["); at != std::string_view::npos; at = line.find(" [", at + 1)) {
    std::string_view rest = line.substr(at + 2);
    if (!take(rest, e.cpu) || !rest.starts_with("] ")) {
      continue;
    }
    rest.remove_prefix(2);
    // The flags; the third tells hard and soft interrupts.
    e.in_hard_interrupt = rest.size() > 2 && (rest[2] == 'h' || rest[2] == 'H');
    rest.remove_prefix(std::min(rest.find(' '), rest.size()));
    skip_blanks(rest);
    std::int64_t s = 0, us = 0;
    if (!take(rest, s) || !rest.starts_with('.')) {
      continue;
    }
    rest.remove_prefix(1);
    if (!take(rest, us) || !rest.starts_with(": ")) {
      continue;
    }
    rest.remove_prefix(2);
    e.t_ns = s * 1'000'000'000 + us * kNs;
    const std::size_t colon = rest.find(':');
    if (colon == std::string_view::npos) {
      return std::nullopt;
    }
    e.name = rest.substr(0, colon);
    rest.remove_prefix(colon + 1);
    skip_blanks(rest);
    e.args = rest;
    std::string_view task = line.substr(0, at);
    task = task.substr(0, task.find_last_not_of(' ') + 1);
    const std::size_t dash = task.rfind('-');
    if (dash == std::string_view::npos) {
      return std::nullopt;
    }
    std::string_view pid = task.substr(dash + 1);
    if (!take(pid, e.pid)) {
      return std::nullopt;
    }
    task = task.substr(0, dash);
    skip_blanks(task);
    e.comm = task;
    return e;
  }
  return std::nullopt;
}

// What stands after "key=", up to " next=" or the end: a comm may hold blanks.
std::string_view value(std::string_view args, std::string_view key) {
  std::size_t at = 0;
  for (;; ++at) {
    at = args.find(key, at);
    if (at == std::string_view::npos) {
      return {};
    }
    if ((at == 0 || args[at - 1] == ' ') && args.substr(at + key.size()).starts_with('=')) {
      break;
    }
  }
  std::string_view rest = args.substr(at + key.size() + 1);
  const std::size_t next = rest.find('=');
  if (next != std::string_view::npos) {
    rest = rest.substr(0, next);
    rest = rest.substr(0, std::min(rest.rfind(' '), rest.size()));
    if (rest.ends_with(" ==>")) {
      rest.remove_suffix(4);
    }
  }
  return rest;
}

int number(std::string_view args, std::string_view key) {
  std::string_view text = value(args, key);
  int out = -1;
  return take(text, out) ? out : -1;
}

// ---- what a processor did ----

struct Key {
  Cause cause = Cause::unknown;
  std::string what;
  friend auto operator<=>(const Key&, const Key&) = default;
};
const Key kSilent{Cause::unknown, "silent"}, kIdle{Cause::sleeping_cpu, "idle"},
    kOwn{Cause::own_computing, ""};

std::string priority_text(int kernel_priority) {
  return kernel_priority < 0                  ? "SCHED_DEADLINE"
         : kernel_priority <= kLowestRealTime ? fmt::format("SCHED_FIFO {}", kFifoPriority - kernel_priority)
                                              : "ordinary priority";
}

struct Task {
  int pid = -1, priority = 0;  // as the kernel counts: the lower the more urgent
  bool known = false;          // its priority
  std::string comm;
};

class Processor {
 public:
  Processor(int tid, int loop_priority) : tid_(tid), loop_priority_(loop_priority) {}

  void see(const TraceEvent& e) {
    if (e.name == "nmi_handler") {  // nmi_ns() tells it
      return;
    }
    if (task_.pid != e.pid) {  // a switch that the trace has not kept
      task_ = {e.pid, 0, false, e.comm};
      inside_.clear();
    }
    if (!e.in_hard_interrupt) {
      left_ = {};
    }
    const std::string& n = e.name;
    if (n == "sched_switch") {
      task_ = {number(e.args, "next_pid"), 0, true, std::string(value(e.args, "next_comm"))};
      std::string_view priority = value(e.args, "next_prio");
      (void)take(priority, task_.priority);
      inside_.clear();
    } else if (n == "irq_handler_entry") {
      enter("irq_handler_exit",
            {Cause::interrupt, fmt::format("irq {} {}", value(e.args, "irq"), value(e.args, "name"))});
    } else if (n == "softirq_entry") {
      const std::string_view action = value(e.args, "action");
      enter("softirq_exit",
            {Cause::interrupt, fmt::format("softirq {}", action.substr(0, action.find(']')))});
    } else if (n == "hrtimer_expire_entry") {
      enter("hrtimer_expire_exit", {Cause::interrupt, fmt::format("timer {}", value(e.args, "function"))});
    } else if (n == "sys_enter" && e.pid == tid_) {
      std::string_view text = e.args.starts_with("NR ") ? std::string_view(e.args).substr(3) : e.args;
      long which = -1;
      (void)take(text, which);
      enter("sys_exit", which == SYS_clock_nanosleep
                            ? kOwn
                            : Key{Cause::device_or_bus, fmt::format("system call {}", which)});
    } else if (n.starts_with("page_fault_") && e.pid == tid_) {
      ++faults_;
    } else if (const std::size_t entry = n.rfind("_entry");
               entry != std::string::npos && entry + 6 == n.size() && e.args.starts_with("vector=")) {
      enter(n.substr(0, entry) + "_exit", {Cause::interrupt, n.substr(0, entry)});
    } else {
      leave(n);
    }
  }
  // Until `next`, which follows after gap_ns; null: nothing follows.
  [[nodiscard]] Key doing(bool timer_due, const TraceEvent* next, std::int64_t gap_ns) const {
    if (inside_.empty() && !left_.what.empty() && next != nullptr && next->in_hard_interrupt &&
        gap_ns <= kWithin_ns) {
      return left_;  // not every interrupt tells its own beginning and end
    }
    if (!inside_.empty() && !(inside_.back().second == kOwn)) {
      return inside_.back().second;
    }
    if (task_.pid == tid_) {
      return kOwn;
    }
    if (timer_due) {
      return kSilent;
    }
    if (task_.pid == 0) {
      return kIdle;
    }
    const std::string who = fmt::format("{}-{}", task_.comm, task_.pid);
    if (task_.comm.starts_with("irq/")) {
      return {Cause::interrupt, "thread " + who};
    }
    if (!task_.known) {
      return {Cause::preemption, who};
    }
    return {Cause::preemption,
            fmt::format("{}, {}{}", who, priority_text(task_.priority),
                        loop_priority_ <= kLowestRealTime && task_.priority > loop_priority_
                            ? ", in a section that is not preempted"
                            : "")};
  }
  // Whose thread it would run if it were not silent; empty: nobody's.
  [[nodiscard]] std::string whose() const {
    return task_.pid > 0 && task_.pid != tid_ ? fmt::format("{}-{}", task_.comm, task_.pid) : "";
  }
  [[nodiscard]] int faults() const { return faults_; }
  [[nodiscard]] bool known() const { return task_.pid >= 0; }

 private:
  void enter(std::string until, Key key) { inside_.emplace_back(std::move(until), std::move(key)); }
  void leave(const std::string& exit) {
    for (std::size_t i = inside_.size(); i-- > 0;) {
      if (inside_[i].first == exit) {
        left_ = inside_[i].second.cause == Cause::interrupt ? inside_[i].second : Key{};
        inside_.resize(i);
        return;
      }
    }
  }
  int tid_, loop_priority_;
  Task task_;
  std::vector<std::pair<std::string, Key>> inside_;
  Key left_;  // the interrupt handler that ended last
  int faults_ = 0;
};

// Told at its end alone: "perf_event_nmi_handler() delta_ns: 5123 handled: 1". It comes amid anything else,
// and with interrupts switched off; 0 for other events.
std::int64_t nmi_ns(const TraceEvent& e) {
  constexpr std::string_view kLasted = "delta_ns: ";
  const std::size_t at = e.name == "nmi_handler" ? e.args.find(kLasted) : std::string::npos;
  std::int64_t ns = 0;
  if (at == std::string::npos) {
    return 0;
  }
  std::string_view text = std::string_view(e.args).substr(at + kLasted.size());
  return take(text, ns) ? std::max<std::int64_t>(0, ns) : 0;
}

struct Account {
  std::map<Key, std::int64_t> ns;
  std::map<std::string, std::int64_t> silent_ns;  // with whose thread on the processor
  int faults = 0;
  bool whole = true;  // the trace reaches back to the beginning
  int cpu = -1;       // where the loop ran at the end of the tick
};

// Adds what `cpu` did from `from` to `to`. timer_due: the loop's timer is due and has not come.
void add_piece(const std::vector<TraceEvent>& events, int cpu, std::int64_t from, std::int64_t to,
               bool timer_due, bool awake, int tid, int loop_priority, Account& account) {
  Processor processor(tid, loop_priority);
  std::int64_t at = from;
  int faults_before = 0;
  bool begun = false;
  // Before it has woken the loop computes nothing: its thread is on the processor, and nothing is told.
  const auto key = [&](const TraceEvent* next, std::int64_t gap_ns) {
    const Key doing = processor.known() ? processor.doing(timer_due, next, gap_ns) : kSilent;
    return doing == kOwn && !awake ? kSilent : doing;
  };
  const auto add = [&](const Key& doing, std::int64_t ns) {
    account.ns[doing] += ns;
    if (doing == kSilent) {
      account.silent_ns[processor.whose()] += ns;
    }
  };
  for (const TraceEvent& e : events) {
    if (e.cpu != cpu) {
      continue;
    }
    if (e.t_ns >= to) {
      break;
    }
    if (e.t_ns > from) {
      if (!begun) {
        account.whole = account.whole && processor.known();
        faults_before = processor.faults();
        begun = true;
      }
      const std::int64_t in_nmi = std::min(nmi_ns(e), e.t_ns - at);
      if (in_nmi > 0) {
        account.ns[{Cause::interrupt, fmt::format("NMI {}", e.args.substr(0, e.args.find('(')))}] += in_nmi;
      }
      add(key(&e, e.t_ns - at), e.t_ns - at - in_nmi);
      at = e.t_ns;
    }
    processor.see(e);
  }
  if (!begun) {
    account.whole = account.whole && processor.known();
    faults_before = processor.faults();
  }
  add(key(nullptr, to - at), std::max<std::int64_t>(0, to - at));
  account.faults += processor.faults() - faults_before;
}

// Where the loop's thread is taken from the processor, and why: the state in which it leaves.
Key blocked_as(std::string_view state, int faults) {
  if (state.starts_with('T') || state.starts_with('t')) {
    return {Cause::stopped, "a signal stopped the process"};
  }
  if (state.starts_with('D') && faults > 0) {
    return {Cause::page_fault, "waiting for the disk"};
  }
  return {Cause::device_or_bus, "the tick waited in the kernel"};
}

Account account_of(const Episode& tick, const std::vector<TraceEvent>& events) {
  Account account;
  int priority = 0;
  const TraceEvent* waking = nullptr;
  const TraceEvent* last_own = nullptr;
  std::string_view slept_as = "S";  // in which state it awaits the release
  for (const TraceEvent& e : events) {
    if (e.t_ns > tick.end_ns) {
      break;
    }
    if (e.pid == tick.tid && (last_own == nullptr || e.t_ns <= tick.release_ns)) {
      last_own = &e;
    }
    if (waking == nullptr && e.name == "sched_switch" && number(e.args, "prev_pid") == tick.tid) {
      slept_as = value(e.args, "prev_state");
    }
    if (waking == nullptr && e.t_ns + kNs >= tick.release_ns && e.name == "sched_waking" &&
        number(e.args, "pid") == tick.tid) {
      waking = &e;
      std::string_view text = value(e.args, "prio");
      (void)take(text, priority);
    }
  }
  std::int64_t at = tick.release_ns;
  int cpu = waking != nullptr ? waking->cpu : last_own != nullptr ? last_own->cpu : -1;
  if (cpu < 0) {
    account.whole = false;
    return account;
  }
  const auto until = [&](int where, std::int64_t to, bool due) {
    for (const std::int64_t end : {std::min(to, tick.wake_ns), to}) {
      if (end > at) {
        add_piece(events, where, at, end, due, at >= tick.wake_ns, tick.tid, priority, account);
        at = end;
      }
    }
  };
  if (waking != nullptr) {
    if (slept_as.starts_with('T') || slept_as.starts_with('t')) {
      account.ns[blocked_as(slept_as, 0)] += std::max<std::int64_t>(0, waking->t_ns - at);
      at = std::max(at, waking->t_ns);
    }
    until(cpu, waking->t_ns, !slept_as.starts_with('R'));
  }
  // From one switch of the loop's thread to the next: it runs, or it waits where it will run.
  bool running = waking == nullptr;
  std::string_view left_as = "R";
  for (const TraceEvent& e : events) {
    if (e.t_ns < at || e.name != "sched_switch" || e.t_ns > tick.end_ns) {
      continue;
    }
    if (!running && number(e.args, "next_pid") == tick.tid) {
      if (left_as.starts_with('R')) {
        until(e.cpu, e.t_ns, false);
      } else {
        account.ns[blocked_as(left_as, account.faults)] += e.t_ns - at;
        at = e.t_ns;
      }
      cpu = e.cpu;
      running = true;
    } else if (running && number(e.args, "prev_pid") == tick.tid) {
      until(e.cpu, e.t_ns, false);
      left_as = value(e.args, "prev_state");
      running = false;
    }
  }
  until(cpu, tick.end_ns, false);
  account.cpu = cpu;
  return account;
}

std::string the_largest(const std::map<Key, std::int64_t>& ns, std::int64_t all) {
  std::vector<std::pair<Key, std::int64_t>> list(ns.begin(), ns.end());
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string out;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, list.size()); ++i) {
    out += fmt::format("{}{} us {}{}{}", i > 0 ? ", " : "", list[i].second / kNs,
                       list[i].first == kSilent ? "silence" : name_of(list[i].first.cause),
                       list[i].first == kSilent || list[i].first.what.empty() ? "" : " ",
                       list[i].first == kSilent ? "" : list[i].first.what);
  }
  return fmt::format("of {} us: {}", all / kNs, out);
}

constexpr std::int64_t kMs_ns = 1'000'000, kShort_ns = 100 * kMs_ns;

// Taken from the processor on which the loop was before and after.
std::int64_t stolen_ns(const Counters& before, const Counters& after) {
  if (before.cpu != after.cpu) {
    return 0;
  }
  const auto steps_ms = static_cast<std::int64_t>(rise(before.stolen_ms, after.stolen_ms).value_or(0));
  return static_cast<std::int64_t>(
      rise(before.stolen_ns, after.stolen_ns).value_or(static_cast<std::uint64_t>(steps_ms * kMs_ns)));
}

std::string told_as_stolen(std::int64_t ns, const Counters& after) {
  return fmt::format("{} us counted as steal{}", ns / kNs, after.stolen_ns ? "" : ", in steps of 10 ms");
}

// What is counted beside the tick; in a long time it may have been another tick's.
bool closely_around(const Episode& tick, const Counters& before, const Counters& after) {
  return after.t_ns - before.t_ns - (tick.end_ns - tick.release_ns) <= kShort_ns;
}

// Time in which the processor did nothing that its kernel knows of. whose: the thread that was on it most of
// that time, which may have switched interrupts off; empty: none.
Verdict explain_silence(const Episode& tick, std::int64_t silent_ns, const Counters& before,
                        const Counters& after, const Surroundings& surroundings,
                        const std::string& whose = "") {
  Verdict v;
  v.us = 1e-3 * static_cast<double>(silent_ns);
  const bool short_interval = closely_around(tick, before, after);
  if (const std::uint64_t smis = rise(before.smis, after.smis).value_or(0); smis > 0 && short_interval) {
    v.cause = Cause::smi;
    v.what = fmt::format("{} counted within {} ms around it", smis, (after.t_ns - before.t_ns) / kMs_ns);
    v.proof = Proof::counted;
    return v;
  }
  const std::int64_t stolen = stolen_ns(before, after);
  if (2 * stolen >= silent_ns && short_interval) {
    v.cause = Cause::stolen_time;
    v.what = told_as_stolen(stolen, after);
    v.proof = Proof::counted;
    return v;
  }
  v.what = fmt::format("{:.0f} us in which the processor took no interrupt{}: ", v.us,
                       whose.empty() ? "" : ", with " + whose + " on it");
  if (!surroundings.virtual_machine) {
    v.what += whose.empty() ? "interrupts switched off, the firmware or the way out of a sleep"
                            : "interrupts switched off, or the firmware";
  } else if (after.stolen_ns) {
    v.what += fmt::format("work of the hypervisor, or interrupts switched off; {} within {} ms around it",
                          told_as_stolen(stolen, after), (after.t_ns - before.t_ns) / kMs_ns);
  } else {
    v.what += "the hypervisor, whose stolen time is counted in steps of 10 ms, or interrupts switched off";
  }
  return v;
}

}  // namespace

const char* name_of(Cause cause) {
  switch (cause) {
    case Cause::unknown:
      return "unknown";
    case Cause::interrupt:
      return "interrupt";
    case Cause::preemption:
      return "preemption";
    case Cause::page_fault:
      return "page fault";
    case Cause::own_computing:
      return "own computing";
    case Cause::device_or_bus:
      return "device or bus";
    case Cause::stolen_time:
      return "stolen time";
    case Cause::smi:
      return "SMI";
    case Cause::sleeping_cpu:
      return "sleeping CPU";
    case Cause::frequency:
      return "frequency";
    case Cause::stopped:
      return "stopped";
  }
  return "unknown";
}

const char* name_of(Proof proof) {
  return proof == Proof::traced ? "traced" : proof == Proof::counted ? "counted" : "none";
}

std::vector<TraceEvent> read_trace(std::string_view text) {
  std::vector<TraceEvent> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (text.front() != '#') {
      if (auto event = read_line(text.substr(0, end))) {
        // The kernel writes them by their times, but for a few of different processors.
        const auto at =
            std::upper_bound(out.begin(), out.end(), event->t_ns,
                             [](std::int64_t t_ns, const TraceEvent& e) { return t_ns < e.t_ns; });
        out.insert(at, std::move(*event));
      }
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

Verdict explain(const Episode& tick, const std::vector<TraceEvent>& events, const Counters& before,
                const Counters& after, const Surroundings& surroundings) {
  Account account = account_of(tick, events);
  Verdict v;
  if (!account.whole) {
    v.what = "the trace does not reach back so far";
    return v;
  }
  const std::int64_t all = tick.end_ns - tick.release_ns;
  // Page faults and a change of frequency happen within what the tick computes.
  if (auto own = account.ns.find(kOwn); own != account.ns.end()) {
    const std::int64_t ns = own->second;
    Key inside{Cause::own_computing, "slot " + tick.slot};
    const bool changed = std::any_of(events.begin(), events.end(), [&](const TraceEvent& e) {
      return e.name == "cpu_frequency" && number(e.args, "cpu_id") == account.cpu &&
             e.t_ns >= tick.release_ns && e.t_ns <= tick.end_ns;
    });
    if (account.faults > 0 && ns / account.faults <= kFault_ns) {
      inside = {Cause::page_fault, fmt::format("{} in slot {}", account.faults, tick.slot)};
    } else if (changed) {
      inside = {Cause::frequency, "it changed within slot " + tick.slot};
    }
    account.ns.erase(own);
    account.ns[inside] += ns;
  }
  std::map<Cause, std::int64_t> by_cause;
  for (const auto& [key, ns] : account.ns) {
    by_cause[key.cause] += ns;
  }
  const auto most = std::max_element(by_cause.begin(), by_cause.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == by_cause.end() || 2 * most->second < all) {
    v.what = the_largest(account.ns, all);
    return v;
  }
  if (most->first == Cause::unknown) {
    const auto on_it = std::max_element(account.silent_ns.begin(), account.silent_ns.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
    const bool mostly = on_it != account.silent_ns.end() && 2 * on_it->second >= most->second;
    return explain_silence(tick, most->second, before, after, surroundings, mostly ? on_it->first : "");
  }
  const Key* largest = nullptr;
  std::int64_t largest_ns = -1;
  for (const auto& [key, ns] : account.ns) {
    if (key.cause == most->first && ns > largest_ns) {
      largest = &key;
      largest_ns = ns;
    }
  }
  v.cause = most->first;
  v.what = largest->what;
  v.us = 1e-3 * static_cast<double>(most->second);
  v.proof = Proof::traced;
  // A trace cannot tell what runs from what would run if its processor had not been taken away. Steps of 10
  // ms are too coarse to say that of an interrupt or another thread.
  const bool to_the_ns = before.stolen_ns && after.stolen_ns;
  if ((v.cause == Cause::own_computing || to_the_ns) && 2 * stolen_ns(before, after) >= most->second) {
    Verdict taken = explain_silence(tick, most->second, before, after, surroundings);
    if (v.cause == Cause::own_computing) {
      return taken;
    }
    if (taken.cause == Cause::stolen_time) {
      taken.what += fmt::format(", during {} {}", name_of(v.cause), v.what);
      return taken;
    }
  }
  return v;
}

Verdict explain(const Episode& tick, const Counters& before, const Counters& after) {
  Verdict v;
  const std::int64_t all = tick.end_ns - tick.release_ns;
  const auto at_least_half = [all](std::int64_t ns) { return 2 * ns >= all; };
  const std::int64_t computed = tick.end_ns - tick.wake_ns;
  const std::uint64_t faults =
      after.minor_faults + after.major_faults - before.minor_faults - before.major_faults;
  const auto waited = static_cast<std::int64_t>(rise(before.waited_ns, after.waited_ns).value_or(0));
  const std::int64_t stolen = stolen_ns(before, after);
  // Or it waited in the kernel, and other ticks ran.
  const double others_ns = tick.usual_share * static_cast<double>(after.t_ns - before.t_ns - all);
  const bool did_run = static_cast<double>(rise(before.ran_ns, after.ran_ns).value_or(0)) - others_ns >=
                       0.8 * static_cast<double>(computed);
  v.proof = Proof::counted;
  v.us = 1e-3 * static_cast<double>(all);
  if (!closely_around(tick, before, after)) {
    v.proof = Proof::none;
    v.what = fmt::format("nobody looked for {} ms around it", (after.t_ns - before.t_ns) / kMs_ns);
    return v;
  }
  const std::uint64_t smis = rise(before.smis, after.smis).value_or(0);
  if (at_least_half(stolen)) {
    v.cause = Cause::stolen_time;
    v.what = told_as_stolen(stolen, after);
  } else if (waited > 0 && at_least_half(waited)) {
    v.cause = Cause::preemption;
    v.what =
        fmt::format("the thread waited {} us for its processor; by whom only a trace tells", waited / kNs);
  } else if (at_least_half(computed) && did_run && faults > 0 &&
             (computed <= static_cast<std::int64_t>(faults) * kFault_ns ||
              after.major_faults > before.major_faults)) {
    v.cause = Cause::page_fault;
    v.what = fmt::format("{} major among {}", after.major_faults - before.major_faults, faults);
  } else if (smis > 0) {  // it makes a wake-up late, or a slot long
    v.cause = Cause::smi;
    v.what = fmt::format("{} counted within {} ms around it", smis, (after.t_ns - before.t_ns) / kMs_ns);
  } else if (at_least_half(computed) && at_least_half(tick.slot_ns) && did_run) {
    v.cause = Cause::own_computing;
    v.what = "slot " + tick.slot;
  } else {
    v.proof = Proof::none;
    std::string most;
    std::uint64_t count = 0;
    for (const auto& [name, n] : after.interrupts) {
      const auto was = before.interrupts.find(name);
      const std::uint64_t rose = n - (was != before.interrupts.end() ? std::min(was->second, n) : 0);
      if (rose > count) {
        most = name;
        count = rose;
      }
    }
    v.what = fmt::format("no counter tells it within {:.0f} ms around it; most interrupts: {} ({})",
                         1e-6 * static_cast<double>(after.t_ns - before.t_ns), count, most);
  }
  return v;
}

// ---- counters ----

namespace {

std::string whole_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// What stands after "NAME   : " in ms with six decimals, from `at` on.
std::optional<std::uint64_t> clock_ns(std::string_view text, std::size_t at, std::string_view name) {
  at = text.find(name, at);
  at = at == std::string_view::npos ? at : text.find(": ", at);
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  text.remove_prefix(at + 2);
  std::uint64_t ms = 0, ns = 0;
  if (!take(text, ms) || !text.starts_with('.')) {
    return std::nullopt;
  }
  text.remove_prefix(1);
  return take(text, ns) ? std::optional(ms * kMs_ns + ns) : std::nullopt;
}

// The clock of a processor's tasks stands still while the hypervisor has the processor.
std::optional<std::uint64_t> between_clocks_ns(std::string_view text, int cpu) {
  const std::string title = fmt::format("\ncpu#{}", cpu);
  std::size_t at = text.find(title);
  while (at != std::string_view::npos &&
         text.find_first_not_of("0123456789", at + title.size()) != at + title.size()) {
    at = text.find(title, at + 1);
  }
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  return rise(clock_ns(text, at, "  .clock_task "), clock_ns(text, at, "  .clock "));
}

}  // namespace

std::optional<std::uint64_t> smi_count() {
  constexpr off_t kMsrSmiCount = 0x34;
  const int fd = open("/dev/cpu/0/msr", O_RDONLY | O_CLOEXEC);
  std::uint64_t count = 0;
  const bool read = fd >= 0 && pread(fd, &count, sizeof count, kMsrSmiCount) == sizeof count;
  if (fd >= 0) {
    (void)close(fd);
  }
  return read ? std::optional(count & 0xffffffffU) : std::nullopt;
}

Counters read_counters(int pid, int tid, const std::string& proc, const std::string& scheduler) {
  Counters c;
  c.t_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  const std::string task = fmt::format("{}/{}/task/{}/", proc, pid, tid);
  std::istringstream schedstat(whole_text(task + "schedstat"));
  std::uint64_t ran = 0, waited = 0;
  if (schedstat >> ran >> waited) {
    c.ran_ns = ran;
    c.waited_ns = waited;
  }
  // The name in brackets may hold anything; field 10 is minflt, 12 majflt, 39 the processor.
  const std::string stat = whole_text(task + "stat");
  std::istringstream fields(stat.substr(std::min(stat.rfind(')') + 1, stat.size())));
  std::string field;
  for (int i = 3; i <= 39 && fields >> field; ++i) {
    if (i == 10 || i == 12) {
      (i == 10 ? c.minor_faults : c.major_faults) = std::strtoull(field.c_str(), nullptr, 10);
    } else if (i == 39) {
      c.cpu = static_cast<int>(std::strtol(field.c_str(), nullptr, 10));
    }
  }
  const std::string processors_spent = whole_text(proc + "/stat");
  const std::size_t mine = processors_spent.find(fmt::format("\ncpu{} ", c.cpu));
  if (mine != std::string::npos) {
    std::istringstream spent(
        processors_spent.substr(mine));  // user nice system idle iowait irq softirq steal
    std::uint64_t steal = 0;
    spent >> field;
    for (int i = 0; i < 8; ++i) {
      spent >> steal;
    }
    const long per_s = sysconf(_SC_CLK_TCK);
    if (spent) {
      c.stolen_ms = steal * 1000 / static_cast<std::uint64_t>(per_s > 0 ? per_s : 100);
    }
  }
  if (!scheduler.empty()) {
    c.stolen_ns = between_clocks_ns(whole_text(scheduler), c.cpu);
  }
  c.smis = smi_count();
  std::istringstream lines(whole_text(proc + "/interrupts"));
  std::string line;
  std::getline(lines, line);
  const auto processors = static_cast<std::size_t>(std::count(line.begin(), line.end(), 'C'));
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string label;
    words >> label;
    std::uint64_t sum = 0, n = 0;
    for (std::size_t i = 0; i < processors && words >> n; ++i) {
      sum += n;
    }
    words.clear();
    std::string rest;
    std::getline(words, rest);
    rest.erase(0, rest.find_first_not_of(' '));
    // Those of a device have numbers and a device's name; the others a label that says it.
    const bool of_device = label.find_first_not_of("0123456789:") == std::string::npos;
    c.interrupts[of_device ? "irq " + label + " " + rest.substr(rest.find_last_of(' ') + 1) : label] = sum;
  }
  return c;
}

}  // namespace punctum::tools::late
