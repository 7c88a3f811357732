// Smoothed picture and its gradient, sampled between pixels.
#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "vision/image/contour.hpp"
#include "vision/image/kept_memory.hpp"

namespace punctum::vision {

// Between the four pixels round a place; x and y are not negative.
struct Bilinear {
  int x0, y0;
  double u, v;

  Bilinear(double x, double y) : x0(static_cast<int>(x)), y0(static_cast<int>(y)), u(x - x0), v(y - y0) {}

  [[nodiscard]] double of(const cv::Mat& m) const {
    const float *a = m.ptr<float>(y0) + x0, *b = m.ptr<float>(y0 + 1) + x0;
    return (1 - v) * ((1 - u) * static_cast<double>(a[0]) + u * static_cast<double>(a[1])) +
           v * ((1 - u) * static_cast<double>(b[0]) + u * static_cast<double>(b[1]));
  }
};

struct GradientField {
  cv::Size picture;  // the whole one
  cv::Rect area;     // of the whole picture; the fields below cover it
  double sigma = 0;  // Gaussian, px
  cv::Mat smooth;    // CV_32F grey levels
  cv::Mat gx, gy;    // CV_32F grey levels per px
  cv::Mat sobel;     // CV_32F magnitude of the gradient

  void compute(const cv::Mat& grey, cv::Rect wanted, double sigma_px);

  // Standard deviation of one gradient component when the pixels carry independent noise of noise_grey.
  [[nodiscard]] double noise_of_gradient(double noise_grey) const;

  // Bilinear, picture coordinates; zero outside the area.
  [[nodiscard]] Point gradient(const Point& p) const {
    const double x = p.x - area.x, y = p.y - area.y;
    if (!(x >= 0) || !(y >= 0) || x >= gx.cols - 1 || y >= gx.rows - 1) {
      return {};
    }
    const Bilinear place(x, y);
    return {place.of(gx), place.of(gy)};
  }
  [[nodiscard]] double grey(const Point& p) const {
    const double x = p.x - area.x, y = p.y - area.y;
    if (!(x >= 0) || !(y >= 0) || x >= smooth.cols - 1 || y >= smooth.rows - 1) {
      return 0;
    }
    return Bilinear(x, y).of(smooth);
  }

 private:
  std::array<KeptMemory, 4> kept_;
};

}  // namespace punctum::vision
