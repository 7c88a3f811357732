#include "rt/control/tick_timing.hpp"

#include <algorithm>
#include <cmath>

#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

constexpr double kLongestStep_s = 0.02;  // one late tick advances ramps and filters by no more
constexpr double kShortestStep = 0.1;    // of the nominal period: no two ticks count as nearer than this
// A reading of the clock is believed up to this much past the period that the executive measured: wake-ups
// come late by less, and one wrong reading does not carry the core's time away.
constexpr double kSlack_s = 0.01;
constexpr double kLongestGap_s = 1e6;

}  // namespace

TickTiming::TickTiming(const ServoConfig& config, bool degraded) NONBLOCKING
    : nominal_s_(1 / config.rate_Hz),
      missed_limit_(static_cast<std::uint64_t>(config.overrun_limit)),
      real_actuators_(config.real_actuators),
      standing_alarms_(degraded ? alarm_degraded : 0U) {}

// Three say how long it was: the period that was measured, the clock, and the place on the grid. The one
// between the others counts: a single one that is wrong shortens no time-out and lengthens none.
double TickTiming::voted_s(const TickInfo& now, double told_s) const NONBLOCKING {
  const double clock_s = 1e-9 * static_cast<double>(now.start_ns - last_start_ns_);
  const double grid_s = nominal_s_ * static_cast<double>(now.tick - last_tick_);
  return std::clamp(told_s, std::min(clock_s, grid_s), std::max(clock_s, grid_s));
}

TickTime TickTiming::step(const TickInfo& now) NONBLOCKING {
  TickTime time;
  time.first = !stepped_;
  time.alarms = standing_alarms_;
  const bool valid = std::isfinite(now.period_s) && now.period_s > 0;
  const double told_s = valid ? now.period_s : nominal_s_;
  time.elapsed_s = std::max(stepped_ ? voted_s(now, told_s) : told_s, kShortestStep * nominal_s_);
  const double most_s = std::min(time.elapsed_s + kSlack_s, kLongestGap_s);
  const std::int64_t latest_ns = last_ns_ + static_cast<std::int64_t>(most_s * 1e9);
  time.now_ns = stepped_ ? std::clamp(now.start_ns, last_ns_ + 1, latest_ns) : now.start_ns;
  last_ns_ = time.now_ns;
  last_tick_ = now.tick;
  last_start_ns_ = now.start_ns;
  stepped_ = true;
  time.dt_s = std::min(time.elapsed_s, kLongestStep_s);
  if (now.missed_in_window > missed_limit_) {
    if (real_actuators_) {
      time.fault = Fault::overrun;
    } else {
      time.alarms |= alarm_overrun;
    }
  }
  return time;
}

}  // namespace punctum::rt
