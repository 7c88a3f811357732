#include "vision/impurities.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

std::vector<Impurity> find_impurities(const cv::Mat& binary, const std::vector<Contour>& membranes,
                                      double max_side, int min_area, double keep, cv::Mat& mask) {
  std::vector<Impurity> out;
  mask.create(binary.size(), CV_8U);
  mask.setTo(0);
  if (binary.empty()) {
    return out;
  }
  cv::Mat labels, stats, centres;
  const int n = cv::connectedComponentsWithStats(binary, labels, stats, centres, 8, CV_32S);
  // Components that the membranes' own band touches are not impurities.
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
  std::vector<std::uint8_t> chosen(static_cast<std::size_t>(n), 0);
  for (int i = 1; i < n; ++i) {
    const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                       stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const int area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (!cell[static_cast<std::size_t>(i)] && area >= min_area && box.width <= max_side &&
        box.height <= max_side) {
      chosen[static_cast<std::size_t>(i)] = 255;
      out.push_back({box, area});
    }
  }
  for (int y = 0; y < labels.rows; ++y) {
    const int* l = labels.ptr<int>(y);
    std::uint8_t* m = mask.ptr(y);
    for (int x = 0; x < labels.cols; ++x) {
      m[x] = chosen[static_cast<std::size_t>(l[x])];
    }
  }
  return out;
}

}  // namespace punctum::vision
