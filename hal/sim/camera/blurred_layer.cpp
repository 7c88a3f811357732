#include "hal/sim/camera/blurred_layer.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::sim {

void BlurredLayer::blur(double sigma_px) {
  const int reach = std::max(1, static_cast<int>(std::ceil(kBlurReach * sigma_px)));
  kernel_.resize(static_cast<std::size_t>(reach) + 1);
  double total = 0;
  for (int i = -reach; i <= reach; ++i) {
    total += std::exp(-0.5 * i * i / (sigma_px * sigma_px));
  }
  for (int i = 0; i <= reach; ++i) {
    kernel_[static_cast<std::size_t>(i)] =
        static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px)) / total);
  }
  const int w = box.width();
  const int h = box.height();
  const std::size_t uw = static_cast<std::size_t>(w);
  // Down the columns, into columns_ as a whole picture with the rows' ends padded by their last value.
  const std::size_t padded = uw + 2 * static_cast<std::size_t>(reach);
  columns_.resize(padded * static_cast<std::size_t>(h));
  for (int y = 0; y < h; ++y) {
    float* const to = &columns_[static_cast<std::size_t>(y) * padded];
    float* const mid = to + reach;
    const float* const c = row(y);
    const float k0 = kernel_[0];
    for (int x = 0; x < w; ++x) {
      mid[x] = k0 * c[x];
    }
    for (int i = 1; i <= reach; ++i) {
      const float k = kernel_[static_cast<std::size_t>(i)];
      const float* const up = row(std::max(y - i, 0));
      const float* const down = row(std::min(y + i, h - 1));
      for (int x = 0; x < w; ++x) {
        mid[x] += k * (up[x] + down[x]);
      }
    }
    std::fill(to, mid, mid[0]);
    std::fill(mid + w, mid + w + reach, mid[w - 1]);
  }
  for (int y = 0; y < h; ++y) {
    float* const to = row(y);
    const float* const mid = &columns_[static_cast<std::size_t>(y) * padded] + reach;
    const float k0 = kernel_[0];
    for (int x = 0; x < w; ++x) {
      to[x] = k0 * mid[x];
    }
    for (int i = 1; i <= reach; ++i) {
      const float k = kernel_[static_cast<std::size_t>(i)];
      for (int x = 0; x < w; ++x) {
        to[x] += k * (mid[x - i] + mid[x + i]);
      }
    }
  }
}

}  // namespace punctum::sim
