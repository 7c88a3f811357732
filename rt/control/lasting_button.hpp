// A button counts once it has lasted, pressed or let go: a finger stays for longer than interference lasts.
// One that is down when its device appears has to be let go first.
#pragma once

#include <algorithm>

#include "hal/realtime.hpp"

namespace punctum::rt {

class LastingButton {
 public:
  static constexpr double kLasts_s = 0.02;  // interference: one period of the mains

  // A new sample, since_s after the one before.
  void step(bool down, double since_s) NONBLOCKING {
    differs_s_ = down != down_ && differed_ ? std::min(differs_s_ + since_s, 2 * kLasts_s) : 0;
    differed_ = down != down_;
    if (differs_s_ > kLasts_s) {
      down_ = down;
      muted_ = false;
      differed_ = false;
    }
  }
  [[nodiscard]] bool pressed() const NONBLOCKING { return down_ && !muted_; }
  // It counts again when it is pressed anew.
  void mute() NONBLOCKING { *this = LastingButton(); }

 private:
  bool down_ = true;
  bool muted_ = true;      // down, but for nothing
  bool differed_ = false;  // in the sample before
  double differs_s_ = 0;   // since the first sample that said so
};

}  // namespace punctum::rt
