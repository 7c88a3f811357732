// The velocity of the hand, estimated from its readings as the scene's VelocityParams say.
#pragma once

#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/velocity.hpp"

namespace punctum::rt {

class HandVelocity {
 public:
  HandVelocity(const VelocityParams& params, double rate_Hz) NONBLOCKING;

  // m/s, device frame; from one sample to the next the last estimate counts. 0 where the hand begins or
  // leaps.
  const hal::Vec3& step(const Readings& readings, double dt_s) NONBLOCKING;

 private:
  void restart() NONBLOCKING;

  std::optional<Kalman> kalman_;
  std::optional<Foaw> foaw_;
  double smooth_s_;
  hal::Vec3 estimated_m_s_ = hal::Vec3::Zero();
  hal::Vec3 smoothed_m_s_ = hal::Vec3::Zero();
};

}  // namespace punctum::rt
