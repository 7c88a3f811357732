// Smoothed picture and its gradient, sampled between pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <opencv2/core.hpp>

#include "vision/image/contour.hpp"
#include "vision/image/gaussian.hpp"
#include "vision/image/kept_memory.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

using FourFloats = float __attribute__((vector_size(16)));

// Between the four pixels round a place; x and y are not negative.
struct Bilinear {
  int x0, y0;
  float u, v;

  Bilinear(double x, double y)
      : x0(static_cast<int>(x)),
        y0(static_cast<int>(y)),
        u(static_cast<float>(x - x0)),
        v(static_cast<float>(y - y0)) {}

  [[nodiscard]] float of(const cv::Mat& m) const {  // CV_32F
    const float *a = m.ptr<float>(y0) + x0, *b = m.ptr<float>(y0 + 1) + x0;
    const float left = a[0] + v * (b[0] - a[0]), right = a[1] + v * (b[1] - a[1]);
    return left + u * (right - left);
  }
};

// Of pairs, the first and the second component; `first` is the first one of the upper two pixels.
inline std::array<float, 2> between_pairs(const float* first, std::ptrdiff_t stride, float u, float v) {
  FourFloats top, bottom;
  std::memcpy(&top, first, sizeof top);
  std::memcpy(&bottom, first + stride, sizeof bottom);
  const FourFloats both = top + v * (bottom - top);
  return {both[0] + u * (both[2] - both[0]), both[1] + u * (both[3] - both[1])};
}

struct GradientField {
  cv::Size picture;  // the whole one
  cv::Rect area;     // of the whole picture; the fields below cover it
  double sigma = 0;  // Gaussian, px
  cv::Mat smooth;    // CV_32F grey levels
  cv::Mat slope;     // CV_32FC2 gradient, grey levels per px

  void compute(const cv::Mat& grey, cv::Rect wanted, double sigma_px);

  [[nodiscard]] cv::Mat magnitude(const cv::Range& rows) const;  // CV_32F, of the gradient

  // Standard deviation of one gradient component when the pixels carry independent noise of noise_grey.
  [[nodiscard]] double noise_of_gradient(double noise_grey) const;

  // Bilinear, picture coordinates; zero outside the area.
  [[nodiscard]] Point gradient(const Point& p) const {
    const double x = p.x - area.x, y = p.y - area.y;
    if (!(x >= 0) || !(y >= 0) || x >= area.width - 1 || y >= area.height - 1) {
      return {};
    }
    const Bilinear at(x, y);
    const auto [gx, gy] =
        between_pairs(slope.ptr<float>(at.y0) + 2 * at.x0,
                      static_cast<std::ptrdiff_t>(slope.step[0] / sizeof(float)), at.u, at.v);
    return {static_cast<double>(gx), static_cast<double>(gy)};
  }
  // At equally spaced places, picture coordinates, several at once: `out` has room for a multiple of four.
  // All of them are in the area, as contains() says.
  static constexpr int kAtOnce = 4;
  void gradients(const Point& from, const Point& step, int count, float* gx, float* gy) const;
  void greys(const Point& from, const Point& step, int count, float* out) const;
  // Whether that is so: the first and the last of the places that are looked at.
  [[nodiscard]] bool contains(const Point& from, const Point& step, int count) const {
    const Point last = from + (count + kAtOnce) * step;
    return within(from) && within(last);
  }
  [[nodiscard]] bool shows(const Point& p) const {
    const double x = p.x - area.x, y = p.y - area.y;
    return x >= 0 && y >= 0 && x < area.width - 1 && y < area.height - 1;
  }
  [[nodiscard]] double grey(const Point& p) const {
    return shows(p) ? static_cast<double>(Bilinear(p.x - area.x, p.y - area.y).of(smooth)) : 0;
  }

 private:
  [[nodiscard]] bool within(const Point& p) const {  // a pixel from the border, for the rounding of floats
    return p.x >= area.x + 1 && p.y >= area.y + 1 && p.x <= area.x + area.width - 3 &&
           p.y <= area.y + area.height - 3;
  }
  std::array<KeptMemory, 2> kept_;
  Vector<float> sum_, difference_;
  SmoothingRows rows_;
};

}  // namespace punctum::vision
