#include "rt/executive/monotonic_clock.hpp"

#include <cerrno>
#include <ctime>

#include "hal/realtime.hpp"

// Answered in the calling thread from a page of the kernel's (vDSO), without a system call.
extern "C" int clock_gettime(clockid_t, timespec*) NONBLOCKING;

namespace punctum::rt {
namespace {
constexpr std::int64_t kSecond = 1'000'000'000;
}

std::int64_t MonotonicClock::now_ns() const NONBLOCKING {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * kSecond + t.tv_nsec;
}

void MonotonicClock::sleep_until_ns(std::int64_t t_ns) noexcept {
  const timespec t{t_ns / kSecond, t_ns % kSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace punctum::rt
