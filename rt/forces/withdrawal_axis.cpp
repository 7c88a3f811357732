#include "rt/forces/withdrawal_axis.hpp"

#include <algorithm>

namespace punctum::rt {
namespace {

constexpr double kOneWayRamp_s = 0.05;

}  // namespace

PotentialForce axis_pull(const AxisParams& params, double position_scale, const FixtureFrame& frame,
                         const hal::Vec3& tip_m) NONBLOCKING {
  const hal::Vec3 V = tip_m - frame.entry_m;
  const hal::Vec3 lateral = V - frame.axis.dot(V) * frame.axis;
  const double r = lateral.norm();
  PotentialForce pull;
  if (!(r > 0)) {
    return pull;
  }
  const double KkP = params.K_N_m * position_scale;
  pull.force_N = -KkP * soft_spring(r, params.eps_m) / r * lateral;
  pull.energy_J = KkP * position_scale * soft_spring_energy(r, params.eps_m);
  return pull;
}

EffectOutput WithdrawalAxis::step(const EffectInput& in) NONBLOCKING {
  EffectOutput out;
  const bool on = in.cell_known && in.inside_cell;
  const double last_gain = ramp_.gain();
  if (last_gain == 0) {
    ramp_.set(0);
    if (!on) {
      stored_J_ = 0;
      one_way_.set(0);
      return out;
    }
    frame_ = in.insertion;
  }
  const PotentialForce pull = axis_pull(params_, in.position_scale, frame_, in.fixture_point_m);
  ramp_.step(on, params_.ramp_s, params_.ramp_s, in.dt_s);
  one_way_.step(on && in.withdrawing, kOneWayRamp_s, kOneWayRamp_s, in.dt_s);
  stored_J_ = ramp_.gain() * pull.energy_J;
  const double last_injected_J = injected_J_;
  injected_J_ += (ramp_.gain() - last_gain) * pull.energy_J;

  // Of the Hessian: K psi' and K psi/r are at most K.
  out.storing_N = ramp_.gain() * pull.force_N;
  out.stored_J = stored_J_;
  out.injected_J = injected_J_ - last_injected_J;
  out.stiffness_N_m = ramp_.gain() * params_.K_N_m;

  const double inward_m_s = std::max(frame_.axis.dot(in.handle_velocity_m_s), 0.0);
  out.damping_Ns_m = one_way_.gain() * params_.B_inward_Ns_m;
  out.dissipative_N = -out.damping_Ns_m * inward_m_s * frame_.axis;
  return out;
}

}  // namespace punctum::rt
