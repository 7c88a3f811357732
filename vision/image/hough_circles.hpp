// Circular Hough transform over centre and radius: where a round membrane may be.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/image/circle.hpp"
#include "vision/image/gradient.hpp"

namespace punctum::vision {

struct CircleCandidate {
  Circle circle;
  double score = 0;  // share of the circumference that voted
};

// Every pixel whose gradient exceeds `threshold` votes along its gradient, on both sides. r_min, r_max in px.
// `blocked` (CV_8U, the whole picture; or empty): pixels > 0 do not vote. At most `wanted` candidates, the
// best first, whose centres differ by more than r_min / 3 or whose radii differ by more than 15 %.
[[nodiscard]] std::vector<CircleCandidate> find_circles(const GradientField& field, const cv::Mat& blocked,
                                                        double threshold, double r_min, double r_max,
                                                        int wanted);

}  // namespace punctum::vision
