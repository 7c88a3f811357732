#include "vision/pipettes/pipette_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

Polygon needle_polygon(const NeedlePose& needle, cv::Size picture, double margin, double ahead) {
  const double back = math::hypot(picture.width, picture.height);
  const double w0 = needle.half_width + margin;
  const double w1 = std::min(needle.half_width_at(back), 6 * needle.half_width + 12) + margin;
  // The taper ends where the shaft has its full width.
  const double knee = needle.taper > 1e-3 ? (w1 - w0) / needle.taper : back;
  return {needle.at(-ahead, -w0), needle.at(-ahead, w0), needle.at(std::min(knee, back), w1),
          needle.at(back, w1),    needle.at(back, -w1),  needle.at(std::min(knee, back), -w1)};
}

Polygon holder_polygon(const TubeTrace& tube, const Point& mouth, cv::Size picture, double margin,
                       double ahead) {
  const double back = math::hypot(picture.width, picture.height);
  const Point across(-tube.axis.y, tube.axis.x);
  const double w = std::max(tube.half_width, tube.end_half_width) + margin;
  const Point front = mouth + ahead * tube.axis, rear = mouth - back * tube.axis;
  return {front - w * across, front + w * across, rear + w * across, rear - w * across};
}

void draw_mask(cv::Mat& mask, const std::vector<Polygon>& polygons) {
  constexpr int kShift = 4;
  for (const Polygon& p : polygons) {
    std::vector<cv::Point> fixed;
    for (const Point& q : p) {
      fixed.emplace_back(static_cast<int>(std::lround(std::clamp(q.x, -3e4, 3e4) * (1 << kShift))),
                         static_cast<int>(std::lround(std::clamp(q.y, -3e4, 3e4) * (1 << kShift))));
    }
    if (fixed.size() >= 3) {
      cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{fixed}, cv::Scalar(255), cv::LINE_8, kShift);
    }
  }
}

}  // namespace punctum::vision
