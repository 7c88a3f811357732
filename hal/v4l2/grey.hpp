// Pictures as V4L2 lays them out in memory, and 8-bit grey.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/v4l2/config.hpp"

namespace punctum::v4l2 {

struct Layout {
  V4l2Params::Format format = V4l2Params::Format::grey;
  int width = 0, height = 0;
  int stride = 0;  // bytes from row to row
  int bits = 16;   // of y16
};

[[nodiscard]] constexpr std::size_t row_bytes(const Layout& layout) {
  return static_cast<std::size_t>(layout.width) * (layout.format == V4l2Params::Format::grey ? 1 : 2);
}
// The last row needs no padding.
[[nodiscard]] constexpr std::size_t bytes_needed(const Layout& layout) {
  return static_cast<std::size_t>(layout.stride) * static_cast<std::size_t>(layout.height - 1) +
         row_bytes(layout);
}

// `to` has width * height bytes, rows without padding. Y16: the lowest of the `bits` are dropped, not
// rounded; what is brighter than `bits` can say is 255. YUYV: brightness as the camera coded it, mostly 16
// (black) to 235 (white).
void to_grey(const Layout& layout, const std::uint8_t* from, std::uint8_t* to);

}  // namespace punctum::v4l2
