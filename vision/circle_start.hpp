// Where a round membrane may be: circular Hough transform over centre and radius (three-dimensional
// accumulator).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/gradient.hpp"

namespace punctum::vision {

struct CircleCandidate {
  Circle circle;
  double score = 0;  // share of the circumference that voted
};

// Every pixel whose gradient exceeds `threshold` votes on both sides along its gradient. r_min, r_max in px.
// `blocked` (CV_8U or empty, full picture): pixels > 0 do not vote. At most `wanted` candidates, best first,
// whose centres differ by more than r_min / 3 or radii by more than 15 %.
[[nodiscard]] std::vector<CircleCandidate> find_circles(const GradientField& field, const cv::Mat& blocked,
                                                        double threshold, double r_min, double r_max,
                                                        int wanted);

}  // namespace punctum::vision
