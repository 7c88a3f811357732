// Withdrawal along the insertion axis: after the puncture the tip may move back only along the line it came
// in.
//
// A lateral well, U = K k_p^2 Psi(r) with the soft spring Psi of ramp.hpp, free along the axis; in withdrawal
// a one-way damper resists motion into the cell (it only dissipates, so it adds no energy).
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

[[nodiscard]] Pull axis_pull(const AxisParams& params, double position_scale, const FixtureFrame& frame,
                             const hal::Vec3& tip_m) noexcept;

class WithdrawalAxis {
 public:
  WithdrawalAxis(const AxisParams& params, double position_scale) noexcept
      : params_(params), scale_(position_scale) {}

  // One tick. `line` is taken over while the gain is zero and stays until the gain is zero again. velocity:
  // of the hand, world axes. outward_only: the one-way damper acts.
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& tip_m, const hal::Vec3& velocity_m_s,
                               const FixtureFrame& line, bool on, bool outward_only, double dt_s) noexcept;

  [[nodiscard]] double stored_energy_J() const noexcept { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const noexcept { return injected_J_; }  // signed, cumulative
  [[nodiscard]] const FixtureFrame& frame() const noexcept { return frame_; }
  // Upper bound now, at the hand, of the well's Hessian: K psi' and K psi/r are at most K.
  [[nodiscard]] double stiffness_N_m() const noexcept { return ramp_.gain() * params_.K_N_m; }
  // Of the one-way damper, now; and its part of the force.
  [[nodiscard]] double B_Ns_m() const noexcept { return one_way_.gain() * params_.B_inward_Ns_m; }
  [[nodiscard]] const hal::Vec3& one_way_N() const noexcept { return one_way_N_; }

 private:
  AxisParams params_;
  double scale_;
  FixtureFrame frame_;
  Ramp ramp_;
  Ramp one_way_;
  hal::Vec3 one_way_N_ = hal::Vec3::Zero();
  double stored_J_ = 0;
  double injected_J_ = 0;
};

}  // namespace punctum::rt
