// What one tick did: core -> everyone. Plain data, lives in shared memory.
#pragma once

#include <cstdint>

namespace punctum::rt {

// Phases of an injection, in order. One cell goes through them once.
enum class Phase : std::uint8_t { free, contact, indentation, puncture, injection, withdrawal, clear };
inline constexpr int kPhases = 7;
[[nodiscard]] constexpr const char* name(Phase p) noexcept {
  constexpr const char* names[kPhases] = {"free",      "contact",    "indentation", "puncture",
                                          "injection", "withdrawal", "clear"};
  return names[static_cast<int>(p)];
}

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
  stage_following,  // following error above its limit
  tip_force,        // tip force above its hard limit
  overrun,          // too many missed ticks in the window (real actuators only)
  not_finite,       // a force or set-point was not finite
  command_stop,     // someone asked for a stop
  vacuum_lost,      // holding vacuum below its limit while a cell is held
  injector_open,    // the injector stays open although its gate is shut
};
inline constexpr int kFaults = 15;
[[nodiscard]] constexpr const char* name(Fault f) noexcept {
  constexpr const char* names[] = {
      "none",         "estop",      "estop_discrepancy", "estop_lost",      "hand_lost",
      "hand_invalid", "stage_lost", "stage_fault",       "stage_following", "tip_force",
      "overrun",      "not_finite", "command_stop",      "vacuum_lost",     "injector_open"};
  static_assert(sizeof names == kFaults * sizeof names[0]);
  return names[static_cast<int>(f)];
}

// Conditions that do not stop the station but must be seen. Bits; they go when their cause goes.
enum Alarm : std::uint32_t {
  alarm_vision_stale = 1U << 0,        // force fades, only withdrawal is accepted, the gate is shut
  alarm_force_limited = 1U << 1,       // the hand's force is at its limit
  alarm_depth_limited = 1U << 2,       // penetration or far-wall limit holds the needle
  alarm_travel_limited = 1U << 3,      // workspace, velocity or acceleration limit holds the needle
  alarm_tip_force = 1U << 4,           // soft tip-force limit holds the needle
  alarm_model_invalid = 1U << 5,       // the membrane law is outside its assumptions
  alarm_phase_timeout = 1U << 6,       // a phase takes longer than it should
  alarm_overrun = 1U << 7,             // too many missed ticks (simulated actuators)
  alarm_sensor = 1U << 8,              // a device returned no or unusable data this tick
  alarm_degraded = 1U << 9,            // running without real-time rights
  alarm_stiffness_reduced = 1U << 10,  // the passivity guard renders less than was asked for
};
inline constexpr const char* kAlarmNames[] = {  // by bit
    "vision_stale",  "force_limited", "depth_limited", "travel_limited", "tip_force",        "model_invalid",
    "phase_timeout", "overrun",       "sensor",        "degraded",       "stiffness_reduced"};

enum class StopStage : std::uint8_t { running, stopping, stopped };  // of the safety latch

struct TelemetrySample {
  std::uint64_t tick = 0;  // of the absolute grid: gaps are missed releases
  double t_s = 0;          // since the start of the run
  Phase phase = Phase::free;
  Fault fault = Fault::none;
  StopStage stop = StopStage::running;
  std::uint8_t estop = 0;  // bit 0 contact a open, bit 1 contact b open, bit 2 reset pressed
  std::uint32_t alarms = 0;
  std::uint32_t buttons = 0;
  std::uint32_t cell = 0;  // counts cells of this run from 0

  double x_m[3] = {};      // hand, device frame
  double v_m_s[3] = {};    // hand velocity, filtered
  double tip_m[3] = {};    // needle tip by the stage's encoders
  double cmd_m[3] = {};    // stage set-point
  double force_N[3] = {};  // to the hand, after guard and limits

  // Magnitudes of the parts, at the hand.
  double membrane_N = 0;
  double cone_N = 0;
  double axis_N = 0;
  double damping_N = 0;
  double guard_N = 0;

  // The local membrane model, at the needle.
  double wd_m = 0;
  double a_m = 0;
  double R_m = 0;
  double tip_force_N = 0;             // membrane law, not scaled
  double sigma_d_Pa = 0;              // membrane stress of eq. 4
  double pressure_Pa = 0;             // internal pressure of eq. 4
  double entry_m[3] = {};             // entry point in the stage's frame
  double axis[3] = {};                // approach axis
  double contact_force_N[4][3] = {};  // membrane force as vectors at four points of the pipette's rim

  double obs_age_s = 0;  // age of the newest observation; -1 if none yet
  double sensor_N = 0;   // force sensor, 0 if there is none
  double vacuum_Pa = 0;
  double stored_energy_J = 0;    // in the effects, at the hand
  double injected_energy_J = 0;  // by moving or switching fixtures and by vibration, cumulative
  double obs_gap_m = 0;          // newest observation's gap, for comparison
  std::uint64_t observations = 0;
  std::uint64_t stale_ticks = 0;  // ticks on which the newest observation was too old
  std::uint8_t injector_open = 0;
  std::uint8_t pad[7] = {};
  double repulsive_N = 0;  // more parts, as above
  double friction_N = 0;
  double vibration_N = 0;
};

}  // namespace punctum::rt
