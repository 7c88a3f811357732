// The running effects of a scene and their sum.
#pragma once

#include <array>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"
#include "rt/forces/list.hpp"

namespace punctum::rt {

using EffectGains = std::array<double, effect_count>;
inline constexpr EffectGains kFullGains = [] {
  EffectGains gains{};
  gains.fill(1);
  return gains;
}();

struct EffectSum {
  hal::Vec3 force_N = hal::Vec3::Zero();        // all of it, with force_fade
  ForceParts parts;                             // the same, as the passivity guard takes it
  std::array<double, effect_count> effect_N{};  // magnitude of each effect, before force_fade
  double force_fade = 0;
  double stored_J = 0;    // with fixture_gain, before force_fade
  double injected_J = 0;  // signed, since the start of the run
};

class Effects {
 public:
  Effects(const EffectParams& params, const EffectSetup& setup) NONBLOCKING;

  // Once per tick. Real-time safe. `reduced`: 0 .. 1 of each effect, as commanded, unless all are full; the
  // caller ramps it.
  const EffectSum& step(const EffectInput& in, const EffectGains* reduced = nullptr) NONBLOCKING;

  [[nodiscard]] const EffectSum& sum() const NONBLOCKING { return sum_; }
  [[nodiscard]] const std::optional<Membrane>& membrane() const NONBLOCKING { return membrane_; }

 private:
#define PUNCTUM_EFFECT(name, Class) std::optional<Class> name##_;
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT

  std::optional<hal::Mat3> reach_;
  EffectSum sum_;
  double last_fixture_gain_ = 0;
  EffectGains last_gain_ = kFullGains;
  bool last_full_ = true;  // last_gain_ is kFullGains
};

}  // namespace punctum::rt
