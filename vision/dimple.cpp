#include "vision/dimple.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

namespace punctum::vision {

namespace {

constexpr double kReach = 0.995;          // of R: beyond it the depth is not to be told
constexpr double kNeedleMargin_px = 2.5;  // beside the needle's edge the contour is guessed

}  // namespace

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
  // Oval: r(t) = a0 + a1 cos t + b1 sin t + a2 cos 2t + b2 sin 2t about the circle's centre.
  cv::Mat a = cv::Mat::zeros(5, 5, CV_64F), b = cv::Mat::zeros(5, 1, CV_64F), x;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    if (weights[i] <= 0) {
      continue;
    }
    const Point d = contour[i] - circle->centre;
    const double t = std::atan2(d.y, d.x), r = cv::norm(d);
    const double f[5] = {1, std::cos(t), std::sin(t), std::cos(2 * t), std::sin(2 * t)};
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
  std::vector<double> r(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    r[static_cast<std::size_t>(i)] = x.at<double>(0) + x.at<double>(1) * std::cos(t) +
                                     x.at<double>(2) * std::sin(t) + x.at<double>(3) * std::cos(2 * t) +
                                     x.at<double>(4) * std::sin(2 * t);
  }
  out.shape = from_polar(circle->centre, r);
  return out;
}

std::optional<Point> entry_point(const Contour& shape, const Point& through, const Point& axis) {
  std::optional<double> best;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Point p = shape[i] - through, q = shape[(i + 1) % shape.size()] - through;
    const double up = axis.cross(p), uq = axis.cross(q);
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

std::vector<ProfilePoint> depth_profile(const Contour& contour, const Contour& shape, const Point& entry,
                                        const Point& axis, double reach) {
  std::vector<ProfilePoint> out;
  for (const Point& p : contour) {
    const double u = axis.cross(p - entry);
    const double s = (p - entry).dot(axis);
    if (std::abs(u) > reach || s > reach) {  // the far side has the same u
      continue;
    }
    const auto q = entry_point(shape, p, axis);
    if (q) {
      out.push_back({u, (p - *q).dot(axis)});
    }
  }
  std::sort(out.begin(), out.end(), [](const ProfilePoint& l, const ProfilePoint& r) { return l.u < r.u; });
  return out;
}

std::optional<double> half_width(const std::vector<ProfilePoint>& profile, double wd, double c, double R) {
  if (!(wd > 0) || !(c > 0) || !(R > 2 * c)) {
    return std::nullopt;
  }
  // Each side by itself, outwards from the needle: medians in bins of lateral distance.
  double sum = 0;
  int sides = 0;
  for (const double side : {-1.0, 1.0}) {
    constexpr int kBins = 40;
    std::array<std::vector<double>, kBins> bin;
    const double reach = kReach * R;
    for (const ProfilePoint& p : profile) {
      const double u = side * p.u;
      if (u > 1.2 * c && u < reach) {
        bin[static_cast<std::size_t>(u / reach * kBins)].push_back(p.depth);
      }
    }
    std::vector<double> us, depths;
    for (int i = 0; i < kBins; ++i) {
      auto& b = bin[static_cast<std::size_t>(i)];
      if (!b.empty()) {
        std::nth_element(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(b.size() / 2), b.end());
        us.push_back((i + 0.5) * reach / kBins);
        depths.push_back(b[b.size() / 2]);
      }
    }
    const double level = 0.01 * wd;
    for (std::size_t i = 1; i < us.size(); ++i) {
      if (depths[i] < level && depths[i - 1] >= level) {
        sum += us[i - 1] + (us[i] - us[i - 1]) * (depths[i - 1] - level) / (depths[i - 1] - depths[i]);
        ++sides;
        break;
      }
    }
  }
  if (sides == 0) {
    return std::nullopt;
  }
  return sum / sides;
}

std::optional<double> dimple_half_width(const Contour& contour, const Undeformed& undeformed,
                                        const Point& entry, double wd, double c) {
  const double R = undeformed.circle.r;
  Point normal = undeformed.circle.centre - entry;
  normal *= 1 / std::max(cv::norm(normal), 1e-9);
  std::vector<ProfilePoint> seen = depth_profile(contour, undeformed.shape, entry, normal, kReach * R);
  std::erase_if(seen, [c](const ProfilePoint& p) { return !(std::abs(p.u) > c + kNeedleMargin_px); });
  return half_width(seen, wd, c, R);
}

}  // namespace punctum::vision
