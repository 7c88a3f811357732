#include "rt/control/force_limits.hpp"

#include <algorithm>

#include "hal/frames.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

constexpr double kSoftHysteresis = 0.9;  // of the soft limit of the tip force, so that it does not flicker
constexpr double kLongestStep = 2;       // nominal periods: a late tick is no licence for a leap

// What is left of `last`, straight towards zero by `falls` at most, of what `wanted` has no more of.
[[nodiscard]] hal::Vec3 let_go(const hal::Vec3& last, const hal::Vec3& wanted, double falls) NONBLOCKING {
  const double size = last.norm();
  if (!(size > 0 && falls > 0)) {
    return last;
  }
  const double kept = std::clamp(wanted.dot(last) / size, std::max(size - falls, 0.0), size);
  return last * (kept / size);
}

}  // namespace

ForceLimits::ForceLimits(const LimitParams& limits, double rate_Hz) NONBLOCKING
    : limits_(limits),
      longest_step_s_(kLongestStep / rate_Hz) {}

LimitedForces ForceLimits::step(const hal::Vec3& wanted_N, double law_N, const Readings& readings,
                                const hal::Vec3& last_N, double dt_s, double commanded_N) NONBLOCKING {
  LimitedForces out;
  // The law's or the measured one, whichever is larger: a sensor that hangs at zero lifts no limit.
  const double tip_N = readings.sensor_fresh ? std::max(law_N, readings.sensor_filtered_N) : law_N;
  const double soft_N = limits_.tip_force_soft_N;
  tip_force_soft_ = tip_N > (tip_force_soft_ ? kSoftHysteresis * soft_N : soft_N);
  out.tip_force_soft = tip_force_soft_;
  if (tip_force_soft_) {
    out.alarms |= alarm_tip_force;
  }
  if (tip_N > limits_.tip_force_hard_N) {
    out.fault = Fault::tip_force;
  }

  const LimitedForce hand =
      limit_hand_force(hand_from_world(wanted_N), std::min(limits_.hand_force_N, commanded_N));
  if (hand.limited) {
    out.alarms |= alarm_force_limited;
  }
  if (!hand.finite) {
    out.fault = first_of(out.fault, Fault::not_finite);
  }
  if (hand.finite) {
    // Between two forces within the limit: within the limit.
    const double step_s = std::min(dt_s, longest_step_s_);
    const hal::Vec3 from_N = let_go(last_N, hand.force_N, kSlew_N_s * (dt_s - step_s));
    const hal::Vec3 change = hand.force_N - from_N;
    const double most_N = kSlew_N_s * step_s;
    const double size_N = change.norm();
    out.hand_force_N = size_N > most_N ? hal::Vec3(from_N + change * (most_N / size_N)) : hand.force_N;
  }
  return out;
}

}  // namespace punctum::rt
