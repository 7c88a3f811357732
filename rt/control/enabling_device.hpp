// The enabling device: a button that the operator holds for the station to move.
//
// A press counts that began after the button was let go: one that is held from the start, or through a stop,
// enables nothing. Press and release have to last (lasting_button.hpp); the station stops for a shorter
// release too, after release_s. Squeezed to its third position it is a stop, and must be let go altogether
// before the next press.
#pragma once

#include <algorithm>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/control/lasting_button.hpp"
#include "rt/station/fault.hpp"

namespace punctum::rt {

class EnablingDevice {
 public:
  explicit EnablingDevice(double release_s) NONBLOCKING : release_s_(release_s) {}

  // A new sample of the handle's buttons, since_s after the one before; before step().
  void read(std::uint32_t buttons, double since_s) NONBLOCKING {
    squeezed_ = (buttons & hal::kButtonPanic) != 0;
    const bool down = (buttons & hal::kButtonEnable) != 0;
    held_ = down && !squeezed_;
    const bool before = button_.pressed();
    button_.step(down || squeezed_, since_s);
    if (squeezed_) {
      button_.mute();
    }
    pressed_ = button_.pressed() && !before;
  }

  // Once per tick. running: no stop is latched.
  [[nodiscard]] Fault step(bool running, double elapsed_s) NONBLOCKING {
    press_ = pressed_;
    pressed_ = false;
    // What is held when a stop begins, or ends by the reset button, is no new press.
    if (running != ran_ && !(running && enabled_)) {
      button_.mute();
    }
    ran_ = running;
    if (!running) {
      enabled_ = press_;  // and stays so if this press ends the stop
      released_s_ = 0;
      return Fault::none;
    }
    enabled_ = enabled_ || press_;
    released_s_ = enabled_ ? std::max(released_s_ + (held_ ? -kHeldCounts : 1) * elapsed_s, 0.0) : 0;
    if (released_s_ > release_s_ || (enabled_ && squeezed_)) {
      enabled_ = false;
      return Fault::enabling_released;
    }
    return Fault::none;
  }

  [[nodiscard]] bool enabled() const NONBLOCKING { return enabled_; }
  [[nodiscard]] bool pressed_anew() const NONBLOCKING { return press_; }  // on this tick

 private:
  // A contact that chatters is let go again and again: being held makes up for a tenth of it.
  static constexpr double kHeldCounts = 0.1;

  double release_s_;
  bool held_ = false;
  bool squeezed_ = false;
  LastingButton button_;
  bool ran_ = false;      // on the last tick
  bool pressed_ = false;  // since the last tick
  bool press_ = false;    // on this tick
  bool enabled_ = false;
  double released_s_ = 0;
};

}  // namespace punctum::rt
