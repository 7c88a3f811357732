#include "vision/image/circle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

constexpr int kReweightings = 4;
constexpr int kNewtonSteps = 3;
constexpr double kTukeyScales = 4.7;  // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale = 0.05;  // px

// Kasa's algebraic fit, from its normal equations about `mean`. The centre is relative to `mean`.
std::optional<Circle> algebraic_circle(std::span<const Point> points, const std::vector<double>& w,
                                       const Point& mean) {
  double sxx = 0, sxy = 0, syy = 0, sx = 0, sy = 0, s1 = 0, sxz = 0, syz = 0, sz = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point p = points[i] - mean;
    const double z = p.dot(p);
    sxx += w[i] * p.x * p.x;
    sxy += w[i] * p.x * p.y;
    syy += w[i] * p.y * p.y;
    sx += w[i] * p.x;
    sy += w[i] * p.y;
    s1 += w[i];
    sxz += w[i] * p.x * z;
    syz += w[i] * p.y * z;
    sz += w[i] * z;
  }
  const cv::Matx33d m(sxx, sxy, sx, sxy, syy, sy, sx, sy, s1);
  if (!(s1 > 0) || std::abs(cv::determinant(m)) < 1e-9 * std::pow(s1 + sxx + syy, 2)) {
    return std::nullopt;
  }
  const cv::Vec3d u = m.solve(cv::Vec3d(sxz, syz, sz), cv::DECOMP_LU);
  Circle c;
  c.centre = Point(u[0] / 2, u[1] / 2);
  const double r2 = u[2] + c.centre.dot(c.centre);
  if (!(r2 > 0) || !std::isfinite(r2)) {
    return std::nullopt;
  }
  c.r = std::sqrt(r2);
  return c;
}

// Gauss-Newton steps that make the fit geometric: the squared distances from the circle are minimised.
void refine(std::span<const Point> points, const std::vector<double>& w, const Point& mean, Circle& c) {
  for (int step = 0; step < kNewtonSteps; ++step) {
    cv::Matx33d a = cv::Matx33d::zeros();
    cv::Vec3d b(0, 0, 0);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point d = points[i] - mean - c.centre;
      const double l = cv::norm(d);
      if (l < 1e-9) {
        continue;
      }
      const cv::Vec3d j(d.x / l, d.y / l, 1);
      a += w[i] * (j * j.t());
      b += w[i] * (l - c.r) * j;
    }
    const cv::Vec3d s = a.solve(b, cv::DECOMP_LU);
    if (!std::isfinite(s[0] + s[1] + s[2])) {
      return;
    }
    c.centre += Point(s[0], s[1]);
    c.r += s[2];
  }
}

// From the normal matrix of the fit and the rms distance; `part` of the points was fitted.
double radius_sd(std::span<const Point> points, const std::vector<double>& w, const Circle& c, double part) {
  cv::Matx33d a = cv::Matx33d::zeros();
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point d = points[i] - c.centre;
    const double l = cv::norm(d);
    if (w[i] > 0 && l > 1e-9) {
      const cv::Vec3d j(d.x / l, d.y / l, 1);
      a += w[i] * (j * j.t());
      sum += w[i];
    }
  }
  return c.rms * std::sqrt(std::max(0.0, sum * a.inv()(2, 2)) / (Circle::kPieces * part));
}

}  // namespace

Contour circle_contour(const Circle& circle, int points) {
  Contour out;
  out.reserve(static_cast<std::size_t>(std::max(points, 0)));
  for (int i = 0; i < points; ++i) {
    const double t = 2 * std::numbers::pi * i / points;
    out.push_back(circle.centre + circle.r * Point(math::cos(t), math::sin(t)));
  }
  return out;
}

std::optional<Circle> fit_circle(std::span<const Point> points, std::span<const double> weights) {
  std::vector<double> w(points.size(), 1.0);
  if (weights.size() == points.size()) {
    w.assign(weights.begin(), weights.end());
  }
  const std::vector<double> given = w;
  Point mean;
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    mean += given[i] * points[i];
    total += given[i];
  }
  if (!(total > 0)) {
    return std::nullopt;
  }
  mean *= 1 / total;
  Circle out;
  for (int round = 0; round < kReweightings; ++round) {
    std::optional<Circle> c = algebraic_circle(points, w, mean);
    if (!c) {
      return std::nullopt;
    }
    refine(points, w, mean, *c);
    if (!std::isfinite(c->centre.x + c->centre.y + c->r) || c->r <= 0) {
      return std::nullopt;
    }
    out.centre = c->centre + mean;
    out.r = c->r;
    std::vector<double> distances;
    double se = 0, sw = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double d = cv::norm(points[i] - out.centre) - out.r;
      if (given[i] > 0) {
        distances.push_back(std::abs(d));
      }
      se += w[i] * d * d;
      sw += w[i];
    }
    out.rms = std::sqrt(se / std::max(sw, 1e-12));
    const double scale = std::max(kSdOfMedian * median_of(std::move(distances)), kLeastScale);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double t = (cv::norm(points[i] - out.centre) - out.r) / (kTukeyScales * scale);
      w[i] = std::abs(t) < 1 ? given[i] * std::pow(1 - t * t, 2) : 0;
    }
  }
  const auto fitted = std::count_if(given.begin(), given.end(), [](double v) { return v > 0; });
  out.r_sd = radius_sd(points, given, out, static_cast<double>(fitted) / static_cast<double>(points.size()));
  return out;
}

}  // namespace punctum::vision
