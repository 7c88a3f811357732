#include "vision/membrane/membrane_on_needle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <tuple>

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
constexpr double kTells = 4;     // variances: what a membrane explains where it tells its place
constexpr double kGoneOdds = 2;  // log odds from which on a membrane is no longer on the tip
constexpr double kUsuallyOff_px = 0.5;  // the membrane from the outermost glass: standard deviation
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

// As the smoothed picture shows it: its shape was learnt from the picture itself.
TipOnMembrane::Membrane TipOnMembrane::membrane_along(const EdgeLearnt& membrane, const NeedlePose& needle,
                                                      double smoothed_px) {
  Membrane out{};
  const auto place = [](std::ptrdiff_t i) {  // ahead of its face, px
    return static_cast<double>(i) * kStep_px - kFrom_px - kOffGlass_px;
  };
  if (membrane.shape.empty()) {
    const double blur = math::hypot(std::max(membrane.own_blur_px, kUsualBlur_px), smoothed_px);
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = 0.5 * blurred_step(place(static_cast<std::ptrdiff_t>(i)) / (std::numbers::sqrt2 * blur));
    }
    return out;
  }
  constexpr std::ptrdiff_t kReach = 12;
  std::array<double, 2 * kReach + 1> weights{};
  double sum = 0;
  for (std::ptrdiff_t j = -kReach; j <= kReach; ++j) {
    const double blurs = static_cast<double>(j) * kStep_px / smoothed_px;
    sum += weights[static_cast<std::size_t>(j + kReach)] = math::exp(-0.5 * blurs * blurs);
  }
  std::array<double, std::tuple_size_v<Membrane> + 2 * kReach> own{};
  for (std::size_t i = 0; i < own.size(); ++i) {
    own[i] = grey_beside_face(membrane, -needle.axis, -place(static_cast<std::ptrdiff_t>(i) - kReach));
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t j = 0; j < weights.size(); ++j) {
      out[i] += weights[j] / sum * own[i + j];
    }
  }
  return out;
}

// For every place of the tip, and of the membrane beside it, the picture is compared with the learnt grey
// there, the membrane of any contrast, and a level. Where the picture tells little, what the pose says
// counts.
std::optional<TipOnMembrane::Tip> TipOnMembrane::ahead(const GradientField& field, double noise,
                                                       const EdgeLearnt& membrane,
                                                       const NeedlePose& needle) const {
  constexpr double kReach_px = 5, kDrawn_px = 3;  // by which the tip may be wrong: at most, and deviation
  constexpr double kRounded = 0.3;                // grey levels, standard deviation of whole ones
  constexpr std::size_t kTips = static_cast<std::size_t>(2 * kReach_px / kStep_px) + 1;
  constexpr std::size_t kLearntFrom = static_cast<std::size_t>((kBack_px - kFrom_px) / kStep_px);
  if (frames_ == 0) {
    return std::nullopt;
  }
  std::array<double, kCompared + kTips - 1> seen{};  // from behind
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto grey = grey_in_lumen(field, needle, kFrom_px + kReach_px - static_cast<double>(i) * kStep_px);
    if (!grey) {
      return std::nullopt;
    }
    seen[i] = *grey;
  }
  // Samples that are nearer than the smoothing tell the same.
  const double grey = std::max(noise, kRounded), variance = grey * grey * kNoiseShare * kJoined_px / kStep_px;
  constexpr double n = kCompared;
  // Certainty of its height, where it is known how the membrane looks.
  const double own = membrane.shape.empty() ? 0 : 1 / (kHeight * kHeight), known = variance * own;
  const Membrane along = membrane_along(membrane, needle, field.sigma);
  struct Fit {
    double unlikely = 0, left = 0, by_membrane = 0;  // -2 times the log-likelihood; grey levels squared
  };
  std::array<std::array<Fit, kOffGlass>, kTips> fits{};
  Fit gone{.unlikely = std::numeric_limits<double>::infinity()};  // the likeliest far behind the tip
  double gone_to_px = 0;
  constexpr std::size_t kCoarse = 2;  // steps between two places of one that went back
  const auto of_tip = [](std::size_t t) { return static_cast<double>(t) * kStep_px - kReach_px; };
  const auto off_glass = [](std::size_t m) { return static_cast<double>(m) * kStep_px - kOffGlass_px; };
  for (std::size_t t = 0; t < kTips; ++t) {
    std::array<double, kCompared> rest{};
    double d = 0, dd = 0;
    for (std::size_t i = 0; i < kCompared; ++i) {
      rest[i] = seen[t + i] - grey_[kLearntFrom + i];
      d += rest[i];
      dd += rest[i] * rest[i];
    }
    const double drawn = of_tip(t) / kDrawn_px;
    const auto fit = [&](const double* shown) -> Fit {
      double s = 0, ss = 0, sd = 0;
      for (std::size_t i = 0; i < kCompared; ++i) {
        s += shown[i];
        ss += shown[i] * shown[i];
        sd += shown[i] * rest[i];
      }
      // The height that fits best, and is the membrane's own as far as that is known: not upside down.
      const double with = sd - s * d / n, power = ss - s * s / n;
      const double best = (with + known) / (power + known), height = own > 0 ? std::max(0.0, best) : best,
                   other = height - 1;
      const double by_membrane = height * (2 * with - height * power), left = dd - d * d / n - by_membrane;
      return {left / variance + own * other * other + drawn * drawn, left, by_membrane};
    };
    const double* const foremost = along.data() + kOffGlass - 1;
    for (std::size_t m = 0; m < kOffGlass; ++m) {
      const double off = off_glass(m) / kUsuallyOff_px;
      fits[t][m] = fit(foremost - m);
      fits[t][m].unlikely += off * off;
    }
    for (std::size_t m = kCoarse; m <= kGone && t % kCoarse == 0; m += kCoarse) {
      if (const Fit there = fit(foremost + m); there.unlikely < gone.unlikely) {
        gone = there;
        gone_to_px = of_tip(t) - kOffGlass_px - static_cast<double>(m) * kStep_px;
      }
    }
  }
  // Where a membrane on the tip does not explain what is seen even just on it, or one that went back does so
  // better, it is not there.
  constexpr std::size_t kOnGlass = kOffGlass / 2;
  const auto likeliest = std::min_element(fits.begin(), fits.end(), [](const auto& a, const auto& b) {
    return a[kOnGlass].unlikely < b[kOnGlass].unlikely;
  });
  const Fit& on = (*likeliest)[kOnGlass];
  double least = on.unlikely, likeliest_place = of_tip(static_cast<std::size_t>(likeliest - fits.begin()));
  for (std::size_t t = 0; t < kTips; ++t) {
    for (std::size_t m = 0; m < kOffGlass; ++m) {
      if (fits[t][m].unlikely < least) {
        least = fits[t][m].unlikely;
        likeliest_place = of_tip(t) + off_glass(m);
      }
    }
  }
  if (const double odds = 0.5 * (least - gone.unlikely); odds > kGoneOdds) {
    return Tip{.membrane = gone_to_px, .membrane_sd = kStep_px * kCoarse, .gone_odds = odds};
  }
  if (on.left >= n * kNoiseShare * grey * grey + kUnlike * kUnlike * on.by_membrane) {
    return Tip{};
  }
  if (on.by_membrane < kTells * variance) {  // noise hides it, and the pose counts
    return Tip{.sd = kDrawn_px, .membrane_sd = kDrawn_px};
  }
  if (likeliest == fits.begin()) {  // the tip was not seen there, but the membrane is, or still further back
    return Tip{.membrane = -kReach_px, .membrane_sd = kGone_px - kReach_px, .gone_odds = kGoneOdds};
  }
  if (likeliest == fits.end() - 1) {
    return Tip{.sd = kReach_px};
  }
  // Further off other pixels are compared, which the membrane may not even be in.
  constexpr double kSamePlace_px = 1.5;
  double sum = 0, tip = 0, tips = 0, place = 0, places = 0;  // of the weights; means; of squares
  for (std::size_t t = 0; t < kTips; ++t) {
    for (std::size_t m = 0; m < kOffGlass; ++m) {
      const double at = of_tip(t), seen_at = at + off_glass(m);
      if (std::abs(seen_at - likeliest_place) > kSamePlace_px) {
        continue;
      }
      const double weight = math::exp(-0.5 * (fits[t][m].unlikely - least));
      sum += weight;
      tip += weight * at;
      tips += weight * at * at;
      place += weight * seen_at;
      places += weight * seen_at * seen_at;
    }
  }
  tip /= sum;
  place /= sum;
  return Tip{tip, std::sqrt(std::max(tips / sum - tip * tip, 0.0)), place - tip,
             std::sqrt(std::max(places / sum - place * place, 0.0))};
}

}  // namespace punctum::vision
