#include "vision/image/circle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>

#include "vision/image/dispatched.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr int kReweightings = 4;
constexpr int kNewtonSteps = 3,
              kNewtonStepsAgain = 1;  // of the first round, and of those that begin at its circle
constexpr double kTukeyScales = 4.7;  // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale = 0.05;  // px

// Kasa's algebraic fit, from its normal equations about `mean`. The centre is relative to `mean`.
std::optional<Circle> algebraic_circle(std::span<const Point> points, const Vector<double>& w,
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

// Of points seen from the centre of a circle: their directions, and how far off it they are. A point in the
// centre has no direction, and no weight.
PUNCTUM_WIDE_LOOP void off_circle(const Point* points, const double* weight, std::size_t n, const Point& mean,
                                  const Circle& c, double* x, double* y, double* off, double* w) {
  const double mean_x = mean.x, mean_y = mean.y, centre_x = c.centre.x, centre_y = c.centre.y, r = c.r;
  for (std::size_t i = 0; i < n; ++i) {
    const double dx = points[i].x - mean_x - centre_x, dy = points[i].y - mean_y - centre_y,
                 l = std::sqrt(dx * dx + dy * dy);
    const bool none = l < 1e-9;
    x[i] = none ? 0 : dx / l;
    y[i] = none ? 0 : dy / l;
    w[i] = none ? 0 : weight[i];
    off[i] = l - r;
  }
}

// Gauss-Newton steps that make the fit geometric: the squared distances from the circle are minimised.
void refine(std::span<const Point> points, const Vector<double>& weights, const Point& mean, int steps,
            Circle& c) {
  const std::size_t n = points.size();
  Vector<double> x(n), y(n), off(n), w(n);
  for (int step = 0; step < steps; ++step) {
    off_circle(points.data(), weights.data(), n, mean, c, x.data(), y.data(), off.data(), w.data());
    double xx = 0, xy = 0, yy = 0, x1 = 0, y1 = 0, one = 0, bx = 0, by = 0, b1 = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double wx = w[i] * x[i], wy = w[i] * y[i];
      xx += wx * x[i];
      xy += wx * y[i];
      yy += wy * y[i];
      x1 += wx;
      y1 += wy;
      one += w[i];
      bx += wx * off[i];
      by += wy * off[i];
      b1 += w[i] * off[i];
    }
    const cv::Matx33d a(xx, xy, x1, xy, yy, y1, x1, y1, one);
    const cv::Vec3d b(bx, by, b1);
    const cv::Vec3d s = a.solve(b, cv::DECOMP_LU);
    if (!std::isfinite(s[0] + s[1] + s[2])) {
      return;
    }
    c.centre += Point(s[0], s[1]);
    c.r += s[2];
  }
}

// From the normal matrix of the fit and the rms distance; `part` of the points was fitted.
double radius_sd(std::span<const Point> points, const Vector<double>& w, const Circle& c, double part) {
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
  return from_polar(circle.centre, Vector<double>(static_cast<std::size_t>(std::max(points, 0)), circle.r));
}

std::optional<Circle> fit_circle(std::span<const Point> points, std::span<const double> weights) {
  Vector<double> w(points.size(), 1.0);
  if (weights.size() == points.size()) {
    w.assign(weights.begin(), weights.end());
  }
  const Vector<double> given = w;
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
  Vector<double> distances, off(points.size());  // of the points with weight; of all, with their sign
  distances.reserve(points.size());
  std::optional<Circle> c = algebraic_circle(points, w, mean);
  for (int round = 0; round < kReweightings; ++round) {
    if (!c) {
      return std::nullopt;
    }
    refine(points, w, mean, round == 0 ? kNewtonSteps : kNewtonStepsAgain, *c);
    if (!std::isfinite(c->centre.x + c->centre.y + c->r) || c->r <= 0) {
      return std::nullopt;
    }
    out.centre = c->centre + mean;
    out.r = c->r;
    distances.clear();
    double se = 0, sw = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      off[i] = cv::norm(points[i] - out.centre) - out.r;
      if (given[i] > 0) {
        distances.push_back(std::abs(off[i]));
      }
      se += w[i] * off[i] * off[i];
      sw += w[i];
    }
    out.rms = std::sqrt(se / std::max(sw, 1e-12));
    const double scale = std::max(kSdOfMedian * median_in_place(distances), kLeastScale);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double t = off[i] / (kTukeyScales * scale);
      w[i] = std::abs(t) < 1 ? given[i] * std::pow(1 - t * t, 2) : 0;
    }
  }
  const auto fitted = std::count_if(given.begin(), given.end(), [](double v) { return v > 0; });
  out.r_sd = radius_sd(points, given, out, static_cast<double>(fitted) / static_cast<double>(points.size()));
  return out;
}

}  // namespace punctum::vision
