#include "vision/pipettes/backdrop.hpp"

#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "vision/pipettes/pipette_mask.hpp"

namespace punctum::vision {

namespace {

constexpr double kBeside_px = 10;   // of the needle's walls: their blur, out of focus
constexpr double kAhead_px = 40;    // of the tip: it may be seen short of where it is
constexpr float kPart = 1.0F / 16;  // of a frame in the mean

void learn_row(const float* now, const std::uint8_t* hidden, const std::uint8_t* known, int n, float* mean) {
  for (int x = 0; x < n; ++x) {
    const float before = mean[x], here = now[x];
    const float mean_so_far = known[x] > 0 ? before : here;
    const float learnt = mean_so_far * (1 - kPart) + here * kPart;
    mean[x] = hidden[x] > 0 ? before : learnt;
  }
}

void join_seen(const std::uint8_t* hidden, int n, std::uint8_t* known) {
  for (int x = 0; x < n; ++x) {
    known[x] |= hidden[x] > 0 ? 0 : 255;
  }
}

}  // namespace

void Backdrop::learn(const GradientField& field, const NeedlePose& needle) {
  if (field.area.empty()) {
    return;
  }
  if (mean_.size() != field.picture) {
    mean_ = cv::Mat::zeros(field.picture, CV_32F);
    known_ = cv::Mat::zeros(field.picture, CV_8U);
  }
  hidden_.create(field.picture, CV_8U);
  hidden_.setTo(0);
  draw_mask(hidden_, {needle_polygon(needle, field.picture, kBeside_px, kAhead_px)});
  const cv::Rect& a = field.area;
  for (int y = 0; y < a.height; ++y) {
    const std::uint8_t* hidden = hidden_.ptr(a.y + y) + a.x;
    std::uint8_t* known = known_.ptr(a.y + y) + a.x;
    learn_row(field.smooth.ptr<float>(y), hidden, known, a.width, mean_.ptr<float>(a.y + y) + a.x);
    join_seen(hidden, a.width, known);
  }
}

std::optional<double> Backdrop::grey(const Point& p) const {
  if (!(p.x >= 0) || !(p.y >= 0) || p.x >= mean_.cols - 1 || p.y >= mean_.rows - 1) {
    return std::nullopt;
  }
  const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
  const std::uint8_t *k0 = known_.ptr(y) + x, *k1 = known_.ptr(y + 1) + x;
  if ((k0[0] & k0[1] & k1[0] & k1[1]) == 0) {
    return std::nullopt;
  }
  const float *a = mean_.ptr<float>(y) + x, *b = mean_.ptr<float>(y + 1) + x;
  const double u = p.x - x, v = p.y - y;
  return (1 - v) * ((1 - u) * static_cast<double>(a[0]) + u * static_cast<double>(a[1])) +
         v * ((1 - u) * static_cast<double>(b[0]) + u * static_cast<double>(b[1]));
}

}  // namespace punctum::vision
