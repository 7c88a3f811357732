// Contact. In the paper the injection pipette, and the cell with the holding pipette, are two classes of the
// thresholded picture after a vertical dilation; contact is when the two classes merge. The tracker decides
// by the gap.
#pragma once

#include <limits>
#include <opencv2/core.hpp>

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

// The tracker's test: whether needle and cell touch, from the gap between the tip and the undeformed membrane
// in every frame and its standard deviation. Of the two states, apart and touching, the likelier one given
// all gaps so far (the forward filter of a hidden Markov chain).
class ContactTest {
 public:
  // gap_px > 0 outside; any number, and sd_px is at least 0. speed_px: by which it became less in the last
  // frames. True while touching is likelier.
  bool update(double gap_px, double sd_px, double speed_px);

 private:
  double log_odds_ = -2.9;  // of touching, after many frames apart
  double last_gap_px_ = std::numeric_limits<double>::infinity();
};

}  // namespace punctum::vision
