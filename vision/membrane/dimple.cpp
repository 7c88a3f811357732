#include "vision/membrane/dimple.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

constexpr double kLevel = 0.01;           // of w_d: the depth at the half-width a
constexpr double kReach = 0.995;          // of R: beyond it the depth cannot be measured
constexpr double kNeedleMargin_px = 2.5;  // within it beside the needle's edge the contour is uncertain

// Depth over the lateral distance, outwards from the needle on one side.
struct SideProfile {
  Vector<double> us, depths;
};

// Medians in bins.
SideProfile profile_on_side(const Vector<ProfilePoint>& profile, double side, double from, double reach) {
  constexpr int kBins = 40;
  Vector<std::pair<int, double>> in_bins;
  in_bins.reserve(profile.size());
  for (const ProfilePoint& p : profile) {
    const double u = side * p.u;
    if (u > from && u < reach) {
      in_bins.emplace_back(static_cast<int>(u / reach * kBins), p.depth);
    }
  }
  std::sort(in_bins.begin(), in_bins.end());
  SideProfile out;
  out.us.reserve(kBins);
  out.depths.reserve(kBins);
  for (auto first = in_bins.begin(), last = first; first != in_bins.end(); first = last) {
    last = std::find_if(first, in_bins.end(), [first](const auto& p) { return p.first != first->first; });
    out.us.push_back((first->first + 0.5) * reach / kBins);
    out.depths.push_back((first + (last - first) / 2)->second);
  }
  return out;
}

// Where the depth falls below `level`.
std::optional<double> width_at(const SideProfile& side, double level) {
  const auto& [us, depths] = side;
  for (std::size_t i = 1; i < us.size(); ++i) {
    if (depths[i] < level && depths[i - 1] >= level) {
      return us[i - 1] + (us[i] - us[i - 1]) * (depths[i - 1] - level) / (depths[i - 1] - depths[i]);
    }
  }
  return std::nullopt;
}

// Of a closed curve: across the axis, and along it.
struct Place {
  double u, s;
};

// Where along the axis a curve is met first, by a line along it at u.
std::optional<double> first_crossing(const Vector<Place>& curve, double u) {
  std::optional<double> first;
  const Place* p = curve.empty() ? nullptr : &curve.back();
  for (const Place& q : curve) {
    if ((p->u > u) != (q.u > u)) {
      const double s = p->s + (u - p->u) / (q.u - p->u) * (q.s - p->s);
      first = first ? std::min(*first, s) : s;
    }
    p = &q;
  }
  return first;
}

}  // namespace

Vector<ProfilePoint> depth_profile(const Contour& contour, const Contour& shape, const Point& entry,
                                   const Point& axis, double reach) {
  Vector<ProfilePoint> out;
  Vector<Place> places(shape.size());
  std::transform(shape.begin(), shape.end(), places.begin(),
                 [&](const Point& p) { return Place{axis.cross(p - entry), (p - entry).dot(axis)}; });
  for (const Point& p : contour) {
    const double u = axis.cross(p - entry);
    const double s = (p - entry).dot(axis);
    if (std::abs(u) > reach || s > reach) {  // the far side has the same u
      continue;
    }
    if (const auto first = first_crossing(places, u)) {
      out.push_back({u, s - *first});
    }
  }
  std::sort(out.begin(), out.end(), [](const ProfilePoint& l, const ProfilePoint& r) { return l.u < r.u; });
  return out;
}

std::optional<HalfWidth> half_width(const Vector<ProfilePoint>& profile, double wd, double c, double R,
                                    double depth_sd) {
  if (!(wd > 0) || !(c > 0) || !(R > 2 * c)) {
    return std::nullopt;
  }
  HalfWidth out;
  double variance = 0;
  int sides = 0;
  for (const double sign : {-1.0, 1.0}) {
    const SideProfile side = profile_on_side(profile, sign, 1.2 * c, kReach * R);
    if (const auto width = width_at(side, kLevel * wd)) {
      const double shortest = width_at(side, kLevel * wd + depth_sd).value_or(1.2 * c);
      const double longest = width_at(side, kLevel * wd - depth_sd).value_or(kReach * R);
      out.a += *width;
      variance += (longest - shortest) * (longest - shortest) / 4;
      ++sides;
    }
  }
  if (sides == 0) {
    return std::nullopt;
  }
  out.a /= sides;
  out.sd = std::sqrt(variance) / sides;
  return out;
}

std::optional<HalfWidth> dimple_half_width(const Contour& contour, const Undeformed& undeformed,
                                           const Point& entry, double wd, double c, double depth_sd) {
  const double R = undeformed.circle.r;
  Point normal = undeformed.circle.centre - entry;
  normal *= 1 / std::max(cv::norm(normal), 1e-9);
  Vector<ProfilePoint> seen = depth_profile(contour, undeformed.shape, entry, normal, kReach * R);
  std::erase_if(seen, [c](const ProfilePoint& p) { return !(std::abs(p.u) > c + kNeedleMargin_px); });
  return half_width(seen, wd, c, R, depth_sd);
}

}  // namespace punctum::vision
