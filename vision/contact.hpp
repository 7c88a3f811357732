// Contact: cell with holding pipette, and injection pipette, are two classes of the thresholded picture after
// a vertical dilation; contact is when they merge.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/cleared_picture.hpp"

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
[[nodiscard]] bool needle_merges_with_cell(const ClearedPicture& picture, const NeedleFix& needle,
                                           const Contour& outer, int dilation_px);

// The gap, where known, decides, with hysteresis; the merging confirms it, or decides alone.
[[nodiscard]] bool touches(const std::optional<double>& gap_px, bool merged, bool touched_before);

// Where the membrane meets the needle's edges. level: usual edge along the membrane, grey levels per px.
struct MembraneOnNeedle {
  ContactPoints points;
  std::optional<double> behind_tip;  // px, mean of both sides, by the contour where no point is seen
};
[[nodiscard]] MembraneOnNeedle membrane_on_needle(const ClearedPicture& picture, const NeedleFix& needle,
                                                  const Contour& outer, Polarity polarity, double level);

// While the needle pushes, the membrane's outer face lies on its end face and blurs into the walls' ends;
// across the lumen's mouth it is seen by itself, and tells how far ahead of needle.tip the end face is. 0: it
// does not.
[[nodiscard]] double membrane_ahead_of_tip(const GradientField& field, const NeedleFix& needle,
                                           Polarity polarity, double level);

}  // namespace punctum::vision
