#include "vision/image/gradient.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

// Sobel's mask in two steps, in loops of which a compiler makes several steps at once.
PUNCTUM_WIDE_LOOP void across_rows(const float* above, const float* here, const float* below, int n,
                                   float* sum, float* difference) {
  for (int x = 0; x < n; ++x) {
    sum[x] = 0.125F * (above[x] + 2 * here[x] + below[x]);
    difference[x] = 0.125F * (below[x] - above[x]);
  }
}

PUNCTUM_WIDE_LOOP void along_rows(const float* sum, const float* difference, int n, float* slope) {
  for (int x = 0; x < n; ++x) {
    slope[2 * x] = sum[x + 1] - sum[x - 1];
    slope[2 * x + 1] = difference[x - 1] + 2 * difference[x] + difference[x + 1];
  }
}

PUNCTUM_WIDE_LOOP void lengths(const float* slope, int n, float* out) {
  for (int x = 0; x < n; ++x) {
    out[x] = std::sqrt(slope[2 * x] * slope[2 * x] + slope[2 * x + 1] * slope[2 * x + 1]);
  }
}

using FourInts = int __attribute__((vector_size(16)));

// Four places between the pixels of a field.
struct FourPlaces {
  FourInts left, top;
  FourFloats u, v;
  FourPlaces(const cv::Point2f& from, const cv::Point2f& step, int j) {
    const FourFloats k = FourFloats{0, 1, 2, 3} + static_cast<float>(j);
    const FourFloats x = from.x + k * step.x, y = from.y + k * step.y;
    left = __builtin_convertvector(x, FourInts);
    top = __builtin_convertvector(y, FourInts);
    u = x - __builtin_convertvector(left, FourFloats);
    v = y - __builtin_convertvector(top, FourFloats);
  }
  [[nodiscard]] std::ptrdiff_t pixel(int l, int stride) const {
    return static_cast<std::ptrdiff_t>(top[l]) * stride + left[l];
  }
};

PUNCTUM_WIDE_LOOP void pairs_along(const float* slope, int stride, const cv::Point2f& from,
                                   const cv::Point2f& step, int count, float* gx, float* gy) {
  for (int j = 0; j < count; j += GradientField::kAtOnce) {
    const FourPlaces at(from, step, j);
    std::array<FourFloats, 4> pairs;
    for (int l = 0; l < 4; ++l) {
      const float* first = slope + 2 * at.pixel(l, stride);
      FourFloats above, below;
      std::memcpy(&above, first, sizeof above);
      std::memcpy(&below, first + 2 * stride, sizeof below);
      pairs[static_cast<std::size_t>(l)] = above + at.v[l] * (below - above);
    }
    // Of the four, the components on the left and on the right side by side.
    const FourFloats x01 = __builtin_shufflevector(pairs[0], pairs[1], 0, 4, 2, 6),
                     y01 = __builtin_shufflevector(pairs[0], pairs[1], 1, 5, 3, 7),
                     x23 = __builtin_shufflevector(pairs[2], pairs[3], 0, 4, 2, 6),
                     y23 = __builtin_shufflevector(pairs[2], pairs[3], 1, 5, 3, 7);
    const FourFloats x_left = __builtin_shufflevector(x01, x23, 0, 1, 4, 5),
                     x_right = __builtin_shufflevector(x01, x23, 2, 3, 6, 7),
                     y_left = __builtin_shufflevector(y01, y23, 0, 1, 4, 5),
                     y_right = __builtin_shufflevector(y01, y23, 2, 3, 6, 7);
    const FourFloats x = x_left + at.u * (x_right - x_left), y = y_left + at.u * (y_right - y_left);
    std::memcpy(gx + j, &x, sizeof x);
    std::memcpy(gy + j, &y, sizeof y);
  }
}

PUNCTUM_WIDE_LOOP void values_along(const float* smooth, int stride, const cv::Point2f& from,
                                    const cv::Point2f& step, int count, float* out) {
  for (int j = 0; j < count; j += GradientField::kAtOnce) {
    const FourPlaces at(from, step, j);
    std::array<const float*, 4> p{};
    for (int l = 0; l < 4; ++l) {
      p[static_cast<std::size_t>(l)] = smooth + at.pixel(l, stride);
    }
    const auto four = [&p](std::ptrdiff_t by) { return FourFloats{p[0][by], p[1][by], p[2][by], p[3][by]}; };
    const FourFloats a0 = four(0), a1 = four(1), b0 = four(stride), b1 = four(stride + 1);
    const FourFloats left = a0 + at.v * (b0 - a0), right = a1 + at.v * (b1 - a1);
    const FourFloats value = left + at.u * (right - left);
    std::memcpy(out + j, &value, sizeof value);
  }
}

cv::Point2f in_floats(const Point& p) { return {static_cast<float>(p.x), static_cast<float>(p.y)}; }

}  // namespace

void GradientField::gradients(const Point& from, const Point& step, int count, float* gx, float* gy) const {
  pairs_along(slope.ptr<float>(), static_cast<int>(slope.step[0] / (2 * sizeof(float))),
              in_floats(from - Point(area.x, area.y)), in_floats(step), count, gx, gy);
}

void GradientField::greys(const Point& from, const Point& step, int count, float* out) const {
  values_along(smooth.ptr<float>(), static_cast<int>(smooth.step[0] / sizeof(float)),
               in_floats(from - Point(area.x, area.y)), in_floats(step), count, out);
}

void GradientField::compute(const cv::Mat& grey_in, cv::Rect wanted, double sigma_px) {
  picture = grey_in.size();
  area = wanted & cv::Rect(0, 0, grey_in.cols, grey_in.rows);
  sigma = sigma_px;
  if (area.empty()) {
    smooth.release();
    slope.release();
    return;
  }
  smooth = kept_[0].part(picture, area.size(), CV_32F);
  slope = kept_[1].part(picture, area.size(), CV_32FC2);
  smooth_part(grey_in, area, sigma, rows_, smooth);
  const auto wide = static_cast<std::size_t>(area.width) + 2;
  sum_.resize(wide);
  difference_.resize(wide);
  for (int y = 0; y < area.height; ++y) {
    const float *above = smooth.ptr<float>(std::max(y - 1, 0)), *here = smooth.ptr<float>(y),
                *below = smooth.ptr<float>(std::min(y + 1, area.height - 1));
    across_rows(above, here, below, area.width, sum_.data() + 1, difference_.data() + 1);
    for (Vector<float>* row : {&sum_, &difference_}) {
      row->front() = (*row)[1];
      row->back() = (*row)[wide - 2];
    }
    along_rows(sum_.data() + 1, difference_.data() + 1, area.width, slope.ptr<float>(y));
  }
}

cv::Mat GradientField::magnitude(const cv::Range& rows) const {
  cv::Mat out(rows.size(), area.width, CV_32F);
  for (int y = 0; y < out.rows; ++y) {
    lengths(slope.ptr<float>(rows.start + y), area.width, out.ptr<float>(y));
  }
  return out;
}

double GradientField::noise_of_gradient(double noise_grey) const {
  // Derivative of a Gaussian against white noise: sigma_n / (sqrt(8 pi) sigma^2), with the 3x3 Sobel's own
  // smoothing (variance 2/3 px^2 along and 1/2 px^2 across, on average 0.6) added to sigma^2.
  return noise_grey / (std::sqrt(8 * std::numbers::pi) * (sigma * sigma + 0.6));
}

}  // namespace punctum::vision
