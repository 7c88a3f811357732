// Geometry of the indentation: undeformed membrane, entry point, gap, w_d, a, R (fig. 11).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "vision/contour.hpp"

namespace punctum::vision {

// The membrane as it was, or would be, without needle.
struct Undeformed {
  Circle circle;      // fitted to the undeformed part
  bool round = true;  // the circle describes it; else `shape`, a low-order closed curve, does
  Contour shape;      // closed contour of it
};

// Fits it to the contour's points with weight > 0 (weight 0: dimple, arcs hidden or pressed by a pipette).
[[nodiscard]] std::optional<Undeformed> fit_undeformed(const Contour& contour,
                                                       std::span<const double> weights);

// Where the line through `through` along `axis` first meets the closed contour.
[[nodiscard]] std::optional<Point> entry_point(const Contour& shape, const Point& through, const Point& axis);

// Depth of `contour` past `shape` along `axis` at signed lateral distance u from the line through `entry`.
struct ProfilePoint {
  double u = 0;
  double depth = 0;
};
[[nodiscard]] std::vector<ProfilePoint> depth_profile(const Contour& contour, const Contour& shape,
                                                      const Point& entry, const Point& axis, double reach);

// a: half-width at which the depth has fallen to 1 % of wd, mean of both sides; c: the needle's radius, R:
// the cell's.
[[nodiscard]] std::optional<double> half_width(const std::vector<ProfilePoint>& profile, double wd, double c,
                                               double R);

// The same from the contour: about the membrane's own normal at the entry, for a needle off the middle is not
// the axis of its dimple.
[[nodiscard]] std::optional<double> dimple_half_width(const Contour& contour, const Undeformed& undeformed,
                                                      const Point& entry, double wd, double c);

}  // namespace punctum::vision
