// Rows of pictures that are asked of the memory before they are needed. A processor does so by itself only
// within a page of 4096 bytes, which is a few rows.
#pragma once

#include <cstddef>
#include <cstdint>

namespace punctum::vision {

inline constexpr int kRowsAhead = 8;

inline void prefetch_row(const void* row, std::size_t bytes) {
  constexpr std::size_t kLine = 64;  // bytes that come at once
  const auto* first = static_cast<const std::uint8_t*>(row);
  for (std::size_t at = 0; at < bytes; at += kLine) {
    __builtin_prefetch(first + at);
  }
}

}  // namespace punctum::vision
