// The causes of a latched stop.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

// Why the station stopped. Latched: the first cause is kept until a reset.
enum class Fault : std::uint8_t {
  none,
  estop,              // an e-stop contact is open
  estop_discrepancy,  // the two contacts disagreed for longer than the window
  estop_lost,         // the e-stop chain cannot be read
  hand_lost,          // haptic device disconnected or silent for longer than its limit
  hand_invalid,       // its position is not finite or jumped further than a hand can
  stage_lost,
  stage_fault,
  stage_following,     // following error above its limit
  tip_force,           // tip force above its hard limit
  overrun,             // too many missed ticks in the window (real actuators only)
  not_finite,          // a force or set-point was not finite
  command_stop,        // a stop was commanded
  vacuum_lost,         // holding vacuum below its limit while a cell is held
  injector_open,       // the injector stays open although its gate is shut, or fell silent when it was open
  stage_not_stopping,  // the drive moves, keeps its power or cannot be read although it was told to stop
  stage_not_enabled,   // the drive was told to take up operation and does not
  enabling_released,   // the enabling device was let go or squeezed
  enabling_fault,      // the enabling switch cannot be read, or its two contacts disagreed for too long
};
inline constexpr int kFaults = 19;
[[nodiscard]] constexpr const char* name(Fault f) NONBLOCKING {
  constexpr const char* names[] = {"none",
                                   "estop",
                                   "estop_discrepancy",
                                   "estop_lost",
                                   "hand_lost",
                                   "hand_invalid",
                                   "stage_lost",
                                   "stage_fault",
                                   "stage_following",
                                   "tip_force",
                                   "overrun",
                                   "not_finite",
                                   "command_stop",
                                   "vacuum_lost",
                                   "injector_open",
                                   "stage_not_stopping",
                                   "stage_not_enabled",
                                   "enabling_released",
                                   "enabling_fault"};
  static_assert(sizeof names == kFaults * sizeof names[0]);
  return names[static_cast<int>(f)];
}

// The more urgent of two: the first, unless it is none.
[[nodiscard]] constexpr Fault first_of(Fault a, Fault b) NONBLOCKING { return a != Fault::none ? a : b; }

// What is wrong on one tick: the most urgent, which is named, and all of it, which decides what is done.
struct Causes {
  constexpr Causes(Fault only = Fault::none) NONBLOCKING { add(only); }
  constexpr void add(const Causes& later) NONBLOCKING {
    first = first_of(first, later.first);
    all |= later.all;
  }
  constexpr void add(Fault later) NONBLOCKING {
    if (later != Fault::none) {
      first = first_of(first, later);
      all |= 1U << static_cast<unsigned>(later);
    }
  }
  Fault first = Fault::none;
  std::uint32_t all = 0;  // bit: Fault
};
static_assert(kFaults <= 32);

}  // namespace punctum::rt
