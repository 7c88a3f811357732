#include "vision/pipettes/pipette_mask.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

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

// What of the border lies within half a pixel of the row spans it.
cv::Range touched_in_row(const Polygon& polygon, int y, int columns) {
  double left = columns, right = -1;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
    const double from = std::max(std::min(a.y, b.y), y - 0.5), to = std::min(std::max(a.y, b.y), y + 0.5);
    if (!(from <= to)) {
      continue;
    }
    const bool level = std::abs(b.y - a.y) < 1e-9;
    const double turn = level ? 0 : (b.x - a.x) / (b.y - a.y);
    const double x0 = level ? a.x : a.x + (from - a.y) * turn, x1 = level ? b.x : a.x + (to - a.y) * turn;
    left = std::min({left, x0, x1});
    right = std::max({right, x0, x1});
  }
  const int end = static_cast<int>(std::lround(std::clamp(right, -1.0, columns - 1.0))) + 1;
  return {std::min(static_cast<int>(std::lround(std::clamp(left, 0.0, static_cast<double>(columns)))), end),
          end};
}

void draw_mask(cv::Mat& mask, std::span<const Polygon> polygons) {
  for (const Polygon& p : polygons) {
    double top = mask.rows, bottom = -1;
    for (const Point& q : p) {
      top = std::min(top, q.y);
      bottom = std::max(bottom, q.y);
    }
    const int last = static_cast<int>(std::floor(std::min(bottom + 0.5, mask.rows - 1.0)));
    for (int y = static_cast<int>(std::floor(std::max(top + 0.5, 0.0))); y <= last; ++y) {
      const cv::Range x = touched_in_row(p, y, mask.cols);
      std::fill(mask.ptr(y) + x.start, mask.ptr(y) + x.end, std::uint8_t{255});
    }
  }
}

}  // namespace punctum::vision
