#include "vision/membrane/membrane_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr double kSaturation = 0.7;   // times the usual edge: a stronger one is not better
constexpr double kBesideHalf = 0.24;  // rad to either side of the entry: the steep part of the dimple

}  // namespace

MembraneSearch::MembraneSearch(const FollowedMembrane& followed, const ClearedPicture& cleared,
                               const Surroundings& s, const Point& shift)
    : m(followed),
      picture(cleared),
      surroundings(s),
      angles(static_cast<int>(m.r.size())),
      usual_r(median_of(m.r)),
      saturation(kSaturation * m.level) {
  band.centre = m.centre + shift;
  band.middle = m.r;
  band.half_width = std::clamp(0.11 * usual_r, 6.0, 14.0);
  band.slope = 1.0;
  band.covered = picture.covered;
  rest = m.rest.seen_from(band.centre);
  keep_membranes_apart();

  std::vector<double> expected = m.r;
  if (s.outermost && s.undeformed && s.undeformed->round) {
    // A contour that has slipped inwards along the holding pipette comes back.
    const std::vector<double> free = polar_radii(s.undeformed->shape, band.centre, angles);
    for (std::size_t i = 0; i < free.size(); ++i) {
      expected[i] = std::max(expected[i], free[i]);
    }
  }
  picture.exclude_holder(band, expected);

  if (s.needle.ok) {
    const Point tip = s.needle.tip - band.centre;
    const auto entry = entry_point(m.contour(), s.needle.tip, s.needle.axis);
    const Point towards = entry ? *entry - band.centre : -s.needle.axis;
    needle = {std::atan2(towards.y, towards.x), polar_index(tip, angles), cv::norm(tip)};
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
    double tip_angle = 0;
    if (surroundings.last_tip) {
      const Point tip = *surroundings.last_tip - band.centre;
      tip_angle = std::atan2(tip.y, tip.x);
    }
    for (std::size_t k = 0; k < band.lower.size(); ++k) {
      // The inner membrane was there one frame ago; near the needle it may have moved since.
      const bool near =
          surroundings.last_tip && angle_between(polar_angle(static_cast<int>(k), angles), tip_angle) < 0.5;
      band.lower[k] += near ? -4.0 : std::max(2.5, 0.35 * usual_gap);
    }
  }
}

// The membrane is not pushed in further than the tip has come.
void MembraneSearch::limit_depth_to_tip() {
  constexpr double kMargin_px = 6;
  const Point tip = surroundings.needle.tip - band.centre;
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
  free.half_width = std::min(band.half_width, 7.0);
  return path_in(free);
}

// The membrane lies flat against the end face of the needle; a pierced one reaches to the tip at most.
std::vector<std::pair<int, double>> MembraneSearch::end_face() const {
  const NeedlePose& n = surroundings.needle;
  const double ahead = (n.tip - band.centre).dot(n.axis);
  std::vector<std::pair<int, double>> face;
  for (int i = 0; i < angles && ahead < 0 && !surroundings.punctured; ++i) {
    const Point ray = on_ray(Point(0, 0), i, angles, 1);
    const double towards = ray.dot(n.axis);
    if (towards < -0.5 &&
        std::abs((ahead / towards * ray + band.centre - n.tip).cross(n.axis)) < n.half_width) {
      face.emplace_back(i, ahead / towards);
    }
  }
  return face.empty() ? std::vector{std::make_pair(needle->tip_index, needle->tip_r)} : face;
}

// For a membrane that lies on the tip: the dimple moves with the needle.
EdgePath MembraneSearch::path_pushed() const {
  EdgeBand pushed = band;
  const int tip = needle->tip_index;
  const double move = needle->tip_r - pushed.middle[static_cast<std::size_t>(tip)];
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

// Over the visible angles; 0 if there are none.
double MembraneSearch::mean_beside_needle(const std::vector<double>& per_angle) const {
  double sum = 0;
  int n = 0;
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (from_needle(i) < kBesideHalf && !picture.hidden(on_ray(band.centre, i, angles, rest[k]))) {
      sum += per_angle[k];
      ++n;
    }
  }
  return n > 0 ? sum / n : 0.0;
}

EdgeFound pushed_or_free(const MembraneSearch& s) {
  const auto tip_inside = [&] {
    return s.needle->tip_r < s.rest[static_cast<std::size_t>(s.needle->tip_index)] - 1.0;
  };
  if (!s.needle || s.rest.empty() || !tip_inside()) {
    return {s.path_in(s.band)};
  }
  EdgePath free = s.path_free();
  EdgePath pushed = s.surroundings.outermost ? s.path_pushed() : s.path_in(s.band);
  if (free.r.empty() || pushed.r.empty()) {
    return {std::move(pushed)};
  }
  std::vector<double> seen, apart, from_rest;
  for (std::size_t k = 0; k < free.r.size(); ++k) {
    seen.push_back(std::clamp(static_cast<double>(free.strength[k]) / s.saturation, 0.0, 1.0));
    apart.push_back(std::max(0.0, free.r[k] - pushed.r[k]));
    from_rest.push_back(std::abs(free.r[k] - s.rest[k]));
  }
  const double free_seen = s.mean_beside_needle(seen), between = s.mean_beside_needle(apart);
  // Where another edge lies further out than the dimple and is seen as well, the dimple belongs to another
  // membrane. But an edge that is nearer to the dimple than to the rest outline is the wall of the dimple.
  const bool is_free = s.surroundings.punctured && s.surroundings.outermost
                           ? free_seen > 0.4
                           : between > 1.5 && between > s.mean_beside_needle(from_rest) && free_seen > 0.7;
  return {is_free ? std::move(free) : std::move(pushed), is_free};
}

}  // namespace punctum::vision
