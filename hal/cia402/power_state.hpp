// The power state machine of a drive (CiA 402, 6040h and 6041h): what the statusword says, and the
// controlword for the next step.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::cia402 {

enum class PowerState : std::uint8_t {
  not_ready,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction,
  fault,
  unknown,  // no pattern of the standard
};

[[nodiscard]] constexpr PowerState power_state(std::uint16_t statusword) NONBLOCKING {
  switch (statusword & 0x4FU) {
    case 0x00:
      return PowerState::not_ready;
    case 0x40:
      return PowerState::switch_on_disabled;
    case 0x08:
      return PowerState::fault;
    case 0x0F:
      return PowerState::fault_reaction;
    default:
      break;
  }
  switch (statusword & 0x6FU) {
    case 0x21:
      return PowerState::ready_to_switch_on;
    case 0x23:
      return PowerState::switched_on;
    case 0x27:
      return PowerState::operation_enabled;
    case 0x07:
      return PowerState::quick_stop_active;
    default:
      return PowerState::unknown;
  }
}

[[nodiscard]] constexpr const char* name_of(PowerState state) {
  switch (state) {
    case PowerState::not_ready:
      return "not ready to switch on";
    case PowerState::switch_on_disabled:
      return "switch-on disabled";
    case PowerState::ready_to_switch_on:
      return "ready to switch on";
    case PowerState::switched_on:
      return "switched on";
    case PowerState::operation_enabled:
      return "operation enabled";
    case PowerState::quick_stop_active:
      return "quick stop active";
    case PowerState::fault_reaction:
      return "fault reaction active";
    case PowerState::fault:
      return "fault";
    case PowerState::unknown:
      break;
  }
  return "a state that the standard does not know";
}

// The motor has power, or may have. A statusword that says nothing known does not say that it has none.
[[nodiscard]] constexpr bool powered(PowerState state) NONBLOCKING {
  switch (state) {
    case PowerState::not_ready:
    case PowerState::switch_on_disabled:
    case PowerState::ready_to_switch_on:
    case PowerState::fault:
      return false;
    default:
      return true;
  }
}

// Bits of the statusword beyond the state. In cyclic synchronous position: 12 the drive follows its
// set-point, 13 following error. In homing: 10 target reached, 12 homing attained, 13 homing error.
inline constexpr std::uint16_t kTargetReached = 1U << 10U;
inline constexpr std::uint16_t kFollows = 1U << 12U;
inline constexpr std::uint16_t kFollowingError = 1U << 13U;
inline constexpr std::uint16_t kHomingAttained = 1U << 12U;
inline constexpr std::uint16_t kHomingError = 1U << 13U;

inline constexpr std::uint16_t kDisableVoltage = 0x00;
inline constexpr std::uint16_t kQuickStop = 0x02;
inline constexpr std::uint16_t kShutdown = 0x06;
inline constexpr std::uint16_t kSwitchOn = 0x07;
inline constexpr std::uint16_t kEnableOperation = 0x0F;
inline constexpr std::uint16_t kStartHoming = 0x1F;
inline constexpr std::uint16_t kFaultReset = 0x80;  // on its rising edge

// One step towards operation. A fault is not left here: that takes a decision.
[[nodiscard]] constexpr std::uint16_t step_to_operation(PowerState state) NONBLOCKING {
  switch (state) {
    case PowerState::switch_on_disabled:
      return kShutdown;
    case PowerState::ready_to_switch_on:
      return kSwitchOn;
    case PowerState::switched_on:
    case PowerState::operation_enabled:
      return kEnableOperation;
    default:
      return kDisableVoltage;
  }
}

}  // namespace punctum::cia402
