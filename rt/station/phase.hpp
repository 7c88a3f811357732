// The phases of one injection.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

// Phases of an injection, in order. One cell goes through them once. `puncture` begins when the outer
// membrane has given way, `injection` with the press of the button after the innermost one has.
enum class Phase : std::uint8_t { free, contact, indentation, puncture, injection, withdrawal, clear };
inline constexpr int kPhases = 7;
[[nodiscard]] constexpr const char* name(Phase p) NONBLOCKING {
  constexpr const char* names[kPhases] = {"free",      "contact",    "indentation", "puncture",
                                          "injection", "withdrawal", "clear"};
  return names[static_cast<int>(p)];
}

}  // namespace punctum::rt
