#include "vision/image/polar_contour.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

// Almost every contour has the same number of them.
std::span<const Point> unit_rays(int angles) {
  thread_local Vector<Point> of_last;
  if (of_last.size() != static_cast<std::size_t>(angles)) {
    of_last.clear();
    for (int i = 0; i < angles; ++i) {
      const double t = polar_angle(i, angles);
      of_last.emplace_back(math::cos(t), math::sin(t));
    }
  }
  return of_last;
}

Vector<double> polar_radii(std::span<const Point> contour, const Point& centre, int angles) {
  const std::size_t n = static_cast<std::size_t>(angles);
  Vector<double> out(n, -1.0);
  const std::span<const Point> ray = unit_rays(angles);
  const auto next = [n](std::size_t k) { return k + 1 < n ? k + 1 : 0; };
  if (contour.empty() || n < 3) {
    return {};
  }
  // The ray at or before each point: which side of a ray the next one lies on, its cross product tells.
  const auto ray_before = [&](const Point& d) {
    const auto k = static_cast<std::size_t>(polar_index(d, angles));
    return ray[k].cross(d) >= 0 ? k : k > 0 ? k - 1 : n - 1;
  };
  Point p = contour[0] - centre;
  std::size_t at = ray_before(p);
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point q = contour[i + 1 < contour.size() ? i + 1 : 0] - centre, e = q - p;
    const double turn = p.cross(q);
    const auto cross_ray = [&](std::size_t k) {
      const double den = ray[k].cross(e);
      if (std::abs(den) > 1e-12) {
        out[k] = std::max(out[k], turn / den);  // where a wall overhangs, the outermost crossing
      }
    };
    while (turn > 0 && ray[next(at)].cross(q) >= 0) {
      at = next(at);
      cross_ray(at);
    }
    while (turn < 0 && ray[at].cross(q) < 0) {
      cross_ray(at);
      at = at > 0 ? at - 1 : n - 1;
    }
    if (turn == 0) {  // through the centre, or straight along a ray
      at = ray_before(q);
    }
    p = q;
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
  const std::span<const Point> ray = unit_rays(static_cast<int>(radii.size()));
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
  return centre + r * unit_rays(angles)[static_cast<std::size_t>(i)];
}

double angle_between(double a, double b) {
  const double apart = std::abs(a - b);
  if (apart <= std::numbers::pi) {
    return apart;
  }
  if (apart < 3 * std::numbers::pi) {
    return std::abs(apart - 2 * std::numbers::pi);  // exact, as the remainder is, and much faster
  }
  return std::abs(std::remainder(apart, 2 * std::numbers::pi));
}

Vector<cv::Vec3d> effects_of_motion(std::span<const double> radii) {
  const std::size_t n = radii.size();
  const std::span<const Point> ray = unit_rays(static_cast<int>(n));
  Vector<cv::Vec3d> effect(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Point& d = ray[i];
    const double slope = (radii[(i + 1) % n] - radii[(i + n - 1) % n]) * static_cast<double>(n) /
                         (4 * std::numbers::pi * std::max(radii[i], 1.0));
    effect[i] = cv::Vec3d(d.x + slope * d.y, d.y - slope * d.x, -slope);
  }
  return effect;
}

}  // namespace punctum::vision
