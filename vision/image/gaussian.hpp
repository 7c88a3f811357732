// Pictures smoothed by a narrow Gaussian.
#pragma once

#include <opencv2/core.hpp>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// Grey levels of a part of a picture (CV_8U), CV_32F. sigma_px: at most 1.3, for the kernel has nine weights.
// The picture goes on beyond its border as it ends there.
// rows: memory that may be kept for the next picture.
struct SmoothingRows {
  Vector<float> wide, across;
};
void smooth_part(const cv::Mat& grey, const cv::Rect& part, double sigma_px, SmoothingRows& rows,
                 cv::Mat& out);

}  // namespace punctum::vision
