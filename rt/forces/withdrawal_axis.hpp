// Withdrawal along the insertion axis: after the puncture the tip may move back only along the line it came
// in.
//
// A lateral well, U = K k_p^2 Psi(r) with the soft spring Psi of ramp.hpp, free along the axis; in withdrawal
// a one-way damper resists motion into the cell (it only dissipates, so it adds no energy).
#pragma once

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

// Withdrawal along the insertion axis only.
struct AxisParams {
  double K_N_m = 150;   // lateral, at the hand
  double eps_m = 1e-6;  // width of the C1 ramp (needle scale)
  double ramp_s = 0.2;
  double B_inward_Ns_m = 5;  // in withdrawal, against motion back into the cell; 0 = off
};
constexpr auto keys_of(const AxisParams*) {
  return hal::keys(hal::real("K_N_m", &AxisParams::K_N_m, 0, 3000),
                   hal::micro("eps_um", &AxisParams::eps_m, 0.01, 100),
                   hal::real("ramp_s", &AxisParams::ramp_s, 0.001, 5),
                   hal::real("B_inward_Ns_m", &AxisParams::B_inward_Ns_m, 0, 100));
}

[[nodiscard]] PotentialForce axis_pull(const AxisParams& params, double position_scale,
                                       const FixtureFrame& frame, const hal::Vec3& tip_m) NONBLOCKING;

class WithdrawalAxis {
 public:
  using Params = AxisParams;
  static constexpr Gives kGives{.point = EnergyPoint::fixture_point, .storing = true, .dissipative = true};

  WithdrawalAxis(const AxisParams& params, const EffectSetup& /*setup*/) NONBLOCKING : params_(params) {}

  // On while the needle is inside a known cell. The line of insertion is taken over while the gain is zero
  // and stays until the gain is zero again.
  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

  [[nodiscard]] double stored_energy_J() const NONBLOCKING { return stored_J_; }
  [[nodiscard]] double injected_energy_J() const NONBLOCKING { return injected_J_; }  // signed, cumulative
  [[nodiscard]] const FixtureFrame& frame() const NONBLOCKING { return frame_; }

 private:
  AxisParams params_;
  FixtureFrame frame_;
  Ramp ramp_;
  Ramp one_way_;
  double stored_J_ = 0;
  double injected_J_ = 0;
};

}  // namespace punctum::rt
