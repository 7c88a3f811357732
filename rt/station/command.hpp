// What others may ask of the core, and who may ask for what.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

// The core checks the range; what is out of range or not the writer's to ask is counted and dropped. Changes
// of a value are ramped.
struct Command {
  enum Kind : std::uint64_t {
    none,
    stop,         // latched safe stop (Fault::command_stop); value unused
    end,          // end the task where that is safe: at once outside, inside when drawn back; value unused
    force_scale,  // value: 0 .. 1 of the scene's force scale
    effect_gain,  // target: rt::Effect of the scene; value: 0 .. 1 of the scene's effect
    hand_force_limit,  // value: newtons, more than 0, up to the scene's hand-force limit
    // value: hand metres per needle metre, within the scene's bounds; from when hand and needle are next
    // uncoupled on, by clutch or stop
    position_scale,
    depth_limit,  // value: metres past the membrane, more than 0, up to the scene's penetration depth
  };
  std::uint64_t kind = none;
  double value = 0;
  std::uint64_t target = 0;
};
inline constexpr int kCommandKinds = 8;

// As report.json has it.
[[nodiscard]] constexpr const char* name(Command::Kind kind) NONBLOCKING {
  constexpr const char* names[] = {"none",           "stop",        "end",
                                   "force_scale",    "effect_gain", "hand_force_limit",
                                   "position_scale", "depth_limit"};
  static_assert(sizeof names == kCommandKinds * sizeof names[0]);
  return names[static_cast<int>(kind)];
}

// Kinds of command that a writer may use: bit k stands for kind k.
using CommandKinds = std::uint32_t;
[[nodiscard]] constexpr CommandKinds kinds() NONBLOCKING { return 0; }
template <class... More>
[[nodiscard]] constexpr CommandKinds kinds(Command::Kind first, More... more) NONBLOCKING {
  return (1U << first) | kinds(more...);
}
[[nodiscard]] constexpr bool contains(CommandKinds allowed, std::uint64_t kind) NONBLOCKING {
  return kind < 32 && ((allowed >> kind) & 1U) != 0;
}

// Each writer has a queue of its own; its role is the kinds of command that the core takes from it.
struct CommandWriter {
  const char* name;  // also of its segment
  CommandKinds role;
};
inline constexpr CommandWriter kParent = {"parent", kinds(Command::stop, Command::end, Command::force_scale)};
// Whoever operates the running station from outside.
inline constexpr CommandWriter kConsole = {
    "console", kinds(Command::stop, Command::end, Command::force_scale, Command::effect_gain,
                     Command::hand_force_limit, Command::position_scale, Command::depth_limit)};

// Everybody who may ask, in the order in which the core takes their commands. The place in this table is the
// writer's number in an event.
inline constexpr const CommandWriter* kCommandWriters[] = {&kParent, &kConsole};
inline constexpr std::size_t kCommandWriterCount = sizeof kCommandWriters / sizeof kCommandWriters[0];

}  // namespace punctum::rt
