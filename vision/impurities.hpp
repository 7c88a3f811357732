// Impurities of the medium: what is left of the thresholded Sobel picture, labelled, after the cell is taken
// out.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/contour.hpp"

namespace punctum::vision {

struct Impurity {
  cv::Rect box;
  int area = 0;
};

// binary: CV_8U, 255 where the Sobel magnitude is above the threshold (pipettes already erased). A component
// is an impurity when its box is smaller than max_side, it has at least min_area pixels, and it stays `keep`
// px away from all membranes. Its pixels are set in mask (CV_8U, same size, zeroed first).
[[nodiscard]] std::vector<Impurity> find_impurities(const cv::Mat& binary,
                                                    const std::vector<Contour>& membranes, double max_side,
                                                    int min_area, double keep, cv::Mat& mask);

}  // namespace punctum::vision
