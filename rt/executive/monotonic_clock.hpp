// The machine's own clock: CLOCK_MONOTONIC, absolute sleeps. The only system calls of the real-time loop.
#pragma once

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

class MonotonicClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const NONBLOCKING override;
  void sleep_until_ns(std::int64_t t_ns) noexcept override;  // signals do not shorten it
};

}  // namespace punctum::rt
