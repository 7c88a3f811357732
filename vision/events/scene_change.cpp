#include "vision/events/scene_change.hpp"

#include <opencv2/imgproc.hpp>

namespace punctum::vision {

double similarity(const cv::Mat& before, const cv::Mat& now) {
  const cv::Size small(std::min(32, before.cols), std::min(32, before.rows));
  cv::Mat a, b;
  cv::resize(before, a, small, 0, 0, cv::INTER_AREA);
  cv::resize(now, b, small, 0, 0, cv::INTER_AREA);
  a.convertTo(a, CV_32F);
  b.convertTo(b, CV_32F);
  a -= cv::mean(a);
  b -= cv::mean(b);
  const double both = cv::norm(a) * cv::norm(b);
  return both > 0 ? a.dot(b) / both : 0;
}

}  // namespace punctum::vision
