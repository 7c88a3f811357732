#include "hal/v4l2/grey.hpp"

#include <algorithm>

namespace punctum::v4l2 {

void to_grey(const Layout& layout, const std::uint8_t* from, std::uint8_t* to) {
  const auto width = static_cast<std::size_t>(layout.width);
  for (int y = 0; y < layout.height; ++y, from += layout.stride, to += width) {
    switch (layout.format) {
      case V4l2Params::Format::grey:
        std::copy_n(from, width, to);
        break;
      case V4l2Params::Format::y16:
        for (std::size_t x = 0; x < width; ++x) {
          const int value = from[2 * x] | from[2 * x + 1] << 8;
          to[x] = static_cast<std::uint8_t>(std::min(value >> (layout.bits - 8), 255));
        }
        break;
      case V4l2Params::Format::yuyv:
        for (std::size_t x = 0; x < width; ++x) {
          to[x] = from[2 * x];
        }
        break;
    }
  }
}

}  // namespace punctum::v4l2
