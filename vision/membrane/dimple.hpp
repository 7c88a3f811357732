// Geometry of the indentation (fig. 11): depth of the membrane beside the needle, and the half-width a.
#pragma once

#include <optional>

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

// Depth of the contour past the undeformed shape, at the signed lateral distance u from the line through the
// entry point.
struct ProfilePoint {
  double u = 0;
  double depth = 0;
};
[[nodiscard]] Vector<ProfilePoint> depth_profile(const Contour& contour, const Contour& shape,
                                                 const Point& entry, const Point& axis, double reach);

struct HalfWidth {
  double a = 0;
  double sd = 0;  // half of what the width changes by when the profile is deeper or flatter by its deviation
};
// a: the half-width at which the depth has fallen to 1 % of w_d, mean of both sides. c: radius of the needle,
// R: radius of the cell. depth_sd: standard deviation of the profile. Empty when the depth falls so far on
// neither side.
[[nodiscard]] std::optional<HalfWidth> half_width(const Vector<ProfilePoint>& profile, double wd, double c,
                                                  double R, double depth_sd);

// The same from the contour, about the membrane's own normal at the entry: the axis of a needle that enters
// off the middle is not the axis of the dimple.
[[nodiscard]] std::optional<HalfWidth> dimple_half_width(const Contour& contour, const Undeformed& undeformed,
                                                         const Point& entry, double wd, double c,
                                                         double depth_sd);

}  // namespace punctum::vision
