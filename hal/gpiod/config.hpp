// Which GPIO lines the devices are wired to: table [gpiod] of a scene.
#pragma once

#include <cstdint>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::gpiod {

inline constexpr int kNotWired = -1;

// Offsets count the lines of the chip from 0. How the contacts are wired decides level and bias together, so
// that a cut wire reads as an open contact with either wiring.
struct GpiodParams {
  enum class Closed : std::uint8_t {
    high,  // contacts switch to the supply, a resistor pulls the input down
    low,   // contacts switch to ground, a resistor pulls the input up
  };
  enum class Pull : std::uint8_t { internal, external };  // whose resistor that is: the chip's or the board's
  enum class Level : std::uint8_t { high, low };          // of an output, when it is active

  std::string chip = "/dev/gpiochip0";
  Closed contacts_closed = Closed::high;
  Pull pull = Pull::internal;
  int contact_a = kNotWired;  // of the emergency stop: closed while it may run
  int contact_b = kNotWired;
  int reset = kNotWired;      // closed while it is pressed
  int heartbeat = kNotWired;  // to the relay that watches it
  int enable = kNotWired;     // to the drives: active while they are given power
  Level enable_active_at = Level::high;
  int gate = kNotWired;  // of the injector
  Level gate_opens_at = Level::high;
  int vacuum_gate = kNotWired;  // the valve between pump and holding pipette: held while it is claimed
  Level vacuum_holds_at = Level::high;
  int vacuum_switch = kNotWired;  // closed at vacuum_switch_Pa below ambient, or more
  double vacuum_switch_Pa = 0;
  int valve_contact = kNotWired;  // closed while the valve is shut; not wired: the gate's line is read back
  int enabling_a = kNotWired;     // of the enabling switch: closed in its middle position only
  int enabling_b = kNotWired;
};
constexpr auto keys_of(const GpiodParams*) {
  return hal::keys(hal::text("chip", &GpiodParams::chip),
                   hal::choice("contacts_closed", &GpiodParams::contacts_closed, "high", "low"),
                   hal::choice("pull", &GpiodParams::pull, "internal", "external"),
                   hal::whole("contact_a", &GpiodParams::contact_a, kNotWired, 1023),
                   hal::whole("contact_b", &GpiodParams::contact_b, kNotWired, 1023),
                   hal::whole("reset", &GpiodParams::reset, kNotWired, 1023),
                   hal::whole("heartbeat", &GpiodParams::heartbeat, kNotWired, 1023),
                   hal::whole("enable", &GpiodParams::enable, kNotWired, 1023),
                   hal::choice("enable_active_at", &GpiodParams::enable_active_at, "high", "low"),
                   hal::whole("gate", &GpiodParams::gate, kNotWired, 1023),
                   hal::choice("gate_opens_at", &GpiodParams::gate_opens_at, "high", "low"),
                   hal::whole("vacuum_gate", &GpiodParams::vacuum_gate, kNotWired, 1023),
                   hal::choice("vacuum_holds_at", &GpiodParams::vacuum_holds_at, "high", "low"),
                   hal::whole("vacuum_switch", &GpiodParams::vacuum_switch, kNotWired, 1023),
                   hal::kilo("vacuum_switch_kPa", &GpiodParams::vacuum_switch_Pa, 0, 100),
                   hal::whole("valve_contact", &GpiodParams::valve_contact, kNotWired, 1023),
                   hal::whole("enabling_a", &GpiodParams::enabling_a, kNotWired, 1023),
                   hal::whole("enabling_b", &GpiodParams::enabling_b, kNotWired, 1023));
}

}  // namespace punctum::gpiod
