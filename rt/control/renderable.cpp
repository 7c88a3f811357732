#include "rt/control/renderable.hpp"

#include <algorithm>
#include <cmath>

#include "rt/control/device_limits.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/membrane.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {
namespace {

using What = NotRenderable::What;
using Springs = std::array<Spring, 4>;

// Damping that would make the handle itself swing.
std::optional<NotRenderable> find_damping(const ServoConfig& config) NONBLOCKING {
  if (!config.damping && !config.axis) {
    return std::nullopt;
  }
  const double most = stable_damping_Ns_m(config.device, 1 / config.rate_Hz, config.velocity);
  double inside = 0;
  if (config.damping) {
    const double outer = config.damping->B1_Ns_m;
    const double inner = config.damping->B2_Ns_m;
    if (!(outer < most)) {
      return NotRenderable{.what = What::damping_outside, .asked = outer, .most = most};
    }
    if (!(inner < most)) {
      return NotRenderable{.what = What::damping_inside, .asked = inner, .most = most};
    }
    inside = std::max(outer, inner);
  }
  if (config.axis && !(inside + config.axis->B_inward_Ns_m < most)) {
    return NotRenderable{.what = What::damping_inward,
                         .asked = config.axis->B_inward_Ns_m,
                         .most = most,
                         .beside_Ns_m = inside};
  }
  return std::nullopt;
}

// The largest stiffness that the membrane has at the hand, up to the force that a limit cuts off.
double membrane_stiffness_N_m(const ServoConfig& config) NONBLOCKING {
  if (!config.membrane || !config.local_model) {
    return 0;
  }
  constexpr int kSteps = 200;
  const double k_p = config.mapping.least_position_scale();
  const double k_f = config.mapping.force_scale;
  double largest = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double part = static_cast<double>(i) / kSteps;
    const MembraneState m = membrane_law(*config.membrane, part * part * config.limits.penetration_depth_m,
                                         config.membrane->R_m, config.local_model->dimple_scale);
    largest = std::max(largest, m.stiffness_N_m * k_f / k_p);
    if (m.force_N > config.limits.tip_force_hard_N || m.force_N * k_f > config.limits.hand_force_N) {
      break;
    }
  }
  return largest;
}

// Springs that act at once beside damping B: stable with nobody at the handle, and passive without a guard.
std::optional<NotRenderable> find_springs(const ServoConfig& config, const Springs& springs, double B)
    NONBLOCKING {
  NotRenderable found{.beside_Ns_m = B, .stiffest = springs[0].of};
  double stiffest = springs[0].K_N_m;
  for (const Spring& spring : springs) {
    if (!(spring.K_N_m > 0)) {
      continue;
    }
    found.asked += spring.K_N_m;
    found.springs[static_cast<std::size_t>(found.spring_count++)] = spring;
    if (spring.K_N_m > stiffest) {
      stiffest = spring.K_N_m;
      found.stiffest = spring.of;
    }
  }
  if (found.spring_count == 0) {
    return std::nullopt;
  }
  const double T_s = 1 / config.rate_Hz;
  found.what = What::unstable;
  found.most = stable_stiffness_N_m(config.device, T_s, config.velocity, B);
  if (!(found.asked <= found.most)) {
    return found;
  }
  found.what = What::not_passive;
  found.most = passive_stiffness_N_m(config.device, T_s);
  if (!config.guard && !(found.asked <= found.most)) {
    return found;
  }
  return std::nullopt;
}

// The stiffest moment of the puncture, where the cone is switched off while the axis is switched on.
struct Crossing {
  double cone_N_m = 0;
  double axis_N_m = 0;
};
Crossing stiffest_crossing(const ServoConfig& config, double cone_N_m) NONBLOCKING {
  const double axis_N_m = config.axis ? config.axis->K_N_m : 0;
  double both = axis_N_m;
  double fading = 0;
  if (config.cone && config.axis) {
    constexpr int kSteps = 64;
    for (int i = 0; i < kSteps; ++i) {
      const double t_s = i * std::max(config.cone->ramp_s, config.axis->ramp_s) / kSteps;
      const double of_cone = cone_N_m * smooth_step(1 - t_s / config.cone->ramp_s);
      const double of_axis = axis_N_m * smooth_step(t_s / config.axis->ramp_s);
      if (of_cone + of_axis > both) {
        both = of_cone + of_axis;
        fading = of_cone;
      }
    }
  }
  return {fading, both - fading};
}

std::optional<NotRenderable> find_stiffness(const ServoConfig& config) NONBLOCKING {
  using enum Spring::Of;
  const double cone_N_m = config.cone ? cone_stiffness_bound_N_m(*config.cone) : 0;
  const Spring membrane_spring{membrane, membrane_stiffness_N_m(config)};
  const Spring repulsive_spring{repulsive, config.repulsive ? config.repulsive->K_N_m : 0};
  const Spring friction_spring{friction, config.friction ? config.friction->K_N_m : 0};
  const Spring wall{forbidden, config.forbidden ? config.forbidden->K_N_m : 0};
  const double B1 = config.damping ? config.damping->B1_Ns_m : 0;
  const double B2 = config.damping ? config.damping->B2_Ns_m : 0;
  const Springs outside{Spring{cone, cone_N_m}, membrane_spring, repulsive_spring, friction_spring};
  if (const auto found = find_springs(config, outside, B1)) {
    return found;
  }
  // Glass stands beside the cell, where its cone, membrane and axis have ended. Where they overlap all the
  // same, the guard takes the sum.
  const Springs at_glass{wall, repulsive_spring, friction_spring};
  if (const auto found = find_springs(config, at_glass, B1)) {
    return found;
  }
  const Crossing crossing = stiffest_crossing(config, cone_N_m);
  const Springs inside{Spring{axis, crossing.axis_N_m}, Spring{cone, crossing.cone_N_m}, repulsive_spring,
                       friction_spring};
  const double inward = config.axis ? config.axis->B_inward_Ns_m : 0;
  for (const double B : {B1, B2, B2 + inward}) {
    if (const auto found = find_springs(config, inside, B)) {
      return found;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<NotRenderable> find_not_renderable(const ServoConfig& config) NONBLOCKING {
  if (!(config.device.force_max_N > 0)) {
    return std::nullopt;
  }
  if (const auto found = find_damping(config)) {
    return found;
  }
  return find_stiffness(config);
}

double stage_click_N(const ServoConfig& config, double stage_step_m) NONBLOCKING {
  return membrane_stiffness_N_m(config) * config.mapping.least_position_scale() * stage_step_m;
}

}  // namespace punctum::rt
