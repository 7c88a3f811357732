#include "vision/contact.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace punctum::vision {

Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels, const cv::Mat& cell_pixels,
                      int dilation_px) {
  Classes out;
  if (binary.empty() || needle_pixels.size() != binary.size() || cell_pixels.size() != binary.size()) {
    return out;
  }
  cv::Mat grown, labels;
  if (dilation_px > 0) {
    const cv::Mat column = cv::Mat::ones(dilation_px + 1, 1, CV_8U);
    cv::dilate(binary, grown, column, cv::Point(0, dilation_px / 2), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  } else {
    grown = binary;
  }
  const int n = cv::connectedComponents(grown, labels, 8, CV_32S);
  std::vector<int> needle(static_cast<std::size_t>(n), 0), cell(static_cast<std::size_t>(n), 0);
  for (int y = 0; y < labels.rows; ++y) {
    const int* l = labels.ptr<int>(y);
    const std::uint8_t *a = needle_pixels.ptr(y), *b = cell_pixels.ptr(y);
    for (int x = 0; x < labels.cols; ++x) {
      needle[static_cast<std::size_t>(l[x])] += a[x] > 0;
      cell[static_cast<std::size_t>(l[x])] += b[x] > 0;
    }
  }
  const auto largest = [](const std::vector<int>& count) {
    int best = 0;
    for (std::size_t i = 1; i < count.size(); ++i) {
      if (count[i] > 0 && (best == 0 || count[i] > count[static_cast<std::size_t>(best)])) {
        best = static_cast<int>(i);
      }
    }
    return best;
  };
  out.needle = largest(needle);
  out.cell = largest(cell);
  out.merged = out.needle > 0 && out.needle == out.cell;
  return out;
}

}  // namespace punctum::vision
