// Contact. The injection pipette, and the cell with the holding pipette, are two classes of the thresholded
// picture after a vertical dilation; contact is when the two classes merge.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

struct Classes {
  int needle = 0;  // label of the component to which most of the needle's pixels belong; 0 = none
  int cell = 0;    // likewise of the cell
  bool merged = false;
};

// binary: CV_8U, 255 = strong gradient, with the pipettes, without the impurities. needle_pixels,
// cell_pixels: CV_8U, > 0 where each is expected. rows: height of the structuring element; 1 or less changes
// nothing.
[[nodiscard]] Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels,
                                    const cv::Mat& cell_pixels, int rows);
[[nodiscard]] bool needle_merges_with_cell(const ClearedPicture& picture, const NeedlePose& needle,
                                           const Contour& outer, int rows);

// Where the gap is known it decides, with hysteresis, and the merged classes confirm it; otherwise the merged
// classes decide alone.
[[nodiscard]] bool merging_decides(const std::optional<double>& gap_px);
[[nodiscard]] bool touches(const std::optional<double>& gap_px, bool merged, bool touched_before);

}  // namespace punctum::vision
