#include "rt/forces/effects.hpp"

namespace punctum::rt {
namespace {

struct Energy {
  double stored_J;
  double injected_J;
  double stiffness_N_m;
};

constexpr bool is_fixture(const Gives& gives) NONBLOCKING {
  return gives.point == EnergyPoint::fixture_point;
}

// What the effects of one tick add up to besides their parts.
struct Sums {
  hal::Vec3 force_N = hal::Vec3::Zero();
  Energy fixtures{};                        // before fixture_gain
  std::array<Energy, effect_count> others;  // each by itself: they are added after the fixtures
  std::size_t other_count = 0;
};

// Returns the effect's whole force.
template <Gives gives>
[[nodiscard]] hal::Vec3 add(ForceParts& parts, const EffectOutput& out, double gain) NONBLOCKING {
  hal::Vec3 whole_N = hal::Vec3::Zero();
  hal::Vec3& storing_N = parts.storing[static_cast<std::size_t>(gives.point)].force_N;
  if constexpr (gives.storing && !gives.dissipative) {
    whole_N = gain * out.storing_N;
    storing_N += whole_N;
  }
  if constexpr (gives.dissipative) {
    const hal::Vec3 dissipative_N = gain * out.dissipative_N;
    whole_N = gives.storing ? hal::Vec3(gain * (out.storing_N + out.dissipative_N)) : dissipative_N;
    if constexpr (gives.storing) {
      // Not "+= gain * storing_N": the order of additions is that of the reference runs.
      storing_N += whole_N;
      storing_N -= dissipative_N;
    }
    parts.dissipative_N += dissipative_N;
    parts.damping_Ns_m += out.damping_Ns_m;
  }
  if constexpr (gives.active) {
    const hal::Vec3 active_N = gain * out.active_N;
    parts.active_N += active_N;
    whole_N += active_N;
  }
  return whole_N;
}

// What the effects are added to: the rest is assigned.
void clear(ForceParts& parts) NONBLOCKING {
  for (StoringForce& storing : parts.storing) {
    storing.force_N.setZero();
  }
  parts.dissipative_N.setZero();
  parts.active_N.setZero();
  parts.damping_Ns_m = 0;
}

void fade(ForceParts& parts, double force_fade) NONBLOCKING {
  if (force_fade == 1) {
    return;
  }
  for (StoringForce& storing : parts.storing) {
    storing.force_N *= force_fade;
  }
  parts.dissipative_N *= force_fade;
  parts.active_N *= force_fade;
  parts.damping_Ns_m *= force_fade;
}

// Less of an effect, as commanded. At a standing hand, d(g U) is what the effect and its gain g did.
void scale(EffectOutput& out, double gain, double last_gain) NONBLOCKING {
  if (gain == 1 && last_gain == 1) {
    return;
  }
  out.injected_J = gain * out.stored_J - last_gain * (out.stored_J - out.injected_J);
  out.storing_N *= gain;
  out.dissipative_N *= gain;
  out.active_N *= gain;
  out.stored_J *= gain;
  out.stiffness_N_m *= gain;
  out.damping_Ns_m *= gain;
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

const EffectSum& Effects::step(const EffectInput& in, const EffectGains* reduced) NONBLOCKING {
  ForceParts& parts = sum_.parts;
  clear(parts);
  Sums sums;
  const EffectGains& gain = reduced != nullptr ? *reduced : kFullGains;
  const bool scaled = reduced != nullptr || !last_full_;  // rarely
  const auto take = [&]<class Class>(std::optional<Class>& effect, Effect which) {
    if (!effect) {
      return;
    }
    constexpr Gives gives = Class::kGives;
    EffectOutput out = effect->step(in);
    if (scaled) {
      scale(out, gain[which], last_gain_[which]);
    }
    // The stored energy changes only along the ways that the stage can make.
    if (gives.storing && gives.point != EnergyPoint::handle && reach_) {
      out.storing_N = reach_->lazyProduct(hal::Vec3(out.storing_N));
    }
    const hal::Vec3 whole_N = add<gives>(parts, out, is_fixture(gives) ? in.fixture_gain : 1);
    sum_.effect_N[which] = whole_N.norm();
    sums.force_N += whole_N;
    if constexpr (is_fixture(gives)) {
      sums.fixtures.stored_J += out.stored_J;
      sums.fixtures.injected_J += out.injected_J;
      sums.fixtures.stiffness_N_m += out.stiffness_N_m;
    } else if constexpr (gives.storing || gives.active) {
      sums.others[sums.other_count++] = {out.stored_J, out.injected_J, out.stiffness_N_m};
    }
  };
#define PUNCTUM_EFFECT(name, Class) take(name##_, effect_##name);
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  const Energy& fixtures = sums.fixtures;

  fade(parts, in.force_fade);
  parts.storing[static_cast<std::size_t>(EnergyPoint::fixture_point)].point_m =
      in.position_scale * in.fixture_point_m;
  parts.storing[static_cast<std::size_t>(EnergyPoint::needle)].point_m = in.position_scale * in.needle_tip_m;
  parts.storing[static_cast<std::size_t>(EnergyPoint::handle)].point_m = in.handle_m;
  parts.stiffness_N_m = in.force_fade * in.fixture_gain * fixtures.stiffness_N_m;
  sum_.force_fade = in.force_fade;
  sum_.force_N = in.force_fade * sums.force_N;

  // At a standing hand, d(g U) is what the fixtures and their gain g did since the last tick.
  sum_.stored_J = in.fixture_gain * fixtures.stored_J;
  sum_.injected_J +=
      in.fixture_gain * fixtures.stored_J - last_fixture_gain_ * (fixtures.stored_J - fixtures.injected_J);
  last_fixture_gain_ = in.fixture_gain;
  if (scaled) {
    last_gain_ = gain;
    last_full_ = reduced == nullptr;
  }
  for (std::size_t i = 0; i < sums.other_count; ++i) {  // at most effect_count rounds
    const Energy& other = sums.others[i];
    sum_.stored_J += other.stored_J;
    sum_.injected_J += other.injected_J;
    parts.stiffness_N_m += in.force_fade * other.stiffness_N_m;
  }
  parts.stored_J = in.force_fade * sum_.stored_J;
  return sum_;
}

}  // namespace punctum::rt
