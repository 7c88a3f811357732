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
  std::vector<double> us, depths;
};

// Medians in bins.
SideProfile profile_on_side(const std::vector<ProfilePoint>& profile, double side, double from,
                            double reach) {
  constexpr int kBins = 40;
  std::array<std::vector<double>, kBins> bin;
  for (const ProfilePoint& p : profile) {
    const double u = side * p.u;
    if (u > from && u < reach) {
      bin[static_cast<std::size_t>(u / reach * kBins)].push_back(p.depth);
    }
  }
  SideProfile out;
  for (int i = 0; i < kBins; ++i) {
    auto& b = bin[static_cast<std::size_t>(i)];
    if (!b.empty()) {
      out.us.push_back((i + 0.5) * reach / kBins);
      out.depths.push_back(median_of(std::move(b)));
    }
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

}  // namespace

std::vector<ProfilePoint> depth_profile(const Contour& contour, const Contour& shape, const Point& entry,
                                        const Point& axis, double reach) {
  std::vector<ProfilePoint> out;
  for (const Point& p : contour) {
    const double u = axis.cross(p - entry);
    const double s = (p - entry).dot(axis);
    if (std::abs(u) > reach || s > reach) {  // the far side has the same u
      continue;
    }
    const auto q = entry_point(shape, p, axis);
    if (q) {
      out.push_back({u, (p - *q).dot(axis)});
    }
  }
  std::sort(out.begin(), out.end(), [](const ProfilePoint& l, const ProfilePoint& r) { return l.u < r.u; });
  return out;
}

std::optional<HalfWidth> half_width(const std::vector<ProfilePoint>& profile, double wd, double c, double R,
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
  std::vector<ProfilePoint> seen = depth_profile(contour, undeformed.shape, entry, normal, kReach * R);
  std::erase_if(seen, [c](const ProfilePoint& p) { return !(std::abs(p.u) > c + kNeedleMargin_px); });
  return half_width(seen, wd, c, R, depth_sd);
}

}  // namespace punctum::vision
