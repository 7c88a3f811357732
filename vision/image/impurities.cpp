#include "vision/image/impurities.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

int find_impurities(const cv::Mat& binary, const std::vector<Contour>& membranes, double max_side,
                    int min_area, double keep, cv::Mat& mask) {
  mask.create(binary.size(), CV_8U);
  mask.setTo(0);
  if (binary.empty()) {
    return 0;
  }
  cv::Mat labels, stats, centres;
  const int n = cv::connectedComponentsWithStats(binary, labels, stats, centres, 8, CV_32S);
  // What lies on a membrane belongs to the cell.
  std::vector<bool> cell(static_cast<std::size_t>(n), false);
  const int reach = static_cast<int>(std::ceil(keep));
  for (const Contour& c : membranes) {
    for (const Point& p : c) {
      const int px = static_cast<int>(std::lround(p.x)), py = static_cast<int>(std::lround(p.y));
      for (int y = std::max(0, py - reach); y <= std::min(labels.rows - 1, py + reach); ++y) {
        for (int x = std::max(0, px - reach); x <= std::min(labels.cols - 1, px + reach); ++x) {
          cell[static_cast<std::size_t>(labels.at<int>(y, x))] = true;
        }
      }
    }
  }
  int count = 0;
  std::vector<std::uint8_t> chosen(static_cast<std::size_t>(n), 0);
  for (int i = 1; i < n; ++i) {
    if (!cell[static_cast<std::size_t>(i)] && stats.at<int>(i, cv::CC_STAT_AREA) >= min_area &&
        stats.at<int>(i, cv::CC_STAT_WIDTH) <= max_side && stats.at<int>(i, cv::CC_STAT_HEIGHT) <= max_side) {
      chosen[static_cast<std::size_t>(i)] = 255;
      ++count;
    }
  }
  for (int y = 0; y < labels.rows; ++y) {
    const int* l = labels.ptr<int>(y);
    std::uint8_t* m = mask.ptr(y);
    for (int x = 0; x < labels.cols; ++x) {
      m[x] = chosen[static_cast<std::size_t>(l[x])];
    }
  }
  return count;
}

}  // namespace punctum::vision
