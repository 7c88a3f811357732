// Smoothed picture and its gradient, sampled between pixels.
#pragma once

#include <opencv2/core.hpp>

#include "vision/image/contour.hpp"

namespace punctum::vision {

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
  [[nodiscard]] Point gradient(const Point& p) const;
  [[nodiscard]] double grey(const Point& p) const;
};

}  // namespace punctum::vision
