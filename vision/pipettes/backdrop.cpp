#include "vision/pipettes/backdrop.hpp"

#include <algorithm>
#include <utility>

#include "vision/image/dispatched.hpp"
#include "vision/pipettes/pipette_mask.hpp"

namespace punctum::vision {

namespace {

constexpr double kBeside_px = 10;   // of the needle's walls: their blur, out of focus
constexpr double kAhead_px = 40;    // of the tip: it may be seen short of where it is
constexpr float kPart = 1.0F / 16;  // of a frame in the mean

constexpr float kUnknown = -1;

PUNCTUM_WIDE_LOOP void learn_row(const float* now, int n, float* mean) {
  for (int x = 0; x < n; ++x) {
    const float before = mean[x] < 0 ? now[x] : mean[x];
    mean[x] = before + kPart * (now[x] - before);
  }
}

}  // namespace

void Backdrop::learn(const GradientField& field, const NeedlePose& needle) {
  const cv::Rect& a = field.area;
  if (a.empty()) {
    return;
  }
  if (mean_.size() != field.picture) {
    mean_ = cv::Mat(field.picture, CV_32F, cv::Scalar(double{kUnknown}));
  }
  Polygon near = needle_polygon(needle, field.picture, kBeside_px, kAhead_px);
  for (Point& p : near) {
    p -= Point(a.x, a.y);
  }
  for (int y = 0; y < a.height; ++y) {
    const auto [from, to] = [&] {
      const cv::Range x = touched_in_row(near, y, a.width);
      return x.empty() ? std::pair(a.width, a.width) : std::pair(x.start, x.end);
    }();
    const float* now = field.smooth.ptr<float>(y);
    float* mean = mean_.ptr<float>(a.y + y) + a.x;
    learn_row(now, from, mean);
    learn_row(now + to, a.width - to, mean + to);
  }
}

std::optional<double> Backdrop::grey(const Point& p) const {
  if (!(p.x >= 0) || !(p.y >= 0) || p.x >= mean_.cols - 1 || p.y >= mean_.rows - 1) {
    return std::nullopt;
  }
  const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
  const float *a = mean_.ptr<float>(y) + x, *b = mean_.ptr<float>(y + 1) + x;
  if (a[0] < 0 || a[1] < 0 || b[0] < 0 || b[1] < 0) {
    return std::nullopt;
  }
  const double u = p.x - x, v = p.y - y;
  return (1 - v) * ((1 - u) * static_cast<double>(a[0]) + u * static_cast<double>(a[1])) +
         v * ((1 - u) * static_cast<double>(b[0]) + u * static_cast<double>(b[1]));
}

}  // namespace punctum::vision
