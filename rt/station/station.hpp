// The station: where core, vision and everyone else meet. One shared-memory segment with a plain, versioned
// layout. Telemetry and observations are rings, commands a queue, the core's own state atomic words.
// Nothing here waits, allocates or makes a system call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "hal/exchange.hpp"
#include "rt/station/observation.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

using hal::Word;

// Everyone -> core. Range-checked by the core; what is out of range is counted and dropped.
struct Command {
  enum Kind : std::uint64_t {
    none,
    stop,         // latched safe stop (Fault::command_stop); value unused
    end,          // end the task where that is safe: at once outside, inside when drawn back; value unused
    force_scale,  // value: 0 .. 1 of the scene's force scale
  };
  std::uint64_t kind = none;
  double value = 0;
};

// Why the core ended.
enum class ExitReason : std::uint64_t {
  running,
  task_done,
  latched_fault,
  time_limit,
  command,
  invalid_setup
};
inline constexpr int kExitReasons = 6;
[[nodiscard]] constexpr const char* name(ExitReason r) noexcept {
  constexpr const char* names[kExitReasons] = {"running",    "task done", "latched fault",
                                               "time limit", "command",   "invalid set-up"};
  return names[static_cast<int>(r)];
}

// A short text that is written before its table is announced and never changed afterwards.
template <std::size_t N>
struct Text {
  char text[N] = {};
  void set(const char* from) noexcept {
    std::size_t n = 0;
    while (n + 1 < N && from[n] != '\0') ++n;
    std::memcpy(text, from, n);
    text[n] = '\0';
  }
};

// One right that real-time work needs: got or not, and how to get it.
struct Right {
  Text<32> name;
  Text<192> detail;  // what was found
  Text<280> remedy;  // how to get it; empty when got
  std::uint32_t got = 0;
  std::uint32_t required = 0;  // 1: without it the core runs visibly degraded; 0: advice
};

inline constexpr std::size_t kMaxRights = 16;
inline constexpr std::size_t kMaxSlots = 8;
inline constexpr std::size_t kHistogramBins = 2000;  // of 1 us
using TimeHistogram = hal::Histogram<kHistogramBins>;

// One slot of the executive.
struct SlotStatus {
  Text<32> name;
  Word divisor{};
  Word runs{};
  Word skipped{};           // its releases that passed without a run
  TimeHistogram wake;       // release on the grid -> start of the slot
  TimeHistogram execution;  // start -> end of the slot
};

// Written by the core alone, readable live.
struct CoreStatus {
  Word pid{};
  Word started{};            // 1 from the first tick on
  Word start_ns{};           // release of tick 0, station clock
  Word period_ns{};          // of the base tick
  Word ticks{};              // executed
  Word tick_index{};         // of the newest tick on the grid
  Word missed{};             // releases skipped, since the start
  Word missed_in_window{};   // of them inside the sliding window
  Word worst_lateness_ns{};  // wake-up after the release
  Word degraded{};           // 1: a required right is missing
  Word fault{};              // rt::Fault, the latched first cause
  Word faults_latched{};     // bit f: rt::Fault f was latched in this run
  Word phase{};              // rt::Phase
  Word task_finished{};      // 1: `clear` of the last cell was reached, all injected
  Word exit_reason{};        // rt::ExitReason
  Word commands_refused{};   // out of range

  // Of the real-time thread, from the start of the loop to its end (getrusage RUSAGE_THREAD).
  Word minor_faults{};
  Word major_faults{};
  Word voluntary_switches{};
  Word involuntary_switches{};
  Word allocations{};          // heap calls of the real-time thread within the loop
  Word allocations_watched{};  // 1: the trap was there
  Word counters_final{};       // 1: the loop has ended and the six words above are whole

  Word rights_count{};  // stored last: the table before it is then whole
  Right rights[kMaxRights];

  TimeHistogram wake;  // release -> wake-up of the thread
  TimeHistogram tick;  // wake-up -> end of the last slot
  Word slot_count{};   // stored last: the names before it are then whole
  SlotStatus slots[kMaxSlots];
};

struct Station {
  static constexpr std::uint64_t kMagic = 0x6e6f697461747350ULL;  // "Pstation"
  static constexpr std::uint64_t kVersion = 1;                    // raise when a meaning changes
  static const std::uint64_t kLayout;                             // version, sizes and offsets

  using TelemetryRing = hal::SeqRing<TelemetrySample, 8192>;
  using ObservationSlot = hal::SeqRing<Observation, 4>;
  using Commands = hal::CommandQueue<Command, 64>;

  hal::SegmentHeader header;
  CoreStatus core;
  Commands commands;            // parent -> core
  ObservationSlot observation;  // vision -> core, newest wins
  TelemetryRing telemetry;      // core -> everyone
};

inline constexpr std::uint64_t Station::kLayout = hal::fingerprint(
    Station::kVersion, sizeof(Station), sizeof(TelemetrySample), sizeof(Observation), sizeof(CoreStatus),
    offsetof(TelemetrySample, x_m), offsetof(TelemetrySample, membrane_N),
    offsetof(TelemetrySample, obs_age_s), offsetof(Observation, gap_m), offsetof(Observation, total_us),
    offsetof(Station, core), offsetof(Station, commands), offsetof(Station, observation),
    offsetof(Station, telemetry));

static_assert(std::is_standard_layout_v<Station> && std::is_trivially_destructible_v<Station>);
static_assert(offsetof(Station, header) == 0 && offsetof(Station, core) == 64);
static_assert(offsetof(Station, telemetry) % 64 == 0 && offsetof(Station, observation) % 64 == 0);

}  // namespace punctum::rt
