// Which GenICam camera it is, and how its pixels come: table [aravis] of a scene.
#pragma once

#include <cstdint>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::aravis {

struct AravisParams {
  enum class Format : std::uint8_t { mono8, mono10, mono12, mono16 };  // not packed; the upper 8 bits count

  std::string name;  // as `arv-tool-0.8` lists it, "Maker-serial number"; empty: the only one there is
  Format format = Format::mono8;
};
constexpr auto keys_of(const AravisParams*) {
  return hal::keys(hal::text("name", &AravisParams::name),
                   hal::choice("format", &AravisParams::format, "mono8", "mono10", "mono12", "mono16"));
}

}  // namespace punctum::aravis
