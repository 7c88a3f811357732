// Dry friction at the hand: something to rest against, so that the hand holds still and starts with a break.
//
// A bristle of stiffness K between the hand and a point it adheres to (Hayward & Armstrong 2000, without
// creep): F = -K z, z from that point to the hand; beyond |z| = F_c/K the point is dragged along. A function
// of the path alone: it neither drifts under a resting force nor rings at rest, whatever the noise of the
// encoder. Work goes into the bristle, F_c^2/(2 K) at most, or is lost in sliding. Real-time safe.
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

class Friction {
 public:
  explicit Friction(const FrictionParams& params) noexcept : params_(params) {}

  // on = false: the bristle lets go and takes hold afresh.
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& hand_m, bool on) noexcept {
    if (!on || !holds_) adheres_m_ = hand_m;
    holds_ = on;
    hal::Vec3 z_m = hand_m - adheres_m_;
    const double length_m = z_m.norm();
    const double longest_m = params_.F_c_N / params_.K_N_m;
    if (length_m > longest_m) {
      z_m *= longest_m / length_m;
      adheres_m_ = hand_m - z_m;
    }
    stored_J_ = 0.5 * params_.K_N_m * z_m.squaredNorm();
    return -params_.K_N_m * z_m;
  }

  [[nodiscard]] double stored_energy_J() const noexcept { return stored_J_; }
  [[nodiscard]] double stiffness_N_m() const noexcept { return holds_ ? params_.K_N_m : 0; }

 private:
  FrictionParams params_;
  hal::Vec3 adheres_m_ = hal::Vec3::Zero();
  bool holds_ = false;
  double stored_J_ = 0;
};

}  // namespace punctum::rt
