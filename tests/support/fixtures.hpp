// What the tests of the fixtures' fields share.
#pragma once

#include "rt/forces/effect.hpp"

namespace punctum::rt::test {

inline constexpr double kScale = 500;  // the hand's way for the needle's
inline constexpr EffectSetup kSetup;

// Of the potential U at a point, by sixth-order central differences with step h.
template <typename Potential>
hal::Vec3 gradient(const Potential& U, const hal::Vec3& at, double h) {
  hal::Vec3 g;
  for (int k = 0; k < 3; ++k) {
    const hal::Vec3 e = hal::Vec3::Unit(k) * h;
    g[k] = (45 * (U(at + e) - U(at - e)) - 9 * (U(at + 2 * e) - U(at - 2 * e)) +
            (U(at + 3 * e) - U(at - 3 * e))) /
           (60 * h);
  }
  return g;
}

}  // namespace punctum::rt::test
