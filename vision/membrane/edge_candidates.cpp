#include "vision/membrane/edge_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

// The median along a whole path is believed earlier than a single edge: the best path through pure noise has
// 1.6 to 1.9 times the gradient's noise.
constexpr double kPathClear_noise = 2.7;
constexpr double kContrast = 4;           // of a second edge: times the median edge of its band
constexpr double kOvalDeviation = 0.055;  // of the radius, rms: a cell is nearly an oval

// A start is refined by the search that follows it: here half as many rays and samples as there do.
constexpr int kStartAngles = 128;
constexpr double kCoarse_px = 1;
// By its sign an edge is followed finely: the two faces of a thin membrane are closer than coarse samples
// tell.
constexpr int kFineAngles = 256;
constexpr double kFine_px = 0.5;
constexpr double kSameCentre_px = 1.5;  // the edge round it is the same

struct Radii {
  double from, to, expected;  // px

  // Cells are not round: the radius seen from the centre varies more than the radius of the circle.
  Radii(const Circle& circle, bool seeded, const VisionConfig& config)
      : from(seeded ? 0.75 * circle.r : 0.6 * config.px(config.R_min_m)),
        to(seeded ? 1.25 * circle.r : 1.3 * config.px(config.R_max_m)),
        expected(circle.r) {}
};

EdgeBand band_round(const Point& centre, const Radii& radii, int angles, double finest_px,
                    const ClearedPicture& picture) {
  const double width = radii.to - radii.from;
  EdgeBand band;
  band.centre = centre;
  band.step = std::max(finest_px, finest_px * width / 80);
  band.half_width = width / 2;
  band.middle.assign(static_cast<std::size_t>(angles), (radii.from + radii.to) / 2);
  band.slope = 1.5;
  band.stiffness = 0.5;
  band.covered = picture.covered;
  band.measures_background = true;
  picture.exclude_holder(band, std::vector<double>(band.middle.size(), 1.08 * radii.expected));
  return band;
}

ClosedEdge edge_in(const EdgeBand& band, const ClearedPicture& picture, Polarity polarity,
                   double saturation) {
  return {closed_path(picture.field, band, polarity, picture.edge_floor(), saturation), band.centre,
          polarity};
}

bool stands_out(const EdgePath& path, const ClearedPicture& picture) {
  return !path.r.empty() && path.visible >= 0.45 && path.support >= 0.6 &&
         path.level >= 1.8 * path.background && path.level >= kPathClear_noise * picture.gradient_noise;
}

// Share of the angles that are visible and have less than half of the saturated edge.
double weak_share(const EdgePath& p) {
  const double angles = static_cast<double>(p.strength.size());
  const auto weak = std::count_if(p.strength.begin(), p.strength.end(),
                                  [&](float e) { return static_cast<double>(e) < 0.5 * p.saturation; });
  return (static_cast<double>(weak) - (1 - p.visible) * angles) / angles;
}

// Whether the radii differ little from r(t) = c0 + c1 cos t + c2 sin t + c3 cos 2t + c4 sin 2t.
bool nearly_oval(const std::vector<double>& r) {
  constexpr int kTerms = 5;
  const int n = static_cast<int>(r.size());
  const auto f = [n](int i, int k) {
    const double t = polar_angle(i, n);
    switch (k) {
      case 0:
        return 1.0;
      case 1:
        return math::cos(t);
      case 2:
        return math::sin(t);
      case 3:
        return math::cos(2 * t);
      default:
        return math::sin(2 * t);
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

}  // namespace

std::optional<ClosedEdge> closed_edge_round(const Circle& circle, bool seeded, double saturation,
                                            std::vector<Point>& tried, const ClearedPicture& picture,
                                            const VisionConfig& config) {
  constexpr int kCentrings = 6;
  constexpr double kSettled_px = 0.5;
  const Radii radii(circle, seeded, config);
  ClosedEdge edge;
  Point centre = circle.centre;
  for (int round = 0; round < kCentrings; ++round) {
    if (std::any_of(tried.begin(), tried.end(),
                    [&](const Point& p) { return cv::norm(p - centre) < kSameCentre_px; })) {
      return std::nullopt;
    }
    edge = edge_in(band_round(centre, radii, kStartAngles, kCoarse_px, picture), picture, Polarity::any,
                   saturation);
    if (edge.path.r.empty()) {
      return std::nullopt;
    }
    centre = centroid(from_polar(centre, edge.path.r));
    if (cv::norm(centre - edge.centre) < kSettled_px) {
      break;
    }
  }
  tried.push_back(edge.centre);
  return stands_out(edge.path, picture) ? std::optional(std::move(edge)) : std::nullopt;
}

std::optional<MainEdge> edge_by_its_sign(const ClosedEdge& any, const Circle& circle, bool seeded,
                                         const ClearedPicture& picture, const VisionConfig& config) {
  MainEdge best{any, any};
  // Where the edge has one sign all round (bright field), it is followed by that sign, which tells the two
  // faces of a membrane apart. Where the sign changes round the cell, some arcs of a signed path are weak. In
  // noise single rays are, too, and a path of any sign finds some other edge there: at a noise of 0.28 of the
  // edge's level on up to 0.05 of the rays.
  const double noise = picture.gradient_noise / std::max(any.path.level, 1e-6);
  const double weak_most = weak_share(any.path) + 0.015 + 2.5 * noise * noise * noise;
  const auto follow_signs = [&](const EdgeBand& band) {
    for (const Polarity sign : {Polarity::brighter_out, Polarity::darker_out}) {
      ClosedEdge e = edge_in(band, picture, sign, any.path.saturation);
      if (!e.path.r.empty() && e.path.mean_strength > 0.93 * any.path.mean_strength &&
          weak_share(e.path) < weak_most &&
          (best.edge.polarity == Polarity::any || e.path.mean_strength > best.edge.path.mean_strength)) {
        best.edge = std::move(e);
      }
    }
  };
  EdgeBand band = band_round(any.centre, Radii(circle, seeded, config), kFineAngles, kFine_px, picture);
  follow_signs(band);
  if (best.edge.polarity == Polarity::any) {  // another edge has more of one sign: near this one alone
    constexpr double kNear_px = 6;
    band.middle = polar_radii(from_polar(any.centre, any.path.r), any.centre, kFineAngles);
    band.half_width = kNear_px;
    follow_signs(band);
    best.edge.path.background = any.path.background;
  }
  return stands_out(best.edge.path, picture) ? std::optional(std::move(best)) : std::nullopt;
}

SecondEdge find_second(const std::vector<double>& r1, const Point& centre, Polarity known_sign, bool outside,
                       const ClearedPicture& picture, const VisionConfig& config) {
  const double r_max = config.px(config.R_max_m), mean = median_of(r1);
  const std::vector<double> first = polar_radii(from_polar(centre, r1), centre, kStartAngles);
  SecondEdge best;
  if (first.empty()) {
    return best;
  }
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
    band.step = std::max(kCoarse_px, (to - from) / 120);
    band.middle = first;
    picture.exclude_holder(band, outside ? std::vector<double>(first.size(), mean + gap) : first);
    for (double& r : band.middle) {
      r += (from + to) / 2;
    }
    band.slope = 1.0;
    band.stiffness = 0.8;
    band.covered = picture.covered;
    band.measures_background = true;
    EdgePath p = closed_path(picture.field, band, q, picture.edge_floor(), 0);
    if (p.r.empty() || p.visible < 0.4) {
      continue;
    }
    // Along the limit of the band it is the flank of the first edge.
    std::vector<double> offsets;
    for (std::size_t i = 0; i < p.r.size(); ++i) {
      offsets.push_back(std::abs(p.r[i] - first[i]));
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
  if (!best.path.r.empty()) {
    best.path.r = polar_radii(from_polar(centre, best.path.r), centre, static_cast<int>(r1.size()));
  }
  return best;
}

bool clear_enough(const SecondEdge& edge, double first_level, const ClearedPicture& picture) {
  // A path that is not nearly an oval has followed something else.
  return edge.quality >= kContrast && edge.path.level >= kPathClear_noise * picture.gradient_noise &&
         edge.path.level >= 0.12 * first_level && nearly_oval(edge.path.r);
}

}  // namespace punctum::vision
