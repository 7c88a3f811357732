#include "vision/membrane/undeformed.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>

#include "hal/math/elementary.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

std::optional<Undeformed> fit_undeformed(const Contour& contour, std::span<const double> weights) {
  if (contour.size() < 16 || weights.size() != contour.size()) {
    return std::nullopt;
  }
  const auto circle = fit_circle(contour, weights);
  if (!circle) {
    return std::nullopt;
  }
  Undeformed out;
  out.circle = *circle;
  out.round = circle->rms < 0.02 * circle->r;
  const int n = static_cast<int>(contour.size());
  if (out.round) {
    out.shape = circle_contour(*circle, n);
    return out;
  }
  // An oval, r(t) = a0 + a1 cos t + b1 sin t + a2 cos 2t + b2 sin 2t about the circle's centre,
  // with a small penalty on all terms but a0.
  cv::Mat a = cv::Mat::zeros(5, 5, CV_64F), b = cv::Mat::zeros(5, 1, CV_64F), x;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    if (weights[i] <= 0) {
      continue;
    }
    const Point d = contour[i] - circle->centre;
    const double t = math::atan2(d.y, d.x), r = cv::norm(d);
    const double f[5] = {1, math::cos(t), math::sin(t), math::cos(2 * t), math::sin(2 * t)};
    for (int p = 0; p < 5; ++p) {
      for (int q = 0; q < 5; ++q) {
        a.at<double>(p, q) += weights[i] * f[p] * f[q];
      }
      b.at<double>(p) += weights[i] * f[p] * r;
    }
  }
  for (int p = 1; p < 5; ++p) {
    a.at<double>(p, p) += 0.01 * a.at<double>(0, 0);
  }
  if (!cv::solve(a, b, x, cv::DECOMP_CHOLESKY)) {
    return std::nullopt;
  }
  Vector<double> r(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    r[static_cast<std::size_t>(i)] = x.at<double>(0) + x.at<double>(1) * math::cos(t) +
                                     x.at<double>(2) * math::sin(t) + x.at<double>(3) * math::cos(2 * t) +
                                     x.at<double>(4) * math::sin(2 * t);
  }
  out.shape = from_polar(circle->centre, r);
  return out;
}

std::optional<Point> entry_point(const Contour& shape, const Point& through, const Point& axis) {
  std::optional<double> best;
  double uq = shape.empty() ? 0 : axis.cross(shape.front() - through);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Point p = shape[i] - through, q = shape[i + 1 < shape.size() ? i + 1 : 0] - through;
    const double up = uq;
    uq = axis.cross(q);
    if ((up > 0) == (uq > 0) || up == uq) {
      continue;
    }
    const double t = up / (up - uq);
    const double s = (p + t * (q - p)).dot(axis);
    if (!best || s < *best) {
      best = s;
    }
  }
  if (!best) {
    return std::nullopt;
  }
  return through + *best * axis;
}

}  // namespace punctum::vision
