#include "rt/forces/effects.hpp"

namespace punctum::rt {
namespace {

// Of all fixtures, before fixture_gain.
struct FixtureEnergy {
  double stored_J = 0;
  double injected_J = 0;
  double stiffness_N_m = 0;
};

void add(FixtureEnergy& fixtures, const EffectOutput& out) NONBLOCKING {
  fixtures.stored_J += out.stored_J;
  fixtures.injected_J += out.injected_J;
  fixtures.stiffness_N_m += out.stiffness_N_m;
}

// Returns the effect's whole force.
[[nodiscard]] hal::Vec3 add(ForceParts& parts, const EffectOutput& out, double gain) NONBLOCKING {
  const hal::Vec3 dissipative_N = gain * out.dissipative_N;
  const hal::Vec3 passive_N = gain * (out.storing_N + out.dissipative_N);
  const hal::Vec3 active_N = gain * out.active_N;
  // Not "+= gain * storing_N": the order of additions is that of the reference runs.
  hal::Vec3& storing_N = parts.storing[static_cast<std::size_t>(out.point)].force_N;
  storing_N += passive_N;
  storing_N -= dissipative_N;
  parts.dissipative_N += dissipative_N;
  parts.active_N += active_N;
  parts.damping_Ns_m += out.damping_Ns_m;
  return passive_N + active_N;
}

void fade(ForceParts& parts, double force_fade) NONBLOCKING {
  for (StoringForce& storing : parts.storing) {
    storing.force_N *= force_fade;
  }
  parts.dissipative_N *= force_fade;
  parts.active_N *= force_fade;
  parts.damping_Ns_m *= force_fade;
}

// Less of an effect, as commanded. At a standing hand, d(g U) is what the effect and its gain g did.
[[nodiscard]] EffectOutput scaled(const EffectOutput& out, double gain, double last_gain) NONBLOCKING {
  if (gain == 1 && last_gain == 1) {
    return out;
  }
  EffectOutput less = out;
  less.storing_N *= gain;
  less.dissipative_N *= gain;
  less.active_N *= gain;
  less.stored_J *= gain;
  less.injected_J = gain * out.stored_J - last_gain * (out.stored_J - out.injected_J);
  less.stiffness_N_m *= gain;
  less.damping_Ns_m *= gain;
  return less;
}

[[nodiscard]] bool is_fixture(const EffectOutput& out) NONBLOCKING {
  return out.point == EnergyPoint::fixture_point;
}

}  // namespace

Effects::Effects(const EffectParams& params, const EffectSetup& setup) NONBLOCKING : reach_(setup.reach) {
#define PUNCTUM_EFFECT(name, Class)       \
  if (params.name) {                      \
    name##_.emplace(*params.name, setup); \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
}

// The stored energy changes only along the ways that the stage can make.
EffectOutput Effects::reachable(EffectOutput out) const NONBLOCKING {
  if (reach_ && out.point != EnergyPoint::handle) {
    out.storing_N = reach_->lazyProduct(hal::Vec3(out.storing_N));
  }
  return out;
}

const EffectSum& Effects::step(const EffectInput& in, const EffectGains& gain) NONBLOCKING {
  hal::Vec3 force_N = hal::Vec3::Zero();
  ForceParts parts;
  FixtureEnergy fixtures;
  const auto add_effect = [&](const EffectOutput& out, double& effect_N) {
    const hal::Vec3 whole_N = add(parts, out, is_fixture(out) ? in.fixture_gain : 1);
    effect_N = whole_N.norm();
    force_N += whole_N;
    if (is_fixture(out)) {
      add(fixtures, out);
    }
  };
#define PUNCTUM_EFFECT(name, Class)                                                           \
  if (name##_) {                                                                              \
    outputs_[effect_##name] =                                                                 \
        reachable(scaled(name##_->step(in), gain[effect_##name], last_gain_[effect_##name])); \
    add_effect(outputs_[effect_##name], sum_.effect_N[effect_##name]);                        \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT

  fade(parts, in.force_fade);
  parts.storing[static_cast<std::size_t>(EnergyPoint::fixture_point)].point_m =
      in.position_scale * in.fixture_point_m;
  parts.storing[static_cast<std::size_t>(EnergyPoint::needle)].point_m = in.position_scale * in.needle_tip_m;
  parts.storing[static_cast<std::size_t>(EnergyPoint::handle)].point_m = in.handle_m;
  parts.stiffness_N_m = in.force_fade * in.fixture_gain * fixtures.stiffness_N_m;
  sum_.force_fade = in.force_fade;
  sum_.force_N = in.force_fade * force_N;

  // At a standing hand, d(g U) is what the fixtures and their gain g did since the last tick.
  sum_.stored_J = in.fixture_gain * fixtures.stored_J;
  sum_.injected_J +=
      in.fixture_gain * fixtures.stored_J - last_fixture_gain_ * (fixtures.stored_J - fixtures.injected_J);
  last_fixture_gain_ = in.fixture_gain;
  last_gain_ = gain;
  const auto add_energy = [&](const EffectOutput& out) {
    if (!is_fixture(out)) {
      sum_.stored_J += out.stored_J;
      sum_.injected_J += out.injected_J;
      parts.stiffness_N_m += in.force_fade * out.stiffness_N_m;
    }
  };
#define PUNCTUM_EFFECT(name, Class)      \
  if (name##_) {                         \
    add_energy(outputs_[effect_##name]); \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  parts.stored_J = in.force_fade * sum_.stored_J;
  sum_.parts = parts;
  return sum_;
}

}  // namespace punctum::rt
