#include "vision/image/gradient.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "vision/image/dispatched.hpp"
#include "vision/image/gaussian.hpp"

namespace punctum::vision {

namespace {

// Sobel's mask in two steps, in loops of which a compiler makes several steps at once.
PUNCTUM_WIDE_LOOP void across_rows(const float* above, const float* here, const float* below, int n,
                                   float* sum, float* difference) {
  for (int x = 0; x < n; ++x) {
    sum[x] = 0.125F * (above[x] + 2 * here[x] + below[x]);
    difference[x] = 0.125F * (below[x] - above[x]);
  }
}

PUNCTUM_WIDE_LOOP void along_rows(const float* sum, const float* difference, int n, float* gx, float* gy) {
  for (int x = 0; x < n; ++x) {
    gx[x] = sum[x + 1] - sum[x - 1];
    gy[x] = difference[x - 1] + 2 * difference[x] + difference[x + 1];
  }
}

}  // namespace

void GradientField::compute(const cv::Mat& grey_in, cv::Rect wanted, double sigma_px) {
  picture = grey_in.size();
  area = wanted & cv::Rect(0, 0, grey_in.cols, grey_in.rows);
  sigma = sigma_px;
  if (area.empty()) {
    smooth.release();
    gx.release();
    gy.release();
    sobel.release();
    return;
  }
  for (auto [field, memory] : {std::pair(&smooth, &kept_[0]), std::pair(&gx, &kept_[1]),
                               std::pair(&gy, &kept_[2]), std::pair(&sobel, &kept_[3])}) {
    *field = memory->part(picture, area.size(), CV_32F);
  }
  smooth_part(grey_in, area, sigma, smooth);
  std::vector<float> sum(static_cast<std::size_t>(area.width) + 2), difference(sum);
  for (int y = 0; y < area.height; ++y) {
    const float *above = smooth.ptr<float>(std::max(y - 1, 0)), *here = smooth.ptr<float>(y),
                *below = smooth.ptr<float>(std::min(y + 1, area.height - 1));
    across_rows(above, here, below, area.width, sum.data() + 1, difference.data() + 1);
    for (std::vector<float>* row : {&sum, &difference}) {
      row->front() = (*row)[1];
      row->back() = (*row)[row->size() - 2];
    }
    along_rows(sum.data() + 1, difference.data() + 1, area.width, gx.ptr<float>(y), gy.ptr<float>(y));
  }
  cv::magnitude(gx, gy, sobel);
}

double GradientField::noise_of_gradient(double noise_grey) const {
  // Derivative of a Gaussian against white noise: sigma_n / (sqrt(8 pi) sigma^2), with the 3x3 Sobel's own
  // smoothing (variance 2/3 px^2 along and 1/2 px^2 across, on average 0.6) added to sigma^2.
  return noise_grey / (std::sqrt(8 * std::numbers::pi) * (sigma * sigma + 0.6));
}

}  // namespace punctum::vision
