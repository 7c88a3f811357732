// Noise of a picture; every threshold of vision is a multiple of it.
#pragma once

#include <opencv2/core.hpp>

namespace punctum::vision {

// Standard deviation of the noise in grey levels, by Immerkaer's second-difference mask. The median instead
// of the mean, so that texture and edges count little. Every `stride`-th pixel is used. 0 for pictures
// smaller than 3x3.
[[nodiscard]] double noise_level(const cv::Mat& grey, int stride = 4);

}  // namespace punctum::vision
