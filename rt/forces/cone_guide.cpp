#include "rt/forces/cone_guide.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::rt {
namespace {

// The free core widens outside the membrane only; its slope comes in over this part of d0, so the force stays
// C1.
constexpr double kCoreBlend = 0.25;

// Integral of smooth_step(t/e) dt from 0: 0 inside, d - e/2 far outside, and its slope.
struct Widening {
  double value;
  double slope;
};
[[nodiscard]] Widening widening(double d, double e) NONBLOCKING {
  const double t = d / e;
  if (t <= 0) {
    return {0, 0};
  }
  if (t >= 1) {
    return {d - e / 2, 1};
  }
  return {e * t * t * t * t * (t * (t - 3) + 2.5), smooth_step(t)};
}

// 1 in front and down to d0 behind the membrane, 0 from 2 d0 behind it.
[[nodiscard]] Widening weight(double d, double d0) NONBLOCKING {
  const double u = d / d0;
  const double f = 1 / (1 + u * u);
  const double slope = -2 * u / d0 * f * f;
  const double t = u + 2;
  const double window = smooth_step(t);
  return {f * window, slope * window + f * smooth_step_slope(t) / d0};
}

// Moves a frame towards another with time constant tau_s, without a step; the axis stays a unit vector.
void follow_frame(FixtureFrame& frame, const FixtureFrame& target, double tau_s, double dt_s) NONBLOCKING {
  const double part = low_pass_part(dt_s, tau_s);
  frame.entry_m += part * (target.entry_m - frame.entry_m);
  const hal::Vec3 turned = frame.axis + part * (target.axis - frame.axis);
  const double length = turned.norm();
  frame.axis = length > 1e-3 ? hal::Vec3(turned / length) : target.axis;
}

}  // namespace

PotentialForce cone_pull(const Cone& cone, double position_scale, const FixtureFrame& frame,
                         const hal::Vec3& tip_m) NONBLOCKING {
  const hal::Vec3 V = tip_m - frame.entry_m;
  const double along = frame.axis.dot(V);
  const hal::Vec3 lateral = V - along * frame.axis;  // V - V_proj, eq. 6
  const double d = -along;
  const double r = lateral.norm();

  PotentialForce pull;
  if (cone.method == ConeParams::Method::paper) {
    const double f = cone.d0_m / (cone.d0_m + std::max(d, 0.0));
    pull.force_N = -cone.K_N_m * f * position_scale * lateral;
    pull.energy_J = 0.5 * cone.K_N_m * f * position_scale * position_scale * r * r;
    return pull;
  }

  const Widening f = weight(d, cone.d0_m);
  if (f.value == 0 && f.slope == 0) {
    return pull;
  }
  const Widening core = widening(d, kCoreBlend * cone.d0_m);
  const double delta = (r - cone.r0_m - cone.tan_alpha * core.value) * cone.cos_alpha;
  if (delta <= 0) {
    return pull;
  }

  const double spring = soft_spring(delta, cone.eps_m);
  const double energy = soft_spring_energy(delta, cone.eps_m);
  const double letting_go = 1 + 2 * energy / (cone.reach_m * cone.reach_m);
  const double phi = energy / letting_go;
  const double phi_slope = spring / (letting_go * letting_go);

  const double KkP = cone.K_N_m * position_scale;
  const double from_r = f.value * phi_slope * cone.cos_alpha;
  const double from_d = f.slope * phi - f.value * phi_slope * cone.tan_alpha * core.slope * cone.cos_alpha;
  // delta > 0 and r0 >= 0 mean r > 0. The gradient of d is -b.
  pull.force_N = -KkP * from_r / r * lateral + KkP * from_d * frame.axis;
  pull.energy_J = KkP * position_scale * f.value * phi;
  return pull;
}

// With t = 2 Phi/reach^2 in 0 .. 1, c = reach/d0 and unit vectors n (across the cone's surface), e (along the
// axis), n.e = -sin(alpha) at most, the Hessian over K is
//
//   f Phi'' n n^T + d0 f' c C (n e^T + e n^T) + (d0^2 f'' c^2 t/2 - f c C sin(alpha) d0 s') e e^T
//
// and f Phi' cos(alpha)/r <= 1 round the axis, where C(t) = Phi'/reach <= sqrt(t) (1-t)^(3/2) and
// -(4t-1)(1-t)^2 <= Phi'' <= (1-3t)(1-t)^2 as far as these are < 0, > 0 (psi^2 <= 2 Phi of the plain spring,
// >= 3/2 of it behind its ramp). s' is the slope of the core's widening, in 0 .. d0/4 only.
double cone_stiffness_bound_N_m(const ConeParams& params) NONBLOCKING {
  if (params.method == ConeParams::Method::paper) {
    return params.K_N_m;
  }
  struct Part {
    double f_slope;  // largest |f'| d0, and |f''| d0^2
    double f_bend;
    double widening;  // largest s' d0
  };
  constexpr Part kParts[] = {{0.444, 2.0, 1.875 / kCoreBlend}, {0.811, 2.0, 0}};  // 0 < d < d0/4; elsewhere
  constexpr int kSteps = 512;  // of sqrt(t), in which everything is smooth
  const double c = params.reach_m / params.d0_m;
  const double sin_alpha = math::sin(params.alpha_rad);
  double largest = 1;
  for (const Part& part : kParts) {
    // No factor changes faster with sqrt(t) than this: what a maximum between two steps may be missed by.
    const double steepest =
        2.5 + c * c * part.f_bend + c * (part.widening * sin_alpha + part.f_slope * (1 + sin_alpha));
    for (int i = 0; i <= kSteps; ++i) {
      const double root = static_cast<double>(i) / kSteps;
      const double t = root * root;
      const double C = c * root * (1 - t) * std::sqrt(1 - t);
      const double across = (1 - t) * (1 - t) * std::max({1 - 3 * t, 4 * t - 1, 0.0});
      const double along = c * c * t / 2 * part.f_bend + C * sin_alpha * part.widening;
      // Largest eigenvalue of across n n^T + along e e^T.
      const double half = (across - along) / 2;
      const double both =
          (across + along) / 2 + std::sqrt(half * half + across * along * sin_alpha * sin_alpha);
      largest = std::max(largest, both + C * part.f_slope * (1 + sin_alpha) + steepest / (2 * kSteps));
    }
  }
  return params.K_N_m * largest;
}

EffectOutput ConeGuide::step(const EffectInput& in) NONBLOCKING {
  EffectOutput out;
  const bool on = in.cell_known && !in.punctured;
  const double last_gain = ramp_.gain();
  if (!on && last_gain == 0) {
    stored_J_ = 0;
    ramp_.set(0);
    return out;
  }
  const FixtureFrame& target = in.cell_known ? in.entry : frame_;
  double last_energy_J = 0;
  if (last_gain == 0) {
    frame_ = target;
  } else {
    last_energy_J = last_gain * cone_pull(cone_, in.position_scale, frame_, in.fixture_point_m).energy_J;
    follow_frame(frame_, target, cone_.ramp_s / 4, in.dt_s);
  }
  ramp_.step(on, cone_.ramp_s, cone_.ramp_s, in.dt_s);
  const PotentialForce pull = cone_pull(cone_, in.position_scale, frame_, in.fixture_point_m);
  stored_J_ = ramp_.gain() * pull.energy_J;
  const double last_injected_J = injected_J_;
  injected_J_ += stored_J_ - last_energy_J;

  out.storing_N = ramp_.gain() * pull.force_N;
  out.stored_J = stored_J_;
  out.injected_J = injected_J_ - last_injected_J;
  out.stiffness_N_m = ramp_.gain() * stiffness_bound_N_m_;
  return out;
}

}  // namespace punctum::rt
