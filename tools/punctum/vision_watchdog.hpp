// Notices that vision hangs: its loop goes round with every frame, and ten times a second without one. A loop
// that does not is stuck, or its process is stopped; a camera without frames is no such thing.
#pragma once

#include <algorithm>
#include <cstdint>

namespace punctum::tools {

class VisionWatchdog {
 public:
  // A frame takes some 30 ms. A machine on which it takes 300 times as long is no reason to kill; the
  // core fades the force and accepts only withdrawal long before. In virtual time the core waits for vision,
  // and calls it hung after twice the time.
  static constexpr double kHung_s = 10, kHungVirtual_s = 15;
  static constexpr double kStart_s = 30;  // to load its libraries, and a station's tables
  static constexpr double kStep_s = 0.5;  // while this program did not run, nobody has watched

  explicit VisionWatchdog(bool real_time) : hung_s_(real_time ? kHung_s : kHungVirtual_s) {}

  void started(double now_s, std::uint64_t rounds) {
    rounds_ = rounds;
    watched_s_ = now_s;
    silent_s_ = 0;
    allowed_s_ = kStart_s;
  }
  // Once per round of the parent: whether vision hangs.
  [[nodiscard]] bool hangs(double now_s, std::uint64_t rounds) {
    if (rounds != rounds_) {
      rounds_ = rounds;
      silent_s_ = 0;
      allowed_s_ = hung_s_;
    } else {
      silent_s_ += std::min(now_s - watched_s_, kStep_s);
    }
    watched_s_ = now_s;
    return silent_s_ > allowed_s_;
  }
  [[nodiscard]] double silent_s() const { return silent_s_; }

 private:
  double hung_s_;
  double allowed_s_ = kStart_s;
  double silent_s_ = 0, watched_s_ = 0;
  std::uint64_t rounds_ = 0;
};

}  // namespace punctum::tools
