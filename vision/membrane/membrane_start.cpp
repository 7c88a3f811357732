#include "vision/membrane/membrane_start.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "vision/image/hough_circles.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/edge_candidates.hpp"
#include "vision/membrane/parallel_edge.hpp"

namespace punctum::vision {

namespace {

constexpr int kCircles = 6;         // candidates that are tried
constexpr int kVotingParts = 2;     // of the picture's rows
constexpr int kCirclesPerPart = 2;  // most are given up after one closed path; at most it takes six each
constexpr double kHalo = 1.4;
constexpr double kCircleScore = 0.35;  // share of a circumference that must have voted

// For a dark line with a face on either side and no other edge. It is the zona, with a brighter space inside
// and an ooplasm too faint to be seen; or else the rim of the ooplasm itself, which is as dark inside.
bool brighter_space_inside(const std::vector<double>& outer_face, const std::vector<double>& inner_face,
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

FollowedMembrane started(const Point& centre, const std::vector<double>& r, Polarity polarity, double level) {
  FollowedMembrane m;
  m.known = true;
  m.centre = centre;
  m.r = r;
  m.polarity = polarity;
  m.level = level;
  return m;
}

StartedMembranes tell_apart(const MainEdge& found, const ClearedPicture& picture,
                            const VisionConfig& config) {
  StartedMembranes out;
  const ClosedEdge& main = found.edge;
  const Contour contour = from_polar(main.centre, main.path.r);
  const Point centre = centroid(contour);
  const std::vector<double> r1 = polar_radii(contour, centre, config.contour_points);
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
  // Two flanks of one dark line belong to one membrane.
  const auto flank = [&](const SecondEdge& x) {
    return main.polarity != Polarity::any && x.polarity != Polarity::any && x.polarity != main.polarity &&
           std::abs(median_of(x.path.r) - mean) < 0.13 * mean;
  };
  const bool outside_is_flank = outside_clear && flank(outside),
             inside_is_flank = inside_clear && flank(inside);
  const FollowedMembrane outer_face =
      outside_is_flank ? begin(outside) : middle;  // of the membrane to which main belongs
  const bool second_inside = inside_clear && !inside_is_flank,
             second_outside = outside_clear && !outside_is_flank;
  if (second_outside && (!second_inside || outside.quality > inside.quality)) {
    out.outer = begin(outside);
    out.inner = middle;
    return out;
  }
  if (second_inside) {
    out.outer = outer_face;
    out.inner = begin(inside);
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
    out.inner = started(any.centre, any.path.r, Polarity::any, any.path.level);
  }
  return out;
}

// The gradient (grey levels per px) below which seven tenths of the picture are.
double texture(const GradientField& field) {
  cv::Mat sample;
  cv::resize(field.sobel, sample, cv::Size(), 0.25, 0.25, cv::INTER_NEAREST);
  std::vector<float> v(sample.begin<float>(), sample.end<float>());
  if (v.empty()) {
    return 0;
  }
  const auto seventh = v.begin() + static_cast<std::ptrdiff_t>(7 * v.size() / 10);
  std::nth_element(v.begin(), seventh, v.end());
  return static_cast<double>(*seventh);
}

}  // namespace

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
    choose_circles(*votes);
    if (!circles_.empty()) {
      return std::nullopt;
    }
    nothing.reason = "no circle found between " + std::to_string(std::lround(config.px(config.R_min_m))) +
                     " and " + std::to_string(std::lround(config.px(config.R_max_m))) + " px radius";
    return nothing;
  }
  if (!circles_.empty()) {
    try_circles(picture, config);
    return std::nullopt;
  }
  if (!candidates_.empty()) {
    const Circle strongest = candidates_.front().circle;
    candidates_.erase(candidates_.begin());
    if (auto begun = begin_round(strongest, picture, config)) {
      return begun;
    }
  }
  if (!candidates_.empty()) {
    return std::nullopt;
  }
  nothing.reason = "no closed edge stands out";
  return nothing;
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

void CellSearch::choose_circles(CircleSearch& votes) {
  for (const CircleCandidate& c : votes.best(kCircles)) {
    if (c.score >= kCircleScore) {
      circles_.push_back(c.circle);
    }
  }
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
    const Candidate c{{edge->centre, circle.r}, edge->path.mean_strength};
    candidates_.insert(
        std::upper_bound(candidates_.begin(), candidates_.end(), c,
                         [](const Candidate& l, const Candidate& r) { return l.strength > r.strength; }),
        c);
  }
}

// The cell round a circle, in this picture alone. Empty when no closed edge stands out there.
std::optional<StartedMembranes> CellSearch::begin_round(const Circle& circle, const ClearedPicture& picture,
                                                        const VisionConfig& config) const {
  std::vector<Point> others;
  const auto any = closed_edge_round(circle, seeded_, saturation_, others, picture, config);
  const auto edge = any ? edge_by_its_sign(*any, circle, seeded_, picture, config) : std::nullopt;
  return edge ? std::optional(tell_apart(*edge, picture, config)) : std::nullopt;
}

std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture, const VisionConfig& config,
                                            const FollowedMembrane& outer, bool faint_too) {
  const SecondEdge inside = find_second(outer.r, outer.centre, outer.polarity, false, picture, config);
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
