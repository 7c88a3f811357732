#include "rt/forces/membrane.hpp"

#include <algorithm>
#include <numbers>

namespace punctum::rt {
namespace {

// Below this depth the law is continued linearly to zero: F ~ w there, and nothing underflows.
constexpr double kLinearBelow_m = 1e-12;
constexpr double kRelease_s = 0.03;  // force to zero after the puncture: no bounce, no step

}  // namespace

MembraneState membrane_law(const MembraneParams& params, double wd_m, double R_m, double scale) noexcept {
  MembraneState s;
  s.valid = true;
  if (!(wd_m > 0)) return s;

  const double w = std::max(wd_m, kLinearBelow_m);
  const double reach = dimple_reach(R_m, w, scale);
  const double c = params.c_m;
  const double a = c + reach;
  const auto shape = membrane_shape(c, reach);
  const double slope_of_dimple = w / a;
  const double force = 2 * std::numbers::pi * params.E_Pa * params.h_m * w * slope_of_dimple *
                       slope_of_dimple / (1 - params.nu) * shape.f;

  // Eq. 4 with the profile w(r) = k [ln(a/r) - (a^2-r^2)/(2a^2)], k = F/(2 pi h sigma_d), w(c) = w_d.
  const double k = w / shape.half_D;
  const double to_zero = wd_m / w;
  s.force_N = force * to_zero;
  s.a_m = c + dimple_reach(R_m, wd_m, scale);
  s.sigma_d_Pa = force / (2 * std::numbers::pi * params.h_m * k);
  s.pressure_Pa = s.force_N / (std::numbers::pi * a * a);
  // dlnF/dlnw = 3 + (dlnF/dlna) (dlna/dlnw), and dlna/dlnw = reach / 2a by the closure.
  s.stiffness_N_m = force / w * (3 - (2 + shape.steepness) * reach / (2 * a));
  s.slope = k * (reach / a) * (1 + c / a) / c;  // -w'(c) = k (1/c - c/a^2)
  s.small_slope = s.slope <= kMembraneSlopeMax;
  s.valid = s.small_slope && params.h_m <= c && a < R_m;
  return s;
}

RimForces rim_forces(const MembraneState& state, double force_N, const hal::Vec3& axis) noexcept {
  RimForces out;
  for (hal::Vec3& f : out) f.setZero();
  if (!(force_N > 0) || !(state.slope > 0)) return out;
  const hal::Vec3 aside = std::abs(axis.z()) < 0.9 ? hal::Vec3::UnitZ() : hal::Vec3::UnitY();
  const hal::Vec3 e1 = axis.cross(aside).normalized();
  const hal::Vec3 e2 = axis.cross(e1);
  const double share = force_N / kRimPoints;
  const double pull = share / state.slope;  // cot(theta) of the axial share
  const std::array<hal::Vec3, kRimPoints> radial{e1, e2, -e1, -e2};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = -share * axis + pull * radial[i];
  return out;
}

void Membrane::step(double wd_m, double R_m, double scale, bool punctured, double dt_s) noexcept {
  if (punctured && !punctured_) {
    punctured_ = true;
    force_at_puncture_N_ = state_.force_N;
    dropped_J_ = stored_J_;
    since_puncture_s_ = 0;
  }
  if (!punctured_) {
    state_ = membrane_law(params_, wd_m, R_m, scale);
    stored_J_ = state_.force_N * std::max(wd_m, 0.0) / 4;
    return;
  }
  since_puncture_s_ += std::max(dt_s, 0.0);
  const double left = 1 - smooth_step(since_puncture_s_ / kRelease_s);
  const double slope = state_.slope;  // the vectors keep their directions while they fade
  state_ = MembraneState{};
  state_.valid = true;
  state_.force_N = force_at_puncture_N_ * left;
  state_.slope = slope;
  stored_J_ = 0;
}

void Membrane::rearm() noexcept {
  punctured_ = false;
  force_at_puncture_N_ = 0;
  stored_J_ = 0;
  state_ = MembraneState{};
}

}  // namespace punctum::rt
