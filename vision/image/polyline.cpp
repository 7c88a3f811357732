#include "vision/image/polyline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <utility>

namespace punctum::vision {

namespace {

constexpr std::size_t kPiecesPerRun = 16;

double squared_distance(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a, to_p = p - a;
  const double length2 = d.dot(d);
  const double t = length2 > 0 ? std::clamp(to_p.dot(d) / length2, 0.0, 1.0) : 0.0;
  const Point e = to_p - t * d;
  return e.dot(e);
}

}  // namespace

Polyline::Polyline(Vector<Point> points, bool closed) : points_(std::move(points)) {
  if (points_.size() < 2) {
    throw std::invalid_argument("a line needs two points");
  }
  if (closed) {
    points_.push_back(points_.front());
  }
  for (std::size_t from = 0; from + 1 < points_.size(); from += kPiecesPerRun) {
    Run run{from, std::min(from + kPiecesPerRun, points_.size() - 1), {}, 0};
    run.centre = 0.5 * (points_[run.from] + points_[run.to]);
    for (std::size_t i = run.from; i <= run.to; ++i) {
      run.radius = std::max(run.radius, cv::norm(points_[i] - run.centre));
    }
    runs_.push_back(run);
  }
}

double Polyline::distance(const Point& p) const {
  // Nothing of a run is nearer than its circle. The run that may be nearest is searched first; most of the
  // others are then known to be further away.
  const auto least = [&p](const Run& run) { return cv::norm(p - run.centre) - run.radius; };
  double best2 = std::numeric_limits<double>::infinity();
  const auto search = [&](const Run& run) {
    for (std::size_t i = run.from; i < run.to; ++i) {
      best2 = std::min(best2, squared_distance(p, points_[i], points_[i + 1]));
    }
  };
  const auto first = std::min_element(runs_.begin(), runs_.end(),
                                      [&](const Run& l, const Run& r) { return least(l) < least(r); });
  search(*first);
  for (auto run = runs_.begin(); run != runs_.end(); ++run) {
    const double nearest = least(*run);
    if (run != first && (nearest <= 0 || nearest * nearest < best2)) {
      search(*run);
    }
  }
  return std::sqrt(best2);
}

}  // namespace punctum::vision
