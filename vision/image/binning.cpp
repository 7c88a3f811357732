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

// Of columns that are summed, so many for each pixel; kBy: the same, where the compiler knows it, or 0.
template <int kBy>
void means(const std::uint16_t* sum, int by, int n, std::uint8_t* row) {
  const unsigned each = static_cast<unsigned>(kBy > 0 ? kBy : by), block = each * each;
  for (int x = 0; x < n; ++x, sum += each) {
    unsigned all = block / 2;
    for (unsigned k = 0; k < each; ++k) {
      all += sum[k];
    }
    row[x] = static_cast<std::uint8_t>(all / block);
  }
}

}  // namespace

void Binning::bin(const std::uint8_t* pixels, int stride, cv::Mat& out) const {
  Vector<std::uint16_t> sums(static_cast<std::size_t>(out.cols * by));
  for (int y = 0; y < out.rows; ++y) {
    std::fill(sums.begin(), sums.end(), std::uint16_t{0});
    for (int k = 0; k < by; ++k) {
      add_row(pixels + static_cast<std::ptrdiff_t>(y * by + k) * stride, sums.size(), sums.data());
    }
    (by == 2   ? means<2>
     : by == 3 ? means<3>
     : by == 4 ? means<4>
               : means<0>)(sums.data(), by, out.cols, out.ptr(y));
  }
}

}  // namespace punctum::vision
