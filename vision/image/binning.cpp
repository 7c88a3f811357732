#include "vision/image/binning.hpp"

#include <algorithm>
#include <cstddef>

#include "vision/image/dispatched.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

namespace {

PUNCTUM_WIDE_LOOP void add_row(const std::uint8_t* row, std::size_t n, std::uint16_t* sums) {
  for (std::size_t i = 0; i < n; ++i) {
    sums[i] = static_cast<std::uint16_t>(sums[i] + row[i]);
  }
}

}  // namespace

void Binning::bin(const std::uint8_t* pixels, int stride, cv::Mat& out) const {
  const int block = by * by;
  Vector<std::uint16_t> sums(static_cast<std::size_t>(out.cols * by));
  for (int y = 0; y < out.rows; ++y) {
    std::fill(sums.begin(), sums.end(), std::uint16_t{0});
    for (int k = 0; k < by; ++k) {
      add_row(pixels + static_cast<std::ptrdiff_t>(y * by + k) * stride, sums.size(), sums.data());
    }
    const std::uint16_t* sum = sums.data();
    std::uint8_t* row = out.ptr(y);
    for (int x = 0; x < out.cols; ++x, sum += by) {
      int all = block / 2;
      for (int k = 0; k < by; ++k) {
        all += sum[k];
      }
      row[x] = static_cast<std::uint8_t>(all / block);
    }
  }
}

}  // namespace punctum::vision
