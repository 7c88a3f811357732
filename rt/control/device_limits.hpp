// What a haptic device can render at a servo period T: the largest damping and stiffness that keep a bare
// mass stable, nobody at the handle, and the stiffness that keeps it passive.
//
// The handle is m x'' + b x' = f with f held over a period and applied delay_ticks periods late; its velocity
// is estimated as VelocityParams says. The limits are those of the exact sampled system: where a pole reaches
// the unit circle; with FOAW, which picks any window up to its longest, the worst over all of them.
// Quantisation, friction and saturation are left out. Bounded time, no allocation; for start-up: up to some
// milliseconds.
#pragma once

#include "rt/control/config.hpp"

namespace punctum::rt {

// K < b / (T/2 + delay): passive against whatever holds the handle (Colgate & Schenkel for B = 0).
[[nodiscard]] double passive_stiffness_N_m(const HandDevice& device, double T_s) noexcept;

// The largest B at the handle; device.damping_Ns_m counts as 0, which is on the safe side.
[[nodiscard]] double stable_damping_Ns_m(const HandDevice& device, double T_s,
                                         const VelocityParams& velocity) noexcept;

// The largest K of a spring beside damping B, with device.damping_Ns_m; 0 if B itself cannot be rendered.
[[nodiscard]] double stable_stiffness_N_m(const HandDevice& device, double T_s,
                                          const VelocityParams& velocity, double B_Ns_m) noexcept;

}  // namespace punctum::rt
