// What the simulated station is made of. An empty optional is a thing that is not there.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/devices.hpp"

namespace punctum::sim {

using hal::Vec3;

struct HandParams {
  double mass_kg = 0.075;
  double damping_Ns_m = 0.1;
  double coulomb_N = 0.04;
  double encoder_step_m = 0.03e-3;
  double force_max_N = 8.5;
  double workspace_m = 0.08;  // half-width; she uses the clutch before its border
  int delay_ticks = 0;        // a force acts this many ticks after it was written; up to kMaxDelayTicks
};
inline constexpr int kMaxDelayTicks = 5;

// The biologist: an arm behind the handle that follows an intention.
struct OperatorParams {
  double arm_stiffness_N_m = 250;
  double arm_damping_Ns_m = 6;
  double tremor_m = 0.25e-3;  // rms at the hand, 8 .. 12 Hz
  double aim_error_m = 4e-6;  // lateral, 1 sigma, at the needle: what she misjudges
  double drift_m_s = 1.0e-6;  // slow lateral wander, at the needle
  double reaction_s = 0.25;
  double approach_s = 3.0;
  double indentation_speed_m_s = 8e-6;  // at the needle
  double depth_m = 25e-6;               // wanted depth of the tip beyond the puncture
  double dwell_s = 1.5;
  double withdrawal_speed_m_s = 30e-6;
  double tilt_rad = 0.03;     // handle orientation, 1 sigma
  double give_way_1_s = 2.0;  // rate at which she follows a sideways force instead of resisting it
};

struct StageParams {
  Vec3 start_m{90e-6, 6e-6, 0};  // tip at the start, world frame
  Vec3 axis{-1, 0, 0};
  double lag_s = 0.004;
  double resolution_m = 0.04e-6;
  double velocity_max_m_s = 1.5e-3;
  double travel_m = 12.5e-3;            // +- from the centre
  Vec3 registration_m{3e-6, -2e-6, 0};  // the stage's frame against the picture: unknown to the core
  double brake_m_s2 = 0.5;
};

struct CellParams {
  Vec3 centre_m{-40e-6, 0, 0};
  double R_m = 60e-6;  // outer face of zona or chorion
  double zona_h_m = 4.6e-6;
  double zona_E_Pa = 35.3e3;
  double nu = 0.5;
  double zona_pretension = 0.2;       // strain of the undeformed zona: turgor, and the bending it has not got
  double zona_puncture_strain = 0.5;  // largest principal strain at the tip: at w of about 21 um, 2.5 uN
  bool inner = true;                  // an inner membrane exists
  double inner_gap_m = 3e-6;          // between the zona's inner face and the inner membrane
  double inner_h_m = 0.5e-6;
  double inner_E_Pa = 10e3;
  double inner_pretension = 0.1;
  double inner_puncture_strain =
      0.24;                      // once the zona is through: tip about 24 um past the zona's outer face
  double recoil_s = 0.04;        // time constant after puncture
  double viscosity_Ns_m = 2e-3;  // drag on the needle inside, N per m/s
  double far_wall_strain_margin_m = 4e-6;  // the far wall is pierced this far past it
  double tear_lateral_m = 9e-6;            // sideways motion of a needle inside that tears the membrane
  double spread = 0.1;                     // relative 1 sigma of size and stiffness from cell to cell
};

struct HolderParams {  // holding pipette, left of the cell
  double outer_radius_m = 45e-6;
  double inner_radius_m = 14e-6;
  double vacuum_Pa = 600;
  double drop_m = 0;  // mouth's centre below the cell's centre
};

struct NeedleParams {
  double radius_m = 3.8e-6;      // c
  double shaft_radius_m = 9e-6;  // far from the tip
  double taper_m = 160e-6;
};

struct InjectorParams {
  double open_s = 0.01;  // valve lag
};

struct ForceSensorParams {
  double noise_N = 0.15e-6;
  double lag_s = 0.001;
};

struct MicroscopeParams {
  int width = 727;
  int height = 485;
  double pixel_m = 0.825e-6;
  double fps = 25;
  double latency_s = 0.04;  // exposure to observation, under the virtual clock
  double psf_px = 1.2;      // blur in focus
  double defocus_m = 0;
  double contrast = 30;    // grey levels of the zona
  double noise = 2;        // grey levels, on mid grey; shot noise scales with the root
  double gradient = 0.15;  // relative illumination difference across the picture
  int impurities = 12;
};

// A device that fails while running.
enum class Failure : std::uint8_t { none, freeze, drop, delay, nan, disconnect, saturate, noise };
enum class Device : std::uint8_t { hand, stage, estop, injector, vacuum, force_sensor, camera };
inline constexpr int kDevices = 7;
struct ScheduledFailure {
  Device device{};
  Failure kind{};
  double at_s = 0;
  double for_s = 0;  // 0 = for good
};

// Scripted presses of the simulated e-stop.
struct EstopEvent {
  double at_s = 0;
  double for_s = 0.5;
  bool contact_a = true;  // which contacts open
  bool contact_b = true;
  bool reset_after = false;  // press reset 0.2 s after release
};

struct SimConfig {
  std::uint64_t seed = 1;
  HandParams hand;
  OperatorParams person;
  StageParams stage;
  NeedleParams needle;
  std::optional<CellParams> cell;
  std::optional<HolderParams> holder;
  std::optional<InjectorParams> injector;
  std::optional<ForceSensorParams> force_sensor;
  std::optional<MicroscopeParams> microscope;
  std::array<ScheduledFailure, 8> failures{};
  int failure_count = 0;
  std::array<EstopEvent, 4> estop_events{};
  int estop_event_count = 0;
  // What the operator's hand is coupled by; the same numbers as the core's mapping.
  double position_scale = 500;
  int cells = 1;                  // to inject, the same as the core's; 0 = until the time limit
  double relay_timeout_s = 0.05;  // without a heartbeat; then drive power goes off
};

}  // namespace punctum::sim
