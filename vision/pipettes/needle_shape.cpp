#include "vision/pipettes/needle_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "hal/math/elementary.hpp"
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
// A needle that left the plane of focus: its walls blur into each other, most of all near the tip.
constexpr std::array kBlurs_px = {0.0, 0.8, 1.2, 1.6, 2.0, 2.5};

// Where a lane stands across the needle: -1 .. 1.
double place(std::size_t lane, std::size_t lanes) {
  return 2.0 * static_cast<double>(lane) / static_cast<double>(lanes - 1) - 1;
}

}  // namespace

void NeedleShape::remove_mean_and_slope(Profile& p) {
  double mean = 0, tilt = 0, xx = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    mean += p[i] / kLanes;
    tilt += place(i, kLanes) * p[i];
    xx += place(i, kLanes) * place(i, kLanes);
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    p[i] -= mean + tilt / xx * place(i, kLanes);
  }
}

std::optional<NeedleShape::Profile> NeedleShape::profile(const GradientField& field, const Backdrop* backdrop,
                                                         const NeedlePose& needle, double behind) const {
  const cv::Rect& a = field.area;
  Profile v{}, without{};
  double light = 0;
  bool known = backdrop != nullptr;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Point p = needle.at(behind, place(i, kLanes) * reach_);
    if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
      return std::nullopt;
    }
    v[i] = field.grey(p);
    light += v[i] / kLanes;
    if (known) {
      const auto g = backdrop->grey(p);
      known = g && *g > 1;
      without[i] = g.value_or(0);
    }
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    v[i] /= known ? without[i] : std::max(light, 1.0);
  }
  remove_mean_and_slope(v);
  return v;
}

void NeedleShape::learn(const GradientField& field, const NeedlePose& needle) {
  if (frames_ == 0) {
    constexpr double kBeside_px = 2.5;  // the blur of the walls
    reach_ = needle.half_width_at(20) + kBeside_px;
  }
  std::vector<Profile> now;
  for (int k = -kAhead; k <= kBehind; ++k) {
    const auto v = profile(field, nullptr, needle, k * kStep_px);
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
  Profiles& shape = shape_.front();
  shape = mean_;
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
      shape[k][i] = median_of(near);
    }
  }
  const double front = kAhead - (face().value_or(0) + kBlur_px) / kStep_px;
  for (std::size_t k = 0; k < kAhead && static_cast<double>(k) < front; ++k) {
    shape[k].fill(0);
  }
  for (std::size_t b = 1; b < shape_.size(); ++b) {
    shape_[b] = blurred(kBlurs_px[b]);
  }
}

// In three sums that do not wait for each other: this is where a frame's time goes.
double NeedleShape::product(const Profile& a, const Profile& b) {
  static_assert(kLanes % 3 == 0);
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < kLanes; i += 3) {
    sum[0] += a[i] * b[i];
    sum[1] += a[i + 1] * b[i + 1];
    sum[2] += a[i + 2] * b[i + 2];
  }
  return sum[0] + sum[1] + sum[2];
}

// Blur does not move the middle of a step: there the walls have half of their strength. From the walls to
// the front, so that a speck ahead of the tip does not count.
std::optional<double> NeedleShape::face() const {
  const Profiles& shape = shape_.front();
  constexpr std::size_t kFrom = 6, kTo = 16;    // steps behind the face: the walls in full strength
  constexpr std::size_t kSurely = kAhead + 30;  // steps: there the shape shows walls however wrong the start
  if (shape.size() < kSurely + kTo) {
    return std::nullopt;
  }
  const auto strength = [&shape](std::size_t k, const Profile& walls) {
    return product(shape[k], walls) / std::max(product(walls, walls), 1e-12);
  };
  for (std::size_t k = kSurely; k > 0; --k) {
    Profile walls{};
    for (std::size_t j = k + kFrom; j < k + kTo; ++j) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        walls[i] += shape[j][i] / (kTo - kFrom);
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

// The shape out of focus.
NeedleShape::Profiles NeedleShape::blurred(double sigma_px) const {
  Profiles out = shape_.front();
  const auto kernel = [](double sigma) {
    std::vector<double> k;
    double sum = 0;
    for (int i = -static_cast<int>(std::ceil(3 * sigma)); i <= std::ceil(3 * sigma); ++i) {
      k.push_back(math::exp(-0.5 * i * i / (sigma * sigma)));
      sum += k.back();
    }
    for (double& x : k) {
      x /= sum;
    }
    return k;
  };
  const auto across = kernel(sigma_px * (kLanes - 1) / (2 * reach_)), along = kernel(sigma_px / kStep_px);
  const int m = static_cast<int>(across.size() / 2), l = static_cast<int>(along.size() / 2);
  for (Profile& p : out) {
    const double beside = 0.5 * (p.front() + p.back());  // there is no needle
    Profile q{};
    for (int i = 0; i < static_cast<int>(kLanes); ++i) {
      for (int d = -m; d <= m; ++d) {
        if (i + d >= 0 && i + d < static_cast<int>(kLanes)) {
          q[static_cast<std::size_t>(i)] +=
              across[static_cast<std::size_t>(d + m)] * (p[static_cast<std::size_t>(i + d)] - beside);
        }
      }
    }
    remove_mean_and_slope(q);
    p = q;
  }
  const Profiles sharp = out;
  const int last = static_cast<int>(out.size()) - 1;
  for (int k = 0; k <= last; ++k) {
    Profile q{};
    for (int d = -l; d <= l; ++d) {
      const Profile& p = sharp[static_cast<std::size_t>(std::clamp(k + d, 0, last))];
      for (std::size_t i = 0; i < kLanes; ++i) {
        q[i] += along[static_cast<std::size_t>(d + l)] * p[i];
      }
    }
    out[static_cast<std::size_t>(k)] = q;
  }
  return out;
}

// What the picture shows, from the most forward end on; the j-th is j steps behind it. Up to the border.
NeedleShape::Profiles NeedleShape::profiles(const GradientField& field, const Backdrop* backdrop,
                                            const NeedlePose& needle, double ahead, int ends) const {
  Profiles seen;
  for (int j = -kAhead; j < ends + kBehind - kAhead; ++j) {
    const auto v = profile(field, backdrop, needle, j * kStep_px - ahead);
    if (!v) {
      break;
    }
    seen.push_back(*v);
  }
  return seen;
}

NeedleShape::Fit NeedleShape::fit(const Profiles& seen, View view, int ends) const {
  const Profiles& shape = shape_[view.blur];
  const int n = static_cast<int>(seen.size());
  std::vector<double> power;  // of the shape, step by step
  for (const Profile& p : shape) {
    power.push_back(product(p, p));
  }
  const int last_shape = static_cast<int>(shape.size()) - 1;
  Fit out;
  out.view = view;
  out.gain.assign(static_cast<std::size_t>(ends), 0.0);
  for (int e = 0; e < ends; ++e) {
    for (int j = e; j < n; ++j) {
      const std::size_t k = static_cast<std::size_t>(std::min(j - e, last_shape));
      if (power[k] <= 0) {
        continue;
      }
      const double dot = product(seen[static_cast<std::size_t>(j)], shape[k]);
      // A speck or another edge may tell for or against it no more than the needle itself.
      const double share = std::clamp(dot / power[k], -0.5, 1.5);
      out.gain[static_cast<std::size_t>(e)] += power[k] * (share - 0.5);
    }
  }
  out.best = static_cast<int>(std::max_element(out.gain.begin(), out.gain.end()) - out.gain.begin());
  // What the surroundings of the needle show is noise to it. Variance of a lane: by the profiles ahead of
  // this end, and of what is left behind it.
  double sum = 0;
  int count = 0;
  for (int j = 0; j < n && j - out.best < kLeastShaft; ++j) {
    const int k = j - out.best;
    for (std::size_t i = 0; i < kLanes; ++i, ++count) {
      const double of_shape = k < 0 ? 0 : shape[static_cast<std::size_t>(std::min(k, last_shape))][i];
      const double d = seen[static_cast<std::size_t>(j)][i] - of_shape;
      sum += d * d;
    }
  }
  out.variance = sum / std::max(count, 1);
  return out;
}

std::optional<NeedleShape::End> NeedleShape::end(const GradientField& field, const Backdrop& backdrop,
                                                 const NeedlePose& needle, double back, double ahead,
                                                 View near) const {
  const int ends = static_cast<int>((back + ahead) / kStep_px) + 1;
  const Profiles plain = profiles(field, nullptr, needle, ahead, ends);
  if (!known() || static_cast<int>(plain.size()) < ends + kAhead + kLeastShaft) {
    return std::nullopt;
  }
  // A backdrop takes granules off, unless they have moved since; then it doubles them.
  const Profiles over = profiles(field, &backdrop, needle, ahead, ends);
  Fit best = fit(plain, {false, near.blur}, ends);
  if (Fit f = fit(over, {true, near.blur}, ends); f.variance < best.variance) {
    best = std::move(f);
  }
  const Profiles& seen = best.view.over_backdrop ? over : plain;
  const auto better = [&](std::size_t blur) {
    Fit f = fit(seen, {best.view.over_backdrop, blur}, ends);
    const bool is = f.top() > best.top();
    if (is) {
      best = std::move(f);
    }
    return is;
  };
  while (best.view.blur > 0 && better(best.view.blur - 1)) {
  }
  if (best.view.blur == near.blur) {
    while (best.view.blur + 1 < shape_.size() && better(best.view.blur + 1)) {
    }
  }
  return end_of(best, ahead);
}

std::optional<NeedleShape::End> NeedleShape::end_in(View view, const GradientField& field,
                                                    const Backdrop& backdrop, const NeedlePose& needle,
                                                    double back, double ahead) const {
  const int ends = static_cast<int>((back + ahead) / kStep_px) + 1;
  const Profiles seen = profiles(field, view.over_backdrop ? &backdrop : nullptr, needle, ahead, ends);
  if (!known() || static_cast<int>(seen.size()) < ends + kAhead + kLeastShaft) {
    return std::nullopt;
  }
  return end_of(fit(seen, view, ends), ahead);
}

std::optional<NeedleShape::End> NeedleShape::end_of(const Fit& f, double ahead) {
  const int ends = static_cast<int>(f.gain.size()), best = f.best;
  if (best < 2 || best > ends - 3) {
    return std::nullopt;
  }
  const double unit = kJoined * std::max(f.variance, 1e-8);
  const auto at = [&](int e) { return f.gain[static_cast<std::size_t>(e)] / unit; };
  if (at(best) - at(0) < kClear || at(best) - at(ends - 1) < kClear) {
    return std::nullopt;
  }
  End out;
  out.view = f.view;
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
