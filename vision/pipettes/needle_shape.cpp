#include "vision/pipettes/needle_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"

namespace punctum::vision {

namespace {

constexpr double kStep_px = 0.5;
constexpr int kAhead = 20;       // steps that the shape begins ahead of the tip: as far as a start may err
constexpr int kBehind = 160;     // steps behind the tip; further back the shaft tells nothing of the end
constexpr int kLeastShaft = 24;  // steps of the needle that must be seen
constexpr int kMemory = 40;      // frames
// Neighbouring steps do not tell independent things: smoothing and granules join about this many.
constexpr double kJoined = 8;
constexpr double kClear = 6;  // log-likelihood by which a needle is told from none
constexpr double kDoubt = 3;  // log-likelihood below the best; a Gaussian has fallen so far at 2.4 sigma

}  // namespace

std::optional<NeedleShape::Profile> NeedleShape::profile(const GradientField& field, const NeedlePose& needle,
                                                         double behind) const {
  const cv::Rect& a = field.area;
  Profile v{};
  double mean = 0, tilt = 0, xx = 0;
  const auto place = [](std::size_t i) { return 2.0 * static_cast<double>(i) / (kLanes - 1) - 1; };
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Point p = needle.at(behind, place(i) * reach_);
    if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
      return std::nullopt;
    }
    v[i] = field.grey(p);
    mean += v[i] / kLanes;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    tilt += place(i) * v[i];
    xx += place(i) * place(i);
  }
  const double light = std::max(mean, 1.0);
  for (std::size_t i = 0; i < kLanes; ++i) {
    v[i] = (v[i] - mean - tilt / xx * place(i)) / light;
  }
  return v;
}

void NeedleShape::learn(const GradientField& field, const NeedlePose& needle) {
  if (frames_ == 0) {
    constexpr double kBeside_px = 2.5;  // the blur of the walls
    reach_ = needle.half_width_at(20) + kBeside_px;
  }
  std::vector<Profile> now;
  for (int k = -kAhead; k <= kBehind; ++k) {
    const auto v = profile(field, needle, k * kStep_px);
    if (!v) {
      break;
    }
    now.push_back(*v);
  }
  if (now.size() < static_cast<std::size_t>(kAhead + kLeastShaft)) {
    return;
  }
  frames_ = std::min(frames_ + 1, kMemory);
  const std::size_t old = mean_.size();
  mean_.resize(std::max(old, now.size()));
  for (std::size_t k = 0; k < now.size(); ++k) {
    const double part = k < old ? 1.0 / frames_ : 1;
    for (std::size_t i = 0; i < kLanes; ++i) {
      mean_[k][i] += part * (now[k][i] - mean_[k][i]);
    }
  }
  smooth_along_shaft();
}

// Behind its tip the needle looks the same everywhere, and ahead of it is nothing of it: what differs there
// is a speck, and one that stands still while the needle moves must not hold the shape where it was.
void NeedleShape::smooth_along_shaft() {
  // Steps: up to here the shape is the tip's own. Over few frames a speck would weigh, so it is less then.
  const std::size_t tip = kAhead + (frames_ < kMemory / 2 ? 8 : 16);
  constexpr std::size_t kReach = 24, kStride = 4;  // steps: a speck is shorter
  constexpr double kBlur_px = 4;                   // ahead of the face
  shape_ = mean_;
  std::vector<double> near;
  for (std::size_t k = tip; k < mean_.size(); ++k) {
    std::size_t from = std::max(tip, k - kReach), to = std::min(mean_.size() - 1, k + kReach);
    if (frames_ >= kMemory / 2) {  // even, so that a needle that widens is not drawn to one side
      const std::size_t reach = std::min({kReach, k - kAhead, mean_.size() - 1 - k}) / kStride * kStride;
      from = k - reach;
      to = k + reach;
    }
    for (std::size_t i = 0; i < kLanes; ++i) {
      near.clear();
      for (std::size_t j = from; j <= to; j += kStride) {
        near.push_back(mean_[j][i]);
      }
      shape_[k][i] = median_of(near);
    }
  }
  const double front = kAhead - (face().value_or(0) + kBlur_px) / kStep_px;
  for (std::size_t k = 0; k < kAhead && static_cast<double>(k) < front; ++k) {
    shape_[k].fill(0);
  }
}

double NeedleShape::square(const Profile& p) {
  double s = 0;
  for (const double x : p) {
    s += x * x;
  }
  return s;
}

// Blur does not move the middle of a step: there the walls have half of their strength. From the walls to
// the front, so that a speck ahead of the tip does not count.
std::optional<double> NeedleShape::face() const {
  constexpr std::size_t kFrom = 6, kTo = 16;    // steps behind the face: the walls in full strength
  constexpr std::size_t kSurely = kAhead + 30;  // steps: there the shape shows walls however wrong the start
  if (shape_.size() < kSurely + kTo) {
    return std::nullopt;
  }
  const auto strength = [this](std::size_t k, const Profile& walls) {
    double s = 0;
    for (std::size_t i = 0; i < kLanes; ++i) {
      s += shape_[k][i] * walls[i];
    }
    return s / std::max(square(walls), 1e-12);
  };
  for (std::size_t k = kSurely; k > 0; --k) {
    Profile walls{};
    for (std::size_t j = k + kFrom; j < k + kTo; ++j) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        walls[i] += shape_[j][i] / (kTo - kFrom);
      }
    }
    const double here = strength(k, walls), before = strength(k - 1, walls);
    if (before < 0.5) {
      const double part = here > before ? std::clamp((0.5 - before) / (here - before), 0.0, 1.0) : 0.5;
      return (kAhead - (static_cast<double>(k) - 1 + part)) * kStep_px;
    }
  }
  return kAhead * kStep_px;  // the needle goes on at least so far
}

std::optional<NeedleShape::End> NeedleShape::end(const GradientField& field, const NeedlePose& needle,
                                                 double back, double ahead) const {
  if (!known()) {
    return std::nullopt;
  }
  // What the picture shows, from the most forward end on; seen[j] is j steps behind it.
  const int ends = static_cast<int>((back + ahead) / kStep_px) + 1;
  std::vector<Profile> seen;
  for (int j = -kAhead; j < ends + kBehind - kAhead; ++j) {
    const auto v = profile(field, needle, j * kStep_px - ahead);
    if (!v) {
      break;
    }
    seen.push_back(*v);
  }
  const int n = static_cast<int>(seen.size());
  if (n < ends + kAhead + kLeastShaft) {
    return std::nullopt;
  }
  std::vector<double> power;  // of the shape, step by step
  for (const Profile& p : shape_) {
    power.push_back(square(p));
  }
  // What the surroundings of the needle show is noise to it: the mean square of what remains of the profiles
  // once the needle is taken off, for an end e steps behind the most forward one.
  const int last_shape = static_cast<int>(shape_.size()) - 1;
  std::vector<double> gain(static_cast<std::size_t>(ends), 0.0);
  for (int e = 0; e < ends; ++e) {
    for (int j = e; j < n; ++j) {
      const std::size_t k = static_cast<std::size_t>(std::min(j - e, last_shape));
      if (power[k] <= 0) {
        continue;
      }
      double dot = 0;
      for (std::size_t i = 0; i < kLanes; ++i) {
        dot += seen[static_cast<std::size_t>(j)][i] * shape_[k][i];
      }
      // A speck or another edge may tell for or against it no more than the needle itself.
      const double share = std::clamp(dot / power[k], -0.5, 1.5);
      gain[static_cast<std::size_t>(e)] += power[k] * (share - 0.5);
    }
  }
  const auto top = std::max_element(gain.begin(), gain.end());
  const int best = static_cast<int>(top - gain.begin());
  if (best < 2 || best > ends - 3) {
    return std::nullopt;
  }
  // Variance of a lane: by the profiles ahead of this end, and of what is left behind it.
  std::vector<double> squares;
  for (int j = 0; j < n; ++j) {
    const int k = j - best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double shape = k < 0 ? 0 : shape_[static_cast<std::size_t>(std::min(k, last_shape))][i];
      const double d = seen[static_cast<std::size_t>(j)][i] - shape;
      if (k < kLeastShaft) {
        squares.push_back(d * d);
      }
    }
  }
  double variance = 0;
  for (const double s : squares) {
    variance += s / static_cast<double>(squares.size());
  }
  const double unit = kJoined * std::max(variance, 1e-8);
  const auto at = [&](int e) { return gain[static_cast<std::size_t>(e)] / unit; };
  if (at(best) - at(0) < kClear || at(best) - at(ends - 1) < kClear) {
    return std::nullopt;
  }
  End out;
  for (int e = 0; e < ends; ++e) {
    if (at(best) - at(e) < kDoubt) {
      out.doubt = std::max(out.doubt, std::abs(e - best) * kStep_px);
    }
  }
  const double peak = best + vertex_offset(at(best - 1), at(best), at(best + 1));
  out.ahead = ahead - peak * kStep_px;
  return out;
}

}  // namespace punctum::vision
