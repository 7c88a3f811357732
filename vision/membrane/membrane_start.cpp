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

constexpr int kCircles = 6;  // candidates that are tried
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
          : inside.quality > outside.quality;
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

std::vector<Circle> circles_to_try(const ClearedPicture& picture, const VisionConfig& config) {
  // The threshold follows the noise, and in pictures rich in texture the texture.
  const double threshold = std::max(kEdgeClear_noise * picture.gradient_noise, texture(picture.field));
  std::vector<Circle> circles;
  for (const CircleCandidate& c :
       find_circles(picture.field, picture.covered, threshold, config.px(config.R_min_m),
                    config.px(config.R_max_m), kCircles)) {
    if (c.score >= kCircleScore) {
      circles.push_back(c.circle);
    }
  }
  return circles;
}

}  // namespace

StartedMembranes start_membranes(const ClearedPicture& picture, const VisionConfig& config,
                                 const std::optional<Circle>& seed) {
  StartedMembranes nothing;
  std::vector<Circle> circles = seed ? std::vector<Circle>{*seed} : circles_to_try(picture, config);
  if (circles.empty()) {
    nothing.reason = "no circle found between " + std::to_string(std::lround(config.px(config.R_min_m))) +
                     " and " + std::to_string(std::lround(config.px(config.R_max_m))) + " px radius";
    return nothing;
  }
  // A long cell gives a circle at either end: the mean of the circles is tried as well.
  if (circles.size() > 2) {
    Circle mean = circles[0];
    mean.centre = (circles[0].centre + circles[1].centre + circles[2].centre) / 3;
    circles.push_back(mean);
  }
  std::optional<MainEdge> best;
  double saturation = 0;
  for (const Circle& c : circles) {
    auto found = strongest_closed_edge(c, seed.has_value(), saturation, picture, config);
    if (found && saturation <= 0) {
      saturation = found->edge.path.saturation;  // the same for all circles
    }
    if (found && (!best || found->edge.path.mean_strength > best->edge.path.mean_strength)) {
      best = std::move(found);
    }
  }
  if (!best) {
    nothing.reason = "no closed edge stands out";
    return nothing;
  }
  return tell_apart(*best, picture, config);
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
