// Eq. 1: normalised correlation without removal of the means, and its peak.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/contour.hpp"

namespace punctum::vision {

// sum M I / sqrt(sum M^2 sum I^2) of the template M at every place inside `window` (OpenCV's
// TM_CCORR_NORMED), both CV_8U. CV_32F, of the size window - template + 1; empty if the template does not
// fit.
[[nodiscard]] cv::Mat correlation_map(const cv::Mat& window, const cv::Mat& pattern);

// The same with both means removed: it tells a pattern from an evenly bright patch.
[[nodiscard]] cv::Mat centred_correlation_map(const cv::Mat& window, const cv::Mat& pattern);

struct Peak {
  Point at;  // of the template's top left corner in the window; sub-pixel, but on the window's rim
  double score = 0;
};
[[nodiscard]] std::optional<Peak> peak(const cv::Mat& map);

}  // namespace punctum::vision
