#include "rt/forces/membrane.hpp"

#include <numbers>

namespace punctum::rt {
namespace {

using std::numbers::pi;

// Below this depth the paper's law is continued linearly to zero: F ~ w there, and nothing underflows.
constexpr double kLinearBelow_m = 1e-12;
constexpr double kRelease_s = 0.03;  // force to zero after the puncture: no bounce, no step
constexpr double kSmallest = 1e-300;
constexpr double kSinMax = 0.999;
constexpr double kReachMax_m = 1e150;
constexpr double kLargest = 1e100;  // of E h and R in the corrected law: no product of theirs overflows

[[nodiscard]] double saturated(double x) NONBLOCKING {
  constexpr double most = std::numeric_limits<double>::max();
  return std::clamp(x, -most, most);
}

void saturate(MembraneState& s) NONBLOCKING {
  for (double* x : {&s.force_N, &s.a_m, &s.sigma_d_Pa, &s.pressure_Pa, &s.slope, &s.pull_N, &s.stiffness_N_m,
                    &s.energy_J}) {
    *x = saturated(*x);
  }
}

// The paper's law with the closure, at one depth.
struct PaperPoint {
  double c, reach, a, force;
  MembraneShape<double> shape;
};
[[nodiscard]] PaperPoint paper_point(const MembraneParams& params, double w, double R_m, double scale)
    NONBLOCKING {
  PaperPoint p{};
  p.c = std::clamp(params.c_m, kSmallest, kReachMax_m);
  p.reach = std::clamp(dimple_reach(R_m, w, scale), kSmallest, kReachMax_m);
  p.a = p.c + p.reach;
  p.shape = membrane_shape(p.c, p.reach);
  p.force = eq5(params.E_Pa, params.nu, params.h_m, w, p.a, p.shape.f);
  return p;
}

// Integral of F dw from contact, by Gauss' rule in sqrt(w): of the closure there is no closed form.
[[nodiscard]] double paper_energy(const MembraneParams& params, double w, double R_m, double scale)
    NONBLOCKING {
  constexpr double node[] = {0.04691007703066802, 0.23076534494715845, 0.5, 0.76923465505284155,
                             0.95308992296933198};
  constexpr double weight[] = {0.11846344252809454, 0.23931433524968323, 0.28444444444444444,
                               0.23931433524968323, 0.11846344252809454};
  double sum = 0;
  for (int i = 0; i < 5; ++i) {
    const double at = w * node[i] * node[i];
    sum += weight[i] * 2 * node[i] * paper_point(params, at, R_m, scale).force;
  }
  return w * sum;
}

[[nodiscard]] MembraneState paper_law(const MembraneParams& params, double wd_m, double R_m, double scale)
    NONBLOCKING {
  const double w = std::max(wd_m, kLinearBelow_m);
  const PaperPoint at = paper_point(params, w, R_m, scale);
  const double to_zero = wd_m / w;
  const double tilt = std::min(w / at.a, 1e100);

  // Eq. 4 with the profile w(r) = k [ln(a/r) - (a^2-r^2)/(2a^2)], k = F/(2 pi h sigma_d), w(c) = w_d.
  const double k = saturated(w / at.shape.half_D);
  MembraneState s;
  s.force_N = at.force * to_zero;
  s.a_m = at.c + dimple_reach(R_m, wd_m, scale);
  s.sigma_d_Pa = params.E_Pa / std::max(1 - params.nu, std::numeric_limits<double>::epsilon()) * tilt * tilt *
                 at.shape.f * at.shape.half_D;
  s.pressure_Pa = s.force_N / pi / at.a / at.a;
  // dlnF/dlnw = 3 + (dlnF/dlna) (dlna/dlnw), and dlna/dlnw = reach / 2a by the closure.
  s.stiffness_N_m =
      at.force / w * std::clamp(3 - (2 + at.shape.steepness) * (at.reach / (2 * at.a)), 0.0, 3.0);
  s.slope = k * (at.reach / at.a) * (1 + at.c / at.a) / at.c;  // -w'(c) = k (1/c - c/a^2)
  s.pull_N = s.slope > 0 ? s.force_N / s.slope : 0;
  s.energy_J = to_zero < 1 ? 0.5 * s.force_N * wd_m : paper_energy(params, wd_m, R_m, scale);
  s.shallow = s.slope <= kMembraneSlopeMax;
  s.valid = s.shallow && params.h_m <= params.c_m && at.a < R_m;
  return s;
}

// The cell's radius, and the pipette's over it, as far as numbers go.
struct Sizes {
  double R_m, c;
};
[[nodiscard]] Sizes sizes(const MembraneParams& params, double R_m) NONBLOCKING {
  const double R = std::clamp(R_m, kSmallest, kLargest);
  return {R, std::clamp(params.c_m / R, kSmallest, kLargest)};
}

[[nodiscard]] DeflectionCurve deflection_curve(const MembraneParams& params, double R_m) NONBLOCKING {
  const auto [R, c] = sizes(params, R_m);
  return DeflectionCurve({0, c, params.seat_m / R, params.nu, params.prestrain});
}

[[nodiscard]] MembraneState large_deflection_law(const MembraneParams& params, const DeflectionCurve& curve,
                                                 double wd_m, double R_m) NONBLOCKING {
  const auto [R, c] = sizes(params, R_m);
  const Deflection at = curve.at(wd_m / R);
  const double Eh = std::clamp(params.E_Pa * params.h_m, 0.0, kLargest);
  // Eq. 4 at the rim, where the membrane cannot be steeper than the needle; and its smooth edge, where
  // F = pi a^2 p: not within the pipette.
  const double up = at.force - pi * c * c * at.pressure;
  const double round_rim = std::max(2 * pi * c * at.tension, up / kSinMax);
  const double sine = std::max(up / round_rim, -kSinMax);
  const double cosine = std::sqrt(1 - sine * sine);
  MembraneState s;
  s.force_N = Eh * at.force * R;
  s.a_m = std::max(params.c_m, R * std::sqrt(at.force / (pi * at.pressure)));
  s.sigma_d_Pa = params.E_Pa * round_rim / (2 * pi * c);
  s.pressure_Pa = Eh * at.pressure / R;
  s.slope = sine / cosine;
  s.pull_N = Eh * R * round_rim * cosine;
  s.stiffness_N_m = Eh * at.stiffness;
  s.energy_J = Eh * R * at.energy * R;
  s.valid = s.shallow = at.calibrated;
  return s;
}

}  // namespace

double dimple_reach(double R_m, double wd_m, double scale) NONBLOCKING {
  return scale * std::sqrt(std::clamp(2 * R_m * wd_m, 0.0, std::numeric_limits<double>::max()));
}

MembraneLaw::MembraneLaw(const MembraneParams& params) NONBLOCKING : params_(params) {
  for (const double x : {params.E_Pa, params.nu, params.h_m, params.c_m, params.seat_m, params.prestrain}) {
    finite_ = finite_ && std::isfinite(x);
  }
}

MembraneState MembraneLaw::at(double wd_m, double R_m, double scale) NONBLOCKING {
  MembraneState s;
  if (!finite_ || !std::isfinite(wd_m) || !std::isfinite(R_m) || !std::isfinite(scale)) {
    s.force_N = std::numeric_limits<double>::quiet_NaN();
    s.shallow = false;
    return s;
  }
  s.valid = true;
  if (wd_m <= 0) {
    return s;
  }
  if (params_.law == MembraneParams::Law::paper) {
    s = paper_law(params_, wd_m, R_m, scale);
  } else {
    if (R_m != curve_R_m_) {
      curve_ = deflection_curve(params_, R_m);
      curve_R_m_ = R_m;
    }
    s = large_deflection_law(params_, curve_, wd_m, R_m);
  }
  saturate(s);
  return s;
}

RimForces rim_forces(const MembraneState& state, double force_N, const hal::Vec3& axis) NONBLOCKING {
  RimForces out;
  for (hal::Vec3& f : out) {
    f.setZero();
  }
  if (!(force_N > 0) || !(state.force_N > 0)) {
    return out;
  }
  const hal::Vec3 aside = std::abs(axis.z()) < 0.9 ? hal::Vec3::UnitZ() : hal::Vec3::UnitY();
  const hal::Vec3 e1 = axis.cross(aside).normalized();
  const hal::Vec3 e2 = axis.cross(e1);
  const double share = force_N / kRimPoints;
  const double pull = share * (state.pull_N / state.force_N);
  const std::array<hal::Vec3, kRimPoints> radial{e1, e2, -e1, -e2};
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = -share * axis + pull * radial[i];
  }
  return out;
}

EffectOutput Membrane::step(const EffectInput& in) NONBLOCKING {
  if (in.new_cell) {
    punctured_ = false;
    state_ = MembraneState{};
  }
  advance(in.cell_known ? in.depth_m : 0, in);

  const double scale = in.fixture_gain * setup_.force_scale * in.commanded_scale;
  double force_N = scale * state_.force_N;
  // After the puncture the hand's force only falls, even while fixture_gain and force_fade return.
  if (punctured_) {
    const double last_N = last_force_N_.norm() * std::min(in.last_force_fade, in.force_fade);
    force_N = in.force_fade > 0 ? std::min(force_N, last_N / in.force_fade) : 0;
  }
  last_force_N_ = -force_N * in.approach_axis;
  rim_ = rim_forces(state_, force_N, in.approach_axis);

  const double k_p = in.position_scale;
  EffectOutput out;
  out.storing_N = last_force_N_;
  out.stored_J = scale * state_.energy_J * k_p;
  out.injected_J = force_N * in.depth_correction_m * k_p;
  out.stiffness_N_m = in.fixture_gain * in.commanded_scale * setup_.force_scale / k_p * state_.stiffness_N_m;
  return out;
}

void Membrane::advance(double depth_m, const EffectInput& in) NONBLOCKING {
  if (in.punctured && !punctured_) {
    punctured_ = true;
    at_puncture_ = state_;
    dropped_J_ = state_.energy_J;
    since_puncture_s_ = 0;
  }
  if (!punctured_) {
    state_ = law_.at(depth_m, in.cell_radius_m, in.dimple_scale);
    return;
  }
  since_puncture_s_ += std::max(in.dt_s, 0.0);
  const double left = 1 - smooth_step(since_puncture_s_ / kRelease_s);
  state_ = MembraneState{};
  state_.valid = true;
  state_.force_N = at_puncture_.force_N * left;
  state_.pull_N = at_puncture_.pull_N * left;  // the vectors keep their directions while they fade
  state_.slope = at_puncture_.slope;
}

}  // namespace punctum::rt
