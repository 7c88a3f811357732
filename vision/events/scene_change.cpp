#include "vision/events/scene_change.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "vision/image/noise.hpp"

namespace punctum::vision {

namespace {

// What is left of a picture that is shrunk to `size`, about its mean.
struct Small {
  cv::Mat relief;
  bool even = false;  // it shows noise and nothing else

  Small(const cv::Mat& grey, const cv::Size& size) {
    cv::resize(grey, relief, size, 0, 0, cv::INTER_AREA);
    relief.convertTo(relief, CV_32F);
    relief -= cv::mean(relief);
    constexpr double kRounding = 0.3;  // sd of a whole number of grey levels
    const double averaged = static_cast<double>(grey.total()) / size.area();
    const double noise = noise_level(grey), least = 4 * (noise * noise / averaged + kRounding * kRounding);
    constexpr double kNoNoise = 0.1;  // noise_level tells as much of a picture without any
    even = noise > kNoNoise && relief.dot(relief) <= least * size.area();
    // A lamp that flickers while the camera reads row after row gives each of them another light.
    for (int y = 0; y < relief.rows; ++y) {
      relief.row(y) -= cv::mean(relief.row(y));
    }
  }
};

}  // namespace

double similarity(const cv::Mat& before, const cv::Mat& now) {
  const cv::Size size(std::min(32, before.cols), std::min(32, before.rows));
  const Small a(before, size), b(now, size);
  if (a.even && b.even) {
    return 1;
  }
  const double both = cv::norm(a.relief) * cv::norm(b.relief);
  return both > 0 ? a.relief.dot(b.relief) / both : 0;
}

}  // namespace punctum::vision
