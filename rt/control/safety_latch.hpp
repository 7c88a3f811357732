// The safety latch: a stop, once there, stays until someone releases it on purpose.
//
// running -> stopping (quick stop, injector gate shut, hand force to zero) -> stopped (drive power off) ->
// running, the last only by: contacts closed, cause gone, and a rising edge of the reset button seen while
// stopped. Nothing moves by itself afterwards: the servo anchors the mapping anew and the hand force returns
// by a ramp. Linux reaches no ISO 13849 performance level; the hard-wired relay behind the heartbeat is the
// safety function.
#pragma once

#include <array>
#include <cstdint>

#include "rt/control/config.hpp"
#include "rt/forces/ramp.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

enum class SafetyAction : std::uint8_t {
  none,
  quick_stop,          // within the tick that saw the level
  gate_shut,           // the same tick
  hand_force_to_zero,  // over EstopParams::hand_ramp_s at most
  heartbeat_off,       // once stopped: loop or gate are not to be trusted, the relay shall open
  drive_power_off,     // at standstill or after EstopParams::power_off_after_s
};
// The holding vacuum appears nowhere: a stop never touches it, releasing it loses the cell.

enum class ClearedBy : std::uint8_t {
  never,
  release_and_reset,  // contacts closed, the cause gone, then a rising edge of the reset button
};

inline constexpr int kMaxSafetyActions = 5;
struct SafetyRule {
  Fault cause;
  std::array<SafetyAction, kMaxSafetyActions> actions;  // in this order
  ClearedBy cleared_by;
};

// cause -> what is done, in this order -> what clears it
inline constexpr auto kSafetyRules = [] {
  using enum SafetyAction;
  using enum ClearedBy;
  using A = std::array<SafetyAction, kMaxSafetyActions>;
  constexpr A stop{quick_stop, gate_shut, hand_force_to_zero, drive_power_off};
  constexpr A stop_and_relay{quick_stop, gate_shut, hand_force_to_zero, drive_power_off, heartbeat_off};
  return std::array<SafetyRule, kFaults>{{
      {Fault::none, A{}, never},
      {Fault::estop, stop, release_and_reset},
      {Fault::estop_discrepancy, stop, release_and_reset},
      {Fault::estop_lost, stop_and_relay, release_and_reset},
      {Fault::hand_lost, stop, release_and_reset},
      {Fault::hand_invalid, stop, release_and_reset},
      {Fault::stage_lost, stop, release_and_reset},
      {Fault::stage_fault, stop, release_and_reset},
      {Fault::stage_following, stop, release_and_reset},
      {Fault::tip_force, stop, release_and_reset},
      {Fault::overrun, stop_and_relay, release_and_reset},
      {Fault::not_finite, stop_and_relay, release_and_reset},
      {Fault::command_stop, stop, never},
      {Fault::vacuum_lost, stop, release_and_reset},
      {Fault::injector_open, stop_and_relay, release_and_reset},
  }};
}();

[[nodiscard]] constexpr const SafetyRule& safety_rule(Fault cause) noexcept {
  return kSafetyRules[static_cast<std::size_t>(cause)];
}
[[nodiscard]] constexpr bool asks_for(Fault cause, SafetyAction action) noexcept {
  for (const SafetyAction a : safety_rule(cause).actions) {
    if (a == action) return true;
  }
  return false;
}
static_assert([] {
  for (int i = 0; i < kFaults; ++i) {
    if (kSafetyRules[static_cast<std::size_t>(i)].cause != static_cast<Fault>(i)) return false;
    if (i > 0 && (kSafetyRules[static_cast<std::size_t>(i)].actions[0] != SafetyAction::quick_stop ||
                  kSafetyRules[static_cast<std::size_t>(i)].actions[1] != SafetyAction::gate_shut)) {
      return false;
    }
  }
  return true;
}());

struct LatchInput {
  Fault cause = Fault::none;    // what is wrong on this tick, the most urgent; none if nothing is
  bool chain_readable = true;   // the e-stop chain was read on this tick
  bool contacts_closed = true;  // both
  bool reset_pressed = false;
  bool at_standstill = true;  // of the stage
};

// What the servo has to do on this tick.
struct LatchOutput {
  bool quick_stop = false;
  bool gate_shut = false;
  double hand_gain = 1;  // of the last force before the stop
  bool drive_power = true;
  bool heartbeat = true;
  bool cleared = false;  // on this tick: anchor anew, ramp the force in
};

class SafetyLatch {
 public:
  // All it remembers.
  struct State {
    StopStage stage = StopStage::running;
    Fault cause = Fault::none;  // the first
    bool reset_was = true;      // a button held from the start is no edge
    double since_s = 0;         // since the stop, up to power_off_after_s
    double hand = 1;            // of the hand's ramp, 1 .. 0
    friend bool operator==(const State&, const State&) = default;
  };

  explicit SafetyLatch(const EstopParams& params) noexcept : SafetyLatch(params, State{}) {}
  SafetyLatch(const EstopParams& params, const State& state) noexcept : params_(params), state_(state) {}

  LatchOutput step(const LatchInput& in, double dt_s) noexcept;

  [[nodiscard]] StopStage stage() const noexcept { return state_.stage; }
  [[nodiscard]] Fault cause() const noexcept { return state_.cause; }
  [[nodiscard]] const State& state() const noexcept { return state_; }

 private:
  EstopParams params_;
  State state_;
};

}  // namespace punctum::rt
