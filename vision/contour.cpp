#include "vision/contour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

namespace punctum::vision {

namespace {

// Second derivatives of the periodic cubic spline with knot spacing h through y: cyclic tridiagonal system,
// solved by the Sherman-Morrison correction of the Thomas algorithm.
std::vector<double> second_derivatives(const std::vector<double>& y, const std::vector<double>& h) {
  const std::size_t n = y.size();
  std::vector<double> a(n), b(n), c(n), d(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t p = (i + n - 1) % n, q = (i + 1) % n;
    a[i] = h[p];
    b[i] = 2 * (h[p] + h[i]);
    c[i] = h[i];
    d[i] = 6 * ((y[q] - y[i]) / h[i] - (y[i] - y[p]) / h[p]);
  }
  const double gamma = -b[0];
  std::vector<double> bb = b, u(n, 0.0);
  bb[0] = b[0] - gamma;
  bb[n - 1] = b[n - 1] - a[0] * c[n - 1] / gamma;
  u[0] = gamma;
  u[n - 1] = c[n - 1];
  const auto solve = [&](std::vector<double> r) {
    std::vector<double> cp(n);
    double beta = bb[0];
    r[0] /= beta;
    for (std::size_t i = 1; i < n; ++i) {
      cp[i] = c[i - 1] / beta;
      beta = bb[i] - a[i] * cp[i];
      r[i] = (r[i] - a[i] * r[i - 1]) / beta;
    }
    for (std::size_t i = n - 1; i-- > 0;) {
      r[i] -= cp[i + 1] * r[i + 1];
    }
    return r;
  };
  std::vector<double> x = solve(d);
  const std::vector<double> z = solve(u);
  const double f = (x[0] + x[n - 1] * a[0] / gamma) / (1 + z[0] + z[n - 1] * a[0] / gamma);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] -= f * z[i];
  }
  return x;
}

}  // namespace

Contour spline_through(std::span<const Point> nodes, int points) {
  Contour v;
  v.reserve(nodes.size());
  for (const Point& p : nodes) {
    if (v.empty() || cv::norm(p - v.back()) > 1e-9) {
      v.push_back(p);
    }
  }
  while (v.size() > 1 && cv::norm(v.front() - v.back()) <= 1e-9) {
    v.pop_back();
  }
  const std::size_t n = v.size();
  if (n < 3 || points < 3) {
    return {};
  }
  std::vector<double> h(n), x(n), y(n);
  for (std::size_t i = 0; i < n; ++i) {
    h[i] = cv::norm(v[(i + 1) % n] - v[i]);
    x[i] = v[i].x;
    y[i] = v[i].y;
  }
  const std::vector<double> mx = second_derivatives(x, h), my = second_derivatives(y, h);
  const auto at = [&](std::size_t i, double t) {  // t in 0..1 of segment i
    const std::size_t q = (i + 1) % n;
    const double s = 1 - t, k = h[i] * h[i] / 6;
    return Point(s * x[i] + t * x[q] + k * ((s * s * s - s) * mx[i] + (t * t * t - t) * mx[q]),
                 s * y[i] + t * y[q] + k * ((s * s * s - s) * my[i] + (t * t * t - t) * my[q]));
  };
  // Dense first, then equal steps of length along it.
  const int per = std::max(8, 4 * points / static_cast<int>(n));
  std::vector<Point> dense;
  dense.reserve(n * static_cast<std::size_t>(per) + 1);
  for (std::size_t i = 0; i < n; ++i) {
    for (int j = 0; j < per; ++j) {
      dense.push_back(at(i, static_cast<double>(j) / per));
    }
  }
  dense.push_back(dense.front());
  std::vector<double> length(dense.size(), 0.0);
  for (std::size_t i = 1; i < dense.size(); ++i) {
    length[i] = length[i - 1] + cv::norm(dense[i] - dense[i - 1]);
  }
  Contour out;
  out.reserve(static_cast<std::size_t>(points));
  std::size_t k = 0;
  for (int j = 0; j < points; ++j) {
    const double want = length.back() * j / points;
    while (k + 2 < length.size() && length[k + 1] < want) {
      ++k;
    }
    const double step = length[k + 1] - length[k];
    const double t = step > 0 ? (want - length[k]) / step : 0;
    // Evaluated on the spline itself, not on the chord between two dense points.
    const double along = static_cast<double>(k) + t;
    const std::size_t i = std::min(n - 1, static_cast<std::size_t>(along / per));
    out.push_back(at(i, std::clamp(along / per - static_cast<double>(i), 0.0, 1.0)));
  }
  return out;
}

Contour circle_contour(const Circle& circle, int points) {
  Contour out;
  out.reserve(static_cast<std::size_t>(std::max(points, 0)));
  for (int i = 0; i < points; ++i) {
    const double t = 2 * std::numbers::pi * i / points;
    out.push_back(circle.centre + circle.r * Point(std::cos(t), std::sin(t)));
  }
  return out;
}

double signed_area(std::span<const Point> contour) {
  double sum = 0;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    sum += contour[i].cross(contour[(i + 1) % contour.size()]);
  }
  return 0.5 * sum;
}

double mean_radius(std::span<const Point> contour) {
  return std::sqrt(std::abs(signed_area(contour)) / std::numbers::pi);
}

Point centroid(std::span<const Point> contour) {
  if (contour.empty()) {
    return {};
  }
  const Point o = contour.front();
  double area = 0;
  Point sum;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point p = contour[i] - o, q = contour[(i + 1) % contour.size()] - o;
    const double c = p.cross(q);
    area += c;
    sum += c * (p + q);
  }
  return std::abs(area) > 1e-9 ? o + sum / (3 * area) : o;
}

double distance_to(std::span<const Point> contour, const Point& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point a = contour[i], e = contour[(i + 1) % contour.size()] - a;
    const double l2 = e.dot(e);
    const double t = l2 > 0 ? std::clamp((p - a).dot(e) / l2, 0.0, 1.0) : 0;
    best = std::min(best, cv::norm(p - a - t * e));
  }
  return best;
}

std::optional<Circle> fit_circle(std::span<const Point> points, std::span<const double> weights) {
  std::vector<double> w(points.size(), 1.0);
  if (weights.size() == points.size()) {
    w.assign(weights.begin(), weights.end());
  }
  std::vector<double> base = w;
  Circle c;
  Point mean;
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    mean += base[i] * points[i];
    total += base[i];
  }
  if (!(total > 0)) {
    return std::nullopt;
  }
  mean *= 1 / total;
  for (int round = 0; round < 4; ++round) {
    // Kasa normal equations about the mean give the start; two Gauss-Newton steps make it geometric.
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
    const double det = cv::determinant(m);
    if (!(s1 > 0) || std::abs(det) < 1e-9 * std::pow(s1 + sxx + syy, 2)) {
      return std::nullopt;
    }
    const cv::Vec3d u = m.solve(cv::Vec3d(sxz, syz, sz), cv::DECOMP_LU);
    Point centre(u[0] / 2, u[1] / 2);
    double r2 = u[2] + centre.dot(centre);
    if (!(r2 > 0) || !std::isfinite(r2)) {
      return std::nullopt;
    }
    double r = std::sqrt(r2);
    for (int step = 0; step < 3; ++step) {
      cv::Matx33d a = cv::Matx33d::zeros();
      cv::Vec3d b(0, 0, 0);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Point d = points[i] - mean - centre;
        const double l = cv::norm(d);
        if (l < 1e-9) {
          continue;
        }
        const cv::Vec3d j(d.x / l, d.y / l, 1);
        a += w[i] * (j * j.t());
        b += w[i] * (l - r) * j;
      }
      const cv::Vec3d s = a.solve(b, cv::DECOMP_LU);
      if (!std::isfinite(s[0] + s[1] + s[2])) {
        break;
      }
      centre += Point(s[0], s[1]);
      r += s[2];
    }
    if (!std::isfinite(centre.x + centre.y + r) || r <= 0) {
      return std::nullopt;
    }
    c.centre = centre + mean;
    c.r = r;
    std::vector<double> e;
    double se = 0, sw = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double d = cv::norm(points[i] - c.centre) - r;
      if (base[i] > 0) {
        e.push_back(std::abs(d));
      }
      se += w[i] * d * d;
      sw += w[i];
    }
    c.rms = std::sqrt(se / std::max(sw, 1e-12));
    std::nth_element(e.begin(), e.begin() + static_cast<std::ptrdiff_t>(e.size() / 2), e.end());
    const double scale = std::max(1.4826 * e[e.size() / 2], 0.05);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double t = (cv::norm(points[i] - c.centre) - r) / (4.7 * scale);
      w[i] = std::abs(t) < 1 ? base[i] * std::pow(1 - t * t, 2) : 0;
    }
  }
  return c;
}

std::vector<double> polar_radii(std::span<const Point> contour, const Point& centre, int angles) {
  const std::size_t n = static_cast<std::size_t>(angles);
  std::vector<double> out(n, -1.0);
  const double step = 2 * std::numbers::pi / angles;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point p = contour[i] - centre, q = contour[(i + 1) % contour.size()] - centre;
    const double t0 = std::atan2(p.y, p.x);
    double dt = std::atan2(p.cross(q), p.dot(q));
    const double lo = std::min(t0, t0 + dt), hi = std::max(t0, t0 + dt);
    for (int k = static_cast<int>(std::ceil(lo / step - 1e-9)); k * step <= hi + 1e-9; ++k) {
      const Point d(std::cos(k * step), std::sin(k * step));
      const Point e = q - p;
      const double den = d.cross(e);
      if (std::abs(den) < 1e-12) {
        continue;
      }
      const double r = p.cross(e) / den;
      std::size_t at = static_cast<std::size_t>(((k % angles) + angles) % angles);
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
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const double t = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(radii.size());
    out.push_back(centre + radii[i] * Point(std::cos(t), std::sin(t)));
  }
  return out;
}

double polar_angle(int i, int angles) { return 2 * std::numbers::pi * i / angles; }

int polar_index(const Point& direction, int angles) {
  const double turns = std::atan2(direction.y, direction.x) / (2 * std::numbers::pi);
  return (static_cast<int>(std::lround(turns * angles)) + angles) % angles;
}

Point on_ray(const Point& centre, int i, int angles, double r) {
  const double t = polar_angle(i, angles);
  return centre + r * Point(std::cos(t), std::sin(t));
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::numbers::pi)); }

}  // namespace punctum::vision
