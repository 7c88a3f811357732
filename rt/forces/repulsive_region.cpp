#include "rt/forces/repulsive_region.hpp"

#include <cmath>

namespace punctum::rt {

Pull repulsive_push(const RepulsiveParams& params, double position_scale, const hal::Vec3& centre_m,
                    const hal::Vec3& tip_m) noexcept {
  const hal::Vec3 V = tip_m - centre_m;
  const double left = 1 - V.squaredNorm() / (params.radius_m * params.radius_m);
  Pull push;
  if (!(left > 0)) return push;
  const double rho_m = position_scale * params.radius_m;
  push.force_N = params.K_N_m * position_scale * left * left * V;
  push.energy_J = params.K_N_m * rho_m * rho_m / 6 * left * left * left;
  return push;
}

hal::Vec3 RepulsiveRegion::step(const hal::Vec3& tip_m, const hal::Vec3& cell_centre_m, bool on,
                                double dt_s) noexcept {
  const double gain_before = ramp_.gain();
  if (!on && gain_before == 0) {
    stored_J_ = 0;
    ramp_.set(0);
    return hal::Vec3::Zero();
  }
  const hal::Vec3 target = cell_centre_m + params_.offset_m;
  double energy_before = 0;
  if (gain_before == 0) {
    centre_m_ = target;
  } else {
    energy_before = gain_before * repulsive_push(params_, scale_, centre_m_, tip_m).energy_J;
    centre_m_ += (1 - std::exp(-dt_s / (params_.ramp_s / 4))) * (target - centre_m_);
  }
  ramp_.step(on, params_.ramp_s, params_.ramp_s, dt_s);
  const Pull push = repulsive_push(params_, scale_, centre_m_, tip_m);
  stored_J_ = ramp_.gain() * push.energy_J;
  injected_J_ += stored_J_ - energy_before;
  return ramp_.gain() * push.force_N;
}

}  // namespace punctum::rt
