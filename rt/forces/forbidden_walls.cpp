#include "rt/forces/forbidden_walls.hpp"

#include <algorithm>
#include <limits>

#include "rt/forces/ramp.hpp"

namespace punctum::rt {
namespace {

constexpr double kUsedUp_m = 1e-9;  // more than rounding may hide
constexpr double kSoftPart = 0.25;  // of felt: over so much the wall's stiffness begins

}  // namespace

PotentialForce ForbiddenWalls::push(Region region, const NeedlePose& needle) NONBLOCKING {
  PotentialForce push;
  hal::Vec3& away = away_[static_cast<std::size_t>(region)];
  if (const double room_m = regions_.apart_m(region, away, needle) - params_.felt_m; room_m >= 0) {
    seen_.room_m = std::min(seen_.room_m, room_m);
    return push;  // in that direction alone they are far apart
  }
  const Gap gap = regions_.widest_gap(region, needle);
  away = gap.away;
  const double delta_m = params_.felt_m - gap.apart_m;
  seen_.room_m = std::min(seen_.room_m, -delta_m);
  push.force_N = params_.K_N_m * soft_spring(delta_m, kSoftPart * params_.felt_m) * away;
  if (reach_) {
    push.force_N = reach_->lazyProduct(hal::Vec3(push.force_N));
  }
  push.energy_J = params_.K_N_m * soft_spring_energy(delta_m, kSoftPart * params_.felt_m);
  return push;
}

EffectOutput ForbiddenWalls::step(const EffectInput& in) NONBLOCKING {
  EffectOutput out;
  const NeedlePose needle{in.fixture_point_m, in.needle_axis};
  if (in.coupling_gain > 0 && !(seen_.left_m(needle) > kUsedUp_m)) {
    seen_ = {needle, std::numeric_limits<double>::infinity()};
    for (const Region region : kRegions) {
      if (!regions_.has(region)) {
        continue;
      }
      const PotentialForce wall = push(region, needle);
      if (wall.energy_J > 0) {
        out.storing_N += in.coupling_gain * in.position_scale * wall.force_N;
        out.stored_J += in.coupling_gain * in.position_scale * in.position_scale * wall.energy_J;
        out.stiffness_N_m += in.coupling_gain * params_.K_N_m;
      }
    }
  }
  // What the handle's own way did not give: the gain, a tilt, a hand that slips (it loses what it puts in).
  const double by_hand_J = -0.5 * (last_force_N_ + out.storing_N).dot(in.handle_m - last_handle_m_);
  out.injected_J = out.stored_J - last_stored_J_ - by_hand_J;
  last_stored_J_ = out.stored_J;
  last_force_N_ = out.storing_N;
  last_handle_m_ = in.handle_m;
  return out;
}

}  // namespace punctum::rt
