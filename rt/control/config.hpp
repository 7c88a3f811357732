// Everything the servo needs to know of a scene. An empty optional is a thing that is not there.
#pragma once

#include <optional>

#include "hal/devices.hpp"

namespace punctum::rt {

using hal::Vec3;

// With the values of the paper (Sun & Nelson 2003).
struct MembraneParams {
  enum class Law : std::uint8_t { large_deflection, paper };
  Law law = Law::large_deflection;
  double E_Pa = 35.3e3;     // elastic modulus
  double nu = 0.5;          // Poisson ratio
  double h_m = 4.6e-6;      // thickness
  double c_m = 3.8e-6;      // pipette radius
  double R_m = 60e-6;       // undeformed cell, until vision knows better
  double prestrain = 0.2;   // large deflection: of the undeformed membrane, by turgor
  double seat_m = 29.5e-6;  // large deflection: radius of the patch that rests in the holding pipette or dish
};

// Cone-shaped attractive guide, eq. 6 and fig. 13.
struct ConeParams {
  enum class Method : std::uint8_t { potential, paper };
  Method method = Method::potential;
  double K_N_m =
      150;  // at the hand, on the membrane: with the membrane's own, below 0.9 of what keeps passive
  double d0_m = 40e-6;     // distance from the membrane at which the pull has halved (needle scale)
  double r0_m = 1e-6;      // free radius at the membrane (needle scale)
  double alpha_rad = 0.2;  // half-angle of the free core
  double eps_m = 2e-6;     // width of the C1 ramp (needle scale)
  double ramp_s = 0.2;     // moving or switching
  double reach_m = 40e-6;  // half-width of the attraction; further off it lets go (needle scale)
};

// Withdrawal along the insertion axis only.
struct AxisParams {
  double K_N_m = 150;   // lateral, at the hand
  double eps_m = 1e-6;  // width of the C1 ramp (needle scale)
  double ramp_s = 0.2;
  double B_inward_Ns_m = 5;  // in withdrawal, against motion back into the cell; 0 = off
};

struct DampingParams {
  double B1_Ns_m = 1.0;   // outside
  double B2_Ns_m = 4.0;   // inside, > B1
  double ramp_s = 0.035;  // 20 .. 50 ms
};

// A hill of potential that keeps the needle away from a place in the cell.
struct RepulsiveParams {
  Vec3 offset_m{0, -40e-6, 0};  // of its centre from the cell's, world frame, needle scale
  double radius_m = 15e-6;      // needle scale
  double K_N_m = 150;           // at the hand, its largest stiffness
  double ramp_s = 0.2;          // moving or switching
};

// Dry friction at the hand.
struct FrictionParams {
  double F_c_N = 0.1;  // at which it slides
  double K_N_m = 100;  // of the bristle, until then
};

// A burst that marks contact and puncture.
struct VibrationParams {
  double frequency_Hz = 150;
  double amplitude_N = 0.15;
  double decay_s = 0.03;
  double energy_J = 50e-6;  // of one burst: it ends once it has given more
};

// How the hand's velocity is made of its positions; at the hand.
struct VelocityParams {
  enum class Method : std::uint8_t { kalman, foaw };
  Method method = Method::kalman;
  double d_m = 0.03e-3;       // encoder step
  double jerk_m_s3_rtHz = 5;  // kalman: of the hand, root of its spectral density; more follows faster
  int window = 16;      // foaw: intervals between samples at most, at 1 kHz; grows with the rate, up to 64
  double smooth_s = 0;  // first-order low-pass behind it; 0 = off
};

// The haptic device as the core knows it: what can be rendered follows from it.
struct HandDevice {
  double mass_kg = 0.075;
  double damping_Ns_m = 0.1;
  double encoder_step_m = 0.03e-3;
  double force_max_N = 8.5;
  int delay_ticks = 0;  // 0 .. 5: a force acts this many ticks after it is written
};

// The passivity guard, passivity.hpp.
struct GuardParams {
  double margin = 0.9;   // of the device's passive stiffness: what may be rendered
  double recover_s = 2;  // a lowered stiffness returns over this
};

struct MappingParams {
  double position_scale = 500;    // k_p: hand metres per needle metre
  double force_scale = 1e5;       // k_f: hand newtons per needle newton
  double tremor_cutoff_Hz = 3.0;  // second-order low-pass on the set-point; 0 = off
  double coupling_s = 0.3;        // forces return over this after a start, a clutch, a reset
  double max_tilt_rad = 0.1;      // the handle's orientation tilts the approach axis up to this; 0 = off
  Vec3 workspace_min_m{-280e-6, -180e-6, -60e-6};  // of the needle tip, world frame
  Vec3 workspace_max_m{280e-6, 180e-6, 60e-6};
};

struct LimitParams {
  double hand_force_N = 3.0;
  double stage_velocity_m_s = 400e-6;
  double stage_acceleration_m_s2 = 20e-3;
  double penetration_depth_m = 90e-6;  // past the undeformed outer membrane
  double far_wall_m = 20e-6;           // smallest distance to the far wall
  double tip_force_soft_N = 30e-6;     // the needle is not pushed further
  double tip_force_hard_N = 60e-6;     // latched fault
  double following_error_m = 10e-6;
};

struct PhaseParams {
  double contact_on_m = 0.3e-6;        // w_d that begins contact
  double contact_off_m = 0.5e-6;       // gap that ends it
  double indentation_on_m = 3e-6;      // w_d
  double withdrawal_speed_m_s = 5e-6;  // outward speed that begins withdrawal once inside
  double withdrawal_back_m = 2e-6;     // and the way back from the deepest point that it takes
  double clear_m = 10e-6;              // gap that ends withdrawal
  double timeout_s[7] = {120, 20, 30, 15, 20, 20, 60};  // per phase, alarm
};

// The membrane between two frames, and what happens when vision falls silent.
struct LocalModelParams {
  double disagree_m = 8e-6;  // stage and picture may move apart by this before the picture is not believed
  double gain = 0.3;         // of one observation
  double max_rate_m_s = 100e-6;  // bounded correction of the membrane's position
  double stale_after_s = 0.30;   // age from which the rendered force fades
  double fade_s = 0.15;
  double return_s = 0.4;  // the force returns over this once vision is back
  // The paper's law wants the width of the dimple itself: a = c + dimple_scale sqrt(2 R w_d) follows the
  // simulated cell's force within 0.4 uN. Vision's 1 % width spans a whole sagging cell; a rate above 0 lets
  // it correct the scale.
  double dimple_scale = 0.6;
  double dimple_scale_rate_1_s = 0;
  double dimple_min_m = 2e-6;  // w_d from which a dimple's width is believed
};

struct InjectorParams {
  double max_open_s = 2.0;      // clamped by the tick
  double shut_within_s = 0.25;  // of the gate: open for longer is a fault
};

struct VacuumParams {
  double min_Pa = 200;
  double window_s = 0.1;
  double still_s = 1;  // the same digits for longer: the gauge hangs, alarm; 0 = off
};

struct EstopParams {
  double discrepancy_s = 0.05;     // contacts may differ this long
  double hand_ramp_s = 0.02;       // hand force to zero
  double power_off_after_s = 0.5;  // drive power off at standstill or after this
};

struct ServoConfig {
  double rate_Hz = 1000;   // 1, 2, 4 or 8 kHz
  int stage_divisor = 1;   // stage set-points every n-th tick
  int overrun_limit = 20;  // missed ticks in the window
  double overrun_window_s = 1.0;
  bool real_actuators = false;  // an overrun is then a fault, not an alarm
  double hand_timeout_s = 0.02;
  double hand_jump_m = 0.02;      // between two ticks at 1 kHz
  double stage_timeout_s = 0.02;  // silent for longer: stage_lost
  int cells = 1;                  // to inject; 0 = until the time limit
  bool vision = true;             // observations are expected

  HandDevice device;
  VelocityParams velocity;
  MappingParams mapping;
  LimitParams limits;
  EstopParams estop;
  std::optional<PhaseParams> phases = PhaseParams{};  // absent: always `free`
  std::optional<LocalModelParams> local_model = LocalModelParams{};
  std::optional<MembraneParams> membrane;
  std::optional<ConeParams> cone;
  std::optional<AxisParams> axis;
  std::optional<DampingParams> damping;
  std::optional<RepulsiveParams> repulsive;
  std::optional<FrictionParams> friction;
  std::optional<VibrationParams> vibration;
  std::optional<GuardParams> guard;
  std::optional<InjectorParams> injector;
  std::optional<VacuumParams> vacuum;
  bool force_sensor = false;
};

}  // namespace punctum::rt
