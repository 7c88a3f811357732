// Which input device of Linux is the hand, and how its counts become ways: table [evdev] of a scene.
#pragma once

#include <string>

#include "hal/parameters.hpp"

namespace punctum::evdev {

struct EvdevParams {
  std::string path;         // of the device; empty: it is looked for by its name
  std::string name;         // a part of what the kernel calls it; empty too: the only one that there is
  double count_m = 25e-6;   // of the hand, for one count of a mouse: as far as 1000 counts per inch go
  double wheel_m = 1e-3;    // of the hand, for one notch of its wheel
  double speed_m_s = 0.1;   // the hand goes no faster; at full deflection of a stick or knob as fast
  double dead_zone = 0.15;  // part of the deflection that counts as none
};
constexpr auto keys_of(const EvdevParams*) {
  return hal::keys(hal::text("path", &EvdevParams::path), hal::text("name", &EvdevParams::name),
                   hal::micro("count_um", &EvdevParams::count_m, 0.1, 1000),
                   hal::milli("wheel_mm", &EvdevParams::wheel_m, 0, 50),
                   hal::milli("speed_mm_s", &EvdevParams::speed_m_s, 1, 1000),
                   hal::real("dead_zone", &EvdevParams::dead_zone, 0, 0.9));
}

}  // namespace punctum::evdev
