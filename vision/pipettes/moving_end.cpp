#include "vision/pipettes/moving_end.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

constexpr double kFastest_px = 3, kSpeedsApart_px = 0.25, kPlacesApart_px = 0.5;

// Between two of the ends that were tried; further off, as at the last one.
double gain_at(const LikelyEnds& ends, std::size_t cut, double behind) {
  const auto& of_cut = ends.gain[cut];
  const double place = std::clamp(behind + LikelyEnds::kReach_px, 0.0, 2 * LikelyEnds::kReach_px - 1e-9);
  const auto k = static_cast<std::size_t>(place);
  return of_cut[k] + (place - static_cast<double>(k)) * (of_cut[k + 1] - of_cut[k]);
}

struct Hypothesis {
  double per_frame, behind, outermost, gain;
};

}  // namespace

std::optional<MovingEnd> moving_end(const Vector<SeenEnds>& frames, double radius_px, bool motion_known) {
  const double fastest = motion_known ? 0 : kFastest_px;
  Vector<Hypothesis> likely;
  Hypothesis best{0, 0, 0, -1e18};
  for (double v = -fastest; v <= fastest; v += kSpeedsApart_px) {
    for (std::size_t cut = 0; cut < LikelyEnds::kCuts; ++cut) {
      const double ahead = radius_px * std::abs(LikelyEnds::tangent(cut));
      for (double at = -LikelyEnds::kReach_px; at <= LikelyEnds::kReach_px; at += kPlacesApart_px) {
        Hypothesis& one = likely.emplace_back(Hypothesis{v, at, ahead - at, 0});
        for (const auto& [ends, behind, age] : frames) {
          one.gain += gain_at(ends, cut, at + behind + v * age);
        }
        if (one.gain > best.gain) {
          best = one;
        }
      }
    }
  }
  if (likely.empty() || (!motion_known && std::abs(best.per_frame) >= fastest)) {
    return std::nullopt;
  }
  // Of each speed: how likely it is, and its mean of the outermost glass.
  double all = 0, speed = 0, mean = 0, squares = 0, weight = 0, places = 0;
  for (std::size_t i = 0; i < likely.size(); ++i) {
    const double w = math::exp(0.5 * (likely[i].gain - best.gain)), v = likely[i].per_frame;
    weight += w;
    places += w * likely[i].outermost;
    if (i + 1 == likely.size() || likely[i + 1].per_frame != v) {
      all += weight;
      speed += weight * v;
      mean += places;
      squares += weight > 0 ? places * places / weight : 0;
      weight = places = 0;
    }
  }
  mean /= all;
  return MovingEnd{best.behind, speed / all, std::sqrt(std::max(squares / all - mean * mean, 0.0))};
}

}  // namespace punctum::vision
