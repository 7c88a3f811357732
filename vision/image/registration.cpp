#include "vision/image/registration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/gaussian.hpp"

namespace punctum::vision {

namespace {

constexpr double kSigma_px = 1.2;
constexpr int kMargin = 2;            // px of the pattern that its border falsifies
constexpr double kFurthest_px = 2.5;  // the vertex of eq. 1 errs by less

}  // namespace

Registration::Registration(const cv::Mat& pattern, double noise) {
  pattern_.compute(pattern, cv::Rect(0, 0, pattern.cols, pattern.rows), kSigma_px);
  double n = 0, sum = 0, squares = 0;
  for (int y = kMargin; y < pattern.rows - kMargin; ++y) {
    for (int x = kMargin; x < pattern.cols - kMargin; ++x) {
      const double v = static_cast<double>(pattern_.smooth.at<float>(y, x)),
                   gx = static_cast<double>(pattern_.gx.at<float>(y, x)),
                   gy = static_cast<double>(pattern_.gy.at<float>(y, x));
      ++n;
      sum += v;
      squares += v * v;
      xx_ += gx * gx;
      xy_ += gx * gy;
      yy_ += gy * gy;
    }
  }
  mean_ = n > 0 ? sum / n : 0;
  const double of_noise = pattern_.noise_of_gradient(noise);
  least_ = 0.5 * (xx_ + yy_ - math::hypot(xx_ - yy_, 2 * xy_)) - n * of_noise * of_noise;
  power_ = n > 0 ? squares - n * mean_ * mean_ : 0;
}

double Registration::similarity(const cv::Mat& grey, const cv::Point& corner) const {
  const cv::Rect box(corner, pattern_.smooth.size());
  if (!(power_ > 0) || (box & cv::Rect(0, 0, grey.cols, grey.rows)) != box) {
    return 0;
  }
  cv::Mat smooth;
  smooth_part(grey, box, kSigma_px, smooth);
  double n = 0, v1 = 0, p1 = 0, vv = 0, vp = 0, pp = 0;
  for (int y = 0; y < box.height; ++y) {
    const float *seen = smooth.ptr<float>(y), *pattern = pattern_.smooth.ptr<float>(y);
    for (int x = 0; x < box.width; ++x) {
      const double v = static_cast<double>(seen[x]) - mean_, p = static_cast<double>(pattern[x]) - mean_;
      v1 += v;
      p1 += p;
      vv += v * v;
      vp += v * p;
      pp += p * p;
    }
    n += box.width;
  }
  const double power = (vv - v1 * v1 / n) * (pp - p1 * p1 / n);
  return power > 0 ? (vp - v1 * p1 / n) / std::sqrt(power) : 0;
}

std::optional<Registration::Place> Registration::place(const cv::Mat& grey, const Point& corner) const {
  const double determinant = xx_ * yy_ - xy_ * xy_;
  const int w = pattern_.smooth.cols, h = pattern_.smooth.rows, around = static_cast<int>(kFurthest_px) + 2;
  const cv::Rect part(static_cast<int>(std::floor(corner.x)) - around,
                      static_cast<int>(std::floor(corner.y)) - around, w + 2 * around + 1,
                      h + 2 * around + 1);
  const cv::Rect seen = part & cv::Rect(0, 0, grey.cols, grey.rows);
  if (seen.empty() || !(power_ > 0) || !(determinant > 1e-6 * xx_ * yy_)) {
    return std::nullopt;
  }
  cv::Mat smooth;
  smooth_part(grey, seen, kSigma_px, smooth);
  const Point from = corner - Point(seen.x, seen.y);
  Point at = from;
  cv::Mat shifted(h, w, CV_32F);
  for (int round = 0; round < 12; ++round) {
    if (cv::norm(at - from) > kFurthest_px || at.x < -kMargin || at.y < -kMargin ||
        at.x + w - kMargin >= smooth.cols || at.y + h - kMargin >= smooth.rows) {
      return std::nullopt;
    }
    double sum = 0, dot = 0, n = 0;
    const int x0 = static_cast<int>(std::floor(at.x)), y0 = static_cast<int>(std::floor(at.y));
    const double u = at.x - x0, t = at.y - y0;  // the same for every pixel
    for (int y = kMargin; y < h - kMargin; ++y) {
      const float *a = smooth.ptr<float>(y0 + y) + x0, *b = smooth.ptr<float>(y0 + y + 1) + x0,
                  *pattern = pattern_.smooth.ptr<float>(y);
      float* out = shifted.ptr<float>(y);
      for (int x = kMargin; x < w - kMargin; ++x) {
        const double v = (1 - t) * ((1 - u) * static_cast<double>(a[x]) + u * static_cast<double>(a[x + 1])) +
                         t * ((1 - u) * static_cast<double>(b[x]) + u * static_cast<double>(b[x + 1]));
        out[x] = static_cast<float>(v);
        sum += v;
        dot += v * (static_cast<double>(pattern[x]) - mean_);
        ++n;
      }
    }
    const double gain = dot / power_, mean = sum / n;
    if (!(gain > 0.2)) {
      return std::nullopt;
    }
    double bx = 0, by = 0, ee = 0;
    for (int y = kMargin; y < h - kMargin; ++y) {
      for (int x = kMargin; x < w - kMargin; ++x) {
        const double e = (static_cast<double>(shifted.at<float>(y, x)) - mean) / gain -
                         (static_cast<double>(pattern_.smooth.at<float>(y, x)) - mean_);
        ee += e * e;
        bx += e * static_cast<double>(pattern_.gx.at<float>(y, x));
        by += e * static_cast<double>(pattern_.gy.at<float>(y, x));
      }
    }
    const Point step(-(yy_ * bx - xy_ * by) / determinant, -(xx_ * by - xy_ * bx) / determinant);
    at += step;
    if (cv::norm(step) < 0.002) {
      // The smoothing joins so many pixels.
      constexpr double kJoined_px2 = 4 * std::numbers::pi * kSigma_px * kSigma_px;
      return Place{at + Point(seen.x, seen.y), std::sqrt(kJoined_px2 * ee / n / std::max(least_, 1e-9))};
    }
  }
  return std::nullopt;
}

}  // namespace punctum::vision
