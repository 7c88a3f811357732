// How noisy a picture is; every threshold of vision follows it.
#pragma once

#include <opencv2/core.hpp>

namespace punctum::vision {

// Standard deviation of the noise in grey levels (Immerkaer's second-difference mask, median instead of mean,
// so that texture and edges count little). 0 for pictures smaller than 3x3. Every `stride`-th pixel is looked
// at.
[[nodiscard]] double noise_level(const cv::Mat& grey, int stride = 2);

}  // namespace punctum::vision
