// The list of force effects. Their order is the order of additions and of telemetry's effect_N.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/damping.hpp"
#include "rt/forces/forbidden_walls.hpp"
#include "rt/forces/friction.hpp"
#include "rt/forces/membrane.hpp"
#include "rt/forces/repulsive_region.hpp"
#include "rt/forces/vibration.hpp"
#include "rt/forces/withdrawal_axis.hpp"
#include "rt/station/telemetry.hpp"

// One line per effect: its scene table, its class.
#define PUNCTUM_EFFECTS(X)      \
  X(membrane, Membrane)         \
  X(cone, ConeGuide)            \
  X(axis, WithdrawalAxis)       \
  X(damping, Damping)           \
  X(repulsive, RepulsiveRegion) \
  X(friction, Friction)         \
  X(vibration, Vibration)       \
  X(forbidden, ForbiddenWalls)

namespace punctum::rt {

enum Effect : std::uint8_t {
#define PUNCTUM_EFFECT(name, Class) effect_##name,
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
      effect_count
};
static_assert(effect_count <= kMaxEffects, "raise kMaxEffects in rt/station/telemetry.hpp");

inline constexpr const char* kEffectNames[] = {
#define PUNCTUM_EFFECT(name, Class) #name,
    PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
};
[[nodiscard]] constexpr const char* effect_name(std::size_t effect) NONBLOCKING {
  return kEffectNames[effect];
}

// The effects of a scene: an empty optional is an effect that is not there.
struct EffectParams {
#define PUNCTUM_EFFECT(name, Class) std::optional<Class::Params> name;
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
};

}  // namespace punctum::rt
