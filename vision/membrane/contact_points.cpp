#include "vision/membrane/contact_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vision/image/parabola.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr double kBesideNeedle_px = 2.5;  // the blur of the needle's edge reaches less far
constexpr double kAlongStep_px = 0.5;
constexpr double kBefore_px = 8;    // outside the last contour; a frame moves the membrane by less
constexpr double kDeepest = 0.4;    // of the cell's radius, inside the last contour: no dimple is deeper
constexpr double kClearEdge = 0.5;  // of the usual edge

// Distance behind the tip of the first edge on the line beside one edge of the needle.
std::optional<double> first_edge(const GradientField& field, const NeedlePose& needle, double side,
                                 double from, double to, double clear) {
  double last = 0, here = 0;
  for (double s = from; s >= to; s -= kAlongStep_px) {
    const Point p = needle.at(s, side * (needle.half_width_at(s) + kBesideNeedle_px));
    const double next = std::abs(field.gradient(p).dot(needle.axis));
    if (here > clear && here >= last && here > next) {
      return s + (1 - vertex_offset(last, here, next)) * kAlongStep_px;
    }
    last = here;
    here = next;
  }
  return std::nullopt;
}

}  // namespace

ContactPoints contact_points(const ClearedPicture& picture, const NeedlePose& needle, const Contour& contour,
                             double level) {
  ContactPoints out;
  const Point across(-needle.axis.y, needle.axis.x);
  const double clear = std::max(picture.edge_floor(), kClearEdge * level);
  for (std::size_t k = 0; k < 2; ++k) {
    const double side = k == 0 ? -1 : 1;
    const auto crossing = entry_point(
        contour, needle.tip + side * (needle.half_width + kBesideNeedle_px) * across, needle.axis);
    if (!crossing) {
      continue;
    }
    const double last = -(*crossing - needle.tip).dot(needle.axis);
    const auto s = first_edge(picture.field, needle, side, last + kBefore_px,
                              last - kDeepest * mean_radius(contour), clear);
    if (s) {
      out.behind_tip[k] = *s;
      out.point[k] = needle.at(*s, side * (needle.half_width_at(*s) + kBesideNeedle_px));
    }
  }
  return out;
}

}  // namespace punctum::vision
