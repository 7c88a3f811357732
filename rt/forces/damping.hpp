// Viscous damping F = -B v (the paper omits the sign): B1 outside, B2 > B1 inside the cell.
// Dissipative for any B(t) >= 0; B is ramped so that switching is not felt as a step.
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

class Damping {
 public:
  explicit Damping(const DampingParams& params) noexcept : params_(params) {}

  // `inside` must be latched by the caller (from the puncture until the needle is clear).
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& velocity_m_s, bool inside, double dt_s) noexcept {
    ramp_.step(inside, params_.ramp_s, params_.ramp_s, dt_s);
    return -B_Ns_m() * velocity_m_s;
  }
  [[nodiscard]] double B_Ns_m() const noexcept {
    return params_.B1_Ns_m + ramp_.gain() * (params_.B2_Ns_m - params_.B1_Ns_m);
  }

 private:
  DampingParams params_;
  Ramp ramp_;
};

}  // namespace punctum::rt
