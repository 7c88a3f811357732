// The limits of forces, last of all before the safety latch: the needle's on the cell, the hand's on the
// operator.
#pragma once

#include <cstdint>
#include <limits>

#include "hal/realtime.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/limits.hpp"

namespace punctum::rt {

struct LimitedForces {
  hal::Vec3 hand_force_N = hal::Vec3::Zero();  // device frame, bounded, without a jolt, and finite
  bool tip_force_soft = false;                 // the needle is not pushed further
  Fault fault = Fault::none;
  std::uint32_t alarms = 0;
};

class ForceLimits {
 public:
  // No device needs to change its force faster. It is 3 N in 10 ms: a handle of 75 g that nobody holds has
  // then moved by 0.7 mm, where a leap of 3 N would have thrown it 2 mm. Injections without a fault stay
  // below 50 N/s. A tick that comes late lets go of what the force should have lost meanwhile: a handle that
  // it has thrown is not pushed on while it comes down.
  static constexpr double kSlew_N_s = 300;

  ForceLimits(const LimitParams& limits, double rate_Hz) NONBLOCKING;

  // wanted_N: world axes. law_N: the needle's force by the membrane law. last_N: what was written to the hand
  // on the last tick, device frame. commanded_N: a lower limit of the hand's force than the scene's.
  [[nodiscard]] LimitedForces step(const hal::Vec3& wanted_N, double law_N, const Readings& readings,
                                   const hal::Vec3& last_N, double dt_s,
                                   double commanded_N = std::numeric_limits<double>::infinity()) NONBLOCKING;

  [[nodiscard]] bool last_tip_force_soft() const NONBLOCKING { return tip_force_soft_; }

 private:
  LimitParams limits_;
  double longest_step_s_;
  bool tip_force_soft_ = false;
};

}  // namespace punctum::rt
