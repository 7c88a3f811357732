// Microseconds between two places of the program.
#pragma once

#include <chrono>

namespace punctum::vision {

class Stopwatch {
 public:
  double lap_us() {  // since the last lap, or the beginning
    const auto now = Clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    return us;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

}  // namespace punctum::vision
