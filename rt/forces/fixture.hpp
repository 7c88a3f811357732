// What the force fields at the needle share: where a virtual fixture stands, and what its potential gives.
#pragma once

#include "hal/devices.hpp"

namespace punctum::rt {

// Where a fixture stands: stage frame, needle scale.
struct FixtureFrame {
  hal::Vec3 entry_m = hal::Vec3::Zero();
  hal::Vec3 axis = -hal::Vec3::UnitX();  // unit, into the cell
};

// A force of a potential, in world axes, and the energy stored in it; both at the hand.
struct PotentialForce {
  hal::Vec3 force_N = hal::Vec3::Zero();
  double energy_J = 0;
};

}  // namespace punctum::rt
