// Viscous damping F = -B v (the paper omits the sign): B1 outside, B2 > B1 inside the cell.
// Dissipative for any B(t) >= 0; B is ramped so that switching is not felt as a step.
#pragma once

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {

struct DampingParams {
  double B1_Ns_m = 1.0;   // outside
  double B2_Ns_m = 4.0;   // inside, > B1
  double ramp_s = 0.035;  // 20 .. 50 ms
};
constexpr auto keys_of(const DampingParams*) {
  return hal::keys(hal::real("B1_Ns_m", &DampingParams::B1_Ns_m, 0, 100),
                   hal::real("B2_Ns_m", &DampingParams::B2_Ns_m, 0, 100),
                   hal::milli("ramp_ms", &DampingParams::ramp_s, 1, 1000));
}

class Damping {
 public:
  using Params = DampingParams;
  static constexpr Gives kGives{.dissipative = true};

  Damping(const DampingParams& params, const EffectSetup&) NONBLOCKING : params_(params) {}

  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING {
    ramp_.step(in.inside_cell, params_.ramp_s, params_.ramp_s, in.dt_s);
    EffectOutput out;
    out.damping_Ns_m = params_.B1_Ns_m + ramp_.gain() * (params_.B2_Ns_m - params_.B1_Ns_m);
    out.dissipative_N = -out.damping_Ns_m * in.handle_velocity_m_s;
    return out;
  }

 private:
  DampingParams params_;
  Ramp ramp_;
};

}  // namespace punctum::rt
