// The devices of a scene, as the servo gets them.
#pragma once

#include "hal/devices.hpp"

namespace punctum::rt {

// The hand is always there; a null pointer is a thing the scene does not have.
struct Devices {
  hal::HapticDevice& hand;
  hal::Stage* stage = nullptr;
  hal::EstopChain* estop = nullptr;
  hal::Injector* injector = nullptr;
  hal::HoldingVacuum* vacuum = nullptr;
  hal::ForceSensor* force_sensor = nullptr;
  hal::EnablingSwitch* enabling = nullptr;  // null: the enabling device, if any, is a button of the hand
};

}  // namespace punctum::rt
