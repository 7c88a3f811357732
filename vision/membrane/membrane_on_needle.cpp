#include "vision/membrane/membrane_on_needle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/parabola.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr double kBesideEdge_px = 2.5;     // outside the needle's edge; the needle's blur reaches less far
constexpr double kContourReach_px = 5;     // a contact point lies so near the contour
constexpr double kDistancePenalty = 0.05;  // of the floor per px from the contour
constexpr std::array kLumen = {-0.4, -0.2, 0.0, 0.2, 0.4};  // of the half-width: clear of the walls
// Of the variance of the picture's noise, once it is smoothed and averaged across the lumen; and how far
// along the axis neighbours tell the same.
constexpr double kNoiseShare = 0.05, kJoined_px = 3;
constexpr double kHeight = 0.5;  // by which a membrane on the tip stands out more or less than elsewhere: sd
constexpr double kUnlike = 0.2;  // of what a membrane on the tip explains, left beyond the noise: it is none

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
  Vector<double> g, at;
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

// Mean over the inner part of the lumen, at the distance s behind the tip. Empty outside of the field.
std::optional<double> grey_in_lumen(const GradientField& field, const NeedlePose& needle, double s) {
  const cv::Rect& a = field.area;
  double sum = 0;
  for (const double u : kLumen) {
    const Point p = needle.at(s, u * needle.half_width);
    if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
      return std::nullopt;
    }
    sum += field.grey(p);
  }
  return sum / kLumen.size();
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

void TipOnMembrane::learn(const GradientField& field, const NeedlePose& needle) {
  std::array<double, kPlaces> now{};
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const auto grey = grey_in_lumen(field, needle, kBack_px - static_cast<double>(i) * kStep_px);
    if (!grey) {
      return;
    }
    now[i] = *grey;
  }
  constexpr int kMemory = 40;
  frames_ = std::min(frames_ + 1, kMemory);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    grey_[i] += (now[i] - grey_[i]) / frames_;
  }
}

// For every place of the tip the picture is compared with the learnt grey there, the membrane of any contrast
// at the tip, and a level. Where the picture tells little, what the pose says counts.
std::optional<TipOnMembrane::Tip> TipOnMembrane::ahead(const GradientField& field, double noise,
                                                       const EdgeLearnt& membrane,
                                                       const NeedlePose& needle) const {
  constexpr double kReach_px = 5, kDrawn_px = 3;  // by which the tip may be wrong: at most, and deviation
  constexpr double kFrom_px = 8, kTo_px = 3;      // of the tip: what is compared
  constexpr double kRounded = 0.3;                // grey levels, standard deviation of whole ones
  constexpr int kPlacesSeen = static_cast<int>((kFrom_px + kTo_px + 2 * kReach_px) / kStep_px) + 1;
  if (frames_ == 0) {
    return std::nullopt;
  }
  std::array<double, static_cast<std::size_t>(kPlacesSeen)> seen{};  // from behind
  for (int i = 0; i < kPlacesSeen; ++i) {
    const auto grey = grey_in_lumen(field, needle, kFrom_px + kReach_px - i * kStep_px);
    if (!grey) {
      return std::nullopt;
    }
    seen[static_cast<std::size_t>(i)] = *grey;
  }
  constexpr int kTips = static_cast<int>(2 * kReach_px / kStep_px) + 1;
  constexpr int kCompared = static_cast<int>((kFrom_px + kTo_px) / kStep_px) + 1;
  constexpr int kLearntFrom = static_cast<int>((kBack_px - kFrom_px) / kStep_px);
  const double blur = math::hypot(std::max(membrane.own_blur_px, kUsualBlur_px), field.sigma);
  // Samples that are nearer than the smoothing tell the same.
  const double grey = std::max(noise, kRounded), variance = grey * grey * kNoiseShare * kJoined_px / kStep_px;
  std::array<double, static_cast<std::size_t>(kTips)> unlikely{};  // -2 times the log-likelihood
  std::array<bool, static_cast<std::size_t>(kTips)> explained{};
  std::array<double, static_cast<std::size_t>(kCompared)> step{};
  double s = 0, ss = 0;
  for (int i = 0; i < kCompared; ++i) {
    const double place = i * kStep_px - kFrom_px;  // ahead of the tip
    const double here = step[static_cast<std::size_t>(i)] =
        membrane.shape.empty() ? 0.5 * blurred_step(place / (std::numbers::sqrt2 * blur))
                               : grey_beside_face(membrane, -needle.axis, -place);
    s += here;
    ss += here * here;
  }
  constexpr double n = kCompared;
  // Certainty of its height, where it is known how the membrane looks.
  const double own = membrane.shape.empty() ? 0 : 1 / (kHeight * kHeight);
  for (int t = 0; t < kTips; ++t) {  // the tip lies t steps ahead of the range's back end
    double d = 0, sd = 0, dd = 0;
    for (int i = 0; i < kCompared; ++i) {
      const double rest =
          seen[static_cast<std::size_t>(t + i)] - grey_[static_cast<std::size_t>(kLearntFrom + i)];
      d += rest;
      sd += step[static_cast<std::size_t>(i)] * rest;
      dd += rest * rest;
    }
    // The height that fits best, and is the membrane's own as far as that is known: not upside down.
    const double with = sd - s * d / n, power = ss - s * s / n, known = variance * own;
    const double best = (with + known) / (power + known), height = own > 0 ? std::max(0.0, best) : best,
                 other = height - 1, off = (t * kStep_px - kReach_px) / kDrawn_px;
    const double by_membrane = height * (2 * with - height * power), left = dd - d * d / n - by_membrane;
    unlikely[static_cast<std::size_t>(t)] = left / variance + own * other * other + off * off;
    explained[static_cast<std::size_t>(t)] =
        left < n * kNoiseShare * grey * grey + kUnlike * kUnlike * by_membrane;
  }
  const auto best = std::min_element(unlikely.begin() + 1, unlikely.end() - 1);
  const auto i = static_cast<std::size_t>(best - unlikely.begin());
  if (!explained[i]) {
    return Tip{};
  }
  const double curvature = (unlikely[i - 1] - 2 * *best + unlikely[i + 1]) / (kStep_px * kStep_px);
  if (*best > unlikely[i - 1] || *best > unlikely[i + 1] || curvature <= 0) {
    return Tip{0, kReach_px};
  }
  return Tip{(static_cast<double>(i) + vertex_offset(-unlikely[i - 1], -*best, -unlikely[i + 1])) * kStep_px -
                 kReach_px,
             std::sqrt(2 / curvature)};
}

}  // namespace punctum::vision
