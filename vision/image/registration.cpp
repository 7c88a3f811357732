#include "vision/image/registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

constexpr double kSigma_px = 1.2;
constexpr int kMargin = 2;            // px of the pattern that its border falsifies
constexpr double kFurthest_px = 2.5;  // the vertex of eq. 1 errs by less

PUNCTUM_WIDE_LOOP void between_rows(const float* a, const float* b, float u, float t, int n, float* out) {
  for (int x = 0; x < n; ++x) {
    const float left = a[x] + t * (b[x] - a[x]), right = a[x + 1] + t * (b[x + 1] - a[x + 1]);
    out[x] = left + u * (right - left);
  }
}

// Sums over a row, four at once in a fixed order. What is left of the row is added one by one.
FourFloats four_from(const float* p) {
  FourFloats out;
  std::memcpy(&out, p, sizeof out);
  return out;
}
double total_of(const FourFloats& v) { return static_cast<double>((v[0] + v[1]) + (v[2] + v[3])); }

// Of the values, and of their products with the pattern without its mean.
std::array<double, 2> sums_of_row(const float* v, const float* pattern, float mean, int n) {
  FourFloats sum{}, dot{};
  int x = 0;
  for (; x + 4 <= n; x += 4) {
    const FourFloats here = four_from(v + x);
    sum += here;
    dot += here * (four_from(pattern + x) - mean);
  }
  std::array<double, 2> out{total_of(sum), total_of(dot)};
  for (; x < n; ++x) {
    out[0] += static_cast<double>(v[x]);
    out[1] += static_cast<double>(v[x] * (pattern[x] - mean));
  }
  return out;
}

// What differs from the pattern: its square, and its products with the two components of the gradient.
std::array<double, 3> left_in_row(const float* v, const float* pattern, const float* slope, float scale,
                                  float level, int n) {
  FourFloats square{}, gradient{};  // products with gx and gy take turns
  int x = 0;
  for (; x + 4 <= n; x += 4) {
    const FourFloats e = four_from(v + x) * scale + level - four_from(pattern + x);
    square += e * e;
    gradient += __builtin_shufflevector(e, e, 0, 0, 1, 1) * four_from(slope + 2 * x);
    gradient += __builtin_shufflevector(e, e, 2, 2, 3, 3) * four_from(slope + 2 * x + 4);
  }
  std::array<double, 3> out{total_of(square), static_cast<double>(gradient[0] + gradient[2]),
                            static_cast<double>(gradient[1] + gradient[3])};
  for (; x < n; ++x) {
    const float e = v[x] * scale + level - pattern[x];
    out[0] += static_cast<double>(e * e);
    out[1] += static_cast<double>(e * slope[2 * x]);
    out[2] += static_cast<double>(e * slope[2 * x + 1]);
  }
  return out;
}

}  // namespace

Registration::Registration(const cv::Mat& pattern, double noise) {
  pattern_.compute(pattern, cv::Rect(0, 0, pattern.cols, pattern.rows), kSigma_px);
  double n = 0, sum = 0, squares = 0;
  for (int y = kMargin; y < pattern.rows - kMargin; ++y) {
    for (int x = kMargin; x < pattern.cols - kMargin; ++x) {
      const double v = static_cast<double>(pattern_.smooth.at<float>(y, x)),
                   gx = static_cast<double>(pattern_.slope.at<cv::Vec2f>(y, x)[0]),
                   gy = static_cast<double>(pattern_.slope.at<cv::Vec2f>(y, x)[1]);
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

double Registration::similarity(const cv::Mat& grey, const cv::Point& corner) {
  const cv::Rect box(corner, pattern_.smooth.size());
  if (!(power_ > 0) || (box & cv::Rect(0, 0, grey.cols, grey.rows)) != box) {
    return 0;
  }
  cv::Mat smooth = kept_picture(box.size(), CV_32F);
  smooth_part(grey, box, kSigma_px, rows_, smooth);
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

std::optional<Registration::Place> Registration::place(const cv::Mat& grey, const Point& corner) {
  const double determinant = xx_ * yy_ - xy_ * xy_;
  const int w = pattern_.smooth.cols, h = pattern_.smooth.rows, around = static_cast<int>(kFurthest_px) + 2;
  const cv::Rect part(static_cast<int>(std::floor(corner.x)) - around,
                      static_cast<int>(std::floor(corner.y)) - around, w + 2 * around + 1,
                      h + 2 * around + 1);
  const cv::Rect seen = part & cv::Rect(0, 0, grey.cols, grey.rows);
  if (seen.empty() || !(power_ > 0) || !(determinant > 1e-6 * xx_ * yy_)) {
    return std::nullopt;
  }
  cv::Mat smooth = kept_.part(part.size(), seen.size(), CV_32F);
  smooth_part(grey, seen, kSigma_px, rows_, smooth);
  const Point from = corner - Point(seen.x, seen.y);
  Point at = from;
  cv::Mat shifted = kept_shifted_.part(pattern_.smooth.size(), pattern_.smooth.size(), CV_32F);
  for (int round = 0; round < 12; ++round) {
    if (cv::norm(at - from) > kFurthest_px || at.x < -kMargin || at.y < -kMargin ||
        at.x + w - kMargin >= smooth.cols || at.y + h - kMargin >= smooth.rows) {
      return std::nullopt;
    }
    double sum = 0, dot = 0;
    const double n = static_cast<double>(w - 2 * kMargin) * (h - 2 * kMargin);
    const int x0 = static_cast<int>(std::floor(at.x)), y0 = static_cast<int>(std::floor(at.y));
    const auto u = static_cast<float>(at.x - x0), t = static_cast<float>(at.y - y0);  // of every pixel
    for (int y = kMargin; y < h - kMargin; ++y) {
      const float *a = smooth.ptr<float>(y0 + y) + x0, *b = smooth.ptr<float>(y0 + y + 1) + x0,
                  *pattern = pattern_.smooth.ptr<float>(y);
      float* out = shifted.ptr<float>(y);
      between_rows(a + kMargin, b + kMargin, u, t, w - 2 * kMargin, out + kMargin);
      const auto [in_row, in_row_dot] =
          sums_of_row(out + kMargin, pattern + kMargin, static_cast<float>(mean_), w - 2 * kMargin);
      sum += in_row;
      dot += in_row_dot;
    }
    const double gain = dot / power_, mean = sum / n;
    if (!(gain > 0.2)) {
      return std::nullopt;
    }
    double bx = 0, by = 0, ee = 0;
    for (int y = kMargin; y < h - kMargin; ++y) {
      const auto left = left_in_row(shifted.ptr<float>(y) + kMargin, pattern_.smooth.ptr<float>(y) + kMargin,
                                    pattern_.slope.ptr<float>(y) + 2 * kMargin, static_cast<float>(1 / gain),
                                    static_cast<float>(mean_ - mean / gain), w - 2 * kMargin);
      ee += left[0];
      bx += left[1];
      by += left[2];
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
