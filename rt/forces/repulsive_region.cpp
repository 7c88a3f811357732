#include "rt/forces/repulsive_region.hpp"

#include <cmath>

namespace punctum::rt {

PotentialForce repulsive_push(const RepulsiveParams& params, double position_scale, const hal::Vec3& centre_m,
                              const hal::Vec3& tip_m) NONBLOCKING {
  const hal::Vec3 V = tip_m - centre_m;
  const double left = 1 - V.squaredNorm() / (params.radius_m * params.radius_m);
  PotentialForce push;
  if (!(left > 0)) {
    return push;
  }
  const double rho_m = position_scale * params.radius_m;
  push.force_N = params.K_N_m * position_scale * left * left * V;
  push.energy_J = params.K_N_m * rho_m * rho_m / 6 * left * left * left;
  return push;
}

EffectOutput RepulsiveRegion::step(const EffectInput& in) NONBLOCKING {
  EffectOutput out;
  const double last_gain = ramp_.gain();
  if (!in.cell_known && last_gain == 0) {
    stored_J_ = 0;
    ramp_.set(0);
    return out;
  }
  const hal::Vec3 target = in.cell_centre_m + params_.offset_m;
  double last_energy_J = 0;
  if (last_gain == 0) {
    centre_m_ = target;
  } else {
    last_energy_J =
        last_gain * repulsive_push(params_, in.position_scale, centre_m_, in.fixture_point_m).energy_J;
    centre_m_ += low_pass_part(in.dt_s, params_.ramp_s / 4) * (target - centre_m_);
  }
  ramp_.step(in.cell_known, params_.ramp_s, params_.ramp_s, in.dt_s);
  const PotentialForce push = repulsive_push(params_, in.position_scale, centre_m_, in.fixture_point_m);
  stored_J_ = ramp_.gain() * push.energy_J;
  const double last_injected_J = injected_J_;
  injected_J_ += stored_J_ - last_energy_J;

  out.storing_N = ramp_.gain() * push.force_N;
  out.stored_J = stored_J_;
  out.injected_J = injected_J_ - last_injected_J;
  out.stiffness_N_m = stored_J_ > 0 ? ramp_.gain() * params_.K_N_m : 0;
  return out;
}

}  // namespace punctum::rt
