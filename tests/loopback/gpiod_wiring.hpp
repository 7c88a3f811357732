// How the loopback tests wire the simulated chip.
#pragma once

#include "hal/gpiod/config.hpp"
#include "tests/loopback/gpio_sim.hpp"

namespace punctum::loopback {

inline constexpr int kContactA = 0, kContactB = 1, kReset = 2, kHeartbeat = 3, kGate = 4, kValve = 5,
                     kEnablingA = 6, kEnablingB = 7, kEnable = 8, kVacuumGate = 9, kVacuumSwitch = 10;

inline gpiod::GpiodParams wiring(const GpioSim& board) {
  gpiod::GpiodParams params;
  params.chip = board.path();
  params.contact_a = kContactA;
  params.contact_b = kContactB;
  params.reset = kReset;
  params.heartbeat = kHeartbeat;
  params.gate = kGate;
  params.valve_contact = kValve;
  params.enabling_a = kEnablingA;
  params.enabling_b = kEnablingB;
  params.enable = kEnable;
  params.vacuum_gate = kVacuumGate;
  params.vacuum_switch = kVacuumSwitch;
  params.vacuum_switch_Pa = 20'000;
  return params;
}

}  // namespace punctum::loopback
