#include "vision/injection_pipette.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vision/correlation.hpp"

namespace punctum::vision {

bool InjectionPipette::cut(const cv::Mat& grey, const Point& tip) {
  // Shaft and end face, and next to nothing of what lies ahead of the tip.
  const double back = std::clamp(6 * last_.half_width, 14.0, 40.0), ahead = 2.5;
  const double wide = last_.half_width_at(back) + 4;
  const Point a = last_.at(back, 0), b = last_.at(-ahead, 0);
  const cv::Rect box = cv::Rect(static_cast<int>(std::lround(std::min(a.x, b.x))),
                                static_cast<int>(std::lround(std::min(a.y, b.y) - wide)),
                                static_cast<int>(std::lround(std::abs(a.x - b.x))) + 1,
                                static_cast<int>(std::lround(std::abs(a.y - b.y) + 2 * wide)) + 1) &
                       cv::Rect(0, 0, grey.cols, grey.rows);
  if (box.width < 8 || box.height < 6) {
    return false;
  }
  template_ = grey(box).clone();
  tip_in_template_ = tip - Point(box.x, box.y);
  return true;
}

bool InjectionPipette::start(const GradientField& field, const cv::Mat& grey, double noise) {
  std::optional<TubeTrace> best;
  const double width_max = std::max(22.0, 8 * c_px_);
  for (const Side s : {Side::right, Side::left}) {
    if (side_ != Side::automatic && s != side_) {
      continue;
    }
    const auto t = trace_tube(field, s, 3, width_max, noise);
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
  if (const auto s = end_face(field, last_.tip, last_.axis, 0.9 * last_.half_width, 9, noise)) {
    last_.tip += *s * last_.axis;
  }
  fit_edges(field, noise, last_);
  if (const auto s = end_face(field, last_.tip, last_.axis, 0.9 * last_.half_width, 4, noise)) {
    last_.tip += *s * last_.axis;
  }
  if (!cut(grey, last_.tip)) {
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

void InjectionPipette::fit_edges(const GradientField& field, double noise, NeedleFix& fix) const {
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
      if (g[k] > top && g[k] >= g[k - 1] && g[k] >= g[k + 1]) {
        top = g[k];
        best = k;
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
  for (double s = 8; s < 170; s += 5) {
    const Point p = fix.at(s, 0);
    if (p.x < field.area.x + 3 || p.x > field.area.x + field.area.width - 4 || p.y < field.area.y + 3 ||
        p.y > field.area.y + field.area.height - 4) {
      break;
    }
    double lo = 0, hi = 0;
    const double w = fix.half_width_at(s);
    if (edge(s, -w, lo) && edge(s, w, hi) && hi - lo > 0.5 * w) {
      stations.push_back({s, 0.5 * (lo + hi), 0.5 * (hi - lo), 1});
    }
  }
  if (stations.size() < 4) {
    return;
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
      return;
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
}

NeedleFix InjectionPipette::find(const GradientField& field, const cv::Mat& grey, double noise) {
  NeedleFix fix = last_;
  fix.ok = false;
  fix.why.clear();
  if (!started_) {
    fix.why = why_.empty() ? "not started" : why_;
    return fix;
  }
  const cv::Rect all(0, 0, grey.cols, grey.rows);
  const Point expected = last_.tip + velocity_ - tip_in_template_;
  const int rx = 24 + 8 * lost_, ry = 10 + 6 * lost_;
  const cv::Rect window =
      cv::Rect(static_cast<int>(std::lround(expected.x)) - rx, static_cast<int>(std::lround(expected.y)) - ry,
               template_.cols + 2 * rx, template_.rows + 2 * ry) &
      all;
  const auto p = peak(centred_correlation_map(grey(window), template_));
  fix.score = p ? p->score : 0;
  if (!p || p->score < 0.55) {
    fix.why = "tip not recognised";
    velocity_ = {};
    if (++lost_ > 3) {
      // From the border again; what is found takes its place.
      const NeedleFix before = last_;
      if (start(field, grey, noise)) {
        return last_;
      }
      last_ = before;
      started_ = true;
    }
    return fix;
  }
  fix.tip = p->at + Point(window.x, window.y) + tip_in_template_;
  fit_edges(field, noise, fix);
  fix.ok = true;
  velocity_ = lost_ == 0 ? fix.tip - last_.tip : Point();
  lost_ = 0;
  last_ = fix;
  return fix;
}

void InjectionPipette::learn(const cv::Mat& grey, const NeedleFix& fix) {
  if (!fix.ok || template_.empty()) {
    return;
  }
  cv::Mat here;
  cv::getRectSubPix(
      grey, template_.size(),
      cv::Point2f(static_cast<float>(fix.tip.x - tip_in_template_.x + (template_.cols - 1) / 2.0),
                  static_cast<float>(fix.tip.y - tip_in_template_.y + (template_.rows - 1) / 2.0)),
      here);
  cv::addWeighted(template_, 0.9, here, 0.1, 0, template_);
}

}  // namespace punctum::vision
