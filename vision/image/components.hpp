// Components of a binary picture: pixels > 0 that touch each other, also at their corners.
#pragma once

#include <opencv2/core.hpp>
#include <span>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// Pixels > 0 beside each other, from..to - 1 of the row y.
struct PixelRun {
  int y = 0, from = 0, to = 0;
  std::size_t component = 0;
};

struct Components {
  Vector<PixelRun> runs;    // row by row, from left to right
  Vector<std::size_t> row;  // first run of each row; one more for the end
  Vector<cv::Rect> box;     // of each component
  Vector<int> pixels;       // likewise

  [[nodiscard]] std::span<const PixelRun> in_row(int y) const {
    const std::size_t k = static_cast<std::size_t>(y);
    return std::span(runs).subspan(row[k], row[k + 1] - row[k]);
  }
};

[[nodiscard]] Components components_of(const cv::Mat& binary);  // CV_8U

}  // namespace punctum::vision
