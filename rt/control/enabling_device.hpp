// The enabling device: a button that the operator holds for the station to move.
//
// A press counts that began after the button was seen let go: one that is held from the start, or through a
// stop, enables nothing. Squeezed to its third position it is a stop, and must be let go altogether before
// the next press.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/station/fault.hpp"

namespace punctum::rt {

class EnablingDevice {
 public:
  explicit EnablingDevice(double release_s) NONBLOCKING : release_s_(release_s) {}

  // A new sample of the handle's buttons; before step().
  void read(std::uint32_t buttons) NONBLOCKING {
    squeezed_ = (buttons & hal::kButtonPanic) != 0;
    held_ = (buttons & hal::kButtonEnable) != 0 && !squeezed_;
    pressed_ = held_ && let_go_;
    let_go_ = !held_ && !squeezed_;
  }

  // Once per tick. running: no stop is latched.
  [[nodiscard]] Fault step(bool running, double elapsed_s) NONBLOCKING {
    press_ = pressed_;
    pressed_ = false;
    if (!running) {
      enabled_ = press_;  // and stays so if this press ends the stop
      released_s_ = 0;
      return Fault::none;
    }
    enabled_ = enabled_ || press_;
    released_s_ = enabled_ && !held_ ? released_s_ + elapsed_s : 0;
    if (released_s_ > release_s_ || (enabled_ && squeezed_)) {
      enabled_ = false;
      return Fault::enabling_released;
    }
    return Fault::none;
  }

  [[nodiscard]] bool enabled() const NONBLOCKING { return enabled_; }
  [[nodiscard]] bool pressed_anew() const NONBLOCKING { return press_; }  // on this tick

 private:
  double release_s_;
  bool held_ = false;
  bool squeezed_ = false;
  bool let_go_ = false;
  bool pressed_ = false;  // since the last tick
  bool press_ = false;    // on this tick
  bool enabled_ = false;
  double released_s_ = 0;
};

}  // namespace punctum::rt
