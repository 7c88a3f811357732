// Waiting for another process to move a word in shared memory: short sleeps, bounded. For the virtual
// clock and the takers of the bench; nothing in real time waits.
#pragma once

#include <sched.h>
#include <time.h>

#include <cstdint>

#include "hal/realtime.hpp"

// Answered in the calling thread from a page of the kernel's (vDSO), without a system call.
extern "C" int clock_gettime(clockid_t, timespec*) NONBLOCKING;

namespace punctum::sim {

[[nodiscard]] inline std::int64_t real_now_ns() NONBLOCKING {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

class Waiting {
 public:
  explicit Waiting(std::int64_t timeout_ns) noexcept : timeout_ns_(timeout_ns) {}

  // Sleeps briefly; false once timeout_ns of real time have passed since the first call.
  [[nodiscard]] bool pause() noexcept {
    if (rounds_ < kYields) {
      ++rounds_;
      sched_yield();
      if (rounds_ == 1) {
        end_ns_ = real_now_ns() + timeout_ns_;
      }
      return rounds_ > 1 || timeout_ns_ > 0;
    }
    timespec nap{};
    nap.tv_nsec = 50'000;
    nanosleep(&nap, nullptr);
    return real_now_ns() < end_ns_;
  }

 private:
  static constexpr int kYields = 20;
  std::int64_t timeout_ns_;
  std::int64_t end_ns_ = 0;
  int rounds_ = 0;
};

}  // namespace punctum::sim
