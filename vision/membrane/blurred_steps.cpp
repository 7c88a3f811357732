#include "vision/membrane/blurred_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/membrane/edge_profiles.hpp"

namespace punctum::vision {

namespace {

constexpr double kFurthestStep_px = 2.5;  // an own step further from the contour is another edge
constexpr double kShapeNoise = 0.5;       // grey levels: what the common shape itself is worth
// Width of a halo's line, its place outside the step, and by what that differs; of the blur.
constexpr double kHaloBlur = 1.3, kHaloAt = 1.2, kHaloTolerance = 0.2;
constexpr double kBlurFirst_px = 1.8, kBlurLeast_px = 0.6, kBlurMost_px = 5;

double place_of(const EdgeShape& edge, std::size_t sample) {  // px from the contour
  return static_cast<double>(sample) * EdgeProfiles::kStep_px - edge.inside;
}

}  // namespace

// Whether it is brighter beside the outer face of a wall than further out: the halo of a cell out of
// perfect focus.
bool BlurredSteps::bright_outside(const Vector<double>& shape, const EdgeShape& edge) {
  constexpr double kShare = 0.15;  // of what the shape spans
  constexpr std::ptrdiff_t kFarOut = 3;
  if (!edge.nearby || edge.nearby->at > 0) {
    return false;
  }
  const auto [least, most] = std::minmax_element(shape.begin(), shape.end());
  const double far = *std::max_element(shape.end() - kFarOut, shape.end());
  return *most - far > kShare * (*most - *least) &&
         place_of(edge, static_cast<std::size_t>(most - shape.begin())) > -kFurthestStep_px;
}

std::optional<BlurredSteps::Fit> BlurredSteps::fit(const std::optional<cv::Vec4d>& last) {
  auto found = last ? fit_from(*last) : std::nullopt;
  return found ? found : fit_from({0, kBlurFirst_px, edge_.nearby ? edge_.nearby->at : 0, 1.5});
}

std::optional<BlurredSteps::Fit> BlurredSteps::fit_from(cv::Vec4d x) {
  if (edge_.nearby && !free(2)) {
    x[2] = edge_.nearby->at;
  }
  double cost = residuals(x, now_), damping = 1e-3;
  cv::Vec4d heights = heights_;
  for (int round = 0; round < 25 && damping < 1e4; ++round) {
    const cv::Vec4d y = x + step(x, damping);
    const double next = residuals(y, ahead_);
    if (!(next < cost)) {
      damping *= 10;
      continue;
    }
    const bool settled = cost - next < 1e-4 * cost;
    x = y;
    cost = next;
    heights = heights_;
    std::swap(now_, ahead_);
    damping = std::max(damping / 5, 1e-6);
    if (settled) {
      break;
    }
  }
  const bool plausible = std::abs(x[0]) < kFurthestStep_px && x[1] > kBlurLeast_px && x[1] < kBlurMost_px;
  if (!plausible) {
    return std::nullopt;
  }
  return Fit{x[0], x[1], heights[2], halo_, x};
}

// Returns the sum of their squares.
double BlurredSteps::residuals(const cv::Vec4d& x, Vector<double>& out) {
  const double blur = std::clamp(x[1], 0.3, 8.0) * std::numbers::sqrt2;
  Vector<cv::Vec4d>& column = column_;
  column.resize(shape_.size());
  cv::Matx44d a = cv::Matx44d::zeros();  // its lower half: no more of it is asked for
  cv::Vec4d b = cv::Vec4d::all(0);
  for (std::size_t j = 0; j < shape_.size(); ++j) {
    const double s = place_of(edge_, j) - x[0];
    const double z = (s - x[3]) / (kHaloBlur * std::clamp(x[1], 0.3, 8.0));
    const cv::Vec4d& here =
        column[j] = {1, blurred_step(s / blur), edge_.nearby ? blurred_step((s - x[2]) / blur) : 0,
                     halo_ ? math::exp(-0.5 * z * z) : 0};
    for (int p = 0; p < kUnknown; ++p) {
      for (int q = 0; q <= p; ++q) {
        a(p, q) += here[p] * here[q];
      }
      b[p] += shape_[j] * here[p];
    }
  }
  for (int p = 0; p < kUnknown; ++p) {
    a(p, p) += 1e-9 * static_cast<double>(shape_.size());
  }
  const cv::Vec4d h = heights_ = a.solve(b, cv::DECOMP_CHOLESKY);
  out.clear();
  double cost = 0;
  for (std::size_t j = 0; j < shape_.size(); ++j) {
    out.push_back(shape_[j] - h.dot(column[j]));
    cost += out.back() * out.back();
  }
  if (free(2)) {
    out.push_back(kShapeNoise * (x[2] - edge_.nearby->at) / edge_.nearby->tolerance_px);
    cost += out.back() * out.back();
  }
  if (halo_) {
    out.push_back(kShapeNoise * (x[3] - kHaloAt * x[1]) / (kHaloTolerance * x[1]));
    cost += out.back() * out.back();
  }
  return cost;
}

// Of Levenberg and Marquardt, with differences.
cv::Vec4d BlurredSteps::step(const cv::Vec4d& x, double damping) {
  constexpr double kDifference = 1e-4;
  auto& slope = ahead_of_;
  cv::Matx44d a = cv::Matx44d::eye();
  cv::Vec4d b = cv::Vec4d::all(0);
  for (int p = 0; p < kUnknown; ++p) {
    if (free(p)) {
      cv::Vec4d y = x;
      y[p] += kDifference;
      residuals(y, slope[static_cast<std::size_t>(p)]);
    }
  }
  for (int p = 0; p < kUnknown; ++p) {
    for (int q = 0; q <= p && free(p); ++q) {
      a(p, q) = 0;
      for (std::size_t j = 0; j < now_.size(); ++j) {
        a(p, q) += (slope[static_cast<std::size_t>(p)][j] - now_[j]) *
                   (slope[static_cast<std::size_t>(q)][j] - now_[j]) / (kDifference * kDifference);
      }
      a(q, p) = a(p, q);
    }
    for (std::size_t j = 0; j < now_.size() && free(p); ++j) {
      b[p] -= (slope[static_cast<std::size_t>(p)][j] - now_[j]) / kDifference * now_[j];
    }
    a(p, p) = a(p, p) * (1 + damping) + 1e-9;
  }
  cv::Vec4d d = a.solve(b, cv::DECOMP_CHOLESKY);
  for (int p = 0; p < kUnknown; ++p) {
    d[p] = free(p) ? std::clamp(d[p], -1.0, 1.0) : 0;
  }
  return d;
}

}  // namespace punctum::vision
