#include "vision/image/noise.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace punctum::vision {

double noise_level(const cv::Mat& grey, int stride) {
  if (grey.type() != CV_8U || grey.rows < 3 || grey.cols < 3) {
    return 0;
  }
  stride = std::max(1, stride);
  std::array<int, 2041> count{};  // |1 -2 1; -2 4 -2; 1 -2 1| <= 2040
  std::int64_t total = 0;
  for (int y = 1; y + 1 < grey.rows; y += stride) {
    const std::uint8_t *a = grey.ptr(y - 1), *b = grey.ptr(y), *c = grey.ptr(y + 1);
    for (int x = 1; x + 1 < grey.cols; x += stride) {
      const int v = a[x - 1] - 2 * a[x] + a[x + 1] - 2 * (b[x - 1] - 2 * b[x] + b[x + 1]) + c[x - 1] -
                    2 * c[x] + c[x + 1];
      ++count[static_cast<std::size_t>(std::abs(v))];
      ++total;
    }
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
