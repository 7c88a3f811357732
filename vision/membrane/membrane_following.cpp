#include "vision/membrane/membrane_following.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/membrane/edge_shape.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr double kOuterModes = 12;  // periods round the cell: finer waves a stiff shell does not have
constexpr double kInnerModes = 9;   // granules beside the inner membrane look like waves of it
constexpr double kGranules = 0.75;  // of the variance of its places, at least: they are inside every cell
constexpr double kWallTolerance = 0.15;  // of the wall's thickness: cells differ from the scene's
constexpr double kSoftHalf = 1.2;        // rad to either side of the entry: where a dimple bends the membrane
constexpr double kNeedleHalf = 1.2;      // rad to either side of the entry: what a needle may dent

// Blur moves the two faces of a wall apart that is thinner than the blur. The outer face then lies too far
// out, by half of the difference between the apparent and the true thickness. 0 where the wall appears as
// thick as it is.
double thin_wall_bias(const MembraneSearch& search, const EdgePath& path, double thickness) {
  constexpr double kPsf_px = 1.2;     // px, of a lens in focus
  constexpr double kPixelling = 0.5;  // px^2, of the pixels and the gradient mask
  constexpr double kStep = 0.25;      // px
  const GradientField& field = search.picture.field;
  const double sigma = std::sqrt(field.sigma * field.sigma + kPsf_px * kPsf_px + kPixelling);
  if (search.m.polarity == Polarity::any || search.m.polarity == Polarity::relief || !(thickness > 0) ||
      thickness > 2 * sigma) {
    return 0;
  }
  const double sign = search.m.polarity == Polarity::brighter_out ? 1 : -1;
  Vector<double> apart;
  for (int i = 0; i < search.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!path.seen[k]) {
      continue;
    }
    const Point d = on_ray(Point(0, 0), i, search.angles, 1);
    double top = 0.4 * static_cast<double>(path.strength[k]), at = 0;
    for (double s = 1; s < 3 * sigma; s += kStep) {
      const double e = -sign * field.gradient(search.band.centre + (path.r[k] - s) * d).dot(d);
      if (e > top) {
        top = e;
        at = s;
      }
    }
    if (at > 0) {
      apart.push_back(at);
    }
  }
  if (static_cast<int>(apart.size()) < search.angles / 2) {
    return 0;
  }
  const double seen = median_of(apart);
  return seen < 2.6 * sigma ? std::max(0.0, 0.5 * (seen - thickness)) : 0;
}

// Of a path whose edges do not look alike all round. Half of what it errs by is what lies beside the edge.
SeenOutline seen_by_path(const MembraneSearch& search, const EdgePath& path, Contour contour) {
  constexpr double kShare = 0.3;  // of the variance of a single edge, after the smoothing
  constexpr double kUnseen = 9;   // times as much where no edge is seen
  const double least = std::max(path.residual, 0.1);
  SeenOutline out{std::move(contour), Vector<double>(path.r.size()), {}};
  for (int i = 0; i < search.angles; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.variance[k] = kShare * least * least * (path.seen[k] != 0 ? 1 : kUnseen);
    out.lasting.push_back(0.5 * out.variance[k]);
  }
  return out;
}

// Of the wall of the membrane around, seen from the centre of the band; empty where that is not known.
Contour inner_face(const MembraneSearch& search, const FollowedMembrane& around, double wall) {
  Vector<double> r = polar_radii(around.carried.contour(), search.band.centre, search.angles);
  for (double& x : r) {
    x -= wall;
  }
  return from_polar(search.band.centre, r);
}

// The path moved to where the edge looks as it does all round. Empty for an edge in relief that does not: its
// path alone is off by more than a pixel.
std::optional<SeenOutline> refined(const MembraneSearch& search, const EdgePath& path,
                                   const VisionConfig& config, const Surroundings& surroundings,
                                   EdgeLearnt& learnt) {
  Contour contour = from_polar(search.band.centre, path.r);
  if (search.m.polarity != Polarity::any) {
    Vector<double> soft(contour.size(), 0.0);
    for (int i = 0; i < search.angles && search.needle; ++i) {
      soft[static_cast<std::size_t>(i)] = std::clamp((kSoftHalf - search.from_needle(i)) / 0.6, 0.0, 1.0);
    }
    const double wall = config.px(config.h_m);
    EdgeShape edge;
    if (search.m.polarity == Polarity::relief) {
      const Point along = search.m.relief.along;
      edge.relief = along / cv::norm(along);
      const FollowedMembrane* other = surroundings.outermost ? surroundings.within : surroundings.around;
      if (other && other->known && !other->edge.turning.empty()) {
        edge.other_flatness = other->edge.flatness;
      }
    }
    if (surroundings.outermost && search.m.polarity == Polarity::relief) {
      edge.in_shadow = search.picture.in_shadow_of_holder(contour);
    } else {
      edge.beside_line = search.band.hidden;
    }
    if (surroundings.outermost) {
      edge.modes = kOuterModes;
      edge.nearby = {-wall, kWallTolerance * wall};
    } else {
      edge.inside = 6;
      edge.outside = 5;
      edge.modes = kInnerModes;
      edge.granular = true;
      edge.lasting = kGranules;
      edge.per_blur = 0.8;  // granules and the wall blur into it
      if (surroundings.around) {
        const double gap = mean_radius(surroundings.around->contour()) - mean_radius(contour) - wall;
        if (gap > 1) {
          edge.nearby = {gap, 0};
          if (search.needle && !surroundings.punctured && !search.rest.empty() &&
              search.depth_of_tip() > -gap - wall) {  // the needle may dent it
            edge.nearby_face = inner_face(search, *surroundings.around, wall);
          }
        }
      }
    }
    if (auto shaped = shaped_edge(search.picture, contour, soft, edge, learnt)) {
      return shaped;
    }
    if (search.m.polarity == Polarity::relief && edge.nearby) {
      return std::nullopt;
    }
  }
  if (surroundings.outermost) {
    const double bias = thin_wall_bias(search, path, config.px(config.h_m));
    Vector<double> face = path.r;
    for (double& r : face) {
      r -= bias;
    }
    contour = from_polar(search.band.centre, face);
  }
  return seen_by_path(search, path, std::move(contour));
}

// What a needle is expected to have changed of its shape since the last frame. Where it pushes the membrane,
// the dimple deepens by what the tip has moved; once it is through and the dimple is gone, hardly anything
// changes.
CarriedOutline::Change change_by_needle(const MembraneSearch& search, const EdgeFound& found) {
  // Above the outline at rest, from where the tip may touch: and in its deviations.
  constexpr double kMayTouch_px = 0.5, kMayTouch_sd = 2;
  constexpr double kAnything_px = 2, kSettled_px = 0.3;    // sd
  constexpr double kPushed_px = 0.6, kPushedShare = 0.25;  // sd; of what the tip has moved
  constexpr double kRecoil_px =
      2.5;                           // by which a dimple that it pushes does not differ from what is expected
  constexpr double kDentHalf = 0.8;  // rad to either side of the entry
  // Of depth and radius of the needle together: to where the dimple may change, and to where it does by 1/e.
  constexpr double kChanges = 4, kFallen = 1.5;
  const std::size_t n = static_cast<std::size_t>(search.angles);
  CarriedOutline::Change out{Vector<double>(n, 0.0), Vector<double>(n, 0.0)};
  const NeedlePose& needle = search.surroundings.needle;
  const bool at_rest_known = !search.rest.empty();
  const double depth = at_rest_known && search.needle ? search.depth_of_tip() : 0;
  if (!search.needle || (at_rest_known && depth < -kMayTouch_px - kMayTouch_sd * needle.sd)) {
    return out;
  }
  const FollowedMembrane& last = search.m;
  const bool settled = !found.held && found.dimple_px == 0 && !last.held && last.dimple_px == 0;
  const bool on_tip =
      search.surroundings.outermost && found.held && depth > 0 && !search.surroundings.punctured;
  const double moved = std::min(search.surroundings.expected_px, depth);
  const bool pushed = on_tip && std::abs(found.dimple_px - last.dimple_px - moved) < kRecoil_px;
  const double by = pushed ? moved : 0;
  const double sd = settled ? kSettled_px : pushed ? kPushed_px + kPushedShare * std::abs(by) : kAnything_px;
  const double size = (std::max(depth, 0.0) + needle.half_width) / search.usual_r;
  const double half = at_rest_known ? std::min(kDentHalf, kChanges * size) : kDentHalf;
  for (int i = 0; i < search.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double off = search.from_needle(i);
    out.sd[k] = sd * std::clamp(2 * (half - off) / half, 0.0, 1.0);
    out.by[k] = by * needle.axis.dot(on_ray(Point(0, 0), i, search.angles, 1)) *
                math::exp(-off * off / (kFallen * size * kFallen * size));
  }
  return out;
}

// In relief the edge that is sought is the outer flank of what the light makes of a face. Of an inner
// membrane too, but there nothing asks how deep the tip is to a pixel.
void learn_path_outside(const MembraneSearch& search, const EdgePath& path, const Contour& contour,
                        FollowedMembrane& m) {
  constexpr double kPart = 0.2;  // of a frame
  if (m.polarity != Polarity::relief || !search.surroundings.outermost) {
    return;
  }
  Vector<double> outside;
  for (int i = 0; i < search.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (path.seen[k] != 0 && search.from_needle(i) > kNeedleHalf) {
      outside.push_back(path.r[k] - cv::norm(contour[k] - search.band.centre));
    }
  }
  if (!outside.empty()) {
    m.path_outside_px += (m.path_outside_px == 0 ? 1 : kPart) * (median_of(outside) - m.path_outside_px);
  }
}

// In relief the rim of the pit, above and below the focus, covers the edge of the dimple. The membrane lies
// on the tip that pushes it; what the contour lies short of that its dimple does, the less the further aside.
void deepen_to_the_tip(const MembraneSearch& search, const EdgeFound& found, Contour& contour) {
  constexpr double kRim_px = 1;            // by so much the rim may lie outside: sd
  constexpr double kWide = 1.5, kFar = 3;  // half widths of the needle; of these
  const Surroundings& s = search.surroundings;
  const NeedlePose& n = s.needle;
  if (search.m.polarity != Polarity::relief || !s.outermost || s.punctured || !found.held || !search.needle ||
      search.rest.empty() || search.depth_of_tip() < 0) {
    return;
  }
  const Point tip = n.point();
  const auto entry = entry_point(contour, tip, n.axis);
  if (!entry) {
    return;
  }
  const double short_of = std::max(0.0, (tip - *entry).dot(n.axis)) * kRim_px * kRim_px /
                          (kRim_px * kRim_px + n.sd * n.sd),
               wide = kWide * n.half_width;
  for (Point& p : contour) {
    const Point off = p - *entry;
    const double aside = off.cross(n.axis) / wide;
    if (std::abs(aside) < kFar && cv::norm(off) < 2 * kFar * wide) {
      p += short_of * math::exp(-aside * aside) * n.axis;
    }
  }
}

// Away from the needle a membrane keeps its outline. An arc that has left the outline follows something else.
bool left_outline(const MembraneSearch& s, const EdgePath& path) {
  if (s.rest.size() != path.r.size() || !s.needle || !s.m.rest.reliable()) {
    return false;
  }
  const double limit = std::max(6.0, 0.1 * median_of(s.rest));
  int off = 0, n = 0;
  for (int i = 0; i < s.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (s.from_needle(i) > kNeedleHalf) {
      ++n;
      off += std::abs(path.r[k] - s.rest[k]) > limit;
    }
  }
  return off > n / 12;
}

// Empty when it is still the same edge.
std::string why_not_the_same_edge(const MembraneSearch& s, const EdgeFound& found) {
  const EdgePath& path = found.path;
  Vector<double> jump;
  for (int i = 0; i < s.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!found.is_free || s.from_needle(i) >= kNeedleHalf) {
      jump.push_back(std::abs(path.r[k] - s.m.r[k]));
    }
  }
  if (path.visible < 0.35) {
    return "mostly hidden";
  }
  // A path through noise alone has a level of less than 2 times the noise. A dimple by a needle that is not
  // seen needs a clear edge.
  constexpr double kClear_noise = 2.7;
  if (path.support < 0.55 &&
      !(s.surroundings.dents_seen && path.level > kClear_noise * s.picture.gradient_noise)) {
    return "edge seen over " + std::to_string(std::lround(100 * path.support)) + " % only";
  }
  if (path.level < 0.35 * s.m.level) {
    return "edge has faded";
  }
  if (median_of(jump) > 0.6 * s.band.half_width) {
    return "contour jumped";
  }
  if (left_outline(s, path)) {
    return "contour left the cell's outline";
  }
  return {};
}

// Along the needle, from the outer membrane's entry to where an inner membrane lies that is so far inside
// that it does not move with it: a yolk, beside which a chorion is faint.
double down_to_the_inner(const MembraneSearch& search, const Point& entry) {
  constexpr double kFar_px = 15, kMargin_px = 4;
  const Surroundings& s = search.surroundings;
  double down = std::numeric_limits<double>::infinity();
  if (s.within && s.within->known &&
      mean_radius(search.m.contour()) - mean_radius(s.within->contour()) > s.wall_px + kFar_px) {
    const Vector<double> rest = s.within->rest.seen_from(s.within->centre);
    for (const Vector<double>* r : {&s.within->r, &rest}) {
      if (const auto inner = entry_point(from_polar(s.within->centre, *r), s.needle.tip, s.needle.axis)) {
        down = std::min(down, (*inner - entry).dot(s.needle.axis) - kMargin_px);
      }
    }
  }
  return down;
}

// In relief, where a membrane hardly shows that lies across the relief's axis.
std::optional<double> odds_of_recoil(FollowedMembrane& m, const MembraneSearch& search) {
  constexpr double kNear_px = 12;   // the tip, outside
  constexpr double kHardly_px = 3;  // what is pushed in by less has no way to go back
  const Surroundings& s = search.surroundings;
  const NeedlePose& n = s.needle;
  if (m.polarity == Polarity::relief && s.outermost && !s.punctured && search.needle &&
      !search.rest.empty()) {
    const auto entry = entry_point(from_polar(search.band.centre, search.rest), n.tip, n.axis);
    if (entry && (*entry - n.tip).dot(n.axis) < kNear_px) {
      // A hand that turns back at once is seen to; a tip that seems to jump ahead has not.
      const double moved_px =
          s.last_tip ? std::min(s.expected_px, (n.tip - *s.last_tip).dot(n.axis)) : s.expected_px;
      const auto odds = m.recoil.update(search.picture, n, *entry,
                                        s.carried ? std::optional(s.carried->dot(n.axis)) : std::nullopt,
                                        moved_px, m.level, down_to_the_inner(search, *entry));
      const bool pushed = std::max(m.dimple_px, search.depth_of_tip()) > kHardly_px;
      return odds && !pushed ? std::min(*odds, 0.0) : odds;
    }
  }
  m.recoil.forget();
  return std::nullopt;
}

}  // namespace

Membrane follow(FollowedMembrane& m, const ClearedPicture& picture, const VisionConfig& config,
                const Surroundings& surroundings) {
  Membrane out;
  if (!m.known) {
    out.reason = "not found";
    return out;
  }
  MembraneSearch search(m, picture, surroundings);
  search.free_by_motion = odds_of_recoil(m, search);
  m.recoil_odds = m.held ? search.free_by_motion.value_or(0) : 0;
  const EdgeFound found = pushed_or_free(search);
  const EdgePath& path = found.path;
  if (path.r.empty()) {
    out.reason = "no band to search";
    ++m.lost_frames;
    return out;
  }
  auto shown = refined(search, path, config, surroundings, m.edge);
  if (!shown) {
    out.reason = "edge does not look alike all round";
    ++m.lost_frames;
    return out;
  }
  deepen_to_the_tip(search, found, shown->contour);
  const SeenOutline& seen = *shown;
  out.contour = seen.contour;
  out.support = path.support;
  out.visible = path.visible;
  out.residual_px = path.residual;
  out.reason = why_not_the_same_edge(search, found);
  if (!out.reason.empty()) {
    ++m.lost_frames;
    return out;
  }
  m.level += 0.1 * (path.level - m.level);
  const Point centre = centroid(seen.contour);
  // The centre stays while it is well inside the contour, since resampling costs accuracy.
  const bool moves = cv::norm(centre - search.band.centre) > 0.06 * search.usual_r;
  const Vector<double> r = moves ? polar_radii(seen.contour, centre, search.angles) : path.r;
  if (r.empty()) {
    out.reason = "contour crosses itself";
    ++m.lost_frames;
    return out;
  }
  m.carried.update(seen, change_by_needle(search, found));
  learn_path_outside(search, path, seen.contour, m);
  out.contour = m.carried.contour();
  out.sd_px = m.carried.sd();
  out.ok = true;
  m.held = found.held;
  m.dimple_px = found.dimple_px;
  m.dimple_odds = found.dimple_odds;
  m.lost_frames = 0;
  m.centre = moves ? centre : search.band.centre;
  m.r = r;
  return out;
}

double Membrane::rms_sd_px() const {
  double square = 0;
  for (const double v : sd_px) {
    square += v * v / static_cast<double>(sd_px.size());
  }
  return std::sqrt(square);
}

}  // namespace punctum::vision
