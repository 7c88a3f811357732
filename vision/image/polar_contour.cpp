#include "vision/image/polar_contour.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

// Unit vectors along the rays. Almost every contour has the same number of them.
const std::vector<Point>& rays(int angles) {
  thread_local std::vector<Point> of_last;
  if (of_last.size() != static_cast<std::size_t>(angles)) {
    of_last.clear();
    for (int i = 0; i < angles; ++i) {
      const double t = polar_angle(i, angles);
      of_last.emplace_back(math::cos(t), math::sin(t));
    }
  }
  return of_last;
}

}  // namespace

std::vector<double> polar_radii(std::span<const Point> contour, const Point& centre, int angles) {
  const std::size_t n = static_cast<std::size_t>(angles);
  std::vector<double> out(n, -1.0);
  const double step = 2 * std::numbers::pi / angles;
  const std::vector<Point>& ray = rays(angles);
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point p = contour[i] - centre, q = contour[(i + 1) % contour.size()] - centre;
    const double t0 = math::atan2(p.y, p.x);
    double dt = math::atan2(p.cross(q), p.dot(q));
    const double lo = std::min(t0, t0 + dt), hi = std::max(t0, t0 + dt);
    for (int k = static_cast<int>(std::ceil(lo / step - 1e-9)); k * step <= hi + 1e-9; ++k) {
      const std::size_t at = static_cast<std::size_t>(((k % angles) + angles) % angles);
      const Point d = ray[at], e = q - p;
      const double den = d.cross(e);
      if (std::abs(den) < 1e-12) {
        continue;
      }
      const double r = p.cross(e) / den;
      if (r > out[at]) {
        out[at] = r;  // where a wall overhangs, the outermost crossing
      }
    }
  }
  int known = 0;
  for (double r : out) {
    known += r > 0;
  }
  if (known < angles / 2) {
    return {};
  }
  for (std::size_t i = 0; i < n; ++i) {  // what is left open is filled from its neighbours
    if (out[i] <= 0) {
      std::size_t a = 1, b = 1;
      while (out[(i + n - a) % n] <= 0) {
        ++a;
      }
      while (out[(i + b) % n] <= 0) {
        ++b;
      }
      out[i] = (static_cast<double>(b) * out[(i + n - a) % n] + static_cast<double>(a) * out[(i + b) % n]) /
               static_cast<double>(a + b);
    }
  }
  return out;
}

Contour from_polar(const Point& centre, std::span<const double> radii) {
  Contour out;
  out.reserve(radii.size());
  const std::vector<Point>& ray = rays(static_cast<int>(radii.size()));
  for (std::size_t i = 0; i < radii.size(); ++i) {
    out.push_back(centre + radii[i] * ray[i]);
  }
  return out;
}

double polar_angle(int i, int angles) { return 2 * std::numbers::pi * i / angles; }

int polar_index(const Point& direction, int angles) {
  const double turns = math::atan2(direction.y, direction.x) / (2 * std::numbers::pi);
  return (static_cast<int>(std::lround(turns * angles)) + angles) % angles;
}

Point on_ray(const Point& centre, int i, int angles, double r) {
  return centre + r * rays(angles)[static_cast<std::size_t>(i)];
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::numbers::pi)); }

}  // namespace punctum::vision
