// What every force effect gets, and the one value that it returns.
//
// An effect is a class with
//   using Params = ...;                                     its scene table
//   static constexpr Gives kGives{...};                     its kinds of force
//   Effect(const Params&, const EffectSetup&) noexcept;
//   [[nodiscard]] EffectOutput step(const EffectInput&) noexcept;   once per tick, real-time safe
// and a line in list.hpp. SI units. Forces are at the hand, in world axes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/fixture.hpp"

namespace punctum::rt {

// What does not change during a run.
struct EffectSetup {
  double force_scale = 1e5;   // k_f: hand newtons per needle newton
  int force_delay_ticks = 0;  // a force acts this many ticks after it is written
  // Of a stage that cannot make every motion, the projector onto those that it can: what pulls the needle
  // elsewhere would pull the hand for ever.
  std::optional<hal::Mat3> reach{};
};

struct EffectInput {
  double dt_s = 0;  // bounded: what ramps advance by

  // Changes only while no fixture is felt: fixture_gain and coupling_gain are zero then.
  double position_scale = 500;  // k_p: hand metres per needle metre

  // Positions and velocity.
  hal::Vec3 handle_m = hal::Vec3::Zero();  // of the handle, as its encoders read
  hal::Vec3 handle_velocity_m_s = hal::Vec3::Zero();
  hal::Vec3 fixture_point_m = hal::Vec3::Zero();  // the handle at needle scale, after clutch and limits
  hal::Vec3 needle_tip_m = hal::Vec3::Zero();     // as the stage's encoders read; follows the handle late
  hal::Vec3 needle_axis = -hal::Vec3::UnitX();    // unit, out of its tip, as the stage is told to point it
  hal::Vec3 approach_axis = -hal::Vec3::UnitX();  // unit, into the cell

  // The cell, as vision and the local membrane model know it.
  bool cell_known = false;
  FixtureFrame entry;  // where the approach axis meets the undeformed membrane
  hal::Vec3 cell_centre_m = hal::Vec3::Zero();
  double cell_radius_m = 0;
  double depth_m = 0;             // of the tip past the undeformed membrane
  double depth_correction_m = 0;  // the part of its change that a correction by vision made
  double dimple_scale = 1;        // of the paper's membrane law

  // The phase of the injection.
  bool punctured = false;    // from the puncture until the next cell
  bool inside_cell = false;  // from the puncture until the needle is clear
  bool withdrawing = false;
  bool contact_or_puncture_begins = false;  // on this tick
  bool new_cell = false;                    // on this tick
  FixtureFrame insertion;                   // tip and axis at the puncture

  // Gains, 0 .. 1.
  double fixture_gain = 0;     // of all effects at the needle: clutch, age of the observation
  double coupling_gain = 0;    // the same without the age of the observation
  double commanded_scale = 1;  // command force_scale
  double force_fade = 0;       // of every force, applied to the sum: start, stop, end
  double last_force_fade = 0;
};

// The point that a stored energy depends on.
enum class EnergyPoint : std::uint8_t {
  fixture_point,  // the handle at needle scale. These effects are multiplied by fixture_gain in the sum
  needle,         // the needle's tip, which follows the handle late
  handle,
};
inline constexpr std::size_t kEnergyPoints = 3;

// The kinds of force that an effect gives: the others are zero, and nobody adds them.
struct Gives {
  EnergyPoint point = EnergyPoint::handle;  // of the stored energy
  bool storing = false, dissipative = false, active = false;
};

// What one effect does on one tick, before force_fade.
struct EffectOutput {
  hal::Vec3 storing_N = hal::Vec3::Zero();      // the force of its stored energy
  hal::Vec3 dissipative_N = hal::Vec3::Zero();  // a force against a velocity
  hal::Vec3 active_N = hal::Vec3::Zero();       // a force with a bounded energy of its own
  double stored_J = 0;
  double injected_J = 0;     // since the last tick: by moving, by switching, by an active force
  double stiffness_N_m = 0;  // no eigenvalue of the stored energy's Hessian is larger in magnitude
  double damping_Ns_m = 0;   // the dissipative force is no larger than this times the speed
};

// A force that stores energy as its point moves; the point at the hand's scale.
struct StoringForce {
  hal::Vec3 force_N = hal::Vec3::Zero();
  hal::Vec3 point_m = hal::Vec3::Zero();
};

// The sum of the effects in the parts that the passivity guard tells apart.
struct ForceParts {
  std::array<StoringForce, kEnergyPoints> storing;
  hal::Vec3 dissipative_N = hal::Vec3::Zero();
  hal::Vec3 active_N = hal::Vec3::Zero();
  double stored_J = 0;       // by the storing forces
  double stiffness_N_m = 0;  // bound of the storing forces' stiffness
  double damping_Ns_m = 0;   // bound of the dissipative forces' damping

  [[nodiscard]] hal::Vec3 stored_N() const NONBLOCKING {
    return storing[0].force_N + storing[1].force_N + storing[2].force_N;
  }
  [[nodiscard]] hal::Vec3 wanted_N() const NONBLOCKING { return stored_N() + dissipative_N + active_N; }
};

}  // namespace punctum::rt
