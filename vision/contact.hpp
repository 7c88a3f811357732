// Contact: cell with holding pipette, and injection pipette, are two classes of the thresholded picture after
// a vertical dilation; contact is when they merge.
#pragma once

#include <opencv2/core.hpp>

#include "vision/contour.hpp"

namespace punctum::vision {

struct Classes {
  int needle = 0;  // label of the component most of the needle's pixels belong to, 0 = none
  int cell = 0;    // likewise of the cell
  bool merged = false;
};

// binary: CV_8U, 255 = strong gradient, pipettes included, impurities taken out. dilation_px: in total,
// vertical. needle_pixels, cell_pixels: CV_8U masks of where each is expected.
[[nodiscard]] Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels,
                                    const cv::Mat& cell_pixels, int dilation_px);

}  // namespace punctum::vision
