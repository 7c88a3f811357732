#include "vision/image/noise.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "vision/image/dispatched.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/image/prefetch.hpp"

namespace punctum::vision {

namespace {

// Absolute values; of every pixel, since the compiler vectorises that.
PUNCTUM_WIDE_LOOP void second_differences(const std::uint8_t* above, const std::uint8_t* here,
                                          const std::uint8_t* below, int n, std::int16_t* upright,
                                          std::int16_t* both) {
  for (int x = 0; x < n; ++x) {
    upright[x] = static_cast<std::int16_t>(above[x] - 2 * here[x] + below[x]);
  }
  for (int x = 1; x + 1 < n; ++x) {
    const std::int16_t v = static_cast<std::int16_t>(upright[x - 1] - 2 * upright[x] + upright[x + 1]);
    both[x] = std::max(v, static_cast<std::int16_t>(-v));
  }
}

}  // namespace

double noise_level(const cv::Mat& grey, int stride) {
  if (grey.type() != CV_8U || grey.rows < 3 || grey.cols < 3) {
    return 0;
  }
  stride = std::max(1, stride);
  const int cols = grey.cols;
  std::array<int, 2041> count{};  // |1 -2 1; -2 4 -2; 1 -2 1| <= 2040
  std::int64_t total = 0;
  // Side by side: where one lies a multiple of 4096 bytes from the other, processors take a load from the one
  // for a load of what was just stored in the other, and wait.
  const auto n = static_cast<std::size_t>(cols);
  Vector<std::int16_t> differences(2 * n);
  std::int16_t *upright = differences.data(), *both = upright + n;
  for (int y = 1; y + 1 < grey.rows; y += stride) {
    for (int row = y + kRowsAhead; row < std::min(y + kRowsAhead + stride, grey.rows); ++row) {
      prefetch_row(grey.ptr(row), n);
    }
    second_differences(grey.ptr(y - 1), grey.ptr(y), grey.ptr(y + 1), cols, upright, both);
    for (int x = 1; x + 1 < cols; x += stride) {
      ++count[static_cast<std::size_t>(both[x])];
    }
    total += (cols - 2 + stride - 1) / stride;
  }
  std::int64_t below = 0;
  for (std::size_t v = 0; v < count.size(); ++v) {
    if (below + count[v] > total / 2) {  // interpolated inside the bin
      const double part = (static_cast<double>(total) / 2 - static_cast<double>(below)) / count[v];
      const double median = v == 0 ? 0.5 * part : static_cast<double>(v) - 0.5 + part;
      return median / 0.67449 / 6.0;
    }
    below += count[v];
  }
  return 0;
}

}  // namespace punctum::vision
