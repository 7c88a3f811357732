#include "vision/surface/membrane_net.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace punctum::vision {

namespace {

// How many times denser the control points lie in the dimple than far away.
constexpr double kDenser = 5;
constexpr std::size_t kFewest = 8;  // points of a contour

// Value and slope of the cubic through four places of a line.
Point cubic_through(const std::array<double, 4>& s, const std::array<Point, 4>& p, double at, Point* slope) {
  Point value;
  Point first;
  for (std::size_t i = 0; i < 4; ++i) {
    double product = 1, derivative = 0, below = 1;
    for (std::size_t j = 0; j < 4; ++j) {
      if (j != i) {
        derivative = derivative * (at - s[j]) + product;
        product *= at - s[j];
        below *= s[i] - s[j];
      }
    }
    value += product / below * p[i];
    first += derivative / below * p[i];
  }
  if (slope != nullptr) {
    *slope = first;
  }
  return value;
}

bool winds_once_about(const Point& c, std::span<const Point> closed) {
  int rising = 0;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const Point p = closed[i] - c, q = closed[(i + 1) % closed.size()] - c;
    if (!(p.cross(q) > 0)) {
      return false;
    }
    rising += p.y < 0 && q.y >= 0 ? 1 : 0;
  }
  return rising == 1;
}

bool pieces_cross(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
      std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y)) {
    return false;
  }
  const double c_side = (b - a).cross(c - a), d_side = (b - a).cross(d - a);
  const double a_side = (d - c).cross(a - c), b_side = (d - c).cross(b - c);
  return c_side * d_side <= 0 && a_side * b_side <= 0;
}

}  // namespace

bool is_simple(std::span<const Point> closed) {
  Point middle;
  for (const Point& p : closed) {
    middle += p;
  }
  middle *= 1.0 / static_cast<double>(std::max<std::size_t>(closed.size(), 1));
  if (winds_once_about(middle, closed)) {
    return true;
  }
  const std::size_t n = closed.size();
  for (std::size_t i = 0; i + 2 < n; ++i) {
    for (std::size_t j = i + 2; j < n - (i == 0 ? 1 : 0); ++j) {
      if (pieces_cross(closed[i], closed[i + 1], closed[j], closed[(j + 1) % n])) {
        return false;
      }
    }
  }
  return true;
}

const std::array<CirclePoint, kCirclePoints>& circle_points() {
  constexpr double kCorner = 0.5 * std::numbers::sqrt2;
  static constexpr std::array<CirclePoint, kCirclePoints> kPoints{{{1, 0, 1},
                                                                   {1, 1, kCorner},
                                                                   {0, 1, 1},
                                                                   {-1, 1, kCorner},
                                                                   {-1, 0, 1},
                                                                   {-1, -1, kCorner},
                                                                   {0, -1, 1},
                                                                   {1, -1, kCorner},
                                                                   {1, 0, 1}}};
  return kPoints;
}

Section weighted(const MembraneNet& net, int first, const std::array<double, 4>& weight) {
  const Section* control = &net.control[static_cast<std::size_t>(first)];
  return weight[0] * control[0] + weight[1] * control[1] + weight[2] * control[2] + weight[3] * control[3];
}

double dimple_reach(double wd, double c) { return wd > 0 ? 2 * (wd + c) : 0; }

// The inner knots and both ends are the parameters of the sections; with the slopes at both ends that is one
// equation for each control point. The first two and the last two are told by the ends alone.
NetFit::NetFit(int control_points) : control_points_(std::clamp(control_points, 8, MembraneNet::kLargest)) {
  const int sections = control_points_ - 2;
  for (int k = 0; k < sections; ++k) {
    rows_.push_back(cubic_basis(control_points_, static_cast<double>(k) / (sections - 1)));
  }
  const int checked = 2 * (sections - 1);
  for (int k = 0; k <= checked; ++k) {
    checked_at_.push_back(cubic_basis(control_points_, static_cast<double>(k) / checked));
  }
  // Row k has its three weights at the control points k, k + 1, k + 2.
  upper_.assign(static_cast<std::size_t>(sections), 0);
  pivot_.assign(static_cast<std::size_t>(sections), 0);
  for (std::size_t k = 1; k + 1 < rows_.size(); ++k) {
    const auto& w = rows_[k].value;
    pivot_[k] = w[1] - (k > 1 ? w[0] * upper_[k - 1] : 0);
    upper_[k] = w[2] / pivot_[k];
  }
  section_.resize(static_cast<std::size_t>(sections));
}

void NetFit::fit(std::span<const Point> contour, const Point& through, const Point& axis, double dimple,
                 MembraneNet& net) {
  net.ok = false;
  net.size = 0;
  net.reason = measure_contour(contour);
  if (!net.reason.empty()) {
    return;
  }
  if (!find_pole(through, axis)) {
    net.reason = "the axis does not meet the contour";
    return;
  }
  place_sections(dimple);
  interpolate(net);
  net.reason = check(net, axis);
  net.ok = net.reason.empty();
}

std::string_view NetFit::measure_contour(std::span<const Point> contour) {
  points_.clear();
  for (const Point& p : contour) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      return "a place of the contour is not a number";
    }
    if (points_.empty() || p != points_.back()) {
      points_.push_back(p);
    }
  }
  while (points_.size() > 1 && points_.front() == points_.back()) {
    points_.pop_back();
  }
  if (points_.size() < kFewest) {
    return "no contour";
  }
  if (signed_area(points_) < 0) {
    std::reverse(points_.begin(), points_.end());
  }
  length_.clear();
  double length = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    length_.push_back(length);
    const Point step = points_[(i + 1) % points_.size()] - points_[i];
    length += std::sqrt(step.dot(step));
  }
  length_.push_back(length);
  return {};
}

bool NetFit::find_pole(const Point& through, const Point& axis) {
  const std::size_t n = points_.size();
  bool found = false;
  double first = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Point p = points_[i] - through, q = points_[(i + 1) % n] - through;
    const double p_side = axis.cross(p), q_side = axis.cross(q);
    if (!((p_side <= 0 && q_side > 0) || (p_side >= 0 && q_side < 0))) {
      continue;
    }
    const double share = p_side / (p_side - q_side);
    const double along = axis.dot(p + share * (q - p));
    if (!found || along < first) {
      found = true;
      first = along;
      pole_ = length_[i] + share * (length_[i + 1] - length_[i]);
    }
  }
  return found;
}

// The contour at the distance s from its near pole, on the cubic through the four points nearest to it.
Point NetFit::at(double s, Point* tangent) const {
  const std::size_t n = points_.size();
  const double total = length_[n];
  double place = pole_ + s;
  place -= total * std::floor(place / total);
  const auto next = std::upper_bound(length_.begin() + 1, length_.end() - 1, place);
  const auto i = static_cast<std::size_t>(next - length_.begin()) - 1;
  std::array<double, 4> where{};
  std::array<Point, 4> p;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t j = (i + n + k - 1) % n;
    p[k] = points_[j];
    where[k] = length_[j];
  }
  where[0] -= i == 0 ? total : 0;
  where[2] += i + 1 >= n ? total : 0;
  where[3] += i + 2 >= n ? total : 0;
  return cubic_through(where, p, place, tangent);
}

// The sections lie at equal steps of s + (kDenser - 1) s / sqrt(1 + (s / dimple)^2): kDenser times denser at
// the near pole than far away, without a corner in between.
void NetFit::place_sections(double dimple) {
  const double half = 0.5 * length_.back();
  const double more = dimple > 0 ? kDenser - 1 : 0, reach = dimple > 0 ? dimple : 1;
  const auto steps_to = [&](double s) { return s + more * s / std::sqrt(1 + s * s / (reach * reach)); };
  const auto density = [&](double s) {
    const double q = 1 + s * s / (reach * reach);
    return 1 + more / (q * std::sqrt(q));
  };
  const double all = steps_to(half);
  const std::size_t last = section_.size() - 1;
  double s = 0;
  for (std::size_t k = 0; k <= last; ++k) {
    const double wanted = all * static_cast<double>(k) / static_cast<double>(last);
    // From the left Newton's method never steps over the place: the density falls with s.
    constexpr int kSteps = 20;
    for (int step = 0; step < kSteps && k < last; ++step) {
      const double missing = wanted - steps_to(s);
      if (!(missing > 1e-13 * all)) {
        break;
      }
      s += missing / density(s);
    }
    if (k == last) {
      s = half;
    }
    Point rising_tangent, falling_tangent;
    const Point rising = at(s, &rising_tangent), falling = at(-s, &falling_tangent);
    const Point middle = 0.5 * (rising + falling), radius = 0.5 * (rising - falling);
    Section& section = section_[k];
    section << middle.x, middle.y, radius.x, radius.y, std::sqrt(radius.dot(radius));
    if (k == 0 || k == last) {  // both halves meet: one place, one tangent
      const Point tangent = 0.5 * all / density(s) * (rising_tangent + falling_tangent);
      section.tail<3>().setZero();
      Section& slope = k == 0 ? first_slope_ : last_slope_;
      slope << 0, 0, tangent.x, tangent.y, (k == 0 ? 1 : -1) * std::sqrt(tangent.dot(tangent));
    }
  }
}

void NetFit::interpolate(MembraneNet& net) {
  const std::size_t n = static_cast<std::size_t>(control_points_), last = section_.size() - 1;
  const double end_knot = cubic_knot(control_points_, 4);
  auto& control = net.control;
  control[0] = section_[0];
  control[1] = section_[0] + end_knot / 3 * first_slope_;
  control[n - 1] = section_[last];
  control[n - 2] = section_[last] - end_knot / 3 * last_slope_;
  for (std::size_t k = 1; k < last; ++k) {
    const auto& w = rows_[k].value;
    Section rest = section_[k] - w[0] * control[k];
    if (k + 1 == last) {
      rest -= w[2] * control[n - 2];
    }
    control[k + 1] = rest / pivot_[k];
  }
  for (std::size_t k = last - 1; k-- > 1;) {
    control[k + 1] -= upper_[k] * control[k + 2];
  }
  net.size = control_points_;
}

// The surface crosses itself where its outline in the picture does, or its profile in depth.
std::string_view NetFit::check(const MembraneNet& net, const Point& axis) {
  const std::size_t last = checked_at_.size() - 1;
  checked_.clear();
  for (const CubicBasis& place : checked_at_) {
    checked_.push_back(weighted(net, place.first, place.value));
  }
  outline_.clear();
  profile_.clear();
  for (std::size_t k = 0; k <= last; ++k) {
    const Section& c = checked_[k];
    if (k > 0 && k < last && !(c[4] > 0)) {
      return "the contour crosses its axis";
    }
    outline_.emplace_back(c[0] + c[2], c[1] + c[3]);
    profile_.emplace_back(axis.x * c[0] + axis.y * c[1], -c[4]);
  }
  for (std::size_t k = last; k-- > 1;) {
    const Section& c = checked_[k];
    outline_.emplace_back(c[0] - c[2], c[1] - c[3]);
    profile_.emplace_back(profile_[k].x, c[4]);
  }
  if (!is_simple(outline_)) {
    return "the contour crosses itself";
  }
  if (!is_simple(profile_)) {
    return "the surface crosses itself";
  }
  return {};
}

}  // namespace punctum::vision
