// Whether two pictures show the same scene: recorded stills of different cells are not one sequence.
#pragma once

#include <opencv2/core.hpp>

namespace punctum::vision {

// Correlation, -1 .. 1, of the two pictures shrunk to about 32 px; 8-bit grey, the same size. 0 when one is
// even.
[[nodiscard]] double likeness(const cv::Mat& before, const cv::Mat& now);

// Below it a picture shows another scene. From frame to frame of one sequence it stays above 0.9.
inline constexpr double kSameScene = 0.7;

}  // namespace punctum::vision
