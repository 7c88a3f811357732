#include "tools/report/polyline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace punctum::report {
namespace {

constexpr std::size_t kRun = 16;  // pieces

double squared_distance(const Point2& p, const Point2& a, const Point2& b) {
  const double dx = b[0] - a[0], dy = b[1] - a[1], px = p[0] - a[0], py = p[1] - a[1];
  const double length2 = dx * dx + dy * dy;
  const double t = length2 > 0 ? std::clamp((px * dx + py * dy) / length2, 0.0, 1.0) : 0.0;
  const double ex = px - t * dx, ey = py - t * dy;
  return ex * ex + ey * ey;
}

}  // namespace

Polyline::Polyline(std::vector<Point2> points, bool closed) : points_(std::move(points)) {
  if (points_.size() < 2) throw std::invalid_argument("a line needs two points");
  if (closed) points_.push_back(points_.front());
  for (std::size_t from = 0; from + 1 < points_.size(); from += kRun) {
    Run run{from, std::min(from + kRun, points_.size() - 1), {}, 0};
    const Point2 &a = points_[run.from], &b = points_[run.to];
    run.centre = {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])};
    for (std::size_t i = run.from; i <= run.to; ++i) {
      run.radius =
          std::max(run.radius, std::hypot(points_[i][0] - run.centre[0], points_[i][1] - run.centre[1]));
    }
    runs_.push_back(run);
  }
}

double Polyline::distance(const Point2& p) const {
  // Nothing of a run is nearer than the rim of its circle; the run that can be nearest goes first.
  const auto least = [&p](const Run& run) {
    return std::hypot(p[0] - run.centre[0], p[1] - run.centre[1]) - run.radius;
  };
  double best2 = std::numeric_limits<double>::infinity();
  const auto look = [&](const Run& run) {
    for (std::size_t i = run.from; i < run.to; ++i) {
      best2 = std::min(best2, squared_distance(p, points_[i], points_[i + 1]));
    }
  };
  const auto first = std::min_element(runs_.begin(), runs_.end(),
                                      [&](const Run& l, const Run& r) { return least(l) < least(r); });
  look(*first);
  for (auto run = runs_.begin(); run != runs_.end(); ++run) {
    const double nearest = least(*run);
    if (run != first && (nearest <= 0 || nearest * nearest < best2)) look(*run);
  }
  return std::sqrt(best2);
}

}  // namespace punctum::report
