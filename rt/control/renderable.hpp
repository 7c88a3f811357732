// Whether the haptic device can render what a configuration asks: damping that leaves the bare handle stable,
// springs that leave it stable and, without a guard, passive, and a stage whose step is not felt as a click.
//
// Plain values, no allocation; for start-up: some tens of milliseconds.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

struct Spring {
  enum class Of : std::uint8_t { cone, membrane, axis, repulsive, friction, forbidden };
  Of of{};
  double K_N_m = 0;  // at the hand
};

// What is asked for beyond a limit of the device.
struct NotRenderable {
  enum class What : std::uint8_t {
    damping_outside,  // B1: asked and most in Ns/m
    damping_inside,   // B2
    damping_inward,   // B_inward of the axis, beside damping beside_Ns_m: most is of their sum
    unstable,         // the sum of the springs swings by itself beside damping beside_Ns_m: N/m
    not_passive,      // the sum of the springs, without a guard: N/m
  };
  What what{};
  double asked = 0;
  double most = 0;
  double beside_Ns_m = 0;
  std::array<Spring, 4> springs{};  // that act at once
  int spring_count = 0;
  Spring::Of stiffest{};
};

// The first limit that is passed; none: the device can render every effect of the configuration, or it is
// one without force.
[[nodiscard]] std::optional<NotRenderable> find_not_renderable(const ServoConfig& config) NONBLOCKING;

// One step of the stage under the stiffest part of the membrane law, at the hand.
inline constexpr double kLargestClick_N = 0.25;
[[nodiscard]] double stage_click_N(const ServoConfig& config, double stage_step_m) NONBLOCKING;

}  // namespace punctum::rt
