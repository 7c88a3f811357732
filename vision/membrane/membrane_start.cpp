#include "vision/membrane/membrane_start.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "vision/image/hough_circles.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/edge_candidates.hpp"
#include "vision/membrane/parallel_edge.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr int kCircles = 6;         // candidates that are tried
constexpr int kVotingParts = 2;     // of the picture's rows
constexpr int kCirclesPerPart = 2;  // most are given up after one closed path; at most it takes six each
constexpr double kHalo = 1.4;
constexpr double kAloneSupport = 0.97;  // an edge that no other confirms is seen at so many of its angles
constexpr double kCircleScore = 0.35;   // share of a circumference that must have voted

// For a dark line with a face on either side and no other edge. It is the zona, with a brighter space inside
// and an ooplasm too faint to be seen; or else the rim of the ooplasm itself, which is as dark inside.
bool brighter_space_inside(const Vector<double>& outer_face, const Vector<double>& inner_face,
                           const Point& centre, const GradientField& field) {
  const int angles = static_cast<int>(outer_face.size());
  double near = 0, deep = 0, wall = 0, outside = 0;  // grey levels
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const auto grey = [&](double r) { return field.grey(on_ray(centre, i, angles, r)) / angles; };
    near += grey(inner_face[k] - 3);
    deep += grey(inner_face[k] - 14);
    wall += grey(0.5 * (outer_face[k] + inner_face[k]));
    outside += grey(outer_face[k] + 5);
  }
  return near - deep > 0.25 * std::abs(outside - wall);
}

// Of one dark line: the two belong to one membrane.
bool other_face(const SecondEdge& edge, const Vector<double>& r, Polarity sign) {
  constexpr double kWall = 0.13;  // of the radius, at most
  const double mean = median_of(r);
  return sign != Polarity::any && edge.polarity != Polarity::any && edge.polarity != sign &&
         std::abs(median_of(edge.path.r) - mean) < kWall * mean;
}

// Inside the inner face of a wall, where the space behind it ends: an edge of the sign of the outer face. Its
// path is empty when there is none.
SecondEdge second_of_a_wall(const SecondEdge& inner_face, const Point& centre, Polarity sign, double level,
                            const ClearedPicture& picture, const VisionConfig& config) {
  SecondEdge behind = find_second(inner_face.path.r, centre, inner_face.polarity, false, picture, config);
  return behind.polarity == sign && clear_enough(behind, level, picture) ? std::move(behind) : SecondEdge{};
}

FollowedMembrane started(const Point& centre, const Vector<double>& r, Polarity polarity, double level,
                         const Relief& relief = {}) {
  FollowedMembrane m;
  m.known = true;
  m.centre = centre;
  m.r = r;
  m.polarity = polarity;
  m.level = level;
  m.relief = relief;
  return m;
}

bool clear_in_relief(const SecondEdge& inside, const FollowedMembrane& outer, const ClearedPicture& picture) {
  constexpr double kInsideContrast = 2.2, kOfOuter = 0.4, kSupport = 0.7;
  return inside.quality >= kInsideContrast && inside.path.level >= kOfOuter * outer.level &&
         inside.path.support > kSupport && inside.path.level >= kEdgeClear_noise * picture.gradient_noise;
}

// Of the level of the other one, at least: two faces of a wall are about as clear as each other, a zona may
// be much fainter than its ooplasm.
constexpr double kFaceLevel = 0.4, kZonaLevel = 0.2, kChorionLevel = 0.1;

// Equally far from the other one all round, with this standard deviation: two faces of a wall, or ooplasm and
// zona, between which there is a space.
constexpr double kFaceApart_px = 1, kZonaApart_px = 2;

bool parallel_in_relief(const SecondEdge& edge, const Vector<double>& r, double apart_px, double least_level,
                        const ClearedPicture& picture) {
  if (edge.path.r.size() != r.size() || edge.path.level < least_level ||
      edge.path.level < kEdgeClear_noise * picture.gradient_noise) {
    return false;
  }
  Vector<double> apart(r.size());
  std::transform(edge.path.r.begin(), edge.path.r.end(), r.begin(), apart.begin(), std::minus<>());
  const double usual = median_of(apart);
  std::transform(apart.begin(), apart.end(), apart.begin(),
                 [usual](double a) { return std::abs(a - usual); });
  return kSdOfMedian * median_of(apart) < apart_px;
}

// Inside the wall of an outer membrane in relief, the edge at which what the light crosses grows again. Of a
// thin sheet the wall's inner face has an edge of that sign, too: a clear one further in counts. One
// that stands out less of what else is in there is as clear as the wall, and equally far from it all round.
std::optional<FollowedMembrane> ooplasm_in_relief(const FollowedMembrane& outer,
                                                  const ClearedPicture& picture, const VisionConfig& config) {
  constexpr double kWalls = 1.3, kDeepest = 0.3;  // wall thicknesses; of the radius
  constexpr double kSheet_px = 4, kAsClear = 0.7, kEven = 1.4;
  const double from = -kDeepest * median_of(outer.r), to = -kWalls * config.px(config.h_m);
  SecondEdge inside = find_in_relief(outer.r, outer.centre, outer.relief, from, to, picture);
  if (SecondEdge deep = find_in_relief(outer.r, outer.centre, outer.relief, from, to - kSheet_px, picture);
      parallel_in_relief(deep, outer.r, kFaceApart_px, kFaceLevel * outer.level, picture) &&
      deep.path.level > kAsClear * inside.path.level) {
    inside = std::move(deep);
  }
  const bool even = inside.quality >= kEven &&
                    parallel_in_relief(inside, outer.r, kFaceApart_px, kAsClear * outer.level, picture);
  return even || clear_in_relief(inside, outer, picture)
             ? std::optional(
                   started(outer.centre, inside.path.r, Polarity::relief, inside.path.level, inside.relief))
             : std::nullopt;
}

// Whether two paths run along one edge nearly everywhere.
bool same_edge(const ClosedEdge& a, const ClosedEdge& b) {
  constexpr double kNear_px = 4, kShare = 0.9;
  const Vector<double> there =
      polar_radii(from_polar(b.centre, b.path.r), a.centre, static_cast<int>(a.path.r.size()));
  std::size_t near = 0;
  for (std::size_t i = 0; i < there.size(); ++i) {
    near += std::abs(there[i] - a.path.r[i]) < kNear_px ? 1 : 0;
  }
  return static_cast<double>(near) > kShare * static_cast<double>(a.path.r.size());
}

// Where light runs along it little is seen of a zona, and its path may run along the flank of the ooplasm
// there. It is followed again about the oval of its clear parts, at first of those as far from the ooplasm as
// most, and kept where it is nearly as strong.
void follow_as_an_oval(EdgePath& zona, const FollowedMembrane& ooplasm, const ClearedPicture& picture) {
  constexpr double kNear_px = 4, kAsStrong = 0.95;
  constexpr int kRounds = 3;
  Vector<double> apart(ooplasm.r.size());
  std::transform(zona.r.begin(), zona.r.end(), ooplasm.r.begin(), apart.begin(), std::minus<>());
  const double usual = median_of(apart);
  Vector<double> oval = ooplasm.r, weights(oval.size());
  std::for_each(oval.begin(), oval.end(), [usual](double& r) { r += usual; });
  const Contour followed = from_polar(ooplasm.centre, zona.r);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double clear = std::max(0.0, static_cast<double>(zona.strength[i]));
      weights[i] = std::abs(zona.r[i] - oval[i]) < kNear_px ? clear * clear : 0;
    }
    const auto fitted = fit_undeformed(followed, weights);
    oval = fitted ? polar_radii(fitted->shape, ooplasm.centre, static_cast<int>(weights.size()))
                  : Vector<double>{};
    if (oval.empty()) {
      return;
    }
  }
  SecondEdge again = find_in_relief(oval, ooplasm.centre, ooplasm.relief, -kNear_px, kNear_px, picture);
  const auto strength = [](const EdgePath& path) { return path.mean_strength * path.saturation; };
  if (!again.path.r.empty() && strength(again.path) > kAsStrong * strength(zona)) {
    zona = std::move(again.path);
  }
}

// Round the ooplasm, the outer face of its zona: at both, what the light crosses grows inwards. Where a zona
// clings to it, the flank of the ooplasm's own edge is near; a chorion is far from its yolk, and faint beside
// it.
std::optional<FollowedMembrane> zona_in_relief(const FollowedMembrane& ooplasm, double wall,
                                               const ClearedPicture& picture) {
  constexpr double kFurthest = 0.35, kContrast = 1;  // of the radius; times the median edge of the band
  constexpr double kNearest_px = 5, kFar_px = 8, kFarContrast = 3.5;  // from the ooplasm; likewise
  const auto look = [&](double from, double contrast, double level) -> std::optional<FollowedMembrane> {
    SecondEdge zona = find_in_relief(ooplasm.r, ooplasm.centre, ooplasm.relief, from,
                                     kFurthest * median_of(ooplasm.r), picture);
    if (zona.quality <= contrast ||
        !parallel_in_relief(zona, ooplasm.r, kZonaApart_px, level * ooplasm.level, picture)) {
      return std::nullopt;
    }
    follow_as_an_oval(zona.path, ooplasm, picture);
    return started(ooplasm.centre, zona.path.r, Polarity::relief, zona.path.level, zona.relief);
  };
  if (auto near = look(std::max(wall, kNearest_px), kContrast, kZonaLevel)) {
    return near;
  }
  return look(std::max(wall, kFar_px), kFarContrast, kChorionLevel);
}

// The strongest edge is the ooplasm's, or one of the faces of the wall: the outermost one is where what the
// light crosses begins, and the inner face has the opposite sign.
StartedMembranes tell_apart_in_relief(const MainEdge& found, const ClearedPicture& picture,
                                      const VisionConfig& config) {
  const ClosedEdge& main = found.edge;
  constexpr double kNearest = 0.5, kFurthest = 2;  // wall thicknesses
  constexpr int kFaces = 3;
  StartedMembranes out;
  const double wall = config.px(config.h_m);
  const auto other_face = [&](const FollowedMembrane& of, double from, double to) {
    SecondEdge face = find_in_relief(of.r, of.centre, of.relief.opposite(), from * wall, to * wall, picture);
    return parallel_in_relief(face, of.r, kFaceApart_px, kFaceLevel * of.level, picture)
               ? std::optional(
                     started(of.centre, face.path.r, Polarity::relief, face.path.level, face.relief))
               : std::nullopt;
  };
  FollowedMembrane outermost =
      started(main.centre, main.path.r, Polarity::relief, main.path.level, main.relief);
  if (auto zona = zona_in_relief(outermost, wall, picture)) {
    out.outer = *std::move(zona);
    out.inner = std::move(outermost);
    return out;
  }
  int further = 0;
  for (; further < kFaces; ++further) {
    auto face = other_face(outermost, kNearest, kFurthest);
    if (!face) {
      break;
    }
    outermost = *std::move(face);
  }
  if (further > 0 || !config.inner || other_face(outermost, -kFurthest, -kNearest)) {
    out.outer = std::move(outermost);
  } else {  // no wall: it is the ooplasm
    const ClosedEdge& any = found.of_any_sign;
    out.inner = same_edge(main, any)
                    ? started(main.centre, main.path.r, Polarity::relief, main.path.level, main.relief)
                    : started(any.centre, any.path.r, Polarity::any, any.path.level);
    return out;
  }
  if (config.inner) {
    if (auto inside = ooplasm_in_relief(out.outer, picture, config)) {
      out.inner = *std::move(inside);
    }
  }
  return out;
}

StartedMembranes tell_apart(const MainEdge& found, const ClearedPicture& picture,
                            const VisionConfig& config) {
  StartedMembranes out;
  const ClosedEdge& main = found.edge;
  if (main.polarity == Polarity::relief) {
    return tell_apart_in_relief(found, picture, config);
  }
  const Contour contour = from_polar(main.centre, main.path.r);
  const Point centre = centroid(contour);
  const Vector<double> r1 = polar_radii(contour, centre, config.contour_points);
  if (r1.empty()) {
    out.reason = "closed edge not star-shaped";
    return out;
  }
  const double mean = median_of(r1);
  const SecondEdge outside = find_second(r1, centre, main.polarity, true, picture, config);
  // The bright halo of a dark cell out of perfect focus: its outer flank is weaker than its inner one.
  const bool halo = main.polarity == Polarity::brighter_out && outside.polarity == Polarity::darker_out &&
                    main.path.level > kHalo * outside.path.level;
  const bool outside_clear = !halo && clear_enough(outside, main.path.level, picture);
  const auto begin = [&centre](const auto& edge) {
    return started(centre, edge.path.r, edge.polarity, edge.path.level);
  };
  const FollowedMembrane middle = started(centre, r1, main.polarity, main.path.level);
  if (!config.inner) {  // the outermost clear edge
    out.outer = outside_clear && outside.path.level > 0.5 * main.path.level ? begin(outside) : middle;
    return out;
  }
  const SecondEdge inside = find_second(r1, centre, main.polarity, false, picture, config);
  const bool inside_clear = clear_enough(inside, main.path.level, picture);
  const bool outside_is_flank = outside_clear && other_face(outside, r1, main.polarity),
             inside_is_flank = inside_clear && !outside_is_flank && other_face(inside, r1, main.polarity);
  const FollowedMembrane outer_face =
      outside_is_flank ? begin(outside) : middle;  // of the membrane to which main belongs
  const SecondEdge behind_wall =
      inside_is_flank ? second_of_a_wall(inside, centre, main.polarity, main.path.level, picture, config)
                      : SecondEdge{};
  const bool second_inside = inside_clear && !inside_is_flank,
             second_outside = outside_clear && !outside_is_flank;
  if (second_outside && (!second_inside || outside.quality > inside.quality)) {
    out.outer = begin(outside);
    out.inner = middle;
    return out;
  }
  if (second_inside || !behind_wall.path.r.empty()) {
    out.outer = outer_face;
    out.inner = begin(second_inside ? inside : behind_wall);
    return out;
  }
  const bool too_small_for_outer = mean < 0.9 * config.px(config.R_min_m);
  const bool is_outer =
      outside_is_flank || inside_is_flank
          ? brighter_space_inside(outer_face.r, outside_is_flank ? r1 : inside.path.r, centre, picture.field)
          : inside.quality > outside.quality ||
                parallel_edge_within(r1, centre, main.polarity, picture, config).has_value();
  if (is_outer && !too_small_for_outer) {
    out.outer = outer_face;
  } else {
    // An edge of oolemma in phase-like contrast has flanks of both signs.
    const ClosedEdge& any = found.of_any_sign;
    if (any.path.support < kAloneSupport) {
      out.reason = "an edge with gaps, and no other round it";
      return out;
    }
    out.inner = started(any.centre, any.path.r, Polarity::any, any.path.level);
  }
  return out;
}

// The gradient (grey levels per px) below which seven tenths of the picture are.
double texture(const GradientField& field) {
  cv::Mat sample;
  cv::resize(field.magnitude(cv::Range(0, field.area.height)), sample, cv::Size(), 0.25, 0.25,
             cv::INTER_NEAREST);
  Vector<float> v(sample.begin<float>(), sample.end<float>());
  if (v.empty()) {
    return 0;
  }
  const auto seventh = v.begin() + static_cast<std::ptrdiff_t>(7 * v.size() / 10);
  std::nth_element(v.begin(), seventh, v.end());
  return static_cast<double>(*seventh);
}

}  // namespace

bool is_held(const Circle& c, const ClearedPicture& picture) {
  constexpr double kWithin = 0.3, kBeyond = 0.8, kAside = 0.6;  // of the radius
  if (!picture.holder_face) {
    return false;
  }
  const Point to_centre = c.centre - picture.holder_face->mouth;
  const double ahead = to_centre.dot(picture.holder_face->axis),
               aside = std::abs(to_centre.cross(picture.holder_face->axis));
  return aside < kAside * c.r && ahead > (1 - kWithin) * c.r && ahead < (1 + kBeyond) * c.r;
}

CellSearch::CellSearch(const std::optional<Circle>& seed, const std::optional<Circle>& last_seen)
    : seeded_(seed), last_seen_(last_seen), parts_voted_(seed ? kVotingParts : 0) {
  if (seed) {
    circles_ = {*seed};
  }
}

std::optional<StartedMembranes> CellSearch::advance(const ClearedPicture& picture,
                                                    const VisionConfig& config) {
  StartedMembranes nothing;
  if (const auto there = std::exchange(last_seen_, std::nullopt)) {
    return begin_round(*there, picture, config);
  }
  if (parts_voted_ < kVotingParts) {
    vote(picture, config);
    return std::nullopt;
  }
  if (auto votes = std::exchange(votes_, std::nullopt)) {
    choose_circles(*votes, picture);
    if (!circles_.empty()) {
      return std::nullopt;
    }
    const auto um = [](double m) { return std::to_string(std::lround(m * 1e6)); };
    nothing.reason =
        "no circle found between " + um(config.R_min_m) + " and " + um(config.R_max_m) + " um radius";
    return nothing;
  }
  if (!circles_.empty()) {
    try_circles(picture, config);
    return std::nullopt;
  }
  if (!candidates_.empty() && (!alone_ || candidates_.front().rank > alone_rank_)) {
    if (auto begun = try_strongest(picture, config)) {
      return begun;
    }
    if (!candidates_.empty() || !circles_.empty() || alone_) {
      return std::nullopt;
    }
  }
  if (alone_) {
    return std::exchange(alone_, std::nullopt);
  }
  nothing.reason = reason_.empty() ? "no closed edge stands out" : reason_;
  return nothing;
}

// An edge with no other membrane in or round it may be that of a part of the cell, whose other border is the
// needle or a furrow: an edge as strong round a place beside its middle is then that of the whole.
std::optional<StartedMembranes> CellSearch::try_strongest(const ClearedPicture& picture,
                                                          const VisionConfig& config) {
  constexpr int kLooks = 2;
  const Candidate strongest = candidates_.front();
  candidates_.erase(candidates_.begin());
  auto begun = begin_round(strongest.circle, picture, config);
  if (begun && begun->outer.known && (begun->inner.known || !config.inner)) {
    return begun;
  }
  if (begun && !seeded_ && looks_ < kLooks) {
    ++looks_;
    look_round(strongest.circle);
  }
  if (begun && (begun->outer.known || begun->inner.known)) {
    alone_ = std::move(begun);
    alone_rank_ = strongest.rank;
  } else if (begun) {
    reason_ = begun->reason;
  }
  return std::nullopt;
}

void CellSearch::look_round(const Circle& circle) {
  constexpr int kWays = 8;
  constexpr double kAside = 0.8;  // of the radius
  for (int i = 0; i < kWays; ++i) {
    circles_.push_back({on_ray(circle.centre, i, kWays, kAside * circle.r), circle.r});
  }
}

void CellSearch::vote(const ClearedPicture& picture, const VisionConfig& config) {
  const GradientField& field = picture.field;
  if (!votes_) {
    votes_.emplace(field.area, config.px(config.R_min_m), config.px(config.R_max_m));
  }
  // The threshold follows the noise, and in pictures rich in texture the texture.
  const double threshold = std::max(kEdgeClear_noise * picture.gradient_noise, texture(field));
  const int h = field.area.height;
  votes_->vote(field, picture.covered, threshold,
               {h * parts_voted_ / kVotingParts, h * (parts_voted_ + 1) / kVotingParts});
  ++parts_voted_;
}

void CellSearch::choose_circles(CircleSearch& votes, const ClearedPicture& picture) {
  Vector<Circle> others;
  for (const CircleCandidate& c : votes.best(picture.holder_face ? 2 * kCircles : kCircles)) {
    if (c.score >= kCircleScore) {
      (is_held(c.circle, picture) ? circles_ : others).push_back(c.circle);
    }
  }
  circles_.insert(circles_.end(), others.begin(), others.end());
  circles_.resize(std::min<std::size_t>(circles_.size(), kCircles));
  // A long cell gives a circle at either end: the mean of the circles is tried as well.
  if (circles_.size() > 2) {
    Circle mean = circles_[0];
    mean.centre = (circles_[0].centre + circles_[1].centre + circles_[2].centre) / 3;
    circles_.push_back(mean);
  }
}

void CellSearch::try_circles(const ClearedPicture& picture, const VisionConfig& config) {
  for (int k = 0; k < kCirclesPerPart && !circles_.empty(); ++k) {
    const Circle circle = circles_.front();
    circles_.erase(circles_.begin());
    const auto edge = closed_edge_round(circle, seeded_, saturation_, tried_, picture, config);
    if (!edge) {
      continue;
    }
    saturation_ = edge->path.saturation;
    const Circle found{edge->centre, circle.r};
    const Candidate c{found, {is_held(found, picture), edge->path.mean_strength}};
    candidates_.insert(
        std::upper_bound(candidates_.begin(), candidates_.end(), c,
                         [](const Candidate& l, const Candidate& r) { return l.rank > r.rank; }),
        c);
  }
}

// The cell round a circle, in this picture alone. Empty when no closed edge stands out there.
std::optional<StartedMembranes> CellSearch::begin_round(const Circle& circle, const ClearedPicture& picture,
                                                        const VisionConfig& config) const {
  Vector<Point> others;
  const auto any = closed_edge_round(circle, seeded_, saturation_, others, picture, config);
  const auto edge = any ? edge_by_its_sign(*any, circle, seeded_, picture, config) : std::nullopt;
  return edge ? std::optional(tell_apart(*edge, picture, config)) : std::nullopt;
}

std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture, const VisionConfig& config,
                                            const FollowedMembrane& outer, bool faint_too) {
  if (outer.polarity == Polarity::relief) {
    return ooplasm_in_relief(outer, picture, config);
  }
  SecondEdge inside = find_second(outer.r, outer.centre, outer.polarity, false, picture, config);
  if (clear_enough(inside, outer.level, picture) && other_face(inside, outer.r, outer.polarity)) {
    SecondEdge behind = second_of_a_wall(inside, outer.centre, outer.polarity, outer.level, picture, config);
    inside = behind.path.r.empty() ? std::move(inside) : std::move(behind);
  }
  if (clear_enough(inside, outer.level, picture)) {
    return started(outer.centre, inside.path.r, inside.polarity, inside.path.level);
  }
  std::optional<EdgePath> parallel;
  if (faint_too) {
    parallel = parallel_edge_within(outer.r, outer.centre, outer.polarity, picture, config);
  }
  if (!parallel) {
    return std::nullopt;
  }
  return started(outer.centre, parallel->r, outer.polarity, parallel->level);
}

}  // namespace punctum::vision
