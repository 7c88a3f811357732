// Waiting for another process to move a word in shared memory: short sleeps, bounded. Only the clock and what
// is not real-time wait.
#pragma once

#include <sched.h>
#include <time.h>

#include <cstdint>

namespace punctum::sim {

[[nodiscard]] inline std::int64_t real_now_ns() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

class Waiting {
 public:
  explicit Waiting(std::int64_t timeout_ns) noexcept : timeout_ns_(timeout_ns) {}

  // A little while; false once timeout_ns of real time have passed since the first call.
  [[nodiscard]] bool pause() noexcept {
    if (rounds_++ < kYields) {
      sched_yield();
      if (rounds_ == 1) end_ns_ = real_now_ns() + timeout_ns_;
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
