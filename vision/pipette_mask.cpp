#include "vision/pipette_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

Polygon needle_polygon(const NeedleFix& needle, cv::Size picture, double margin, double ahead) {
  const double back = std::hypot(picture.width, picture.height);
  const double w0 = needle.half_width + margin;
  const double w1 = std::min(needle.half_width_at(back), 6 * needle.half_width + 12) + margin;
  // The taper ends where the shaft has its full width.
  const double knee = needle.taper > 1e-3 ? (w1 - w0) / needle.taper : back;
  return {needle.at(-ahead, -w0), needle.at(-ahead, w0), needle.at(std::min(knee, back), w1),
          needle.at(back, w1),    needle.at(back, -w1),  needle.at(std::min(knee, back), -w1)};
}

Polygon holder_polygon(const TubeTrace& tube, const Point& mouth, cv::Size picture, double margin,
                       double ahead) {
  const double back = std::hypot(picture.width, picture.height);
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

void erase(cv::Mat& edge, const cv::Mat& mask, cv::Point offset) {
  const cv::Rect part = cv::Rect(offset, edge.size()) & cv::Rect(0, 0, mask.cols, mask.rows);
  if (part.size() == edge.size()) {
    edge.setTo(cv::Scalar(0), mask(part));
  }
}

ContactPoints contact_points(const GradientField& field, const NeedleFix& needle, Polarity polarity,
                             double floor, double outside, double past,
                             std::array<std::optional<double>, 2> near, double around) {
  ContactPoints out;
  constexpr double kStep = 0.5;
  for (int side = 0; side < 2; ++side) {
    const std::size_t k = static_cast<std::size_t>(side);
    const double sign = side == 0 ? -1 : 1;
    const double s_far = near[k] ? *near[k] + around : 400, s_near = near[k] ? *near[k] - around : -past;
    std::vector<double> g;
    std::vector<double> at;
    for (double s = s_far; s >= s_near; s -= kStep) {
      const Point p = needle.at(s, sign * (needle.half_width_at(s) + outside));
      if (!field.area.contains(cv::Point(static_cast<int>(p.x), static_cast<int>(p.y)))) {
        continue;
      }
      // Change of grey per px going inwards: a membrane brighter outside gives a fall.
      double e = field.gradient(p).dot(needle.axis);
      e = polarity == Polarity::any ? std::abs(e) : polarity == Polarity::brighter_out ? -e : e;
      g.push_back(e);
      at.push_back(s);
    }
    int best = -1;
    for (std::size_t i = 1; i + 1 < g.size(); ++i) {
      if (g[i] > floor && g[i] >= g[i - 1] && g[i] >= g[i + 1]) {
        if (near[k]) {  // the strongest nearby
          const double better = g[i] - 0.05 * floor * std::abs(at[i] - *near[k]);
          if (best < 0 ||
              better > g[static_cast<std::size_t>(best)] -
                           0.05 * floor * std::abs(at[static_cast<std::size_t>(best)] - *near[k])) {
            best = static_cast<int>(i);
          }
        } else {  // the first
          best = static_cast<int>(i);
          break;
        }
      }
    }
    if (best < 0) {
      continue;
    }
    const std::size_t b = static_cast<std::size_t>(best);
    const double den = g[b - 1] - 2 * g[b] + g[b + 1];
    const double offset = den < -1e-12 ? std::clamp(0.5 * (g[b - 1] - g[b + 1]) / den, -0.5, 0.5) : 0;
    out.behind_tip[k] = at[b] - offset * kStep;
    out.point[k] = needle.at(out.behind_tip[k], sign * needle.half_width_at(out.behind_tip[k]));
  }
  return out;
}

}  // namespace punctum::vision
