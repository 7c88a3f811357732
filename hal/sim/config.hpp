// What the simulated station is made of. An empty optional is a thing that is not there.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"

namespace punctum::sim {

using hal::Vec3;

inline constexpr int kMaxDelayTicks = 5;

struct HandParams {
  double mass_kg = 0.075;
  double damping_Ns_m = 0.1;
  double coulomb_N = 0.04;
  double encoder_step_m = 0.03e-3;
  double force_max_N = 8.5;
  double workspace_m = 0.08;  // half-width; the operator uses the clutch before its border
  int delay_ticks = 0;        // a force acts this many ticks after it was written; up to kMaxDelayTicks
};
constexpr auto keys_of(const HandParams*) {
  return hal::keys(hal::real("mass_kg", &HandParams::mass_kg, 0.01, 2),
                   hal::real("damping_Ns_m", &HandParams::damping_Ns_m, 0, 20),
                   hal::real("coulomb_N", &HandParams::coulomb_N, 0, 2),
                   hal::milli("encoder_step_mm", &HandParams::encoder_step_m, 1e-5, 1),
                   hal::real("force_max_N", &HandParams::force_max_N, 0.1, 40),
                   hal::milli("workspace_mm", &HandParams::workspace_m, 5, 1000),
                   hal::whole("delay_ticks", &HandParams::delay_ticks, 0, kMaxDelayTicks));
}

// The operator: an arm behind the handle that follows an intended position.
struct OperatorParams {
  double arm_stiffness_N_m = 250;
  double arm_damping_Ns_m = 6;
  double tremor_m = 0.25e-3;  // rms at the hand, 8 .. 12 Hz
  double aim_error_m = 4e-6;  // lateral, 1 sigma, at the needle: misjudgement of the entry point
  double drift_m_s = 1.0e-6;  // slow lateral wander, at the needle
  double reaction_s = 0.25;
  double approach_s = 3.0;
  double indentation_speed_m_s = 8e-6;  // at the needle
  double depth_m = 25e-6;               // wanted depth of the tip beyond the puncture
  double dwell_s = 1.5;
  double withdrawal_speed_m_s = 30e-6;
  double tilt_rad = 0.03;     // handle orientation, 1 sigma
  double give_way_1_s = 2.0;  // rate of following a sideways force instead of resisting it
};
constexpr auto keys_of(const OperatorParams*) {
  return hal::keys(hal::real("arm_stiffness_N_m", &OperatorParams::arm_stiffness_N_m, 10, 2000),
                   hal::real("arm_damping_Ns_m", &OperatorParams::arm_damping_Ns_m, 0.1, 50),
                   hal::milli("tremor_mm", &OperatorParams::tremor_m, 0, 5),
                   hal::micro("aim_error_um", &OperatorParams::aim_error_m, 0, 50),
                   hal::micro("drift_um_s", &OperatorParams::drift_m_s, 0, 50),
                   hal::real("reaction_s", &OperatorParams::reaction_s, 0.05, 3),
                   hal::real("approach_s", &OperatorParams::approach_s, 0.2, 60),
                   hal::micro("indentation_speed_um_s", &OperatorParams::indentation_speed_m_s, 0.5, 500),
                   hal::micro("depth_um", &OperatorParams::depth_m, 1, 1000),
                   hal::real("dwell_s", &OperatorParams::dwell_s, 0, 60),
                   hal::micro("withdrawal_speed_um_s", &OperatorParams::withdrawal_speed_m_s, 1, 1000),
                   hal::real("tilt_rad", &OperatorParams::tilt_rad, 0, 0.5),
                   hal::real("give_way_1_s", &OperatorParams::give_way_1_s, 0, 50));
}

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
constexpr auto keys_of(const StageParams*) {
  return hal::keys(hal::micro_vector("start_um", &StageParams::start_m, -5000, 5000),
                   hal::direction("axis", &StageParams::axis),
                   hal::milli("lag_ms", &StageParams::lag_s, 0.1, 200),
                   hal::micro("resolution_um", &StageParams::resolution_m, 0.001, 5),
                   hal::micro("velocity_max_um_s", &StageParams::velocity_max_m_s, 10, 1e5),
                   hal::milli("travel_mm", &StageParams::travel_m, 0.1, 100),
                   hal::micro_vector("registration_um", &StageParams::registration_m, -100, 100),
                   hal::milli("brake_mm_s2", &StageParams::brake_m_s2, 1, 1e5));
}

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
inline constexpr auto kCellKeys = hal::keys(
    hal::micro_vector("centre_um", &CellParams::centre_m, -5000, 5000),
    hal::micro("radius_um", &CellParams::R_m, 5, 2000),
    hal::micro("zona_h_um", &CellParams::zona_h_m, 0.05, 100),
    hal::kilo("zona_E_kPa", &CellParams::zona_E_Pa, 0.1, 1e5), hal::real("nu", &CellParams::nu, 0, 0.5),
    hal::real("zona_pretension", &CellParams::zona_pretension, 0, 0.3),
    hal::real("zona_puncture_strain", &CellParams::zona_puncture_strain, 0.01, 3),
    hal::milli("recoil_ms", &CellParams::recoil_s, 1, 5000),
    hal::real("viscosity_Ns_m", &CellParams::viscosity_Ns_m, 0, 10),
    hal::micro("far_wall_margin_um", &CellParams::far_wall_strain_margin_m, 0, 500),
    hal::micro("tear_lateral_um", &CellParams::tear_lateral_m, 0.5, 500),
    hal::real("spread", &CellParams::spread, 0, 0.5));
inline constexpr auto kInnerCellKeys =
    hal::keys(hal::micro("gap_um", &CellParams::inner_gap_m, 0, 500),
              hal::micro("h_um", &CellParams::inner_h_m, 0.01, 50),
              hal::kilo("E_kPa", &CellParams::inner_E_Pa, 0.01, 1e5),
              hal::real("pretension", &CellParams::inner_pretension, 0, 0.3),
              hal::real("puncture_strain", &CellParams::inner_puncture_strain, 0.01, 3));

struct HolderParams {  // holding pipette, left of the cell
  double outer_radius_m = 45e-6;
  double inner_radius_m = 14e-6;
  double vacuum_Pa = 600;
  double drop_m = 0;  // mouth's centre below the cell's centre
};
constexpr auto keys_of(const HolderParams*) {
  return hal::keys(hal::micro("outer_radius_um", &HolderParams::outer_radius_m, 2, 2000),
                   hal::micro("inner_radius_um", &HolderParams::inner_radius_m, 1, 2000),
                   hal::real("vacuum_Pa", &HolderParams::vacuum_Pa, 0, 50'000),
                   hal::micro("drop_um", &HolderParams::drop_m, -500, 500));
}

struct DishParams {
  double floor_m = 65e-6;  // its height along the optical axis; the picture's plane, z = 0, is above it
};
constexpr auto keys_of(const DishParams*) {
  return hal::keys(hal::micro("floor_um", &DishParams::floor_m, -1e5, 1e5));
}

struct NeedleParams {
  double radius_m = 3.8e-6;      // c
  double shaft_radius_m = 9e-6;  // far from the tip
  double taper_m = 160e-6;
};
constexpr auto keys_of(const NeedleParams*) {
  return hal::keys(hal::micro("radius_um", &NeedleParams::radius_m, 0.2, 50),
                   hal::micro("shaft_radius_um", &NeedleParams::shaft_radius_m, 0.2, 500),
                   hal::micro("taper_um", &NeedleParams::taper_m, 1, 5000));
}

struct InjectorParams {
  double open_s = 0.01;  // valve lag
};
constexpr auto keys_of(const InjectorParams*) {
  return hal::keys(hal::milli("open_ms", &InjectorParams::open_s, 0, 1000));
}

struct ForceSensorParams {
  double noise_N = 0.15e-6;
  double lag_s = 0.001;
};
constexpr auto keys_of(const ForceSensorParams*) {
  return hal::keys(hal::micro("noise_uN", &ForceSensorParams::noise_N, 0, 1000),
                   hal::milli("lag_ms", &ForceSensorParams::lag_s, 0, 1000));
}

// Light from one side, as in Hoffman modulation contrast: an edge is bright where it faces the light.
struct ReliefParams {
  double light_deg = -135;  // where it comes from, in the picture: from x (right) towards y (down)
  double aperture = 0.37;  // of the objective, in water: what lies above and below the focus is blurred by it
};
constexpr auto keys_of(const ReliefParams*) {
  return hal::keys(hal::real("light_deg", &ReliefParams::light_deg, -360, 360),
                   hal::real("aperture", &ReliefParams::aperture, 0.01, 1.2));
}

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
  std::optional<ReliefParams> relief;  // absent: bright field
};
// [camera]: what any camera of this kind has
inline constexpr auto kCameraKeys = hal::keys(hal::whole("width_px", &MicroscopeParams::width, 64, 4096),
                                              hal::whole("height_px", &MicroscopeParams::height, 64, 4096),
                                              hal::micro("pixel_um", &MicroscopeParams::pixel_m, 0.01, 50),
                                              hal::real("fps", &MicroscopeParams::fps, 1, 1000));
// [sim.camera]
inline constexpr auto kMicroscopeKeys =
    hal::keys(hal::milli("latency_ms", &MicroscopeParams::latency_s, 0, 1000),
              hal::real("psf_px", &MicroscopeParams::psf_px, 0.3, 20),
              hal::micro("defocus_um", &MicroscopeParams::defocus_m, -200, 200),
              hal::real("contrast", &MicroscopeParams::contrast, 0, 120),
              hal::real("noise", &MicroscopeParams::noise, 0, 60),
              hal::real("gradient", &MicroscopeParams::gradient, 0, 1),
              hal::whole("impurities", &MicroscopeParams::impurities, 0, 500));

// What a device does wrong while it runs; failures.hpp says what each kind means.
enum class Failure : std::uint8_t {
  none,
  // The device is defective, all of it.
  freeze,
  drop,
  delay,
  nan,
  disconnect,
  saturate,
  noise,
  // One channel of its readings is wrong.
  glitch,
  offset,
  drift,
  set,
  stuck,
  flicker,
  // It is sampled at a fraction of the rate at which it is read.
  sparse,
  repeat,
  // The drive or the valve disobeys.
  ignore,
  creep
};
inline constexpr Failure kLastFailure = Failure::creep;

enum class Device : std::uint8_t { hand, stage, estop, injector, vacuum, force_sensor, camera, vision };
inline constexpr int kDevices = 8;

// Which part of a reading is wrong, or which command is ignored.
enum class Channel : std::uint8_t {
  none,
  all,   // everything but the sample time
  time,  // the sample time
  position,
  orientation,
  axis,
  following_error,
  clutch,
  inject,
  next_cell,
  enabled,
  standstill,
  contact_a,
  contact_b,
  reset,
  pulse,
  open,
  pressure,
  force,
  centre,
  cell,  // centre, entry and gap together
  radius,
  entry,
  gap,
  dimple_depth,
  dimple_width,
  membrane_velocity,
  contact,
  punctured,
  inner_punctured,
  // commands
  enable,
  disable,
  quick_stop,
  gate
};
inline constexpr Channel kLastChannel = Channel::gate;

// Which numbers of a channel that has several.
enum class Component : std::uint8_t { x, y, z, w, all };
inline constexpr Component kLastComponent = Component::all;

struct ScheduledFailure {
  Device device{};
  Failure kind{};
  double at_s = 0;
  double for_s = 0;  // 0 = for good
  Channel channel = Channel::none;
  Component component = Component::x;
  double size = 0;     // in the channel's SI unit (seconds for the time); what it means, the kind says
  double every_s = 0;  // of a glitch: 0 = once
};
constexpr auto keys_of(const ScheduledFailure*) {
  return hal::keys(
      hal::choice("device", &ScheduledFailure::device, "haptic", "stage", "estop", "injector", "vacuum",
                  "force_sensor", "camera", "vision"),
      hal::choice_from(Failure::freeze, "kind", &ScheduledFailure::kind, "freeze", "drop", "delay", "nan",
                       "disconnect", "saturate", "noise", "glitch", "offset", "drift", "set", "stuck",
                       "flicker", "sparse", "repeat", "ignore", "creep"),
      hal::real("at_s", &ScheduledFailure::at_s, 0, 1e6),
      hal::real("for_s", &ScheduledFailure::for_s, 0, 1e6),
      hal::choice("channel", &ScheduledFailure::channel, "none", "all", "time", "position", "orientation",
                  "axis", "following_error", "clutch", "inject", "next_cell", "enabled", "standstill",
                  "contact_a", "contact_b", "reset", "pulse", "open", "pressure", "force", "centre", "cell",
                  "radius", "entry", "gap", "dimple_depth", "dimple_width", "membrane_velocity", "contact",
                  "punctured", "inner_punctured", "enable", "disable", "quick_stop", "gate"),
      hal::choice("component", &ScheduledFailure::component, "x", "y", "z", "w", "all"),
      hal::real("size", &ScheduledFailure::size, -1e308, 1e308),
      hal::real("every_s", &ScheduledFailure::every_s, 0, 1e6));
}

// Scripted presses of the simulated e-stop.
struct EstopEvent {
  double at_s = 0;
  double for_s = 0.5;
  bool contact_a = true;  // which contacts open
  bool contact_b = true;
  bool reset_after = false;  // press reset 0.2 s after release
};
constexpr auto keys_of(const EstopEvent*) {
  return hal::keys(
      hal::real("at_s", &EstopEvent::at_s, 0, 1e6), hal::real("for_s", &EstopEvent::for_s, 0.0001, 1e6),
      hal::flag("contact_a", &EstopEvent::contact_a), hal::flag("contact_b", &EstopEvent::contact_b),
      hal::flag("reset_after", &EstopEvent::reset_after));
}

struct SimConfig {
  std::uint64_t seed = 1;
  HandParams hand;
  OperatorParams operator_params;
  StageParams stage;
  NeedleParams needle;
  std::optional<CellParams> cell;
  std::optional<HolderParams> holder;
  std::optional<DishParams> dish;
  std::optional<InjectorParams> injector;
  std::optional<ForceSensorParams> force_sensor;
  std::optional<MicroscopeParams> microscope;
  std::array<ScheduledFailure, 8> failures{};
  int failure_count = 0;
  std::array<EstopEvent, 4> estop_events{};
  int estop_event_count = 0;
  double position_scale = 500;    // hand to needle, the same number as the core's mapping
  int cells = 1;                  // to inject, the same number as the core's; 0 = until the time limit
  double relay_timeout_s = 0.05;  // without a heartbeat the relay opens: drive power off
};
// [sim.estop]
inline constexpr auto kEstopPlantKeys =
    hal::keys(hal::milli("relay_timeout_ms", &SimConfig::relay_timeout_s, 5, 1000));

}  // namespace punctum::sim
