// What stopped the station, in words, and what to do next: one table for terminal and report.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "rt/control/safety_latch.hpp"
#include "rt/station/fault.hpp"

namespace punctum::tools {

struct FaultAdvice {
  rt::Fault fault;
  const char* cause;
  const char* next;
};

inline constexpr auto kFaultAdvice = [] {
  using enum rt::Fault;
  return std::array<FaultAdvice, rt::kFaults>{{
      {none, "", ""},
      {estop, "an emergency stop is pressed", "turn the pressed button to release it"},
      {estop_discrepancy, "the two contacts of the emergency stop disagree",
       "press and release the emergency stop fully; if it comes back, have its contacts and cable checked"},
      {estop_lost, "the emergency-stop chain cannot be read", "check its cable and supply"},
      {hand_lost, "the haptic handle is silent or disconnected", "check its cable and power"},
      {hand_invalid, "the handle reports positions that no hand can reach in the time",
       "check the handle's cable and calibrate it again"},
      {stage_lost, "the micromanipulator is silent or disconnected", "check its cable and power"},
      {stage_fault,
       "the micromanipulator's drive reports a fault of its own, or it has lost its power: the relay that "
       "watches the core's heartbeat has opened, for example since the control loop stalled",
       "read the drive's error code and remove its cause; where it has none, press the reset button, which "
       "closes the relay, and look into the report for late ticks"},
      {stage_following, "the needle does not follow the set-point: it is blocked, or the drive is weak",
       "look at the needle under the microscope before anything moves; remove what blocks it"},
      {tip_force, "the force at the needle's tip is above its hard limit",
       "look whether needle and cell are whole; withdraw by hand before the next approach"},
      {overrun, "the control loop missed too many ticks",
       "run `punctum check SCENE` for the missing real-time rights, and close other programs"},
      {not_finite, "a force or set-point was not a number",
       "keep this report and tell who maintains the program"},
      {command_stop, "a stop was asked for", "start a new run when the station is ready"},
      {vacuum_lost, "the holding pipette has lost its vacuum while a cell was held",
       "look whether the cell is still held; check the tubing before the next approach"},
      {injector_open, "the injector stays open although it was told to shut, or does not answer",
       "shut the pressure off by hand; do not approach a cell before it shuts again"},
      {stage_not_stopping, "the drive moves or keeps its power although it was told to stop",
       "cut the drive's power by the emergency stop, and have the drive checked"},
      {stage_not_enabled, "the drive does not take up operation",
       "check the drive's power, its enable input and its error code"},
      {enabling_released, "the enabling device was let go or squeezed",
       "take the handle again and press the enabling device to its middle position"},
      {enabling_fault, "the enabling switch cannot be read, or its two contacts disagree",
       "check the switch, its plug and its wires; let it go, so that both contacts are seen open"},
  }};
}();
static_assert([] {
  for (std::size_t i = 0; i < kFaultAdvice.size(); ++i) {
    if (kFaultAdvice[i].fault != static_cast<rt::Fault>(i)) {
      return false;
    }
  }
  return true;
}());

// What lets the station run again, from the latch's own table.
[[nodiscard]] constexpr const char* clearing_condition(rt::Fault fault) {
  for (const rt::SafetyRule& rule : rt::kSafetyRules) {
    if (rule.cause == fault) {
      switch (rule.cleared_by) {
        case rt::ClearedBy::never:
          return "not in this run";
        case rt::ClearedBy::release_and_reset:
          return "once the cause is gone and the emergency stop is released, by the reset button";
        case rt::ClearedBy::release_and_press:
          return "once the emergency stop is released, by pressing the enabling device anew";
      }
    }
  }
  return "";
}

// Of the fault that report.json calls so; none: no fault of this program has that name.
[[nodiscard]] constexpr std::optional<rt::Fault> fault_named(std::string_view name) {
  for (int i = 1; i < rt::kFaults; ++i) {
    if (name == rt::name(static_cast<rt::Fault>(i))) {
      return static_cast<rt::Fault>(i);
    }
  }
  return std::nullopt;
}

}  // namespace punctum::tools
