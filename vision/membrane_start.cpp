#include "vision/membrane_start.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/circle_start.hpp"
#include "vision/median.hpp"

namespace punctum::vision {

namespace {

constexpr double kEdgeClear_noise = 4;    // times the gradient's noise: an edge that is believed
constexpr int kCircles = 6;               // candidates tried
constexpr double kCircleScore = 0.35;     // share of a circumference that must have voted
constexpr double kInnerOfOuter = 0.86;    // radius of the inner membrane's first circle
constexpr double kContrast = 4;           // of a second edge: times the median edge of its band
constexpr double kOvalDeviation = 0.055;  // of the radius, rms: a cell is nearly an oval

// A closed edge round a centre.
struct ClosedEdge {
  EdgePath path;
  Point centre;
  Polarity polarity = Polarity::any;
};

struct MainEdge {
  ClosedEdge edge;
  ClosedEdge of_any_sign;  // the same, whatever its sign, about its own centre
};

struct SecondEdge {
  EdgePath path;  // about the first one's centre
  Polarity polarity = Polarity::any;
  double quality = 0;
};

struct Radii {
  double from, to, expected;  // px
};

EdgePath closed_edge_round(const Point& centre, const Radii& radii, const ClearedPicture& picture, int angles,
                           Polarity polarity, double saturation) {
  const double width = radii.to - radii.from;
  EdgeBand band;
  band.centre = centre;
  band.step = std::max(0.5, width / 160);
  band.half_width = width / 2;
  band.middle.assign(static_cast<std::size_t>(angles), (radii.from + radii.to) / 2);
  band.slope = 1.5;
  band.stiffness = 0.5;
  band.visible = picture.visibility();
  picture.keep_off_holder(band, std::vector<double>(band.middle.size(), 1.08 * radii.expected));
  return closed_path(picture.field, band, polarity, picture.edge_floor(), saturation);
}

// Share of the visible angles with half the edge that counts fully, or less.
double weak_share(const EdgePath& p) {
  const double angles = static_cast<double>(p.strength.size());
  const auto weak = std::count_if(p.strength.begin(), p.strength.end(),
                                  [&](float e) { return static_cast<double>(e) < 0.5 * p.saturation; });
  return (static_cast<double>(weak) - (1 - p.visible) * angles) / angles;
}

// The strongest closed edge round a circle's centre, whatever it is; its centroid becomes the next centre.
std::optional<MainEdge> strongest_closed_edge(const Circle& circle, bool seeded, double saturation,
                                              const ClearedPicture& picture, const VisionConfig& config) {
  // Cells are not round: the radius seen from the centre varies more than the radius of the circle.
  const Radii radii{seeded ? 0.75 * circle.r : 0.6 * config.px(config.R_min_m),
                    seeded ? 1.25 * circle.r : 1.3 * config.px(config.R_max_m), circle.r};
  const auto settle = [&](Point centre, Polarity polarity, double edge_saturation, int rounds) {
    ClosedEdge e;
    e.polarity = polarity;
    for (int i = 0; i < rounds; ++i) {
      e.path = closed_edge_round(centre, radii, picture, config.contour_points, polarity, edge_saturation);
      e.centre = centre;
      if (e.path.r.empty()) {
        break;
      }
      centre = centroid(from_polar(centre, e.path.r));
      if (cv::norm(centre - e.centre) < 0.5) {
        break;
      }
    }
    return e;
  };
  MainEdge best;
  best.of_any_sign = settle(circle.centre, Polarity::any, saturation, 6);
  const ClosedEdge& any = best.of_any_sign;
  if (any.path.r.empty()) {
    return std::nullopt;
  }
  // A picture in which the edge has one sign all round (bright field) is followed by that sign: it tells the
  // two faces of a membrane apart. Where the sign changes round the cell, some arcs of a signed path are
  // weak.
  for (const Polarity q : {Polarity::brighter_out, Polarity::darker_out}) {
    ClosedEdge e = settle(any.centre, q, any.path.saturation, 2);
    if (!e.path.r.empty() && e.path.mean_strength > 0.93 * any.path.mean_strength &&
        weak_share(e.path) < weak_share(any.path) + 0.015 &&
        (best.edge.path.r.empty() || e.path.mean_strength > best.edge.path.mean_strength)) {
      best.edge = std::move(e);
    }
  }
  if (best.edge.path.r.empty()) {
    best.edge = any;
  }
  const EdgePath& path = best.edge.path;
  if (path.visible < 0.45 || path.support < 0.6 || path.level < 1.8 * path.background ||
      path.level < kEdgeClear_noise * picture.gradient_noise) {
    return std::nullopt;
  }
  return best;
}

// A second closed edge inside or outside one that is known (r1 round centre), ordered, with a gap.
SecondEdge find_second(const std::vector<double>& r1, const Point& centre, Polarity known_sign, bool outside,
                       const ClearedPicture& picture, const VisionConfig& config) {
  const double r_max = config.px(config.R_max_m), mean = median_of(r1);
  SecondEdge best;
  for (const Polarity q : {Polarity::brighter_out, Polarity::darker_out, Polarity::any}) {
    // Two edges of known sign may lie close together; a line whose sign is not known has two flanks.
    const bool known = q != Polarity::any && known_sign != Polarity::any;
    const double gap =
        known ? std::max(2.5, 0.02 * mean) : std::max({3.5, 0.035 * mean, 1.2 * config.px(config.h_m)});
    const double from = outside ? gap : -0.62 * mean;
    const double to = outside ? std::min(0.6 * mean, 1.3 * r_max - mean) : -gap;
    if (to - from < 4) {
      continue;
    }
    EdgeBand band;
    band.centre = centre;
    band.half_width = (to - from) / 2;
    band.step = std::max(0.5, (to - from) / 120);
    band.middle = r1;
    picture.keep_off_holder(band, outside ? std::vector<double>(r1.size(), mean + gap) : r1);
    for (double& r : band.middle) {
      r += (from + to) / 2;
    }
    band.slope = 1.0;
    band.stiffness = 0.8;
    band.visible = picture.visibility();
    EdgePath p = closed_path(picture.field, band, q, picture.edge_floor(), 0);
    if (p.r.empty() || p.visible < 0.4) {
      continue;
    }
    // Hugging the limit: the flank of the first edge, no second one.
    std::vector<double> offsets;
    for (std::size_t i = 0; i < p.r.size(); ++i) {
      offsets.push_back(std::abs(p.r[i] - r1[i]));
    }
    if (median_of(offsets) < gap + 1.0) {
      continue;
    }
    const double preference = q == Polarity::any ? 0.8 : q == known_sign ? 1.15 : 1.0;
    const double quality = preference * p.level * p.support * std::min(1.0, p.visible / 0.8) /
                           std::max({p.background, picture.gradient_noise, 0.02});
    if (quality > best.quality) {
      best = {std::move(p), q, quality};
    }
  }
  return best;
}

// Radii per angle as r(t) = c0 + c1 cos t + c2 sin t + c3 cos 2t + c4 sin 2t: rms of what is left over, as a
// share of c0.
bool nearly_oval(const std::vector<double>& r) {
  constexpr int kTerms = 5;
  const int n = static_cast<int>(r.size());
  const auto f = [n](int i, int k) {
    const double t = polar_angle(i, n);
    switch (k) {
      case 0:
        return 1.0;
      case 1:
        return std::cos(t);
      case 2:
        return std::sin(t);
      case 3:
        return std::cos(2 * t);
      default:
        return std::sin(2 * t);
    }
  };
  double c[kTerms] = {};
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < kTerms; ++k) {
      c[k] += r[static_cast<std::size_t>(i)] * f(i, k) * (k == 0 ? 1 : 2) / n;
    }
  }
  double mean_square = 0;
  for (int i = 0; i < n; ++i) {
    double e = r[static_cast<std::size_t>(i)];
    for (int k = 0; k < kTerms; ++k) {
      e -= c[k] * f(i, k);
    }
    mean_square += e * e / n;
  }
  return std::sqrt(mean_square) < kOvalDeviation * c[0];
}

bool clear_enough(const SecondEdge& s, double first_level, const ClearedPicture& picture) {
  // What strays from an oval has followed something else.
  return s.quality >= kContrast && s.path.level >= kEdgeClear_noise * picture.gradient_noise &&
         s.path.level >= 0.12 * first_level && nearly_oval(s.path.r);
}

// A dark line with a face inside and one outside, and nothing else: the zona, with a brighter space inside it
// and the ooplasm too faint, or the ooplasm itself?
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

FollowedMembrane begun(const Point& centre, const std::vector<double>& r, Polarity polarity, double level) {
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
    out.why = "closed edge not star-shaped";
    return out;
  }
  const double mean = median_of(r1);
  const SecondEdge beyond = find_second(r1, centre, main.polarity, true, picture, config);
  const bool good_out = clear_enough(beyond, main.path.level, picture);
  const auto begin = [&centre](const auto& edge) {
    return begun(centre, edge.path.r, edge.polarity, edge.path.level);
  };
  const FollowedMembrane middle = begun(centre, r1, main.polarity, main.path.level);
  if (!config.inner) {  // the outermost edge that is clear
    out.outer = good_out && beyond.path.level > 0.5 * main.path.level ? begin(beyond) : middle;
    return out;
  }
  const SecondEdge in = find_second(r1, centre, main.polarity, false, picture, config);
  const bool good_in = clear_enough(in, main.path.level, picture);
  // Two flanks of one dark line belong to one membrane.
  const auto flank = [&](const SecondEdge& x) {
    return main.polarity != Polarity::any && x.polarity != Polarity::any && x.polarity != main.polarity &&
           std::abs(median_of(x.path.r) - mean) < 0.13 * mean;
  };
  const bool out_is_flank = good_out && flank(beyond), in_is_flank = good_in && flank(in);
  const FollowedMembrane outer_face = out_is_flank ? begin(beyond) : middle;  // of what main belongs to
  const bool second_inside = good_in && !in_is_flank, second_outside = good_out && !out_is_flank;
  if (second_outside && (!second_inside || beyond.quality > in.quality)) {
    out.outer = begin(beyond);
    out.inner = middle;
    return out;
  }
  if (second_inside) {
    out.outer = outer_face;
    out.inner = begin(in);
    return out;
  }
  const bool too_small_for_outer = mean < 0.9 * config.px(config.R_min_m);
  const bool is_outer =
      out_is_flank || in_is_flank
          ? brighter_space_inside(outer_face.r, out_is_flank ? r1 : in.path.r, centre, picture.field)
          : in.quality > beyond.quality;
  if (is_outer && !too_small_for_outer) {
    out.outer = outer_face;
  } else {
    // An edge of oolemma in phase-like contrast has flanks of both signs.
    const ClosedEdge& any = found.of_any_sign;
    out.inner = begun(any.centre, any.path.r, Polarity::any, any.path.level);
  }
  return out;
}

StartedMembranes start_by_snake(const Circle& circle, const VisionConfig& config) {
  const auto start = [&config](const Circle& c) {
    FollowedMembrane m;
    m.known = true;
    m.centre = c.centre;
    m.r.assign(static_cast<std::size_t>(config.contour_points), c.r);
    m.nodes = circle_contour(c, config.snake.nodes);
    return m;
  };
  StartedMembranes out;
  out.outer = start(circle);
  if (config.inner) {
    out.inner = start({circle.centre, kInnerOfOuter * circle.r, 0});
  }
  return out;
}

// Grey levels per px that seven tenths of the picture stay below.
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
    nothing.why = "no circle found between " + std::to_string(std::lround(config.px(config.R_min_m))) +
                  " and " + std::to_string(std::lround(config.px(config.R_max_m))) + " px radius";
    return nothing;
  }
  if (!config.refine) {
    return start_by_snake(circles.front(), config);
  }
  // A long cell gives a circle at either end: the middle of them is worth a try as well.
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
      saturation = found->edge.path.saturation;  // one measure for all
    }
    if (found && (!best || found->edge.path.mean_strength > best->edge.path.mean_strength)) {
      best = std::move(found);
    }
  }
  if (!best) {
    nothing.why = "no closed edge stands out";
    return nothing;
  }
  return tell_apart(*best, picture, config);
}

std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture, const VisionConfig& config,
                                            const FollowedMembrane& outer) {
  const SecondEdge in = find_second(outer.r, outer.centre, outer.polarity, false, picture, config);
  if (!clear_enough(in, outer.level, picture)) {
    return std::nullopt;
  }
  return begun(outer.centre, in.path.r, in.polarity, in.path.level);
}

}  // namespace punctum::vision
