// Times of the stages of one frame.
#pragma once

#include <algorithm>
#include <chrono>

namespace punctum::vision {

class Stopwatch {
 public:
  // Microseconds since the last lap or the beginning. Never 0, which says that a stage did not run.
  double lap_us() {
    const auto now = Clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    return std::max(us, 1e-3);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

}  // namespace punctum::vision
