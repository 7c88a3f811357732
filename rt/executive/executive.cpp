#include "rt/executive/executive.hpp"

#include <algorithm>

namespace punctum::rt {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;

void bump(Word& word, std::uint64_t by = 1) NONBLOCKING { word.store(word.load(kRelaxed) + by, kRelaxed); }

}  // namespace

Executive::Executive(hal::Clock& clock, const hal::Clock& stopwatch, const ExecutiveConfig& config,
                     std::span<const Slot> slots, CoreStatus& status) NONBLOCKING
    : clock_(clock),
      stopwatch_(stopwatch),
      config_(config),
      slots_(slots),
      status_(status),
      window_(config.overrun_window_ticks) {}

bool Executive::valid() const NONBLOCKING {
  if (config_.period_ns <= 0 || slots_.empty() || slots_.size() > kMaxSlots) {
    return false;
  }
  // At most kMaxSlots rounds.
  return std::all_of(slots_.begin(), slots_.end(), [](const Slot& s) {
    return s.run != nullptr && s.divisor >= 1 && s.offset < s.divisor;
  });
}

void Executive::announce() NONBLOCKING {
  for (std::size_t i = 0; i < slots_.size(); ++i) {  // at most kMaxSlots rounds
    status_.slots[i].name.set(slots_[i].name);
    status_.slots[i].divisor.store(slots_[i].divisor, kRelaxed);
    progress_[i] = {.due = slots_[i].offset};
  }
  status_.slot_count.store(slots_.size(), std::memory_order_release);
  status_.start_ns.store(static_cast<std::uint64_t>(start_ns_), kRelaxed);
  status_.period_ns.store(static_cast<std::uint64_t>(config_.period_ns), kRelaxed);
}

// The release this wake-up stands for: the newest one that has passed.
std::uint64_t Executive::index_after_wake(std::uint64_t planned, std::int64_t wake_ns) const NONBLOCKING {
  if (wake_ns < release_ns(planned)) {
    return planned;
  }
  return static_cast<std::uint64_t>((wake_ns - start_ns_) / config_.period_ns);
}

// The first release that still lies ahead: one that passed while the slots ran is skipped, not made up for.
std::uint64_t Executive::next_release_after(std::uint64_t index, std::int64_t now_ns) const NONBLOCKING {
  if (now_ns <= release_ns(index + 1)) {
    return index + 1;
  }
  return static_cast<std::uint64_t>((now_ns - start_ns_ + config_.period_ns - 1) / config_.period_ns);
}

After Executive::run_slots(Tick& tick) NONBLOCKING {
  After after = After::go_on;
  longest_slot_ns_ = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {  // at most kMaxSlots rounds
    const Slot& slot = slots_[i];
    Progress& progress = progress_[i];
    if (tick.index < progress.due) {
      continue;
    }
    const std::uint64_t skipped = (tick.index - progress.due) / slot.divisor;
    progress.due += (skipped + 1) * slot.divisor;
    tick.period_ns = progress.ran ? std::max<std::int64_t>(tick.wake_ns - progress.last_wake_ns, 1)
                                  : config_.period_ns * slot.divisor;
    progress.last_wake_ns = tick.wake_ns;
    progress.ran = true;

    SlotStatus& status = status_.slots[i];
    status.wake.add(clock_.now_ns() - tick.release_ns);
    const std::int64_t begin = stopwatch_.now_ns();
    if (slot.run(slot.self, tick) == After::end) {
      after = After::end;
    }
    const std::int64_t took_ns = stopwatch_.now_ns() - begin;
    status.execution.add(took_ns);
    if (took_ns > longest_slot_ns_) {
      longest_slot_ns_ = took_ns;
      longest_slot_ = i;
    }
    bump(status.runs);
    if (skipped > 0) {
      bump(status.skipped, skipped);
    }
  }
  return after;
}

void Executive::keep_late(std::uint64_t planned, const Tick& tick, std::uint64_t next, std::int64_t end_ns)
    NONBLOCKING {
  LateTick late;
  late.index = planned;
  late.release_ns = release_ns(planned);
  late.wake_ns = tick.wake_ns;
  late.end_ns = end_ns;
  late.missed = next - planned - 1;
  late.longest_slot = longest_slot_;
  late.longest_slot_ns = longest_slot_ns_;
  status_.late.push(late);
}

Executive::Ended Executive::run(const std::atomic<bool>& stop) noexcept {
  if (!valid()) {
    return Ended::invalid;
  }
  start_ns_ = config_.start_ns ? *config_.start_ns : clock_.now_ns() + config_.period_ns;
  announce();

  std::uint64_t planned = 0;
  std::int64_t worst_ns = 0;
  const std::int64_t late_after_ns = config_.late_after_ns.value_or(config_.period_ns);
  for (;;) {
    clock_.sleep_until_ns(release_ns(planned));
    if (stop.load(kRelaxed)) {
      return Ended::by_stop_flag;
    }

    Tick tick;
    tick.wake_ns = clock_.now_ns();
    const std::int64_t begin = stopwatch_.now_ns();
    tick.late_ns = tick.wake_ns - release_ns(planned);
    tick.index = index_after_wake(planned, tick.wake_ns);
    tick.release_ns = release_ns(tick.index);
    missed_ += tick.index - planned;
    tick.missed = missed_;
    tick.missed_in_window = window_.advance(tick.index);

    worst_ns = std::max(worst_ns, tick.late_ns);
    status_.wake.add(tick.late_ns);
    status_.worst_lateness_ns.store(static_cast<std::uint64_t>(worst_ns), kRelaxed);
    status_.missed.store(missed_, kRelaxed);
    status_.missed_in_window.store(tick.missed_in_window, kRelaxed);
    status_.tick_index.store(tick.index, kRelaxed);
    bump(status_.ticks);
    status_.started.store(1, kRelaxed);

    const After after = run_slots(tick);
    status_.tick.add(stopwatch_.now_ns() - begin);
    const std::int64_t end_ns = clock_.now_ns();
    const std::uint64_t next = next_release_after(tick.index, end_ns);
    if (end_ns - release_ns(planned) > late_after_ns) {
      keep_late(planned, tick, next, end_ns);
    }
    if (after == After::end) {
      return Ended::by_slot;
    }
    planned = next;
    missed_ += planned - (tick.index + 1);
  }
}

}  // namespace punctum::rt
