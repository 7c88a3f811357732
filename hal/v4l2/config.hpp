// Which V4L2 device is the camera: table [v4l2] of a scene.
#pragma once

#include <cstdint>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::v4l2 {

struct V4l2Params {
  enum class Format : std::uint8_t {
    grey,  // GREY: 8 bits, taken as they are
    y16,   // Y16: 16 bits, of which `bits` count
    yuyv,  // YUYV: every other byte is brightness, the rest colour
  };

  std::string path = "/dev/video0";  // /dev/v4l/by-id/... stays the same camera after a replug
  Format format = Format::grey;
  int bits = 16;  // of y16: grey = value / 2^(bits - 8), at most 255
};
constexpr auto keys_of(const V4l2Params*) {
  return hal::keys(hal::text("path", &V4l2Params::path),
                   hal::choice("format", &V4l2Params::format, "grey", "y16", "yuyv"),
                   hal::whole("bits", &V4l2Params::bits, 8, 16));
}

}  // namespace punctum::v4l2
