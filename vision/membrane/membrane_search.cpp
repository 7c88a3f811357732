#include "vision/membrane/membrane_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/dimple_seen.hpp"

namespace punctum::vision {

namespace {

constexpr double kSaturation = 0.7;  // times the usual edge: a stronger one is not better
constexpr double kTouching_px = 1;   // a tip that is deeper pushes the membrane, or is through it
constexpr double kStep_px = 0.75, kFineStep_px = 0.5;  // between samples of a clear edge, of a faint one
constexpr double kClearEdge = 5;                       // times the noise of the gradient
constexpr double kDimpleStep_px = 1;                   // between the depths of a dimple that are tried
constexpr double kFreeHalf_px = 7;  // a free membrane is looked for so near to its outline at rest

}  // namespace

MembraneSearch::MembraneSearch(const FollowedMembrane& followed, const ClearedPicture& cleared,
                               const Surroundings& s)
    : m(followed),
      picture(cleared),
      surroundings(s),
      angles(static_cast<int>(m.r.size())),
      usual_r(median_of(m.r)),
      saturation(kSaturation * m.level) {
  band.centre = m.centre;
  band.middle = m.r;
  band.half_width = std::clamp(0.11 * usual_r, 6.0, 14.0);
  band.step = m.level > kClearEdge * picture.gradient_noise ? kStep_px : kFineStep_px;
  band.slope = 1.0;
  band.covered = picture.covered;
  band.relief = m.relief;
  rest = m.rest.seen_from(band.centre);
  keep_membranes_apart();

  Vector<double> expected = m.r;
  if (s.outermost && s.undeformed && s.undeformed->round) {
    // A contour that has slipped inwards along the holding pipette comes back.
    const Vector<double> free = polar_radii(s.undeformed->shape, band.centre, angles);
    for (std::size_t i = 0; i < free.size(); ++i) {
      expected[i] = std::max(expected[i], free[i]);
    }
  }
  picture.exclude_holder(band, expected, m.polarity == Polarity::relief);
  if (!s.outermost) {  // the glass is at least a wall away
    band.seen_to.clear();
  }

  if (s.needle.ok) {
    const Point tip = s.needle.point() - band.centre;
    const auto entry = entry_point(m.contour(), s.needle.point(), s.needle.axis);
    const Point towards = entry ? *entry - band.centre : -s.needle.axis;
    needle = {math::atan2(towards.y, towards.x), polar_index(tip, angles), cv::norm(tip)};
    if (!rest.empty()) {
      limit_depth_to_tip();
    }
  }
}

void MembraneSearch::keep_membranes_apart() {
  const FollowedMembrane *around = surroundings.around, *within = surroundings.within;
  if (around && around->known) {
    const double usual_gap = std::max(0.0, mean_radius(around->contour()) - mean_radius(m.contour()));
    band.upper = polar_radii(around->contour(), band.centre, angles);
    for (double& r : band.upper) {
      r -= std::max(2.0, 0.5 * usual_gap);
    }
  }
  if (within && within->known) {
    const double usual_gap = std::max(0.0, mean_radius(m.contour()) - mean_radius(within->contour()));
    band.lower = polar_radii(within->contour(), band.centre, angles);
    double by_needle = -4;
    if (m.polarity == Polarity::relief) {  // an ooplasm may be five times as clear as its zona
      constexpr double kMayMove_px = 1;
      const double moved = std::max(surroundings.expected_px, 0.0) + kMayMove_px;
      by_needle = std::max(by_needle, std::min(surroundings.least_wall_px(), usual_gap) - moved);
    }
    double tip_angle = 0;
    if (surroundings.last_tip) {
      const Point tip = *surroundings.last_tip - band.centre;
      tip_angle = math::atan2(tip.y, tip.x);
    }
    for (std::size_t k = 0; k < band.lower.size(); ++k) {
      // The inner membrane was there one frame ago; near the needle it may have moved since.
      const bool near =
          surroundings.last_tip && angle_between(polar_angle(static_cast<int>(k), angles), tip_angle) < 0.5;
      band.lower[k] += near ? by_needle : std::max(2.5, 0.35 * usual_gap);
    }
  }
}

// The membrane is not pushed in further than the tip has come.
void MembraneSearch::limit_depth_to_tip() {
  constexpr double kMargin_px = 6;
  const Point tip = surroundings.needle.point() - band.centre;
  const double depth = tip.dot(surroundings.needle.axis) < 0
                           ? std::max(0.0, rest[static_cast<std::size_t>(needle->tip_index)] - needle->tip_r)
                           : 0;
  if (band.lower.empty()) {
    band.lower.assign(m.r.size(), 0.0);
  }
  for (std::size_t k = 0; k < band.lower.size(); ++k) {
    band.lower[k] = std::max(band.lower[k], rest[k] - depth - kMargin_px);
  }
}

// For a membrane that is back at its rest outline.
EdgePath MembraneSearch::path_free() const {
  EdgeBand free = band;
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double weight = std::clamp((1.1 - from_needle(i)) / 0.3, 0.0, 1.0);
    free.middle[k] += weight * (rest[k] - free.middle[k]);
  }
  free.half_width = std::min(band.half_width, kFreeHalf_px);
  return path_in(free);
}

// The membrane lies flat against the end face of the needle; a pierced one reaches to the tip at most.
Vector<std::pair<int, double>> MembraneSearch::end_face() const {
  const NeedlePose& n = surroundings.needle;
  const double ahead = (n.tip - band.centre).dot(n.axis);
  Vector<std::pair<int, double>> face;
  for (int i = 0; i < angles && ahead < 0 && !surroundings.punctured; ++i) {
    const Point ray = on_ray(Point(0, 0), i, angles, 1);
    const double towards = ray.dot(n.axis);
    if (towards < -0.5 &&
        std::abs((ahead / towards * ray + band.centre - n.tip).cross(n.axis)) < n.half_width) {
      face.emplace_back(i, ahead / towards + m.path_outside_px);
    }
  }
  if (face.empty()) {
    face.emplace_back(needle->tip_index, needle->tip_r + m.path_outside_px);
  }
  return face;
}

// For a membrane that lies on the tip: the dimple moves with the needle.
EdgePath MembraneSearch::path_pushed() const {
  EdgeBand pushed = band;
  const int tip = needle->tip_index;
  const double move = needle->tip_r + m.path_outside_px - pushed.middle[static_cast<std::size_t>(tip)];
  const double dimple_px = std::max(4.0, 2.0 * surroundings.needle.half_width);
  for (int i = 0; i < angles; ++i) {
    const double u = angle_between(polar_angle(i, angles), polar_angle(tip, angles)) * usual_r / dimple_px;
    pushed.middle[static_cast<std::size_t>(i)] += move / (1 + u * u);
  }
  pushed.anchors = end_face();
  pushed.slope = 3;
  pushed.stiffness = 0.1;
  return path_in(pushed);
}

double MembraneSearch::depth_of_tip() const {
  return rest[static_cast<std::size_t>(needle->tip_index)] - m.path_outside_px - needle->tip_r;
}

namespace {

// The needle hides the bottom of a dimple that is not on its tip.
void anchor_under_needle(const MembraneSearch& s, const SeenDimple& dimple, EdgeBand& band) {
  constexpr double kShallow_px = 2;  // it hardly differs from the outline at rest
  if (dimple.depth > kShallow_px) {
    const int i = s.needle->tip_index;
    band.anchors = {{i, band.middle[static_cast<std::size_t>(i)]}};
  }
}

EdgeFound outer_pushed_or_free(const MembraneSearch& s) {
  const auto dimple = likeliest_dimple(s);
  EdgeFound found;
  found.dimple_odds = dimple ? dimple->odds : s.m.dimple_odds;
  found.dimple_px = dimple ? dimple->depth : s.m.dimple_px;
  if (!s.surroundings.punctured && (!dimple || dimple->on_tip)) {
    if (dimple) {
      EdgeBand band = band_along(s, *dimple);
      band.anchors = s.end_face();
      if (s.m.polarity == Polarity::relief) {
        const double off = s.depth_of_tip() - dimple->depth,
                     short_of_tip = off < -kDimpleStep_px ? off : std::max(off, 0.0);
        const bool sharp = s.surroundings.needle.point_aside != 0;
        for (auto& [i, r] : band.anchors) {
          r = sharp ? band.middle[static_cast<std::size_t>(i)] : r + short_of_tip;
        }
      }
      band.slope = 1.5;
      band.stiffness = 0.15;
      found.path = s.path_in(band);
    } else {
      found.path = s.path_pushed();
    }
    if (!found.path.r.empty()) {
      return found;
    }
  }
  if (!dimple) {
    found.path = s.path_in(s.band);
    found.held = s.m.held;
    return found;
  }
  EdgeBand band = band_along(s, *dimple);
  anchor_under_needle(s, *dimple, band);
  found.path = s.path_in(band);
  found.is_free = true;
  found.held = false;
  return found;
}

EdgeFound inner_pushed_or_free(const MembraneSearch& s) {
  EdgeFound found;
  found.held = s.m.held;
  if (const auto dimple = likeliest_dimple(s)) {
    EdgeBand band = band_along(s, *dimple);
    anchor_under_needle(s, *dimple, band);
    found.path = s.path_in(band);
    found.is_free = s.surroundings.punctured && !dimple->on_tip;
    found.held = !found.is_free || s.depth_of_tip() < kTouching_px;
    found.dimple_px = dimple->depth;
    found.dimple_odds = dimple->odds;
    return found;
  }
  found.is_free = s.surroundings.punctured;
  found.path = found.is_free ? s.path_free() : s.path_in(s.band);
  found.held = s.m.held || s.depth_of_tip() < kTouching_px;
  return found;
}

}  // namespace

EdgeFound pushed_or_free(const MembraneSearch& s) {
  if (!s.needle || s.rest.empty()) {
    return {s.path_in(s.band), false, s.m.held, s.m.dimple_px, s.m.dimple_odds};
  }
  if (s.surroundings.outermost) {
    return s.depth_of_tip() > kTouching_px ? outer_pushed_or_free(s) : EdgeFound{s.path_in(s.band)};
  }
  return inner_pushed_or_free(s);
}

}  // namespace punctum::vision
