// What a haptic device can render at a servo period T: the largest damping and stiffness that keep a bare
// mass stable, nobody at the handle, and the stiffness that keeps it passive.
//
// The handle is m x'' + b x' = f with f held over a period and applied delay_ticks periods late; its velocity
// is estimated as VelocityParams says. The limits are those of the exact sampled system: where a pole reaches
// the unit circle; with FOAW, which picks any window up to its longest, the worst over all of them.
// Quantisation, friction and saturation are left out. Bounded time, no allocation; for start-up: up to some
// milliseconds.
#pragma once

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/control/velocity.hpp"

namespace punctum::rt {

// The haptic device as the core knows it: what can be rendered follows from it.
struct HandDevice {
  double mass_kg = 0.075;
  double damping_Ns_m = 0.1;
  double encoder_step_m = 0.03e-3;
  double force_max_N = 8.5;  // 0: it renders no force; effects are summed and shown, nobody feels them
  int delay_ticks = 0;       // 0 .. 5: a force acts this many ticks after it is written
};
constexpr auto keys_of(const HandDevice*) {
  return hal::keys(hal::real("mass_kg", &HandDevice::mass_kg, 0.01, 2),
                   hal::real("damping_Ns_m", &HandDevice::damping_Ns_m, 0, 20),
                   hal::milli("encoder_step_mm", &HandDevice::encoder_step_m, 1e-5, 1),
                   hal::real("force_max_N", &HandDevice::force_max_N, 0, 40),
                   hal::whole("delay_ticks", &HandDevice::delay_ticks, 0, 5));
}

// K < b / (T/2 + delay): passive against whatever holds the handle (Colgate & Schenkel for B = 0).
[[nodiscard]] double passive_stiffness_N_m(const HandDevice& device, double T_s) NONBLOCKING;

// The largest B at the handle; device.damping_Ns_m counts as 0, which is on the safe side.
[[nodiscard]] double stable_damping_Ns_m(const HandDevice& device, double T_s, const VelocityParams& velocity)
    NONBLOCKING;

// The largest K of a spring beside damping B, with device.damping_Ns_m; 0 if B itself cannot be rendered.
[[nodiscard]] double stable_stiffness_N_m(const HandDevice& device, double T_s,
                                          const VelocityParams& velocity, double B_Ns_m) NONBLOCKING;

}  // namespace punctum::rt
