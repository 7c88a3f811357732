#include "vision/image/correlation.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/image/parabola.hpp"

namespace punctum::vision {

namespace {

cv::Mat match(const cv::Mat& window, const cv::Mat& pattern, int method) {
  cv::Mat map;
  if (window.empty() || pattern.empty() || window.cols < pattern.cols || window.rows < pattern.rows) {
    return map;
  }
  cv::matchTemplate(window, pattern, map, method);
  cv::patchNaNs(map, 0);
  return map;
}

}  // namespace

cv::Mat correlation_map(const cv::Mat& window, const cv::Mat& pattern) {
  return match(window, pattern, cv::TM_CCORR_NORMED);
}

cv::Mat centred_correlation_map(const cv::Mat& window, const cv::Mat& pattern) {
  return match(window, pattern, cv::TM_CCOEFF_NORMED);
}

std::optional<Peak> peak(const cv::Mat& map) {
  if (map.empty()) {
    return std::nullopt;
  }
  double top = 0;
  cv::Point p;
  cv::minMaxLoc(map, nullptr, &top, nullptr, &p);
  if (!std::isfinite(top)) {
    return std::nullopt;
  }
  Peak out{Point(p.x, p.y), top};
  if (p.x > 0 && p.y > 0 && p.x + 1 < map.cols && p.y + 1 < map.rows) {
    const auto at = [&](int x, int y) { return static_cast<double>(map.at<float>(y, x)); };
    out.at.x += vertex_offset(at(p.x - 1, p.y), top, at(p.x + 1, p.y));
    out.at.y += vertex_offset(at(p.x, p.y - 1), top, at(p.x, p.y + 1));
  }
  return out;
}

}  // namespace punctum::vision
