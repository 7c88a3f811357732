#include "vision/image/spline.hpp"

#include <algorithm>
#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>

namespace punctum::vision {

namespace {

// Second derivatives of the periodic cubic spline with knot spacing h through y: cyclic tridiagonal system,
// solved by the Sherman-Morrison correction of the Thomas algorithm.
Vector<double> second_derivatives(const Vector<double>& y, const Vector<double>& h) {
  const std::size_t n = y.size();
  Vector<double> a(n), b(n), c(n), d(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t p = (i + n - 1) % n, q = (i + 1) % n;
    a[i] = h[p];
    b[i] = 2 * (h[p] + h[i]);
    c[i] = h[i];
    d[i] = 6 * ((y[q] - y[i]) / h[i] - (y[i] - y[p]) / h[p]);
  }
  const double gamma = -b[0];
  Vector<double> bb = b, u(n, 0.0);
  bb[0] = b[0] - gamma;
  bb[n - 1] = b[n - 1] - a[0] * c[n - 1] / gamma;
  u[0] = gamma;
  u[n - 1] = c[n - 1];
  const auto solve = [&](Vector<double> r) {
    Vector<double> cp(n);
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
  Vector<double> x = solve(d);
  const Vector<double> z = solve(u);
  const double f = (x[0] + x[n - 1] * a[0] / gamma) / (1 + z[0] + z[n - 1] * a[0] / gamma);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] -= f * z[i];
  }
  return x;
}

// The nodes without those that repeat the one before.
Contour different_nodes(std::span<const Point> nodes) {
  Contour out;
  out.reserve(nodes.size());
  for (const Point& p : nodes) {
    if (out.empty() || cv::norm(p - out.back()) > 1e-9) {
      out.push_back(p);
    }
  }
  while (out.size() > 1 && cv::norm(out.front() - out.back()) <= 1e-9) {
    out.pop_back();
  }
  return out;
}

class PeriodicSpline {
 public:
  explicit PeriodicSpline(const Contour& nodes) : h_(nodes.size()), x_(nodes.size()), y_(nodes.size()) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      h_[i] = cv::norm(nodes[(i + 1) % nodes.size()] - nodes[i]);
      x_[i] = nodes[i].x;
      y_[i] = nodes[i].y;
    }
    mx_ = second_derivatives(x_, h_);
    my_ = second_derivatives(y_, h_);
  }
  [[nodiscard]] std::size_t segments() const { return h_.size(); }
  [[nodiscard]] Point at(std::size_t i, double t) const {  // t in 0 .. 1 of segment i
    const std::size_t q = (i + 1) % h_.size();
    const double s = 1 - t, k = h_[i] * h_[i] / 6;
    return {s * x_[i] + t * x_[q] + k * ((s * s * s - s) * mx_[i] + (t * t * t - t) * mx_[q]),
            s * y_[i] + t * y_[q] + k * ((s * s * s - s) * my_[i] + (t * t * t - t) * my_[q])};
  }

 private:
  Vector<double> h_, x_, y_, mx_, my_;
};

}  // namespace

Contour spline_through(std::span<const Point> nodes, int points) {
  const Contour different = different_nodes(nodes);
  if (different.size() < 3 || points < 3) {
    return {};
  }
  const PeriodicSpline spline(different);
  const std::size_t n = spline.segments();
  // The length is measured along a dense polygon.
  const int per_segment = std::max(8, 4 * points / static_cast<int>(n));
  Vector<Point> dense;
  dense.reserve(n * static_cast<std::size_t>(per_segment) + 1);
  for (std::size_t i = 0; i < n; ++i) {
    for (int j = 0; j < per_segment; ++j) {
      dense.push_back(spline.at(i, static_cast<double>(j) / per_segment));
    }
  }
  dense.push_back(dense.front());
  Vector<double> length(dense.size(), 0.0);
  for (std::size_t i = 1; i < dense.size(); ++i) {
    length[i] = length[i - 1] + cv::norm(dense[i] - dense[i - 1]);
  }
  Contour out;
  out.reserve(static_cast<std::size_t>(points));
  std::size_t k = 0;
  for (int j = 0; j < points; ++j) {
    const double wanted = length.back() * j / points;
    while (k + 2 < length.size() && length[k + 1] < wanted) {
      ++k;
    }
    const double step = length[k + 1] - length[k];
    const double t = step > 0 ? (wanted - length[k]) / step : 0;
    // The point lies on the spline itself, not on the chord between two dense points.
    const double along = static_cast<double>(k) + t;
    const std::size_t i = std::min(n - 1, static_cast<std::size_t>(along / per_segment));
    out.push_back(spline.at(i, std::clamp(along / per_segment - static_cast<double>(i), 0.0, 1.0)));
  }
  return out;
}

}  // namespace punctum::vision
