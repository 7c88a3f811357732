// How a console works a recording that is played as a station (punctum-replay --station): what it asks for,
// and where the recording is.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/ipc/exchange.hpp"

namespace punctum::tools {

inline constexpr const char* kReplaySegment = "replay";
inline constexpr const char* kReplayWishSegment = "replay.wishes";
// No segment: one line for each mark, "SECONDS TEXT" (hal/ipc/sealed_text.hpp).
inline constexpr const char* kReplayMarks = "replay.marks";

inline constexpr double kSlowestReplay = 0.01, kFastestReplay = 100;

struct ReplayWish {
  enum Kind : std::uint64_t { seek, speed, play, pause };
  std::uint64_t kind = pause;
  double value = 0;  // of seek: s of the run; of speed: times as fast as it was
};

// Written by the console.
struct ReplayWishSegment {
  static constexpr std::uint64_t kMagic = 0x6873697779616c50ULL;  // "Playwish"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  hal::CommandQueue<ReplayWish, 16> queue;
};
inline constexpr std::uint64_t ReplayWishSegment::kLayout =
    hal::fingerprint(ReplayWishSegment::kVersion, sizeof(ReplayWishSegment), sizeof(ReplayWish),
                     offsetof(ReplayWishSegment, queue));

struct ReplayState {
  double first_s = 0, last_s = 0, now_s = 0;  // of the run
  double speed = 1;                           // times as fast as it was
  std::uint64_t playing = 0;
};

// Written by the player.
struct ReplaySegment {
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0x0079616c70655250ULL;  // "PReplay"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  hal::SeqRing<ReplayState, 4> state;
};
inline constexpr std::uint64_t ReplaySegment::kLayout = hal::fingerprint(
    ReplaySegment::kVersion, sizeof(ReplaySegment), sizeof(ReplayState), offsetof(ReplaySegment, state));

}  // namespace punctum::tools
