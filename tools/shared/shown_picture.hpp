// A picture for whoever looks: a large one is reduced to what a page can show.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/station/picture.hpp"

namespace punctum::tools {

// head: of the whole picture. room: for a reduced one; used again and again it allocates once.
inline void show(rt::PictureHead head, const std::uint8_t* pixels, std::size_t stride,
                 std::vector<std::uint8_t>& room, rt::ViewSegment::Ring& ring) {
  const auto bytes_at = [&head](std::uint64_t step) { return (head.width / step) * (head.height / step); };
  std::uint32_t step = 1;
  while (bytes_at(step) > rt::ViewSegment::kLargest) {
    ++step;
  }
  if (step == 1) {
    (void)ring.push(head, pixels, stride);
    return;
  }
  const std::uint32_t width = head.width / step, height = head.height / step;
  room.resize(bytes_at(step));
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      std::uint32_t sum = 0;
      for (std::uint32_t k = 0; k < step; ++k) {
        const std::uint8_t* row = pixels + (std::size_t{y} * step + k) * stride + std::size_t{x} * step;
        for (std::uint32_t i = 0; i < step; ++i) {
          sum += row[i];
        }
      }
      room[std::size_t{y} * width + x] = static_cast<std::uint8_t>(sum / (step * step));
    }
  }
  head.step_px *= step;
  head.width = width;
  head.height = height;
  (void)ring.push(head, room.data(), width);
}

}  // namespace punctum::tools
