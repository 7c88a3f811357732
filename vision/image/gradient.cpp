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

constexpr int kEight = 8;
using EightFloats = float __attribute__((vector_size(kEight * sizeof(float))));
using EightInts = int __attribute__((vector_size(kEight * sizeof(int))));

// Eight places between the pixels of a field whose rows lie `stride` pixels apart, from the j-th on; or four
// of them twice.
struct EightPlaces {
  EightInts pixel;  // the upper left of each
  EightFloats u, v;
  EightPlaces(const cv::Point2f& from, const cv::Point2f& step, int j, bool only_four, int stride) {
    const EightFloats all{0, 1, 2, 3, 4, 5, 6, 7}, four{0, 1, 2, 3, 0, 1, 2, 3};
    const EightFloats k = (only_four ? four : all) + static_cast<float>(j);
    const EightFloats x = from.x + k * step.x, y = from.y + k * step.y;
    const EightInts left = __builtin_convertvector(x, EightInts), top = __builtin_convertvector(y, EightInts);
    u = x - __builtin_convertvector(left, EightFloats);
    v = y - __builtin_convertvector(top, EightFloats);
    pixel = top * stride + left;
  }
};

void store(const EightFloats& values, bool only_four, float* out) {
  std::memcpy(out, &values, (only_four ? 4 : 8) * sizeof(float));
}

// Of the pairs at place l and at place l + 4, between the upper and the lower row.
template <int l>
[[gnu::always_inline]] inline void pairs_between_rows(const float* slope, int stride, const EightPlaces& at,
                                                      EightFloats& out) {
  const float *first = slope + 2 * static_cast<std::ptrdiff_t>(at.pixel[l]),
              *second = slope + 2 * static_cast<std::ptrdiff_t>(at.pixel[l + 4]);
  FourFloats above_first, above_second, below_first, below_second;
  std::memcpy(&above_first, first, sizeof above_first);
  std::memcpy(&above_second, second, sizeof above_second);
  std::memcpy(&below_first, first + 2 * stride, sizeof below_first);
  std::memcpy(&below_second, second + 2 * stride, sizeof below_second);
  const EightFloats above = __builtin_shufflevector(above_first, above_second, 0, 1, 2, 3, 4, 5, 6, 7),
                    below = __builtin_shufflevector(below_first, below_second, 0, 1, 2, 3, 4, 5, 6, 7),
                    v = __builtin_shufflevector(at.v, at.v, l, l, l, l, l + 4, l + 4, l + 4, l + 4);
  out = above + v * (below - above);
}

PUNCTUM_WIDE_LOOP void pairs_along(const float* slope, int stride, const cv::Point2f from,
                                   const cv::Point2f step, int count, float* gx, float* gy) {
  for (int j = 0; j < count; j += kEight) {
    const bool only_four = count - j <= GradientField::kAtOnce;
    const EightPlaces at(from, step, j, only_four, stride);
    std::array<EightFloats, 4> pairs;
    pairs_between_rows<0>(slope, stride, at, pairs[0]);
    pairs_between_rows<1>(slope, stride, at, pairs[1]);
    pairs_between_rows<2>(slope, stride, at, pairs[2]);
    pairs_between_rows<3>(slope, stride, at, pairs[3]);
    // The components on the left and on the right side by side.
    const EightFloats x01 = __builtin_shufflevector(pairs[0], pairs[1], 0, 8, 2, 10, 4, 12, 6, 14),
                      y01 = __builtin_shufflevector(pairs[0], pairs[1], 1, 9, 3, 11, 5, 13, 7, 15),
                      x23 = __builtin_shufflevector(pairs[2], pairs[3], 0, 8, 2, 10, 4, 12, 6, 14),
                      y23 = __builtin_shufflevector(pairs[2], pairs[3], 1, 9, 3, 11, 5, 13, 7, 15);
    const EightFloats x_left = __builtin_shufflevector(x01, x23, 0, 1, 8, 9, 4, 5, 12, 13),
                      x_right = __builtin_shufflevector(x01, x23, 2, 3, 10, 11, 6, 7, 14, 15),
                      y_left = __builtin_shufflevector(y01, y23, 0, 1, 8, 9, 4, 5, 12, 13),
                      y_right = __builtin_shufflevector(y01, y23, 2, 3, 10, 11, 6, 7, 14, 15);
    const EightFloats x = x_left + at.u * (x_right - x_left), y = y_left + at.u * (y_right - y_left);
    store(x, only_four, gx + j);
    store(y, only_four, gy + j);
  }
}

PUNCTUM_WIDE_LOOP void values_along(const float* smooth, int stride, const cv::Point2f from,
                                    const cv::Point2f step, int count, float* out) {
  for (int j = 0; j < count; j += kEight) {
    const bool only_four = count - j <= GradientField::kAtOnce;
    const EightPlaces at(from, step, j, only_four, stride);
    EightFloats a0, a1, b0, b1;
    for (int l = 0; l < kEight; ++l) {
      const float *above = smooth + at.pixel[l], *below = above + stride;
      a0[l] = above[0];
      a1[l] = above[1];
      b0[l] = below[0];
      b1[l] = below[1];
    }
    const EightFloats left = a0 + at.v * (b0 - a0), right = a1 + at.v * (b1 - a1);
    store(left + at.u * (right - left), only_four, out + j);
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
