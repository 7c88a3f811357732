// Where a pattern lies, to hundredths of a pixel: least squares of the grey levels, with gain and offset
// free. The vertex of a correlation is drawn aside by light that changes across the picture.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/gradient.hpp"

namespace punctum::vision {

class Registration {
 public:
  Registration() = default;
  Registration(const cv::Mat& pattern, double noise);  // CV_8U; grey levels

  struct Place {
    Point corner;   // top left one of the pattern
    double sd = 0;  // px, in the direction in which the pattern tells least
  };
  // In a CV_8U picture, near `corner`. Empty where it is not within 2.5 px of it, or reaches over the border.
  [[nodiscard]] std::optional<Place> place(const cv::Mat& grey, const Point& corner);

  // Centred correlation of the smoothed grey levels with the corner there, which must be in the picture; -1
  // .. 1.
  [[nodiscard]] double similarity(const cv::Mat& grey, const cv::Point& corner);

 private:
  GradientField pattern_;
  double mean_ = 0, power_ = 0;      // of its smoothed grey levels
  double xx_ = 0, xy_ = 0, yy_ = 0;  // sums of products of its gradient
  double least_ = 0;  // of the sum over squared gradients in one direction, without the noise's share
  KeptMemory kept_, kept_shifted_;  // of place()
  SmoothingRows rows_;
};

}  // namespace punctum::vision
