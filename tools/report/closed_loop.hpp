// One force effect of the core on the simulated haptic device, as a closed loop at the servo's rate: with and
// without the passivity guard, under everything that makes a held force active.
#pragma once

#include <cstdint>

#include "rt/control/config.hpp"

namespace punctum::report {

// Times of the ticks. steady: on time; jitter: +-20 %; lost_ticks: one in a hundred is followed by one to
// four lost ticks; late_tick: twenty are lost in a row, once (more are a fault).
enum class Timing : std::uint8_t { steady, jitter, lost_ticks, late_tick };
// What holds the handle: nobody (only a constant push acts), a fingertip (1 Ns/m), an arm (250 N/m, 6 Ns/m).
// At a wall that moves a spring holds the handle in place of the push: 10, 50 or 250 N/m. It swings too.
enum class Holder : std::uint8_t { nobody, fingertip, arm };

// What the wall does for the first seconds, before it stands still. modulated: its stiffness swings by a part
// of itself; moving: it swings to and fro; corrected: it moves to another place every 0.12 s, within 30 ms,
// as a correction by vision moves it; switched: it comes and goes by ramps of 50 ms.
enum class WallMotion : std::uint8_t { still, modulated, moving, corrected, switched };

struct LoopCell {
  double rate_Hz = 1000;
  int ticks_per_sample = 1;  // the device gives a new position on one tick of so many
  rt::HandDevice device;
  double slew_N_s = 0;  // of the written force; 0 = no limit
  double coulomb_N = 0;
  double stiffness_N_m = 100;  // of a wall at x = 0; ignored where there is a membrane
  double membrane_E_Pa = 0;    // > 0: a membrane replaces the wall, with the shipped law and scaling
  double damping_share = 0;    // of the largest damping the device can render
  Timing timing = Timing::steady;
  Holder holder = Holder::fingertip;
  double push_N = 0.5;
  double speed_m_s = 0;  // towards the wall, from 5 mm in front of it
  WallMotion motion = WallMotion::still;
  double depth = 0.5;       // modulated: part of the stiffness
  double travel_m = 1e-3;   // moving and corrected: to either side
  double frequency_Hz = 1;  // modulated, moving, switched; an arm swings at half of it
  bool guarded = true;
  std::uint64_t seed = 1;
};

// moving: in the last second the handle moved by more than 4 encoder counts and 0.1 mm.
// active: over the seconds in which it moved so far, the port (force and true position) delivered more energy
// than it absorbed and still stores. The surplus must exceed 5 % of the largest stored energy plus the work
// of 4 encoder counts. active_at_rest: the same over all seconds, including those in which the encoder hardly
// sees a motion; the energy that a returning stiffness stores is subtracted. Both where wall and rate of the
// force have no say in it: the wall stands still, the force follows at once.
// given: more net work than the guard allows, over any time. Stored is then what the force as written can
// give back: one that comes down slowly is still there when its gain has fallen.
struct LoopResult {
  bool owes = true;  // stiffness: the net account has not held it down within the last seconds
  bool moving = false, active = false, active_at_rest = false, given = false;
  double peak_to_peak_m = 0;
  double surplus_J = 0;
  double stored_max_J = 0;
  double net_J = 0;
  double least_gain = 1;
  double commanded_N_m = 0;  // stiffness where the handle has come to rest
  double rendered_N_m = 0;
  double passive_N_m = 0;  // b / (T/2 + delay)
  double damper_Ns_m = 0;  // largest damper of the guard
  double rest_N = 0;       // rms force of that damper in the last second: its noise
  double end_s = 0;
  std::int64_t ticks = 0;
  [[nodiscard]] bool unstable() const noexcept { return moving || active || given; }
};

[[nodiscard]] LoopResult run_loop(const LoopCell& cell);

// The n-th cell of the sweep: every parameter is drawn from its whole range.
[[nodiscard]] LoopCell sweep_cell(std::uint64_t n, bool guarded);

// The same cells with walls that move, devices that sample slowly, and limits of force and slew.
[[nodiscard]] LoopCell moving_cell(std::uint64_t n, bool guarded);

// Whether enough stiffness is rendered: below 0.8 of the passive stiffness at least 0.9 of the commanded one,
// above it at least half of the passive one. True where the handle has come to rest off the wall, and where
// ticks are lost (their period is longer).
[[nodiscard]] bool faithful(const LoopCell& cell, const LoopResult& result) noexcept;

// Transparency: a hand presses 10 mm into the cell's wall and comes out again, once a second. Returns the
// part of the work of its presses that it does not get back; 0 of a spring without hold and delay, and
// negative where these give energy. Exact in the device's position, holder and push play no part.
[[nodiscard]] double lost_part(const LoopCell& cell);

// The largest K of a two-sided spring with which the linear loop comes to rest, by simulation:
// finite-difference velocity, no quantisation, no friction. It has only the device in common with
// device_limits.
[[nodiscard]] double measured_boundary_N_m(const rt::HandDevice& device, double T_s, double B_Ns_m);

// The damping that the device needs so that an imposed motion gains no energy from the spring K and the
// damping B, with hold and delay. The velocity is filtered by backward Euler with the time constant tau.
struct CycleEnergy {
  double slow_Ns_m = 0;      // the worst of sinusoids of 0.01 .. 0.9 of the Nyquist frequency
  double sinusoid_Ns_m = 0;  // at the Nyquist frequency in its worst phase
  double triangle_Ns_m = 0;  // the same samples joined by straight lines, which is the least motion
};
[[nodiscard]] CycleEnergy cycle_energy(double K_N_m, double B_Ns_m, double tau_s, double T_s,
                                       int delay_ticks);

}  // namespace punctum::report
