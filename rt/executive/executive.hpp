// The fixed-rate cyclic executive: one base tick on the absolute grid start + k T, and slots that run on
// whole divisors of it. A late tick skips the releases it missed and counts them; it never bursts. Everything
// here is safe in real time; nothing allocates, blocks (but in the injected clock) or throws.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/executive/missed_window.hpp"
#include "rt/station/core_status.hpp"
#include "rt/station/tick_info.hpp"

namespace punctum::rt {

// What a slot is told about the tick it runs in.
struct Tick {
  std::uint64_t index = 0;      // on the grid: gaps are missed releases
  std::int64_t release_ns = 0;  // start + index T
  std::int64_t wake_ns = 0;     // when the thread really woke
  std::int64_t late_ns = 0;     // of that: after the release it slept for, an older one if some were missed
  std::int64_t period_ns = 0;   // really elapsed since this slot ran last; nominal on its first run
  std::uint64_t missed = 0;     // releases of the base tick skipped since the start of the loop
  std::uint64_t missed_in_window = 0;  // of them within the sliding window that ends with this tick

  // For the servo.
  [[nodiscard]] TickInfo info() const NONBLOCKING {
    return {index, release_ns, wake_ns, static_cast<double>(period_ns) * 1e-9, missed_in_window};
  }
};

enum class After : std::uint8_t { go_on, end };  // end: the loop ends when this tick's slots have run

// Runs on every grid index k with k % divisor == offset, in the order of the table. If such releases were
// missed it runs once, late, on the next tick that takes place: otherwise a steady overload could leave a
// slot of even indices without any run at all.
struct Slot {
  const char* name = "";
  After (*run)(void* self, const Tick& tick) NONBLOCKING = nullptr;
  void* self = nullptr;
  std::uint32_t divisor = 1;
  std::uint32_t offset = 0;
};

// A slot that calls a member function: slot<&Servo::tick>("servo", servo).
template <auto Method, class Self>
[[nodiscard]] constexpr Slot slot(const char* slot_name, Self& self, std::uint32_t divisor = 1,
                                  std::uint32_t offset = 0) NONBLOCKING {
  return {slot_name,
          [](void* me, const Tick& tick)
              NONBLOCKING -> After { return (static_cast<Self*>(me)->*Method)(tick); },
          &self, divisor, offset};
}

struct ExecutiveConfig {
  std::int64_t period_ns = 1'000'000;         // of the base tick
  std::optional<std::int64_t> start_ns = {};  // release of tick 0; none: one period after run() begins
  std::uint32_t overrun_window_ticks = 1000;  // 1 .. MissedWindow::kMaxTicks
  // A tick that ends later than this after the release it slept for is kept in CoreStatus::late. None: a
  // period, and it has missed a release.
  std::optional<std::int64_t> late_after_ns = {};
};

class Executive {
 public:
  enum class Ended : std::uint8_t { by_slot, by_stop_flag, invalid };

  // The clock releases the ticks; the stopwatch times the slots (the same clock, or the machine's own clock
  // when the first is virtual). The slots must outlive the executive.
  Executive(hal::Clock& clock, const hal::Clock& stopwatch, const ExecutiveConfig& config,
            std::span<const Slot> slots, CoreStatus& status) NONBLOCKING;

  // Whole divisors and offsets, no empty slot, not too many, a period above zero.
  [[nodiscard]] bool valid() const NONBLOCKING;

  // The loop. A stop flag ends it before the slots of the next tick.
  Ended run(const std::atomic<bool>& stop) noexcept;

 private:
  [[nodiscard]] std::int64_t release_ns(std::uint64_t index) const NONBLOCKING {
    return start_ns_ + static_cast<std::int64_t>(index) * config_.period_ns;
  }
  void announce() NONBLOCKING;
  [[nodiscard]] std::uint64_t index_after_wake(std::uint64_t planned, std::int64_t wake_ns) const NONBLOCKING;
  [[nodiscard]] std::uint64_t next_release_after(std::uint64_t index, std::int64_t now_ns) const NONBLOCKING;
  [[nodiscard]] After run_slots(Tick& tick) NONBLOCKING;
  void keep_late(std::uint64_t planned, const Tick& tick, std::uint64_t next, std::int64_t end_ns)
      NONBLOCKING;

  struct Progress {                 // of one slot
    std::uint64_t due = 0;          // its next release on the grid
    std::int64_t last_wake_ns = 0;  // of the tick it ran in last
    bool ran = false;
  };

  hal::Clock& clock_;
  const hal::Clock& stopwatch_;
  ExecutiveConfig config_;
  std::span<const Slot> slots_;
  CoreStatus& status_;
  MissedWindow window_;
  std::array<Progress, kMaxSlots> progress_{};
  std::int64_t start_ns_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t longest_slot_ = 0;  // of the tick under way
  std::int64_t longest_slot_ns_ = 0;
};

}  // namespace punctum::rt
