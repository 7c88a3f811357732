#include "vision/injection_pipette.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "vision/correlation.hpp"

namespace punctum::vision {

bool InjectionPipette::cut(const GradientField& field, const Point& tip) {
  // Shaft and end face, and next to nothing of what lies ahead of the tip.
  const double back = std::clamp(6 * last_.half_width, 14.0, 40.0), ahead = 2.5;
  const double wide = last_.half_width_at(back) + 4;
  const Point a = last_.at(back, 0), b = last_.at(-ahead, 0);
  const cv::Rect box = cv::Rect(static_cast<int>(std::lround(std::min(a.x, b.x))),
                                static_cast<int>(std::lround(std::min(a.y, b.y) - wide)),
                                static_cast<int>(std::lround(std::abs(a.x - b.x))) + 1,
                                static_cast<int>(std::lround(std::abs(a.y - b.y) + 2 * wide)) + 1) &
                       field.area;
  if (box.width < 8 || box.height < 6) {
    return false;
  }
  template_ = field.smooth(box - field.area.tl()).clone();
  tip_in_template_ = tip - Point(box.x, box.y);
  return true;
}

bool InjectionPipette::start(const GradientField& field, double noise) {
  std::optional<TubeTrace> best;
  const double width_max = std::max(22.0, 8 * c_px_);
  for (const Side s : {Side::right, Side::left}) {
    if (side_ != Side::automatic && s != side_) {
      continue;
    }
    const auto t = trace_narrow_tube(field, s, 3, width_max, noise);
    if (t && t->clarity > 0.5 && t->likeness > 0.5 && t->length > 12 &&
        (!best || t->clarity * t->likeness > best->clarity * best->likeness)) {
      best = t;
    }
  }
  if (!best) {
    why_ = "no narrow tube enters through the border";
    return false;
  }
  last_ = {};
  last_.axis = best->axis;
  last_.half_width = best->end_half_width;
  last_.taper = std::clamp((best->half_width - best->end_half_width) / std::max(best->length, 1.0), 0.0, 0.2);
  last_.tip = best->end();
  double straight = 0;
  for (int round = 0; round < 3; ++round) {
    straight = fit_edges(field, noise, last_);
    if (const auto s =
            walls_end(field, last_, std::min(30.0, 0.5 * best->length), round == 0 ? 25 : 10, noise)) {
      last_.tip += *s * last_.axis;
    }
  }
  step_sign_ = 0;
  end_offset_ = 0.15 * last_.half_width;
  offset_frames_ = 0;
  calibrate_end(field, last_, noise);
  last_.tip += end_offset_ * last_.axis;
  if (straight < 0.65 || last_.half_width > 2 * c_px_ + 1) {
    why_ = "what enters through the border is not a straight needle";
    return false;
  }
  if (!cut(field, last_.tip)) {
    why_ = "tip too close to the border";
    return false;
  }
  last_.ok = true;
  last_.score = 1;
  found_side_ = best->side;
  velocity_ = {};
  lost_ = 0;
  started_ = true;
  why_.clear();
  return true;
}

double InjectionPipette::fit_edges(const GradientField& field, double noise, NeedleFix& fix) const {
  // Both edges at stations along the shaft; straight lines through middle and half-width.
  struct Station {
    double s, mid, half, weight;
  };
  std::vector<Station> stations;
  const Point across(-fix.axis.y, fix.axis.x);
  const double floor = 4 * field.noise_of_gradient(noise);
  const auto edge = [&](double s, double u0, double& found) {
    double top = 0, at = 0;
    constexpr double kStep = 0.5;
    double g[13];
    for (int k = -6; k <= 6; ++k) {
      // Averaged over 4 px of length.
      double e = 0;
      for (const double ds : {-1.5, 0.0, 1.5}) {
        e += field.gradient(fix.at(s + ds, u0 + k * kStep)).dot(across) / 3;
      }
      g[k + 6] = std::abs(e);
    }
    int best = -1;
    for (int k = 1; k < 12; ++k) {
      if (g[k] >= g[k - 1] && g[k] >= g[k + 1]) {
        top = std::max(top, g[k]);
      }
    }
    // The outermost of the strong ones: a wall has two faces.
    for (int q = 1; q < 12; ++q) {
      const int k = u0 > 0 ? 12 - q : q;
      if (g[k] >= g[k - 1] && g[k] >= g[k + 1] && g[k] >= 0.5 * top) {
        best = k;
        break;
      }
    }
    if (best < 0 || top < floor) {
      return false;
    }
    const double den = g[best - 1] - 2 * g[best] + g[best + 1];
    at = best - 6 + (den < -1e-12 ? std::clamp(0.5 * (g[best - 1] - g[best + 1]) / den, -0.5, 0.5) : 0.0);
    found = u0 + at * kStep;
    return true;
  };
  int tried = 0;
  for (double s = 8; s < 170; s += 5) {
    const Point p = fix.at(s, 0);
    if (p.x < field.area.x + 3 || p.x > field.area.x + field.area.width - 4 || p.y < field.area.y + 3 ||
        p.y > field.area.y + field.area.height - 4) {
      break;
    }
    ++tried;
    double lo = 0, hi = 0;
    const double w = fix.half_width_at(s);
    if (edge(s, -w, lo) && edge(s, w, hi) && hi - lo > 0.5 * w) {
      stations.push_back({s, 0.5 * (lo + hi), 0.5 * (hi - lo), 1});
    }
  }
  if (stations.size() < 4) {
    return 0;
  }
  double m0 = 0, m1 = 0, h0 = 0, h1 = 0;
  for (int round = 0; round < 5; ++round) {
    double s0 = 0, s1 = 0, s2 = 0, a0 = 0, a1 = 0, b0 = 0, b1 = 0;
    for (const Station& t : stations) {
      s0 += t.weight;
      s1 += t.weight * t.s;
      s2 += t.weight * t.s * t.s;
      a0 += t.weight * t.mid;
      a1 += t.weight * t.mid * t.s;
      b0 += t.weight * t.half;
      b1 += t.weight * t.half * t.s;
    }
    const double det = s0 * s2 - s1 * s1;
    if (std::abs(det) < 1e-9) {
      return 0;
    }
    m0 = (a0 * s2 - a1 * s1) / det;
    m1 = (s0 * a1 - s1 * a0) / det;
    h0 = (b0 * s2 - b1 * s1) / det;
    h1 = (s0 * b1 - s1 * b0) / det;
    for (Station& t : stations) {
      const double e = (t.mid - m0 - m1 * t.s) / 0.6, f = (t.half - h0 - h1 * t.s) / 0.8;
      t.weight = 1 / std::pow(1 + e * e + f * f, 2);
    }
  }
  // Stations reach only so far: a short shaft tells its tilt poorly, so it is taken over in part.
  const double trust = std::clamp(stations.back().s / 60, 0.0, 1.0);
  fix.tip += m0 * across;
  fix.axis -= trust * m1 * across;
  fix.axis *= 1 / cv::norm(fix.axis);
  if (h0 > 0.3 * fix.half_width && h0 < 2 * std::max(fix.half_width, c_px_)) {
    fix.half_width = h0;
    fix.taper = std::clamp(h1, 0.0, 0.2);
  }
  int straight = 0;
  for (const Station& t : stations) {
    straight += std::abs(t.mid - m0 - m1 * t.s) < 1 && std::abs(t.half - h0 - h1 * t.s) < 1;
  }
  return static_cast<double>(straight) / tried;
}

std::optional<double> InjectionPipette::wall_step(const GradientField& field, const NeedleFix& fix,
                                                  double reach, double floor) const {
  constexpr double kStep = 0.25;
  const int n = 2 * static_cast<int>(reach / kStep) + 1;
  std::vector<double> g(static_cast<std::size_t>(n), 0.0);
  for (int i = 0; i < n; ++i) {
    const double ahead = (i - n / 2) * kStep;
    double e = 0;
    for (const double u : {-0.95, -0.8, -0.65, 0.65, 0.8, 0.95}) {
      e += field.gradient(fix.at(-ahead, u * fix.half_width)).dot(fix.axis) / 6;
    }
    g[static_cast<std::size_t>(i)] = step_sign_ == 0 ? std::abs(e) : step_sign_ * e;
  }
  int best = -1;
  for (int i = 1; i + 1 < n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (g[k] > floor && g[k] >= g[k - 1] && g[k] >= g[k + 1] &&
        (best < 0 || g[k] > g[static_cast<std::size_t>(best)])) {
      best = i;
    }
  }
  if (best < 0) {
    return std::nullopt;
  }
  const std::size_t k = static_cast<std::size_t>(best);
  const double den = g[k - 1] - 2 * g[k] + g[k + 1];
  return (best - n / 2 + (den < -1e-12 ? std::clamp(0.5 * (g[k - 1] - g[k + 1]) / den, -0.5, 0.5) : 0.0)) *
         kStep;
}

std::optional<double> InjectionPipette::walls_end(const GradientField& field, const NeedleFix& fix,
                                                  double back, double ahead, double noise) const {
  // Cross profiles in units of the half-width, without mean and slope: a membrane that the needle meets
  // head-on is even across it and drops out. How much of the shaft's own profile each station holds:
  constexpr int kLanes = 21;
  constexpr double kReach = 1.5;  // half-widths
  const auto profile = [&](double s, std::array<double, kLanes>& v) {
    const double w = fix.half_width_at(s);
    double mean = 0, tilt = 0;
    for (int i = 0; i < kLanes; ++i) {
      const double x = (2.0 * i / (kLanes - 1) - 1) * kReach;
      const Point p = fix.at(s, x * w);
      if (p.x < field.area.x + 1 || p.y < field.area.y + 1 || p.x > field.area.x + field.area.width - 2 ||
          p.y > field.area.y + field.area.height - 2) {
        return false;
      }
      v[static_cast<std::size_t>(i)] = field.grey(p);
      mean += v[static_cast<std::size_t>(i)] / kLanes;
    }
    double xx = 0;
    for (int i = 0; i < kLanes; ++i) {
      const double x = 2.0 * i / (kLanes - 1) - 1;
      tilt += x * v[static_cast<std::size_t>(i)];
      xx += x * x;
    }
    for (int i = 0; i < kLanes; ++i) {
      const double x = 2.0 * i / (kLanes - 1) - 1;
      v[static_cast<std::size_t>(i)] -= mean + tilt / xx * x;
    }
    return true;
  };
  std::array<double, kLanes> shaft{}, v{};
  int stations = 0;
  for (double s = back + 2; s < back + 60; s += 1) {
    if (profile(s, v)) {
      ++stations;
      for (std::size_t i = 0; i < kLanes; ++i) {
        shaft[i] += v[i];
      }
    }
  }
  double norm2 = 0;
  for (double x : shaft) {
    norm2 += x * x;
  }
  // Walls and lumen must stand out of what smoothing leaves of the noise.
  const double contrast = std::sqrt(norm2 / kLanes) / std::max(stations, 1);
  const double smooth_noise = noise / (2 * field.sigma * std::sqrt(std::numbers::pi));
  if (stations < 5 || contrast < std::max(0.7, 4 * smooth_noise / std::sqrt(stations))) {
    return std::nullopt;
  }
  constexpr double kStep = 0.5;
  std::vector<double> held, place;  // place: distance ahead of fix.tip
  for (double s = back; s >= -ahead; s -= kStep) {
    if (!profile(s, v)) {
      break;
    }
    double dot = 0;
    for (std::size_t i = 0; i < kLanes; ++i) {
      dot += v[i] * shaft[i];
    }
    held.push_back(dot * stations / norm2);
    place.push_back(-s);
  }
  // Change point of (held - 0.22): beyond it the pattern is not there.
  double sum = 0, top = -1;
  std::size_t last = 0;
  for (std::size_t i = 0; i < held.size(); ++i) {
    sum += std::clamp(held[i], -0.3, 0.6) - 0.22;
    if (sum > top) {
      top = sum;
      last = i;
    }
  }
  if (last < 8 || last + 4 >= held.size()) {
    return std::nullopt;
  }
  // Half of what it was just before: blur moves neither side of a step.
  std::vector<double> near(held.begin() + static_cast<std::ptrdiff_t>(last >= 24 ? last - 24 : 0),
                           held.begin() + static_cast<std::ptrdiff_t>(last - 6));
  std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2), near.end());
  const double half = 0.5 * near[near.size() / 2];
  for (std::size_t i = last >= 6 ? last - 6 : 0; i + 1 < std::min(held.size(), last + 8); ++i) {
    if (held[i] >= half && held[i + 1] < half) {
      return place[i] + kStep * (held[i] - half) / (held[i] - held[i + 1]);
    }
  }
  return place[last];
}

NeedleFix InjectionPipette::find(const GradientField& field, double noise) {
  NeedleFix fix = last_;
  fix.ok = false;
  fix.why.clear();
  if (!started_) {
    fix.why = why_.empty() ? "not started" : why_;
    return fix;
  }
  const cv::Rect all = field.area;
  const Point expected = last_.tip + velocity_ - tip_in_template_;
  const int rx = 24 + 8 * lost_, ry = 10 + 6 * lost_;
  const cv::Rect window =
      cv::Rect(static_cast<int>(std::lround(expected.x)) - rx, static_cast<int>(std::lround(expected.y)) - ry,
               template_.cols + 2 * rx, template_.rows + 2 * ry) &
      all;
  const auto p = peak(centred_correlation_map(field.smooth(window - all.tl()), template_));
  fix.score = p ? p->score : 0;
  if (!p || p->score < 0.3) {
    fix.why = "tip not recognised";
    velocity_ = {};
    if (++lost_ > 3) {
      // From the border again; what is found takes its place.
      const NeedleFix before = last_;
      if (start(field, noise)) {
        return last_;
      }
      last_ = before;
      started_ = true;
    }
    return fix;
  }
  // Correlation tells across the needle; along it the shaft looks everywhere the same, so the end of its
  // walls does.
  const Point correlated = p->at + Point(window.x, window.y) + tip_in_template_;
  const Point across(-last_.axis.y, last_.axis.x);
  fix.tip = last_.tip + velocity_ - end_offset_ * last_.axis;
  fix.tip += (correlated - fix.tip).dot(across) * across;
  (void)fit_edges(field, noise, fix);
  // Near where its motion says first: what lies further ahead cannot be taken for it then.
  auto end = walls_end(field, fix, 18, 18, noise);
  const bool near = end.has_value();
  if (!near) {
    end = walls_end(field, fix, 36, 44, noise);
  }
  if (end) {
    fix.tip += *end * fix.axis;
    (void)fit_edges(field, noise, fix);
    if (const auto again = walls_end(field, fix, 16, 16, noise)) {
      fix.tip += *again * fix.axis;
    }
  }
  if (!end) {
    fix.why = "end of the needle not seen";
    velocity_ = {};
    ++lost_;
    return fix;
  }
  fix.tip += end_offset_ * fix.axis;
  // Far from where it should be by its motion and from where the whole tip is recognised: something else
  // crosses.
  constexpr double kJump_px = 4;
  if (!near && std::abs((fix.tip - last_.tip - velocity_).dot(fix.axis)) > kJump_px &&
      std::abs((fix.tip - correlated).dot(fix.axis)) > kJump_px && ++jumps_ <= 3) {
    fix.why = "end of the needle jumped";
    return fix;
  }
  jumps_ = 0;
  fix.ok = true;
  velocity_ = lost_ == 0 ? fix.tip - last_.tip : Point();
  lost_ = 0;
  last_ = fix;
  return fix;
}

void InjectionPipette::calibrate_end(const GradientField& field, const NeedleFix& fix, double noise) {
  const auto step = wall_step(field, fix, 3.5, 3 * field.noise_of_gradient(noise));
  if (!step) {
    return;
  }
  if (step_sign_ == 0) {
    const double e = field.gradient(fix.at(-*step, 0.8 * fix.half_width)).dot(fix.axis) +
                     field.gradient(fix.at(-*step, -0.8 * fix.half_width)).dot(fix.axis);
    step_sign_ = e > 0 ? 1 : -1;
  }
  end_offset_ += (*step - end_offset_) / std::min(++offset_frames_, 30);
}

void InjectionPipette::learn(const GradientField& field, const NeedleFix& fix, double noise) {
  if (!fix.ok || template_.empty()) {
    return;
  }
  NeedleFix walls = fix;
  walls.tip -= end_offset_ * walls.axis;
  calibrate_end(field, walls, noise);
  cv::Mat here;
  cv::getRectSubPix(
      field.smooth, template_.size(),
      cv::Point2f(
          static_cast<float>(fix.tip.x - field.area.x - tip_in_template_.x + (template_.cols - 1) / 2.0),
          static_cast<float>(fix.tip.y - field.area.y - tip_in_template_.y + (template_.rows - 1) / 2.0)),
      here);
  cv::addWeighted(template_, 0.9, here, 0.1, 0, template_);
}

}  // namespace punctum::vision
