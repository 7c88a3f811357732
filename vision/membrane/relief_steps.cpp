#include "vision/membrane/relief_steps.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <type_traits>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/quad.hpp"
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
constexpr double kMostTold = 5;    // by one frame
constexpr double kShorter = 0.55;  // a step than the one before
// What a face shows that lies z blurs within, blurred by a Gaussian of sd 1; a table, for it is asked for
// often.
class BlurredFace {
 public:
  enum Seen : std::uint8_t { root, step, line };  // 1 / sqrt(depth); from 0 to 2; as high as 1
  BlurredFace() {
    for (std::size_t i = 0; i < kCount; ++i) {
      const double z = kFrom + kStep * static_cast<double>(i);
      of_[i] = std::array{blurred_root(z), blurred_step(z / std::numbers::sqrt2), math::exp(-0.5 * z * z)};
    }
  }
  // What is asked for, one after the other.
  template <Seen... asked>
  [[nodiscard]] std::array<double, sizeof...(asked)> at(double z) const {
    const double place = std::clamp((z - kFrom) / kStep, 0.0, static_cast<double>(kCount) - 1.001);
    const auto i = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(i);
    const auto between = [&](Seen of) { return of_[i][of] + part * (of_[i + 1][of] - of_[i][of]); };
    return {(asked == root && z <= kFrom ? 1 / std::sqrt(-z) : between(asked))...};
  }

 private:
  // What is crossed deeper below the face lies further from the plane that is in focus, and is blurred more:
  // by a lens of aperture 0.4 and a cell of 60 um, of a variance of about 1 + depth.
  static double blurred_root(double z) {
    double sum = 0;
    for (int k = 0; k < kNodes; ++k) {  // depth = t^2
      const double t = (k + 0.5) * kNode, off = z + t * t, variance = 1 + kWidening * t * t;
      sum += math::exp(-0.5 * off * off / variance) / std::sqrt(variance);
    }
    return 2 * kNode * sum / std::sqrt(2 * std::numbers::pi);
  }
  static constexpr double kFrom = -12, kTo = 5, kStep = 0.05, kNode = 0.03, kWidening = 1;
  static constexpr std::size_t kCount = static_cast<std::size_t>((kTo - kFrom) / kStep) + 1;
  static constexpr int kNodes = 240;  // as far as t^2 is 52
  std::array<std::array<double, 3>, kCount> of_{};
};

const BlurredFace& blurred_face() {
  static const BlurredFace face;
  return face;
}

// The sum of a b, so many.
PUNCTUM_WIDE_LOOP double product_of(const double* a, const double* b, std::size_t many) {
  Quad sum{};
  for (std::size_t j = 0; j < many; j += kQuad) {
    Quad one, other;
    load(a + j, one);
    load(b + j, other);
    sum += one * other;
  }
  return sum_of(sum);
}

// What the parts leave of what is seen: its square. height: of each part.
template <int kParts, class Parts>
double least_left(const Parts& parts, const Vector<double>& seen, std::size_t samples,
                  Eigen::Vector<double, kParts>& height) {
  constexpr double kHeld = 1e-6;  // to zero, where the parts look alike
  Eigen::Matrix<double, kParts, kParts> a;
  Eigen::Vector<double, kParts> b;
  for (int p = 0; p < kParts; ++p) {
    const double* of = parts[static_cast<std::size_t>(p)].data();
    b[p] = product_of(of, seen.data(), seen.size());
    for (int q = 0; q <= p; ++q) {
      a(p, q) = product_of(of, parts[static_cast<std::size_t>(q)].data(), seen.size());
    }
    a(p, p) += kHeld * static_cast<double>(samples);
  }
  height = a.template selfadjointView<Eigen::Lower>().llt().solve(b);
  return product_of(seen.data(), seen.data(), seen.size()) - height.dot(b);
}

}  // namespace

ReliefSteps::ReliefSteps(const Vector<double>& turning, const EdgeShape& edge)
    : edge_(edge), samples_(turning.size()), turning_(turning) {
  turning_.resize((samples_ + kQuad - 1) / kQuad * kQuad);
  parts_.fill(Vector<double>(turning_.size()));
  std::fill_n(parts_[0].begin(), samples_, 1.0);
}

// at: px from the contour; part: the first of those of that face.
void ReliefSteps::show(double at, double blur, Body body, std::size_t part) {
  const BlurredFace& face = blurred_face();
  const auto blurs = [&](std::size_t j) {
    return (static_cast<double>(j) * EdgeProfiles::kStep_px - edge_.inside - at) / blur;
  };
  if (body == Body::round) {
    for (std::size_t j = 0; j < samples_; ++j) {
      const auto [root, step] = face.at<BlurredFace::root, BlurredFace::step>(blurs(j));
      parts_[part][j] = root;
      parts_[part + 1][j] = step;
    }
  } else {
    for (std::size_t j = 0; j < samples_; ++j) {
      parts_[part][j] = face.at<BlurredFace::line>(blurs(j))[0];
    }
  }
}

double ReliefSteps::cost_of(const cv::Vec3d& x, Body body) {
  const double blur = std::clamp(x[1], kLeastBlur_px, kMostBlur_px);
  show(x[0], blur, body, 1);
  if (edge_.nearby) {
    show(x[0] + x[2], blur, body, body == Body::round ? 3 : 2);
  }
  double left = 0, own = 0;
  const auto fit = [&](auto parts) {
    Eigen::Vector<double, parts> height;
    left = least_left<parts>(parts_, turning_, samples_, height);
    own = height[1];
    if constexpr (parts > 2) {
      own = body == Body::round ? height[1] * blurred_face().at<BlurredFace::root>(-1)[0] + height[2] : own;
    }
  };
  if (body == Body::round) {
    edge_.nearby ? fit(std::integral_constant<int, 5>{}) : fit(std::integral_constant<int, 3>{});
  } else {
    edge_.nearby ? fit(std::integral_constant<int, 3>{}) : fit(std::integral_constant<int, 2>{});
  }
  if (own > 0) {  // it is the inner flank of another face
    return kNoFit;
  }
  const double off = (x[2] - (edge_.nearby ? edge_.nearby->at : 0)) /
                     std::max(kFaceTolerance_px, edge_.nearby ? edge_.nearby->tolerance_px : 0);
  return std::max(0.0, left) + kNearbyNoise * kNearbyNoise * off * off;
}

// Along each of the unknowns, in ever smaller steps; of the blur in smaller ones.
void ReliefSteps::go_downhill(Trial& here, Body body, double& step, int rounds) {
  constexpr double kOfBlur = 0.6;
  for (int round = 0; round < rounds; ++round, step *= kShorter) {
    for (int p = 0; p < (edge_.nearby ? 3 : 2); ++p) {
      for (const double way : {1.0, -1.0}) {
        for (cv::Vec3d x = here.x;;) {
          x[p] += way * step * (p == 1 ? kOfBlur : 1);
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
}

// From a few places to begin at; from where the one leads that comes to lie lowest, on.
ReliefSteps::Trial ReliefSteps::best_of(Body body) {
  constexpr std::array kOwn{-2.5, -1.0, 0.5};
  constexpr double kBlur_px = 1.4, kFirst_px = 0.5;
  constexpr int kRoundsOfEach = 3, kRoundsOfBest = 6;
  Trial best{{0, 0, 0}, 1e300};
  double step = 0;
  for (const double own : kOwn) {
    const cv::Vec3d from(own, kBlur_px, edge_.nearby ? edge_.nearby->at : 0);
    Trial here{from, cost_of(from, body)};
    step = kFirst_px;
    go_downhill(here, body, step, kRoundsOfEach);
    best = here.cost < best.cost ? here : best;
  }
  go_downhill(best, body, step, kRoundsOfBest);
  return best;
}

std::optional<ReliefSteps::Fit> ReliefSteps::fit(double part, double& flatness) {
  const Trial round = best_of(Body::round), sheet = best_of(Body::sheet);
  const double n = static_cast<double>(samples_), least = n * kLeastLeft * kLeastLeft;
  const double seen = math::log((round.cost + least) / (sheet.cost + least));  // one may not fit at all
  flatness += part * (std::clamp(seen, -kMostTold, kMostTold) - flatness);
  const bool is_round = edge_.other_flatness ? flatness + *edge_.other_flatness < math::log(kBothAsRound)
                                             : flatness < math::log(kAsRound);
  const Trial& best = is_round ? round : sheet;
  double mean = 0, square = 0;  // the zeros add nothing
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
