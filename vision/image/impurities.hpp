// Impurities of the medium: components of the thresholded Sobel picture that do not belong to the cell.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/image/contour.hpp"

namespace punctum::vision {

// binary: CV_8U, 255 where the Sobel magnitude is above the threshold, without the pipettes. A component is
// an impurity when both sides of its box are at most max_side px, it has at least min_area pixels, and it is
// further than `keep` px from all membranes. The pixels of the impurities are set in mask (CV_8U, of the same
// size, all others 0). Returns the number of impurities.
[[nodiscard]] int find_impurities(const cv::Mat& binary, const std::vector<Contour>& membranes,
                                  double max_side, int min_area, double keep, cv::Mat& mask);

}  // namespace punctum::vision
