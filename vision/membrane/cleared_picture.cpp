#include "vision/membrane/cleared_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/image/impurities.hpp"
#include "vision/image/noise.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr int kSmallest_px = 32;        // side of a picture in which something can be found
constexpr double kLeastContrast = 0.5;  // sd of the grey levels
constexpr double kLeastNoise = 0.3;     // grey levels
constexpr double kSmoothing_px = 1.2;   // sd of the Gaussian before the gradient
constexpr int kImpurityLeast_px = 6;    // pixels; fewer are noise
constexpr double kImpurityKeep_px = 4;  // nearer to a membrane, it belongs to the membrane
constexpr double kFaceReach_px =
    6.5;  // nearer to the face of the holding pipette, an edge is blurred into it

}  // namespace

std::string ClearedPicture::load(const hal::Frame& frame, int width, int height) {
  const auto size = [](int w, int h) { return std::to_string(w) + "x" + std::to_string(h); };
  if (frame.pixels == nullptr || frame.width <= 0 || frame.height <= 0 || frame.stride < frame.width) {
    return "no picture";
  }
  if (frame.width != width || frame.height != height) {
    return "size " + size(frame.width, frame.height) + " instead of " + size(width, height);
  }
  if (width < kSmallest_px || height < kSmallest_px) {
    return "picture too small: at least " + size(kSmallest_px, kSmallest_px) + " is needed";
  }
  // A copy, since the camera may reuse its buffer. OpenCV has no matrix over constant data.
  cv::Mat(height, width, CV_8U, const_cast<std::uint8_t*>(frame.pixels),
          static_cast<std::size_t>(frame.stride))
      .copyTo(grey);
  cv::Scalar mean, sd;
  cv::meanStdDev(grey, mean, sd);
  if (sd[0] < kLeastContrast) {
    return "no contrast: every pixel is about " + std::to_string(std::lround(mean[0]));
  }
  noise = std::max(noise_level(grey), kLeastNoise);
  return {};
}

void ClearedPicture::compute_gradient(const cv::Rect& area) {
  field.compute(grey, area, kSmoothing_px);
  gradient_noise = field.noise_of_gradient(noise);
}

void ClearedPicture::cover(const std::vector<Polygon>& pipettes) {
  covered.create(grey.size(), CV_8U);
  covered.setTo(0);
  draw_mask(covered, pipettes);
}

int ClearedPicture::cover_impurities(const std::vector<Contour>& membranes, double threshold,
                                     double max_side) {
  cv::compare(field.sobel, threshold, strong, cv::CMP_GT);
  int count = 0;
  if (!membranes.empty()) {
    cv::Mat open = strong.clone(), impurities;
    open.setTo(0, covered(field.area));
    std::vector<Contour> local = membranes;
    for (Contour& c : local) {
      for (Point& p : c) {
        p -= Point(field.area.x, field.area.y);
      }
    }
    count = find_impurities(open, local, max_side, kImpurityLeast_px, kImpurityKeep_px, impurities);
    cv::Mat grown;
    cv::dilate(impurities, grown, cv::Mat::ones(3, 3, CV_8U));
    covered(field.area).setTo(255, grown);
    strong.setTo(0, grown);
  }
  edge = field.sobel.clone();
  erase(edge, covered, field.area.tl());
  return count;
}

bool ClearedPicture::hidden(const Point& p) const {
  const int x = static_cast<int>(p.x + 0.5), y = static_cast<int>(p.y + 0.5);
  return x < 0 || y < 0 || x >= covered.cols || y >= covered.rows || covered.at<std::uint8_t>(y, x) > 0;
}

void ClearedPicture::exclude_holder(EdgeBand& band, const std::vector<double>& expected) const {
  if (!holder_face) {
    return;
  }
  const auto& [mouth, axis, half_width] = *holder_face;
  const double face = (mouth - band.centre).dot(axis);  // < 0: behind the centre
  if (face >= -2) {
    return;
  }
  const int n = static_cast<int>(band.middle.size());
  band.hidden.resize(band.middle.size(), 0);
  if (band.upper.empty()) {
    band.upper.assign(band.middle.size(), 1e9);
  }
  for (int i = 0; i < n; ++i) {
    const Point d = on_ray(Point(0, 0), i, n, 1);
    if (d.dot(axis) > -0.2) {  // this ray does not meet the face
      continue;
    }
    const double r = face / d.dot(axis);
    if (std::abs(axis.cross(band.centre + r * d - mouth)) > half_width + 2) {
      continue;
    }
    const std::size_t k = static_cast<std::size_t>(i);
    band.upper[k] = std::min(band.upper[k], r);
    if (expected[k] > r - kFaceReach_px) {
      band.hidden[k] = 1;
    }
  }
}

}  // namespace punctum::vision
