#include "vision/membrane/membrane_on_needle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "vision/image/parabola.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr double kBesideEdge_px = 2.5;     // outside the needle's edge; the needle's blur reaches less far
constexpr double kContourReach_px = 5;     // a contact point lies so near the contour
constexpr double kDistancePenalty = 0.05;  // of the floor per px from the contour

// Grey levels per px along the needle's axis; > 0 for the outer face of a membrane of that polarity.
double face_strength(double along_axis, Polarity polarity) {
  return polarity == Polarity::any            ? std::abs(along_axis)
         : polarity == Polarity::brighter_out ? -along_axis
                                              : along_axis;
}

// Distance behind the tip of the strongest change of grey on a line beside the needle's edge, near
// `expected`. side: -1 or 1.
std::optional<double> contact_beside_edge(const GradientField& field, const NeedlePose& needle,
                                          Polarity polarity, double floor, double side, double expected) {
  constexpr double kStep_px = 0.5;
  std::vector<double> g, at;
  for (double s = expected + kContourReach_px; s >= expected - kContourReach_px; s -= kStep_px) {
    const Point p = needle.at(s, side * (needle.half_width_at(s) + kBesideEdge_px));
    if (!field.area.contains(cv::Point(static_cast<int>(p.x), static_cast<int>(p.y)))) {
      continue;
    }
    g.push_back(face_strength(field.gradient(p).dot(needle.axis), polarity));
    at.push_back(s);
  }
  const auto merit = [&](std::size_t i) {
    return g[i] - kDistancePenalty * floor * std::abs(at[i] - expected);
  };
  std::optional<std::size_t> best;
  for (std::size_t i = 1; i + 1 < g.size(); ++i) {
    if (g[i] > floor && g[i] >= g[i - 1] && g[i] >= g[i + 1] && (!best || merit(i) > merit(*best))) {
      best = i;
    }
  }
  if (!best) {
    return std::nullopt;
  }
  return at[*best] - vertex_offset(g[*best - 1], g[*best], g[*best + 1]) * kStep_px;
}

}  // namespace

MembraneOnNeedle membrane_on_needle(const ClearedPicture& picture, const NeedlePose& needle,
                                    const Contour& outer, Polarity polarity, double level) {
  MembraneOnNeedle out;
  const Point across(-needle.axis.y, needle.axis.x);
  const double floor = std::max(picture.edge_floor(), 0.3 * level);
  double sum = 0;
  int sides = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double side = k == 0 ? -1 : 1;
    const double u = side * (needle.half_width + kBesideEdge_px);
    const auto crossing = entry_point(outer, needle.tip + u * across, needle.axis);
    if (!crossing) {
      continue;
    }
    const double expected = -(*crossing - needle.tip).dot(needle.axis);
    const auto contact = contact_beside_edge(picture.field, needle, polarity, floor, side, expected);
    if (contact) {
      out.points.behind_tip[k] = *contact;
      out.points.point[k] = needle.at(*contact, side * needle.half_width_at(*contact));
    }
    sum += contact.value_or(expected);
    ++sides;
  }
  if (sides > 0) {
    out.behind_tip = sum / sides;
  }
  return out;
}

double membrane_ahead_of_tip(const GradientField& field, const NeedlePose& needle, Polarity polarity,
                             double level) {
  constexpr double kStep_px = 0.25, kBehind_px = 2.0, kAhead_px = 3.5;
  std::vector<double> e;
  for (double s = -kBehind_px; s <= kAhead_px; s += kStep_px) {
    double sum = 0;
    for (const double u : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
      sum +=
          face_strength(field.gradient(needle.at(-s, u * needle.half_width)).dot(needle.axis) / 5, polarity);
    }
    e.push_back(sum);
  }
  const auto top = std::max_element(e.begin() + 1, e.end() - 1);
  const std::size_t i = static_cast<std::size_t>(top - e.begin());
  if (*top < 0.35 * level || *top < e[i - 1] || *top < e[i + 1]) {
    return 0;
  }
  return -kBehind_px + (static_cast<double>(i) + vertex_offset(e[i - 1], *top, e[i + 1])) * kStep_px;
}

}  // namespace punctum::vision
