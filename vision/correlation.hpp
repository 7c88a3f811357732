// Eq. 1: normalised correlation without offset removal, and its sub-pixel peak.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/contour.hpp"

namespace punctum::vision {

// sum M I / sqrt(sum M^2 sum I^2) of template M at every place inside `window` (OpenCV's TM_CCORR_NORMED).
// CV_32F, (window - template + 1); empty if the template does not fit.
[[nodiscard]] cv::Mat correlation_map(const cv::Mat& window, const cv::Mat& pattern);

// The same with both means removed, which tells a pattern from an evenly bright patch.
[[nodiscard]] cv::Mat centred_correlation_map(const cv::Mat& window, const cv::Mat& pattern);

struct Peak {
  Point at;  // of the template's top left corner in the window, sub-pixel by a parabola in each direction
  double score = 0;
  bool inside = false;  // not on the window's rim
};
[[nodiscard]] std::optional<Peak> peak(const cv::Mat& map);

}  // namespace punctum::vision
