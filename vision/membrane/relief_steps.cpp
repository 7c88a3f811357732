#include "vision/membrane/relief_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/membrane/edge_profiles.hpp"

namespace punctum::vision {

namespace {

constexpr double kFurthestFace_px = 4;   // an own face further from the contour is another edge
constexpr double kFaceTolerance_px = 1;  // of the nearby face's place, at least
constexpr double kNearbyNoise = 0.5;     // grey levels that a nearby face one tolerance away is worth
constexpr double kMostLeft = 0.25;       // of the spread of the shape, rms: a worse fit is none
constexpr double kLeastBlur_px = 0.7, kMostBlur_px = 4;
constexpr double kNoFit = 1e200;
constexpr double kLeastLeft = 0.05;  // grey levels, rms: no fit is better
// A round body has more freedom than a sheet, and fits noise and texture better. Of what the sheet leaves; of
// the two membranes together.
constexpr double kAsRound = 0.55, kBothAsRound = 0.09;
constexpr double kMostTold = 5;  // by one frame
constexpr int kParts = 5;  // level; of either face of a round body the root and a step, of a sheet a line

// 1 / sqrt(depth) blurred by a Gaussian of sd 1, at the depth -z. What is crossed deeper below the face lies
// further from the plane that is in focus, and is blurred more: by a lens of aperture 0.4 and a cell of 60
// um, of a variance of about 1 + depth.
class BlurredRoot {
 public:
  BlurredRoot() {
    for (std::size_t i = 0; i < value_.size(); ++i) {
      const double z = kFrom + kStep * static_cast<double>(i);
      double sum = 0;
      for (int k = 0; k < kNodes; ++k) {  // depth = t^2
        const double t = (k + 0.5) * kNode, off = z + t * t, variance = 1 + kWidening * t * t;
        sum += math::exp(-0.5 * off * off / variance) / std::sqrt(variance);
      }
      value_[i] = 2 * kNode * sum / std::sqrt(2 * std::numbers::pi);
    }
  }
  [[nodiscard]] double at(double z) const {
    if (z <= kFrom) {
      return 1 / std::sqrt(-z);
    }
    const double place = std::min((z - kFrom) / kStep, static_cast<double>(kCount) - 1.001);
    const auto i = static_cast<std::size_t>(place);
    return value_[i] + (place - static_cast<double>(i)) * (value_[i + 1] - value_[i]);
  }

 private:
  static constexpr double kFrom = -12, kTo = 5, kStep = 0.05, kNode = 0.03, kWidening = 1;
  static constexpr std::size_t kCount = static_cast<std::size_t>((kTo - kFrom) / kStep) + 1;
  static constexpr int kNodes = 240;  // as far as t^2 is 52
  std::array<double, kCount> value_{};
};

}  // namespace

double ReliefSteps::cost_of(const cv::Vec3d& x, Body body) const {
  static const BlurredRoot root;
  const double blur = std::clamp(x[1], kLeastBlur_px, kMostBlur_px), spread = blur * std::numbers::sqrt2;
  const int parts = edge_.nearby ? (body == Body::round ? 5 : 3) : (body == Body::round ? 3 : 2);
  cv::Matx<double, kParts, kParts> a = cv::Matx<double, kParts, kParts>::zeros();
  cv::Vec<double, kParts> b = cv::Vec<double, kParts>::all(0);
  std::array<double, kParts> column{};
  double squares = 0;
  for (std::size_t j = 0; j < turning_.size(); ++j) {
    const double s = static_cast<double>(j) * EdgeProfiles::kStep_px - edge_.inside - x[0], t = s - x[2];
    if (body == Body::round) {
      column = {1, root.at(s / blur), blurred_step(s / spread)};
    } else {
      column = {1, math::exp(-s * s / (spread * spread))};
    }
    if (edge_.nearby && body == Body::round) {
      column[3] = root.at(t / blur);
      column[4] = blurred_step(t / spread);
    } else if (edge_.nearby) {
      column[2] = math::exp(-t * t / (spread * spread));
    }
    for (int p = 0; p < parts; ++p) {
      b(p) += column[static_cast<std::size_t>(p)] * turning_[j];
      for (int q = 0; q <= p; ++q) {
        a(p, q) += column[static_cast<std::size_t>(p)] * column[static_cast<std::size_t>(q)];
      }
    }
    squares += turning_[j] * turning_[j];
  }
  for (int p = 0; p < kParts; ++p) {
    a(p, p) += p < parts ? 1e-6 * static_cast<double>(turning_.size()) : 1;
    for (int q = 0; q < p; ++q) {
      a(q, p) = a(p, q);
    }
  }
  const cv::Vec<double, kParts> height = a.solve(b, cv::DECOMP_CHOLESKY);
  const double own = body == Body::round ? height(1) * root.at(-1) + height(2) : height(1);
  if (own > 0) {  // it is the inner flank of another face
    return kNoFit;
  }
  const double off = (x[2] - (edge_.nearby ? edge_.nearby->at : 0)) /
                     std::max(kFaceTolerance_px, edge_.nearby ? edge_.nearby->tolerance_px : 0);
  return std::max(0.0, squares - height.dot(b)) + kNearbyNoise * kNearbyNoise * off * off;
}

// From a few places to begin at, downhill along each of the unknowns, in ever smaller steps.
ReliefSteps::Trial ReliefSteps::best_of(Body body) const {
  constexpr std::array kOwn{-2.5, -1.0, 0.5};
  constexpr double kBlur_px = 1.4;
  constexpr int kRounds = 9;
  constexpr double kShorter = 0.55;
  Trial best{{0, 0, 0}, 1e300};
  for (const double own : kOwn) {
    const cv::Vec3d from(own, kBlur_px, edge_.nearby ? edge_.nearby->at : 0);
    Trial here{from, cost_of(from, body)};
    cv::Vec3d step(0.5, 0.3, 0.5);
    for (int round = 0; round < kRounds; ++round, step *= kShorter) {
      for (int p = 0; p < (edge_.nearby ? 3 : 2); ++p) {
        for (const double way : {1.0, -1.0}) {
          for (cv::Vec3d x = here.x;;) {
            x[p] += way * step[p];
            if (std::abs(x[0]) >= kFurthestFace_px + 1 || x[1] <= kLeastBlur_px || x[1] >= kMostBlur_px) {
              break;
            }
            const double cost = cost_of(x, body);
            if (cost >= here.cost) {
              break;
            }
            here = {x, cost};
          }
        }
      }
    }
    best = here.cost < best.cost ? here : best;
  }
  return best;
}

std::optional<ReliefSteps::Fit> ReliefSteps::fit(double part, double& flatness) const {
  const Trial round = best_of(Body::round), sheet = best_of(Body::sheet);
  const double n = static_cast<double>(turning_.size()), least = n * kLeastLeft * kLeastLeft;
  const double seen = math::log((round.cost + least) / (sheet.cost + least));  // one may not fit at all
  flatness += part * (std::clamp(seen, -kMostTold, kMostTold) - flatness);
  const bool is_round = edge_.other_flatness ? flatness + *edge_.other_flatness < math::log(kBothAsRound)
                                             : flatness < math::log(kAsRound);
  const Trial& best = is_round ? round : sheet;
  double mean = 0, square = 0;
  for (const double v : turning_) {
    mean += v / n;
    square += v * v / n;
  }
  const double left = std::sqrt(best.cost / n);
  if (std::abs(best.x[0]) > kFurthestFace_px || left > kMostLeft * std::sqrt(square - mean * mean)) {
    return std::nullopt;
  }
  return Fit{best.x[0], left};
}

}  // namespace punctum::vision
