#include "rt/forces/withdrawal_axis.hpp"

#include <algorithm>

namespace punctum::rt {
namespace {

constexpr double kOneWayRamp_s = 0.05;

}  // namespace

Pull axis_pull(const AxisParams& params, double position_scale, const FixtureFrame& frame,
               const hal::Vec3& tip_m) noexcept {
  const hal::Vec3 V = tip_m - frame.entry_m;
  const hal::Vec3 lateral = V - frame.axis.dot(V) * frame.axis;
  const double r = lateral.norm();
  Pull pull;
  if (!(r > 0)) return pull;
  const double KkP = params.K_N_m * position_scale;
  pull.force_N = -KkP * soft_spring(r, params.eps_m) / r * lateral;
  pull.energy_J = KkP * position_scale * soft_spring_energy(r, params.eps_m);
  return pull;
}

hal::Vec3 WithdrawalAxis::step(const hal::Vec3& tip_m, const hal::Vec3& velocity_m_s,
                               const FixtureFrame& line, bool on, bool outward_only, double dt_s) noexcept {
  const double gain_before = ramp_.gain();
  if (gain_before == 0) {
    ramp_.set(0);
    if (!on) {
      stored_J_ = 0;
      one_way_.set(0);
      one_way_N_.setZero();
      return hal::Vec3::Zero();
    }
    frame_ = line;
  }
  const Pull pull = axis_pull(params_, scale_, frame_, tip_m);
  ramp_.step(on, params_.ramp_s, params_.ramp_s, dt_s);
  one_way_.step(on && outward_only, kOneWayRamp_s, kOneWayRamp_s, dt_s);
  stored_J_ = ramp_.gain() * pull.energy_J;
  injected_J_ += (ramp_.gain() - gain_before) * pull.energy_J;

  const double inward = std::max(frame_.axis.dot(velocity_m_s), 0.0);
  one_way_N_ = -B_Ns_m() * inward * frame_.axis;
  return ramp_.gain() * pull.force_N + one_way_N_;
}

}  // namespace punctum::rt
