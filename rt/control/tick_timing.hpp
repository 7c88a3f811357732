// How much time a tick counts, whatever the clock reads, and whether too many ticks were missed.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/config.hpp"
#include "rt/station/fault.hpp"
#include "rt/station/tick_info.hpp"

namespace punctum::rt {

struct TickTime {
  std::int64_t now_ns = 0;  // rises: where the clock goes back it stands still until the clock is there again
  double elapsed_s = 0;     // really, since the last tick; > 0
  double dt_s = 0;          // bounded: what ramps and filters advance by
  bool first = false;
  Fault fault = Fault::none;
  std::uint32_t alarms = 0;
};

class TickTiming {
 public:
  // degraded: without real-time rights, which is an alarm on every tick.
  TickTiming(const ServoConfig& config, bool degraded) NONBLOCKING;

  [[nodiscard]] TickTime step(const TickInfo& now) NONBLOCKING;

 private:
  [[nodiscard]] double voted_s(const TickInfo& now, double told_s) const NONBLOCKING;

  double nominal_s_;
  std::uint64_t missed_limit_;
  bool real_actuators_;
  std::uint32_t standing_alarms_;
  bool stepped_ = false;
  std::int64_t last_ns_ = 0;  // as counted
  std::uint64_t last_tick_ = 0;
  std::int64_t last_start_ns_ = 0;
};

}  // namespace punctum::rt
