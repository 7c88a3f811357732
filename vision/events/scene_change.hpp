// Whether two pictures show the same scene. Recorded stills of different cells are not one sequence.
#pragma once

#include <opencv2/core.hpp>

namespace punctum::vision {

// Correlation, -1 .. 1, of two 8-bit grey pictures of the same size, both shrunk to about 32 px. 0 when one
// of them is evenly bright, 1 when neither varies by more than its noise.
[[nodiscard]] double similarity(const cv::Mat& before, const cv::Mat& now);

// From frame to frame of one sequence the similarity stays above 0.9; two stills of different cells stay
// below this.
inline constexpr double kSameScene = 0.7;

}  // namespace punctum::vision
