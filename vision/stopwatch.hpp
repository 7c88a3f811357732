// Microseconds between two places of the program.
#pragma once

#include <algorithm>
#include <chrono>

namespace punctum::vision {

class Stopwatch {
 public:
  double lap_us() {  // since the last lap, or the beginning; never 0
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
