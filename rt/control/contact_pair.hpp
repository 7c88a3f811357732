// Two contacts of one device that open and close together. When they have differed for longer than a window,
// one of them no longer does what it should: that is remembered until both were seen open together.
#pragma once

#include <algorithm>

#include "hal/realtime.hpp"

namespace punctum::rt {

class ContactPair {
 public:
  explicit ContactPair(double window_s) NONBLOCKING : window_s_(window_s) {}

  // Once per tick.
  void step(bool a_closed, bool b_closed, double elapsed_s) NONBLOCKING {
    differ_s_ += a_closed != b_closed ? elapsed_s : -kAgreementCounts * elapsed_s;
    discrepancy_ = discrepancy_ || differ_s_ > window_s_;
    differ_s_ = std::clamp(differ_s_, 0.0, 2 * window_s_);
    if (!a_closed && !b_closed) {
      discrepancy_ = false;
      differ_s_ = 0;
    }
  }
  [[nodiscard]] bool discrepancy() const NONBLOCKING { return discrepancy_; }

 private:
  // A contact that chatters disagrees with the other one again and again: agreement makes up for a tenth of
  // it.
  static constexpr double kAgreementCounts = 0.1;

  double window_s_;
  double differ_s_ = 0;
  bool discrepancy_ = false;
};

}  // namespace punctum::rt
