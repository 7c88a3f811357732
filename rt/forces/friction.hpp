// Dry friction at the hand: the hand can rest against it, and starts to move with a break-away force.
//
// A bristle of stiffness K between the hand and a point it adheres to (Hayward & Armstrong 2000, without
// creep): F = -K z, z from that point to the hand; beyond |z| = F_c/K the point is dragged along. A function
// of the path alone: it neither drifts under a resting force nor rings at rest, whatever the noise of the
// encoder. Work goes into the bristle, F_c^2/(2 K) at most, or is lost in sliding. Real-time safe.
#pragma once

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"

namespace punctum::rt {

// Dry friction at the hand.
struct FrictionParams {
  double F_c_N = 0.1;  // at which it slides
  double K_N_m = 100;  // of the bristle, until then
};
constexpr auto keys_of(const FrictionParams*) {
  return hal::keys(hal::real("F_c_N", &FrictionParams::F_c_N, 0, 10),
                   hal::real("K_N_m", &FrictionParams::K_N_m, 1, 3000));
}

class Friction {
 public:
  using Params = FrictionParams;
  static constexpr Gives kGives{.point = EnergyPoint::handle, .storing = true};

  Friction(const FrictionParams& params, const EffectSetup&) NONBLOCKING : params_(params) {}

  // While no force is rendered the bristle is released; then it adheres where the handle is.
  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING {
    const bool on = in.force_fade > 0;
    if (!on || !adheres_) {
      adheres_at_m_ = in.handle_m;
    }
    adheres_ = on;
    hal::Vec3 z_m = in.handle_m - adheres_at_m_;
    const double length_m = z_m.norm();
    const double longest_m = params_.F_c_N / params_.K_N_m;
    if (length_m > longest_m) {
      z_m *= longest_m / length_m;
      adheres_at_m_ = in.handle_m - z_m;
    }
    EffectOutput out;
    out.storing_N = -params_.K_N_m * z_m;
    out.stored_J = 0.5 * params_.K_N_m * z_m.squaredNorm();
    out.stiffness_N_m = adheres_ ? params_.K_N_m : 0;
    return out;
  }

 private:
  FrictionParams params_;
  hal::Vec3 adheres_at_m_ = hal::Vec3::Zero();
  bool adheres_ = false;
};

}  // namespace punctum::rt
