// The station: where core, vision and everybody else meet in shared memory. One segment for each writer, each
// with a plain, versioned layout; everybody else maps it read-only. Nothing here waits, allocates or makes a
// system call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "hal/ipc/exchange.hpp"
#include "rt/station/command.hpp"
#include "rt/station/core_status.hpp"
#include "rt/station/event.hpp"
#include "rt/station/input.hpp"
#include "rt/station/observation.hpp"
#include "rt/station/run_end.hpp"
#include "rt/station/surface.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

using TelemetryRing = hal::SeqRing<TelemetrySample, 8192>;
// The newest counts; a recorder that is late in virtual time takes them all.
using ObservationSlot = hal::SeqRing<Observation, 64>;
using SurfaceSlot = hal::SeqRing<CellSurface, 64>;
using InputRing = hal::SeqRing<InputSample, 8192>;
using EventRing = hal::SeqRing<Event, 4096>;
using CommandQueue = hal::CommandQueue<Command, 64>;

// Written by the core alone.
struct CoreSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x00000065726f6350ULL;  // "Pcore"
  static constexpr std::uint64_t kVersion = 6;                    // raise when a meaning changes
  static const std::uint64_t kLayout;                             // version, sizes and offsets

  hal::SegmentHeader header;
  CoreStatus status;
  TelemetryRing telemetry;
  EventRing events;
};
inline constexpr std::uint64_t CoreSegment::kLayout =
    hal::fingerprint(CoreSegment::kVersion, sizeof(CoreSegment), sizeof(TelemetrySample), sizeof(CoreStatus),
                     offsetof(TelemetrySample, x_m), offsetof(TelemetrySample, effect_N),
                     offsetof(TelemetrySample, obs_age_s), offsetof(CoreSegment, status), sizeof(LateTick),
                     offsetof(CoreSegment, telemetry), sizeof(Event), offsetof(CoreSegment, events));

// Written by the core alone, and there only where it is recorded: what each tick was given.
struct InputSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x007475706e694350ULL;  // "PCinput"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  InputRing ring;
};
inline constexpr std::uint64_t InputSegment::kLayout = hal::fingerprint(
    InputSegment::kVersion, sizeof(InputSegment), sizeof(InputSample), offsetof(InputSample, hand_m),
    offsetof(InputSample, tip_m), offsetof(InputSample, axial_N), offsetof(InputSegment, ring));

// Written by vision alone.
struct ObservationSegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x6576726573626f50ULL;  // "Pobserve"
  static constexpr std::uint64_t kVersion = 6;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  ObservationSlot slot;
  Word rounds{};        // of vision's loop, with a frame or without: while it grows, vision does not hang
  Word not_kept{};      // bits of NotKept: files that it could not write and goes on without
  SurfaceSlot surface;  // before the observation of the same picture; empty: vision does not reconstruct them

  enum NotKept : std::uint64_t { observations = 1U << 0, frames = 1U << 1 };
};
inline constexpr std::uint64_t ObservationSegment::kLayout = hal::fingerprint(
    ObservationSegment::kVersion, sizeof(ObservationSegment), sizeof(Observation),
    offsetof(Observation, gap_m), offsetof(Observation, total_us), offsetof(ObservationSegment, slot),
    offsetof(ObservationSegment, rounds), offsetof(ObservationSegment, not_kept), sizeof(CellSurface),
    offsetof(ObservationSegment, surface));

// One for each writer of commands: it puts, the core takes.
struct CommandSegment {
  static constexpr std::uint64_t kMagic = 0x646e616d6d6f6350ULL;  // "Pcommand"
  static constexpr std::uint64_t kVersion = 3;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  CommandQueue queue;
};
inline constexpr std::uint64_t CommandSegment::kLayout = hal::fingerprint(
    CommandSegment::kVersion, sizeof(CommandSegment), sizeof(Command), offsetof(CommandSegment, queue));

template <class Segment>
inline constexpr bool kShareable =
    std::is_standard_layout_v<Segment> && std::is_trivially_destructible_v<Segment> &&
    offsetof(Segment, header) == 0;
static_assert(kShareable<CoreSegment> && kShareable<InputSegment> && kShareable<ObservationSegment> &&
              kShareable<CommandSegment>);
static_assert(offsetof(CoreSegment, status) == 64 && offsetof(CoreSegment, telemetry) % 64 == 0);

// A queue that the core empties, and what it takes from it; in the order of kCommandWriters.
struct CommandInput {
  CommandQueue* queue;
  CommandKinds role;
};

// The segments as the core sees them.
struct Station {
  CoreSegment& core;
  const ObservationSlot* observation;  // null: nobody observes
  std::span<const CommandInput> commands;
};

// A whole station in the memory of one process: for tests, and for replaying ticks.
struct LocalStation {
  CoreSegment core;
  ObservationSegment observation;
  CommandSegment parent, console;
  CommandInput inputs[kCommandWriterCount] = {{&parent.queue, kParent.role}, {&console.queue, kConsole.role}};
  Station station{core, &observation.slot, inputs};

  LocalStation() = default;
  LocalStation(const LocalStation&) = delete;
  LocalStation& operator=(const LocalStation&) = delete;
};

}  // namespace punctum::rt
