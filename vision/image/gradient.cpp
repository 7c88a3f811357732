#include "vision/image/gradient.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

void GradientField::compute(const cv::Mat& grey_in, cv::Rect wanted, double sigma_px) {
  picture = grey_in.size();
  area = wanted & cv::Rect(0, 0, grey_in.cols, grey_in.rows);
  sigma = sigma_px;
  if (area.empty()) {
    smooth.release();
    gx.release();
    gy.release();
    sobel.release();
    return;
  }
  cv::Mat part;
  grey_in(area).convertTo(part, CV_32F);
  cv::GaussianBlur(part, smooth, cv::Size(0, 0), sigma, sigma, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, gx, CV_32F, 1, 0, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, gy, CV_32F, 0, 1, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::magnitude(gx, gy, sobel);
}

double GradientField::noise_of_gradient(double noise_grey) const {
  // Derivative of a Gaussian against white noise: sigma_n / (sqrt(8 pi) sigma^2), with the 3x3 Sobel's own
  // smoothing (variance 2/3 px^2 along and 1/2 px^2 across, on average 0.6) added to sigma^2.
  return noise_grey / (std::sqrt(8 * std::numbers::pi) * (sigma * sigma + 0.6));
}

}  // namespace punctum::vision
