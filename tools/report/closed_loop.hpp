// One effect of the core on the simulated haptic device, closed at the servo's rate: with and without the
// passivity guard, under everything that makes a held force active.
#pragma once

#include <cstdint>

#include "rt/control/config.hpp"

namespace punctum::report {

// How the ticks come: on time, +-20 %, every hundredth followed by one to four lost ones, or once twenty lost
// in a row (more are a fault).
enum class Timing : std::uint8_t { steady, jitter, lost_ticks, late_tick };
// Who holds the handle: nobody (a constant push alone), a fingertip (1 Ns/m), an arm (250 N/m, 6 Ns/m).
enum class Holder : std::uint8_t { nobody, fingertip, arm };

struct LoopCell {
  double rate_Hz = 1000;
  rt::HandDevice device;
  double coulomb_N = 0;
  double stiffness_N_m = 100;  // of a wall at x = 0; ignored where there is a membrane
  double membrane_E_Pa = 0;    // > 0: the membrane in its place, with the shipped law and scaling
  double damping_share = 0;    // of the largest damping the device can render
  Timing timing = Timing::steady;
  Holder holder = Holder::fingertip;
  double push_N = 0.5;
  double speed_m_s = 0;  // towards the wall, from 5 mm before it
  bool guarded = true;
  std::uint64_t seed = 1;
};

// moving: over the last second the handle went further than 4 encoder counts and 0.1 mm. active: over the
// seconds in which it did, the port (force and true position) delivered more than it took up and stores, by
// over 5 % of the most it stored and the work of four encoder counts. active_at_rest: the same with all
// seconds counted, those in which the encoder hardly sees a motion too, less what a returning stiffness
// stores by itself.
struct LoopResult {
  bool moving = false, active = false, active_at_rest = false;
  double peak_to_peak_m = 0;
  double surplus_J = 0;
  double stored_max_J = 0;
  double commanded_N_m = 0;  // stiffness where the handle came to rest
  double rendered_N_m = 0;
  double passive_N_m = 0;  // b / (T/2 + delay)
  double damper_Ns_m = 0;  // the guard's, the largest
  double rest_N = 0;       // rms of what its damper added over the last second: its own noise
  double end_s = 0;
  std::int64_t ticks = 0;
  [[nodiscard]] bool unstable() const noexcept { return moving || active; }
};

[[nodiscard]] LoopResult run_loop(const LoopCell& cell);

// The n-th cell of the sweep: every parameter drawn over its whole range.
[[nodiscard]] LoopCell sweep_cell(std::uint64_t n, bool guarded);

// Below 0.8 of the passive stiffness at least 0.9 of the commanded one, above at least half of the passive.
// Always met where the handle came to rest off the wall, and where ticks are lost (their period is longer).
[[nodiscard]] bool faithful(const LoopCell& cell, const LoopResult& result) noexcept;

// Largest K of a two-sided spring that the linear loop brings to rest, found by simulation: finite-difference
// velocity, no quantisation, no friction. Shares nothing with device_limits but the device.
[[nodiscard]] double measured_boundary_N_m(const rt::HandDevice& device, double T_s, double B_Ns_m);

// Damping that the device must have so that an imposed motion gets no energy from spring K and damping B
// (velocity filtered by backward Euler, time constant tau), hold and delay included.
struct CycleEnergy {
  double slow_Ns_m = 0;      // sinusoids of 0.01 .. 0.9 of the Nyquist frequency, the worst of them
  double sinusoid_Ns_m = 0;  // at the Nyquist frequency in its worst phase
  double triangle_Ns_m = 0;  // the same samples joined by straight lines, which move least
};
[[nodiscard]] CycleEnergy cycle_energy(double K_N_m, double B_Ns_m, double tau_s, double T_s,
                                       int delay_ticks);

}  // namespace punctum::report
