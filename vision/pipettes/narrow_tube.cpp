#include "vision/pipettes/narrow_tube.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>

#include "vision/pipettes/border_section.hpp"
#include "vision/pipettes/robust_line.hpp"

namespace punctum::vision {

namespace {

constexpr double kStride_px = 2, kWindow_px = 5;  // a station every stride, averaged over the window
constexpr double kAlongStep_px = 1.5;             // between the lines that a profile is averaged over
constexpr double kSameTube = 0.6;                 // similarity above which the learnt profile follows
constexpr double kLearning = 0.12;                // share of a new profile in the learnt one
constexpr double kContinued = 0.5;                // similarity: the tube goes on
constexpr double kGiveUp = 8;                     // so far below its best value the sum does not recover

// From the border inwards, px.
double strip_of(const GradientField& field) { return std::clamp(0.09 * field.area.width, 16.0, 70.0); }

// Takes off mean and slope and scales to unit length. Returns the length before the scaling, 0 for a flat
// profile.
double normalise(Vector<double>& v) {
  const double n = static_cast<double>(v.size());
  double mean = 0, tilt = 0, ss = 0;
  for (double x : v) {
    mean += x / n;
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double u = static_cast<double>(i) - (n - 1) / 2;
    tilt += u * v[i] * 12 / (n * (n * n - 1));
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    v[i] -= mean + tilt * (static_cast<double>(i) - (n - 1) / 2);
    ss += v[i] * v[i];
  }
  if (ss < 1e-6 * n) {
    return 0;
  }
  for (double& x : v) {
    x /= std::sqrt(ss);
  }
  return std::sqrt(ss);
}

}  // namespace

// At a corner only a part of it crosses the border: there the whole is seen further inside.
std::optional<TubeTrace> narrow_tube_at_border(const GradientField& field, Border border, double width_min,
                                               double width_max, double noise, bool without_specks) {
  constexpr int kLeast_px = 48;
  constexpr double kCorner_px = 60;
  const cv::Rect& a = field.area;
  if (a.width < kLeast_px || a.height < kLeast_px) {
    return std::nullopt;
  }
  const bool upright = border == Border::right || border == Border::left;
  WantedTube wanted{.width_min = width_min,
                    .width_max = width_max,
                    .strip = strip_of(field),
                    .relative = 0.12,
                    .tilt_min_deg = upright ? 0 : 30,
                    .tilt_max_deg = upright ? 45 : 66,
                    .without_specks = without_specks};
  auto sections = border_sections(field, border, wanted, noise);
  if (sections.empty()) {
    return std::nullopt;
  }
  const Point& root = sections.front().root;
  const double along = upright ? root.y - a.y : root.x - a.x, length = upright ? a.height : a.width;
  if (std::min(along, length - along) < kCorner_px) {
    wanted.inset = kCorner_px;
    if (auto inside = border_sections(field, border, wanted, noise); !inside.empty()) {
      sections = std::move(inside);
    }
  }
  return sections.front();
}

NarrowTubeTrace::NarrowTubeTrace(const TubeTrace& at_border)
    : at_border_(at_border),
      across_(across_tube(at_border.axis)),
      n_(2 * static_cast<int>(at_border.half_width + 5) + 1) {}

// False: the profile at the border is flat.
bool NarrowTubeTrace::learn_at_border(const GradientField& field) {
  learnt_ = profile(field, at_border_.root, strip_of(field) * 0.8, n_, 1);
  contrast_ = normalise(learnt_);
  return contrast_ > 0;
}

// The tube ends where the sum of (similarity - kContinued) is largest, so that a short foreign thing across
// it does not end it.
bool NarrowTubeTrace::advance(const GradientField& field) {
  constexpr int kStationsPerPart = 40;
  if (learnt_.empty() && !learn_at_border(field)) {
    return true;
  }
  const Point& axis = at_border_.axis;
  const double longest = 0.85 * std::min(field.area.width / std::max(std::abs(axis.x), 1e-6),
                                         field.area.height / std::max(std::abs(axis.y), 1e-6));
  for (int part = 0; part < kStationsPerPart; ++part) {
    const double s = static_cast<double>(along_.size()) * kStride_px;
    if (s >= longest || sum_ < sum_best_ - kGiveUp) {
      return true;
    }
    step(field, s);
    sum_ += std::clamp(similarity_.back(), -0.5, 1.0) - kContinued;
    if (sum_ > sum_best_) {
      sum_best_ = sum_;
      last_ = similarity_.size() - 1;
    }
  }
  return false;
}

// Mean grey over `length` px along the tube; across it, at samples that are `apart` px apart, about `at`.
Vector<double> NarrowTubeTrace::profile(const GradientField& field, const Point& at, double length,
                                        int samples, double apart) const {
  const cv::Rect& a = field.area;
  Vector<double> v(static_cast<std::size_t>(samples), 0.0);
  int stations = 0;
  for (double k = 0; k < length; k += kAlongStep_px) {
    ++stations;
    for (int i = 0; i < samples; ++i) {
      Point q = at + k * at_border_.axis + (i - samples / 2) * apart * across_;
      q.y = std::clamp(q.y, a.y + 0.0, a.y + a.height - 1.001);
      q.x = std::clamp(q.x, a.x + 0.0, a.x + a.width - 1.001);
      v[static_cast<std::size_t>(i)] += field.grey(q);
    }
  }
  for (double& x : v) {
    x /= stations;
  }
  return v;
}

void NarrowTubeTrace::step(const GradientField& field, double s) {
  constexpr int kHalfPixels = 4;  // that it is looked for to either side
  double top = -2, at = lateral_, top_contrast = 0;
  Vector<double> top_profile;
  // The profiles at all these places share their samples.
  const Vector<double> wide = profile(field, at_border_.root + s * at_border_.axis + lateral_ * across_,
                                      kWindow_px, 2 * (n_ - 1) + 2 * kHalfPixels + 1, 0.5);
  Vector<double> v(static_cast<std::size_t>(n_));
  for (int aside = -kHalfPixels; aside <= kHalfPixels; ++aside) {
    const double dl = 0.5 * aside;
    for (int i = 0; i < n_; ++i) {
      v[static_cast<std::size_t>(i)] = wide[static_cast<std::size_t>(2 * i + aside + kHalfPixels)];
    }
    const double strength = normalise(v);
    if (!(strength > 0)) {
      continue;
    }
    // A faint pattern of the same shape is something else. What lies in front of the glass or behind it may
    // change its contrast by half.
    const double ratio = std::min(1.0, 1.6 * strength / contrast_);
    const double c =
        ratio * std::inner_product(v.begin(), v.end(), learnt_.begin(), 0.0) - 0.004 * std::abs(dl);
    if (c > top) {
      top = c;
      at = lateral_ + dl;
      top_profile = v;
      top_contrast = strength;
    }
  }
  along_.push_back(s);
  similarity_.push_back(top);
  shift_.push_back(at);
  if (top > kSameTube) {
    lateral_ += 0.5 * (at - lateral_);
    contrast_ += kLearning * (top_contrast - contrast_);
    for (std::size_t i = 0; i < learnt_.size(); ++i) {
      learnt_[i] += kLearning * (top_profile[i] - learnt_[i]);
    }
    (void)normalise(learnt_);
  }
}

double NarrowTubeTrace::half_width_near_end(const GradientField& field, const TubeTrace& t) const {
  const Point across(-t.axis.y, t.axis.x);
  const double back = std::min(t.length * 0.6, 26.0);
  Vector<double> tail(static_cast<std::size_t>(n_), 0.0);
  const Point near_end = t.root + (t.length - back) * t.axis;
  for (double k = 0; k < 0.6 * back; k += kAlongStep_px) {
    for (int i = 0; i < n_; ++i) {
      tail[static_cast<std::size_t>(i)] += field.grey(near_end + k * t.axis + (i - n_ / 2) * across);
    }
  }
  const auto edge = [&](int i) {
    return std::abs(tail[static_cast<std::size_t>(i + 1)] - tail[static_cast<std::size_t>(i - 1)]);
  };
  double steepest = 0;
  for (int i = 1; i + 1 < n_; ++i) {
    steepest = std::max(steepest, edge(i));
  }
  double lo = 0, hi = 0;
  bool any = false;
  for (int i = 1; i + 1 < n_; ++i) {
    if (edge(i) > 0.4 * steepest && std::abs(i - n_ / 2) <= t.half_width + 2) {
      lo = any ? lo : i - n_ / 2;
      hi = i - n_ / 2;
      any = true;
    }
  }
  return any ? std::clamp(0.5 * (hi - lo), 1.0, t.half_width + 2) : t.half_width;
}

std::optional<TubeTrace> NarrowTubeTrace::tube(const GradientField& field) {
  // A cell behind its end may look a little like it.
  constexpr std::ptrdiff_t kGap = 4;
  const auto gap = std::search_n(similarity_.begin(), similarity_.end(), kGap, kContinued,
                                 [](double similarity, double least) { return similarity < least; });
  const auto before_gap = static_cast<std::size_t>(gap - similarity_.begin());
  // What looks like it up to where the trace ends is a pipette behind the cell.
  const std::size_t stations = last_ + 1 < similarity_.size() ? last_ + 1 : before_gap;
  if (stations < 4 || stations == similarity_.size()) {
    return std::nullopt;
  }
  last_ = stations - 1;
  TubeTrace t = at_border_;
  double sum = 0;
  for (std::size_t i = 0; i <= last_; ++i) {
    sum += similarity_[i];
  }
  t.similarity = sum / static_cast<double>(last_ + 1);
  for (auto* v : {&along_, &shift_, &similarity_}) {
    v->resize(last_ + 1);
  }
  for (double& weight : similarity_) {
    weight = std::max(0.0, weight);
  }
  const RobustLine middle = fit_robust_line(along_, shift_, similarity_, 2.0);
  if (middle.rms > 0.15 * t.half_width + 1.0) {
    return std::nullopt;
  }
  t.root += middle.line.offset * across_;
  t.axis = t.axis + middle.line.slope * across_;
  t.axis *= 1 / cv::norm(t.axis);
  t.length = along_[last_] + kWindow_px;
  t.sure_length = before_gap > last_ ? t.length : along_[before_gap] + kWindow_px;
  t.end_half_width = half_width_near_end(field, t);
  return t;
}

}  // namespace punctum::vision
