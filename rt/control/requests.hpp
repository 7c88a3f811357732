// What was asked of the core from outside: by the command queues, by signals of the process, by its time
// limit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/effects.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {

inline constexpr std::size_t kCommandsPerTick = 8;  // of each writer, so that a full queue makes no tick late

struct TakenCommand {
  Command command;
  std::uint32_t writer = 0;  // place in kCommandWriters
  bool obeyed = false;
};

struct Requested {
  bool stop = false;                     // latched safe stop
  bool end = false;                      // end of the task, where that is safe
  bool end_here = false;                 // end of the task wherever the needle is
  double force_scale = 1;                // 0 .. 1, ramped
  EffectGains effect_gain = kFullGains;  // 0 .. 1, ramped
  bool reduces_effects = false;          // these are not all 1
  double hand_force_N = 0;               // limit, ramped; never above the scene's
  double depth_limit_m = 0;              // past the membrane, ramped; never above the scene's
  double position_scale = 500;           // taken over while hand and needle are uncoupled
  std::uint64_t refused = 0;             // commands out of range, or not of their writer's role
  std::array<TakenCommand, kCommandsPerTick * kCommandWriterCount> taken{};  // on this tick
  std::size_t taken_count = 0;
};

class Requests {
 public:
  Requests(const ServoConfig& config, Station& station) NONBLOCKING;

  // Once per tick: takes the commands that wait, a few at a time.
  const Requested& take(double dt_s) NONBLOCKING;

  void stop() NONBLOCKING { requested_.stop = true; }
  void end() NONBLOCKING { requested_.end = true; }
  void end_here() NONBLOCKING { requested_.end_here = true; }
  [[nodiscard]] const Requested& requested() const NONBLOCKING { return requested_; }

 private:
  void approach_targets(double dt_s) NONBLOCKING;
  [[nodiscard]] bool obey(const Command& command, CommandKinds role) NONBLOCKING;  // false: refused

  Station& station_;
  std::array<bool, effect_count> effect_exists_{};
  double most_hand_force_N_;
  double most_depth_m_;
  double least_position_scale_;
  double most_position_scale_;
  Requested requested_;
  double force_scale_target_ = 1;
  EffectGains effect_gain_target_ = kFullGains;
  double hand_force_target_N_;
  double depth_target_m_;
  bool at_targets_ = true;
};

}  // namespace punctum::rt
