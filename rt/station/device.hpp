// The devices that the core reads, as bits of TelemetrySample::unusable.
#pragma once

#include <cstdint>

namespace punctum::rt {

enum DeviceBit : std::uint8_t {
  device_estop = 1U << 0,
  device_haptic = 1U << 1,
  device_enabling = 1U << 2,
  device_stage = 1U << 3,
  device_vacuum = 1U << 4,
  device_injector = 1U << 5,
  device_force_sensor = 1U << 6,
  device_vision = 1U << 7,  // an observation came and is not used
};
inline constexpr const char* kDeviceNames[] = {  // by bit: their tables in a scene
    "estop", "haptic", "enabling", "stage", "vacuum", "injector", "force_sensor", "vision"};

}  // namespace punctum::rt
