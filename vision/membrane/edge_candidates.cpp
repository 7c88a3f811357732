#include "vision/membrane/edge_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/edge_profiles.hpp"

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
constexpr double kAsGood = 0.93;        // of the mean strength of the edge whatever its sign is
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
  picture.exclude_holder(band, Vector<double>(band.middle.size(), 1.08 * radii.expected));
  return band;
}

ClosedEdge edge_in(const EdgeBand& band, const ClearedPicture& picture, Polarity polarity,
                   double saturation) {
  return {closed_path(picture.field, band, polarity, picture.edge_floor(), saturation), band.centre, polarity,
          band.relief};
}

bool stands_out(const EdgePath& path, const ClearedPicture& picture) {
  return !path.r.empty() && path.visible >= 0.45 && path.support >= 0.6 &&
         path.level >= 1.8 * path.background && path.level >= kPathClear_noise * picture.gradient_noise;
}

// Share of the angles that have less than half of the saturated edge, where nothing else lies beside the
// path.
double weak_share(const ClosedEdge& edge, const ClearedPicture& picture) {
  constexpr int kBeside_px = 8;
  const EdgePath& p = edge.path;
  const int angles = static_cast<int>(p.strength.size());
  const cv::Rect all(0, 0, picture.covered.cols, picture.covered.rows);
  int weak = 0;
  for (int i = 0; i < angles; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (p.strength[k] != 0 && static_cast<double>(p.strength[k]) < 0.5 * p.saturation) {
      const Point at = on_ray(edge.centre, i, angles, p.r[k]);
      const cv::Rect beside =
          all & cv::Rect(static_cast<int>(at.x) - kBeside_px, static_cast<int>(at.y) - kBeside_px,
                         2 * kBeside_px + 1, 2 * kBeside_px + 1);
      weak += beside.empty() || cv::countNonZero(picture.covered(beside)) > 0 ? 0 : 1;
    }
  }
  return static_cast<double>(weak) / angles;
}

// By how much the radii differ, rms and of the mean radius, from r(t) = c0 + c1 cos t + c2 sin t + c3 cos 2t
// + c4 sin 2t.
double off_an_oval(const Vector<double>& r) {
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
  return std::sqrt(mean_square) / c[0];
}

// Share of the places round which a tenth of the contour is nearly straight: bent outwards by less than a
// third of what a circle is.
double straight_share(const Contour& contour) {
  constexpr double kPart = 0.1, kOfCircle = 0.35;
  const std::size_t n = contour.size();
  Vector<double> length(n);
  double all = 0;
  for (std::size_t i = 0; i < n; ++i) {
    all += length[i] = cv::norm(contour[(i + 1) % n] - contour[i]);
  }
  const double sagitta = kOfCircle * kPart * kPart * all * 2 * std::numbers::pi / 8;
  int straight = 0;
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t end = i;
    for (double along = 0; along < kPart * all; ++end) {
      along += length[end % n];
    }
    const Point chord = contour[end % n] - contour[i];
    double bent = 0;
    for (std::size_t k = i; k < end; ++k) {
      bent = std::max(bent, (contour[k % n] - contour[i]).cross(chord) / std::max(cv::norm(chord), 1e-9));
    }
    straight += bent < sagitta ? 1 : 0;
  }
  return straight / static_cast<double>(n);
}

constexpr double kWeakOf = 0.4;  // of the usual edge

// Share of the places at which light comes across the edge and little of it is seen.
double weak_share_in_light(const ClosedEdge& edge) {
  constexpr double kAcross = 0.5;  // cosine
  constexpr int kApart = 3;        // points of the contour, from either side of a place to it
  const Contour contour = from_polar(edge.centre, edge.path.r);
  const std::size_t n = contour.size();
  Vector<double> lit;  // the edge if light came straight across it
  for (std::size_t i = 0; i < n; ++i) {
    const Point along = contour[(i + kApart) % n] - contour[(i + n - kApart) % n];
    const double across = std::abs(edge.relief.along.cross(along)) / std::max(cv::norm(along), 1e-9);
    if (edge.path.strength[i] != 0 && across > kAcross) {
      lit.push_back(static_cast<double>(edge.path.strength[i]) / across);
    }
  }
  if (lit.empty()) {
    return 1;
  }
  const double usual = median_of(lit);
  const auto weak = std::count_if(lit.begin(), lit.end(), [&](double e) { return e < kWeakOf * usual; });
  return static_cast<double>(weak) / static_cast<double>(lit.size());
}

// Glass, its shadows and dirt have closed paths of strong gradient as well. Round a cell the edge stands out
// of what is beside it, single places of it lie on one curve, and that bends nearly everywhere and fades
// nowhere, in relief nowhere that light comes across it.
bool bounds_a_cell(const ClosedEdge& edge) {
  constexpr double kAboveBackground = 3.5, kMostScatter_px = 0.75, kMostOff = 0.055;
  constexpr double kAboveInRelief = 5, kWeakInLight = 0.15, kWeakUnlit = 0.2;
  constexpr double kStraight = 0.155, kOff = 0.045, kWeak = 0.25;
  const EdgePath& path = edge.path;
  const bool relief = edge.polarity == Polarity::relief;
  const double off = off_an_oval(path.r);
  if (path.level < (relief ? kAboveInRelief : kAboveBackground) * path.background ||
      path.residual > kMostScatter_px || off > kMostOff ||
      (relief && weak_share_in_light(edge) > kWeakInLight)) {
    return false;
  }
  int shown = 0, weak = 0;
  for (const float e : path.strength) {
    shown += e != 0 ? 1 : 0;
    weak += e != 0 && static_cast<double>(e) < kWeakOf * path.level ? 1 : 0;
  }
  if (!relief && weak > kWeakUnlit * shown) {
    return false;
  }
  return straight_share(from_polar(edge.centre, path.r)) < kStraight || (off < kOff && weak < kWeak * shown);
}

// Where light comes from one side, the picture across an edge changes its sign round the cell: what turns
// with the direction of the edge is more than what is the same all round. Least squares for each distance.
struct ReliefSeen {
  Relief relief;
  double even = 0, turning = 0;  // mean squares of the two, summed over the distances
  double left = 1;               // share of the picture across the edge that is neither
};

std::optional<ReliefSeen> relief_across(const ClosedEdge& edge, const ClearedPicture& picture) {
  constexpr double kAcross_px = 6, kMost = 3;  // times the usual misfit; what fits worse counts less
  constexpr int kLeastPoints = 48;
  const EdgeProfiles profiles(picture, from_polar(edge.centre, edge.path.r), kAcross_px, kAcross_px);
  struct Across {
    cv::Vec3d by;  // 1 and the direction of the edge
    std::size_t point;
    double weight = 1, all = 0, left = 0;  // grey levels squared
  };
  Vector<Across> points;
  for (std::size_t i = 0; i < profiles.points; ++i) {
    if (profiles.whole(i)) {
      points.push_back({{1, profiles.normal[i].x, profiles.normal[i].y}, i});
    }
  }
  if (points.size() < kLeastPoints) {
    return std::nullopt;
  }
  const auto grey = [&](const Across& p, std::size_t j) {
    return static_cast<double>(
        profiles.grey_of(p.point / kSideBySide)[j][static_cast<int>(p.point % kSideBySide)]);
  };
  Vector<cv::Vec3d> shown(profiles.samples);
  for (int round = 0; round < 2; ++round) {  // a pipette beside the cell is stronger than the edge
    cv::Matx33d a = cv::Matx33d::eye() * 1e-6;
    for (const Across& p : points) {
      a += p.weight * p.by * p.by.t();
    }
    for (std::size_t j = 0; j < profiles.samples; ++j) {
      cv::Vec3d b;
      for (const Across& p : points) {
        b += p.weight * grey(p, j) * p.by;
      }
      shown[j] = a.solve(b, cv::DECOMP_CHOLESKY);
    }
    Vector<double> misfits;
    for (Across& p : points) {
      p.all = p.left = 0;
      for (std::size_t j = 0; j < profiles.samples; ++j) {
        const double g = grey(p, j), rest = g - p.by.dot(shown[j]);
        p.all += g * g;
        p.left += rest * rest;
      }
      misfits.push_back(p.left);
    }
    const double most = kMost * median_of(misfits);
    for (Across& p : points) {
      p.weight = std::min(1.0, most / std::max(p.left, 1e-9));
    }
  }
  double all = 0, left = 0;
  for (const Across& p : points) {
    all += p.weight * p.all;
    left += p.weight * p.left;
  }
  double even = 0, xx = 0, xy = 0, yy = 0;
  for (const cv::Vec3d& x : shown) {
    even += x[0] * x[0];
    xx += x[1] * x[1];
    xy += x[1] * x[2];
    yy += x[2] * x[2];
  }
  const double turning = 0.5 * (xx + yy + math::hypot(xx - yy, 2 * xy));  // along its direction
  Point along(xy, turning - xx);
  if (cv::norm(along) < 1e-6 * turning) {
    along = Point(1, 0);
  }
  return ReliefSeen{
      {0, along / std::max(cv::norm(along), 1e-9)}, even, 0.5 * turning, left / std::max(all, 1e-9)};
}

// The edge followed in relief, where the picture is lit from one side. A path of any sign, or of one, runs
// along other faces on either side of the cell there, and one in relief does so where it is not. The wrong
// one shows more of the other, and leaves a fifth of the picture untold, whatever its direction and noise.
std::optional<ClosedEdge> edge_in_relief(const ClosedEdge& any, EdgeBand band,
                                         const ClearedPicture& picture) {
  constexpr double kSuspected = 0.02, kStrength = 0.8;
  auto seen = relief_across(any, picture);
  std::optional<ClosedEdge> best;
  for (int round = 0; round < 2 && seen && seen->turning > kSuspected * seen->even; ++round) {
    best.reset();
    for (const Relief& r : {seen->relief, seen->relief.opposite()}) {
      band.relief = r;
      ClosedEdge e = edge_in(band, picture, Polarity::relief, any.path.saturation);
      if (!e.path.r.empty() && (!best || e.path.mean_strength > best->path.mean_strength)) {
        best = std::move(e);
      }
    }
    if (!best) {
      return std::nullopt;
    }
    seen = relief_across(*best, picture);
  }
  if (!best || !seen || seen->turning < seen->even ||
      best->path.mean_strength < kStrength * any.path.mean_strength) {
    return std::nullopt;
  }
  for (const Polarity sign : {Polarity::brighter_out, Polarity::darker_out}) {
    const ClosedEdge e = edge_in(band, picture, sign, any.path.saturation);
    const auto otherwise = e.path.r.empty() ? std::nullopt : relief_across(e, picture);
    if (otherwise && otherwise->left < seen->left &&
        seen->turning * otherwise->turning < seen->even * otherwise->even) {
      return std::nullopt;
    }
  }
  return best;
}

// Of an edge followed by its sign: per angle, how far out the outermost edge of that sign is which is about
// as strong, where such edges make an arc that lies outside of the followed one. 0 elsewhere.
Vector<double> arcs_further_out(const ClosedEdge& edge, const EdgeBand& band, const ClearedPicture& picture) {
  constexpr double kAsStrong = 0.6, kOutside_px = 3, kStep_px = 2;  // of the saturated edge
  constexpr int kArc = kFineAngles / 32;                            // the rays of an arc, at least
  const EdgeSamples samples(picture.field, band, edge.polarity);
  Vector<double> out(band.middle.size(), 0.0);
  if (samples.empty() || edge.path.r.size() != out.size()) {
    return out;
  }
  const float strong = static_cast<float>(kAsStrong * edge.path.saturation);
  const auto at = [&](int i) { return static_cast<std::size_t>(i % samples.angles); };
  const auto outermost = [&](int i) {
    const std::size_t a = at(i);
    for (int j = samples.samples - 1; j >= 0; --j) {
      const double r = band.middle[a] + (j - samples.half) * band.step;
      if (r < edge.path.r[a] + kOutside_px) {
        break;
      }
      if (samples.edge[samples.id(static_cast<int>(a), j)] > strong) {
        return r;
      }
    }
    return 0.0;
  };
  Vector<double> r(out.size());
  for (int i = 0; i < samples.angles; ++i) {
    r[at(i)] = outermost(i);
  }
  const auto goes_on = [&](int i) {
    return r[at(i)] > 0 && r[at(i + 1)] > 0 && std::abs(r[at(i + 1)] - r[at(i)]) < kStep_px;
  };
  for (int from = 0; from < samples.angles; ++from) {
    int length = 0;
    while (length < kArc && goes_on(from + length)) {
      ++length;
    }
    for (int k = 0; length == kArc && k <= kArc; ++k) {
      out[at(from + k)] = r[at(from + k)];
    }
  }
  return out;
}

// Where two edges of one sign are about as strong, one inside the other, as those of a wall and of what it
// holds, a path may change from one to the other. Keeps to the outer one if that is a closed edge as good as
// the followed one.
void keep_to_the_outermost(ClosedEdge& edge, const ClosedEdge& any, EdgeBand band,
                           const ClearedPicture& picture) {
  constexpr double kLeastShare = 0.05, kBlur_px = 2, kAsOval = 0.01;
  const Vector<double> further = arcs_further_out(edge, band, picture);
  const auto out = std::count_if(further.begin(), further.end(), [](double r) { return r > 0; });
  if (static_cast<double>(out) < kLeastShare * static_cast<double>(further.size())) {
    return;
  }
  band.lower.assign(further.size(), 0.0);
  for (std::size_t i = 0; i < further.size(); ++i) {
    band.lower[i] = std::max(0.0, further[i] - kBlur_px);
  }
  ClosedEdge outer = edge_in(band, picture, edge.polarity, edge.path.saturation);
  if (!outer.path.r.empty() && outer.path.mean_strength > kAsGood * any.path.mean_strength &&
      off_an_oval(outer.path.r) < off_an_oval(edge.path.r) + kAsOval) {
    edge = std::move(outer);
  }
}

}  // namespace

std::optional<ClosedEdge> closed_edge_round(const Circle& circle, bool seeded, double saturation,
                                            Vector<Point>& tried, const ClearedPicture& picture,
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
  const double weak_most = weak_share(any, picture) + 0.015 + 2.5 * noise * noise * noise;
  const auto follow_signs = [&](const EdgeBand& band) {
    for (const Polarity sign : {Polarity::brighter_out, Polarity::darker_out}) {
      ClosedEdge e = edge_in(band, picture, sign, any.path.saturation);
      if (e.path.r.empty() || e.path.mean_strength <= kAsGood * any.path.mean_strength) {
        continue;
      }
      keep_to_the_outermost(e, any, band, picture);
      if (weak_share(e, picture) < weak_most &&
          (best.edge.polarity == Polarity::any || e.path.mean_strength > best.edge.path.mean_strength)) {
        best.edge = std::move(e);
      }
    }
  };
  EdgeBand band = band_round(any.centre, Radii(circle, seeded, config), kFineAngles, kFine_px, picture);
  if (auto relief = edge_in_relief(any, band, picture)) {
    best.edge = *std::move(relief);
    return stands_out(best.edge.path, picture) && (seeded || bounds_a_cell(best.edge))
               ? std::optional(std::move(best))
               : std::nullopt;
  }
  follow_signs(band);
  if (best.edge.polarity == Polarity::any) {  // another edge has more of one sign: near this one alone
    constexpr double kNear_px = 6;
    band.middle = polar_radii(from_polar(any.centre, any.path.r), any.centre, kFineAngles);
    band.half_width = kNear_px;
    follow_signs(band);
    best.edge.path.background = any.path.background;
  }
  return stands_out(best.edge.path, picture) && (seeded || bounds_a_cell(best.edge))
             ? std::optional(std::move(best))
             : std::nullopt;
}

SecondEdge find_second(const Vector<double>& r1, const Point& centre, Polarity known_sign, bool outside,
                       const ClearedPicture& picture, const VisionConfig& config) {
  const double r_max = config.px(config.R_max_m), mean = median_of(r1);
  const Vector<double> first = polar_radii(from_polar(centre, r1), centre, kStartAngles);
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
    picture.exclude_holder(band, outside ? Vector<double>(first.size(), mean + gap) : first);
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
    Vector<double> offsets;
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
      best = {std::move(p), q, {}, quality};
    }
  }
  if (!best.path.r.empty()) {
    best.path.r = polar_radii(from_polar(centre, best.path.r), centre, static_cast<int>(r1.size()));
  }
  return best;
}

SecondEdge find_in_relief(const Vector<double>& r1, const Point& centre, const Relief& relief, double from,
                          double to, const ClearedPicture& picture) {
  SecondEdge out;
  const Vector<double> first = polar_radii(from_polar(centre, r1), centre, kFineAngles);
  if (first.empty() || to - from < 4) {
    return out;
  }
  EdgeBand band;
  band.centre = centre;
  band.half_width = (to - from) / 2;
  band.middle = first;
  picture.exclude_holder(band, first, true);
  for (double& r : band.middle) {
    r += (from + to) / 2;
  }
  band.stiffness = 0.8;
  band.covered = picture.covered;
  band.measures_background = true;
  band.relief = relief;
  out.path = closed_path(picture.field, band, Polarity::relief, picture.edge_floor(), 0);
  out.polarity = Polarity::relief;
  out.relief = relief;
  if (!out.path.r.empty()) {
    out.quality = out.path.level * out.path.support * std::min(1.0, out.path.visible / 0.8) /
                  std::max({out.path.background, picture.gradient_noise, 0.02});
    out.path.r = polar_radii(from_polar(centre, out.path.r), centre, static_cast<int>(r1.size()));
  }
  return out;
}

bool clear_enough(const SecondEdge& edge, double first_level, const ClearedPicture& picture) {
  // A path that is not nearly an oval has followed something else, as has one that is not round the centre.
  return !edge.path.r.empty() && edge.quality >= kContrast &&
         edge.path.level >= kPathClear_noise * picture.gradient_noise &&
         edge.path.level >= 0.12 * first_level && off_an_oval(edge.path.r) < kOvalDeviation;
}

}  // namespace punctum::vision
