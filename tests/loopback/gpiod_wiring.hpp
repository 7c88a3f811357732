// How the loopback tests wire the simulated chip.
#pragma once

#include "hal/gpiod/config.hpp"
#include "tests/loopback/gpio_sim.hpp"

namespace punctum::loopback {

inline constexpr int kContactA = 0, kContactB = 1, kReset = 2, kHeartbeat = 3, kGate = 4, kValve = 5;

inline gpiod::GpiodParams wiring(const GpioSim& board) {
  gpiod::GpiodParams params;
  params.chip = board.path();
  params.contact_a = kContactA;
  params.contact_b = kContactB;
  params.reset = kReset;
  params.heartbeat = kHeartbeat;
  params.gate = kGate;
  params.valve_contact = kValve;
  return params;
}

}  // namespace punctum::loopback
