// The safety latch: a stop stays until the operator releases it on purpose.
//
// running -> stopping (quick stop, injector gate shut, hand force to zero) -> stopped (drive power off) ->
// running, the last only by: contacts closed, cause gone, and a press of the reset button that begins after
// both, while stopped; after a release of the enabling device, and nothing else, by a new press of that.
// Nothing moves by itself afterwards: the servo anchors the mapping anew and the hand force returns by a
// ramp. Linux reaches no ISO 13849 performance level; the hard-wired relay behind the heartbeat is the safety
// function.
#pragma once

#include <array>
#include <cstdint>

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/ramp.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

struct EstopParams {
  double discrepancy_s = 0.05;     // contacts may differ this long, those of an enabling switch too
  double hand_ramp_s = 0.02;       // hand force to zero
  double power_off_after_s = 0.5;  // drive power off at standstill or after this
};
constexpr auto keys_of(const EstopParams*) {
  return hal::keys(hal::milli("discrepancy_ms", &EstopParams::discrepancy_s, 1, 1000),
                   hal::milli("hand_ramp_ms", &EstopParams::hand_ramp_s, 0, 20),
                   hal::milli("power_off_after_ms", &EstopParams::power_off_after_s, 10, 5000));
}

enum class SafetyAction : std::uint8_t {
  none,
  quick_stop,          // within the tick that saw the level
  gate_shut,           // the same tick
  hand_force_to_zero,  // over EstopParams::hand_ramp_s at most
  heartbeat_off,       // once stopped: loop, gate or drive are not to be trusted, the relay shall open
  drive_power_off,     // at standstill or after EstopParams::power_off_after_s
};
// The holding vacuum appears nowhere: a stop never touches it, releasing it loses the cell.

enum class ClearedBy : std::uint8_t {
  never,
  release_and_reset,  // contacts closed, the cause gone, then a new press of the reset button
  release_and_press,  // contacts closed, then a new press of the enabling device
};

inline constexpr int kMaxSafetyActions = 5;
struct SafetyRule {
  Fault cause;
  std::array<SafetyAction, kMaxSafetyActions> actions;  // in this order
  ClearedBy cleared_by;
};

// The heartbeat says "this loop runs, and it can stop this drive". Where it cannot be said it ends, with the
// first cause or with a later one, and does not return before the reset. It ends once the stop is over, not
// with its first tick: even of a drive that is not read or does not follow, the quick stop may still brake on
// its ramp, within EstopParams::power_off_after_s, while a drive whose power the relay cuts only coasts.
//
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
      {Fault::stage_lost, stop_and_relay, release_and_reset},
      {Fault::stage_fault, stop_and_relay, release_and_reset},
      {Fault::stage_following, stop_and_relay, release_and_reset},
      {Fault::tip_force, stop, release_and_reset},
      {Fault::overrun, stop_and_relay, release_and_reset},
      {Fault::not_finite, stop_and_relay, release_and_reset},
      {Fault::command_stop, stop, never},
      {Fault::vacuum_lost, stop, release_and_reset},
      {Fault::injector_open, stop_and_relay, release_and_reset},
      {Fault::stage_not_stopping, stop_and_relay, release_and_reset},
      {Fault::stage_not_enabled, stop, release_and_reset},
      {Fault::enabling_released, stop, release_and_press},
      {Fault::enabling_fault, stop, release_and_reset},
  }};
}();

[[nodiscard]] constexpr const SafetyRule& safety_rule(Fault cause) NONBLOCKING {
  return kSafetyRules[static_cast<std::size_t>(cause)];
}
[[nodiscard]] constexpr bool asks_for(Fault cause, SafetyAction action) NONBLOCKING {
  for (const SafetyAction a : safety_rule(cause).actions) {
    if (a == action) {
      return true;
    }
  }
  return false;
}
static_assert([] {
  for (int i = 0; i < kFaults; ++i) {
    if (kSafetyRules[static_cast<std::size_t>(i)].cause != static_cast<Fault>(i)) {
      return false;
    }
    if (i > 0 && (kSafetyRules[static_cast<std::size_t>(i)].actions[0] != SafetyAction::quick_stop ||
                  kSafetyRules[static_cast<std::size_t>(i)].actions[1] != SafetyAction::gate_shut)) {
      return false;
    }
  }
  return true;
}());

// The faults that ask for heartbeat_off; bit: Fault.
inline constexpr std::uint32_t kDistrusted = [] {
  std::uint32_t all = 0;
  for (int i = 0; i < kFaults; ++i) {
    all |= asks_for(static_cast<Fault>(i), SafetyAction::heartbeat_off) ? 1U << i : 0U;
  }
  return all;
}();

struct LatchInput {
  Causes causes;                // what is wrong on this tick
  bool chain_readable = true;   // the e-stop chain was read on this tick
  bool contacts_closed = true;  // both
  bool reset_pressed = false;
  bool at_standstill = true;  // of the stage
  bool drive_obeys = true;    // it stops and loses its power when it is told to, as far as a stop has shown
  bool pressed_anew = false;  // the enabling device, on this tick
  bool reset_down = false;    // the button, for however short a time; reset_pressed: for long enough
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
    bool reset_spent = true;    // the button is no new press until it was seen up
    bool reset_needed = false;  // a cause of this stop asks for the reset button
    double since_s = 0;         // since the stop, up to power_off_after_s
    double hand = 1;            // of the hand's ramp, 1 .. 0
    bool distrusted = false;    // something during this stop asked for heartbeat_off
    friend bool operator==(const State&, const State&) = default;
  };

  explicit SafetyLatch(const EstopParams& params) NONBLOCKING : SafetyLatch(params, State{}) {}
  SafetyLatch(const EstopParams& params, const State& state) NONBLOCKING : params_(params), state_(state) {}

  LatchOutput step(const LatchInput& in, double dt_s) NONBLOCKING;

  [[nodiscard]] StopStage stage() const NONBLOCKING { return state_.stage; }
  [[nodiscard]] Fault cause() const NONBLOCKING { return state_.cause; }
  [[nodiscard]] const State& state() const NONBLOCKING { return state_; }

 private:
  EstopParams params_;
  State state_;
};

}  // namespace punctum::rt
