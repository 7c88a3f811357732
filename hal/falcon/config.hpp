// A Novint Falcon as the handle: [falcon] of a scene.
#pragma once

#include <string>

#include "hal/parameters.hpp"

namespace punctum::falcon {

struct FalconParams {
  std::string firmware;  // boot stream of its processor; empty: it was booted before
  int cpu = -1;          // of the thread that talks to it; -1: any but the servo's
};
constexpr auto keys_of(const FalconParams*) {
  return hal::keys(hal::path("firmware", &FalconParams::firmware),
                   hal::whole("cpu", &FalconParams::cpu, -1, 1023));
}

}  // namespace punctum::falcon
