// Conditions that do not stop the station but that the operator must see.
#pragma once

#include <cstdint>

namespace punctum::rt {

// Bits of one word; each goes when its cause goes.
enum Alarm : std::uint32_t {
  alarm_vision_stale = 1U << 0,         // force fades, only withdrawal is accepted, the gate is shut
  alarm_force_limited = 1U << 1,        // the hand's force is at its limit
  alarm_depth_limited = 1U << 2,        // penetration or far-wall limit holds the needle
  alarm_travel_limited = 1U << 3,       // workspace, velocity or acceleration limit holds the needle
  alarm_tip_force = 1U << 4,            // soft tip-force limit holds the needle
  alarm_model_invalid = 1U << 5,        // the membrane law is outside its assumptions
  alarm_phase_timeout = 1U << 6,        // a phase takes longer than it should
  alarm_overrun = 1U << 7,              // too many missed ticks (simulated actuators)
  alarm_sensor = 1U << 8,               // a device returned no or unusable data this tick; which: device.hpp
  alarm_degraded = 1U << 9,             // running without real-time rights
  alarm_stiffness_reduced = 1U << 10,   // the passivity guard renders less than was asked for
  alarm_vision_implausible = 1U << 11,  // the newest observation claims what cannot be, and is not used
  alarm_lateral_limited = 1U << 12,     // sideways motion inside the cell is held
  alarm_not_enabled = 1U << 13,         // the enabling device was not pressed yet: no drive has power
  alarm_injection_refused = 1U << 14,   // the button is pressed inside, but the gate may not open
  alarm_forbidden_region = 1U << 15,    // dish floor or holding pipette hold the needle
};
inline constexpr const char* kAlarmNames[] = {  // by bit
    "vision_stale",    "force_limited", "depth_limited",     "travel_limited",
    "tip_force",       "model_invalid", "phase_timeout",     "overrun",
    "sensor",          "degraded",      "stiffness_reduced", "vision_implausible",
    "lateral_limited", "not_enabled",   "injection_refused", "forbidden_region"};

}  // namespace punctum::rt
