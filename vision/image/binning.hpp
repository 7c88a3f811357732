// Pictures whose pixels are the means of so many of another one's, in a row and in a column; and where a
// place in one is in the other.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct Binning {
  int by = 1;

  // stride: bytes from row to row. out: CV_8U, of its size; what is left at the right and below is not seen.
  void bin(const std::uint8_t* pixels, int stride, cv::Mat& out) const;

  [[nodiscard]] Point coarse(const Point& fine) const {
    return {(fine.x + 0.5) / by - 0.5, (fine.y + 0.5) / by - 0.5};
  }
  [[nodiscard]] Point fine(const Point& coarse) const {
    return {(coarse.x + 0.5) * by - 0.5, (coarse.y + 0.5) * by - 0.5};
  }
};

}  // namespace punctum::vision
