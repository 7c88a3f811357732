#include "vision/membrane/carried_outline.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>

#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

// Of the whole cell, per frame: sd of the turn at its circumference; of the drift in either direction, at
// first, within which it is learnt, and how fast.
constexpr double kTurn_px = 0.15;
constexpr double kDrift_px = 0.15, kLeastDrift_px = 0.02, kMostDrift_px = 0.3, kDriftLearnt = 0.1;
constexpr double kBroken = 6;        // mean squared surprise, over its variance, that is none of noise
constexpr double kBrokenPushed = 3;  // likewise, where a needle may change the shape
constexpr double kFar = 9;           // a larger surprise is no noise
constexpr double kPushed_px = 0.1;   // an angle that a needle may change by more tells nothing of the cell
// Of the variance that is expected of how frames differ, as much as they do: at least, and how fast it is
// learnt.
constexpr double kLeastTrue = 0.4, kTrueLearnt = 0.1;
// By which the shape of a cell changes in a frame, sd: at first, and within which it is learnt, and how fast.
constexpr double kChange_px = 0.05, kLeastChange_px = 0.01, kMostChange_px = 0.3, kChangeLearnt = 0.1;

}  // namespace

void CarriedOutline::update(const SeenOutline& seen, const Change& pushed) {
  const std::size_t n = seen.contour.size();
  const Vector<double> now =
      r_.size() == n ? polar_radii(seen.contour, centre_, static_cast<int>(n)) : Vector<double>();
  lasting_ = seen.lasting;
  if (now.empty()) {
    centre_ = centroid(seen.contour);
    r_ = polar_radii(seen.contour, centre_, static_cast<int>(n));
    variance_.resize(n);
    change_ = kChange_px * kChange_px;
    true_share_ = 1;
    drift_ = kDrift_px * kDrift_px;
    frames_ = 0;
    for (std::size_t i = 0; i < n; ++i) {
      variance_[i] = seen.variance[i] - seen.lasting[i];
    }
    return;
  }
  for (std::size_t i = 0; i < n; ++i) {
    r_[i] += pushed.by[i];
  }
  ++frames_;
  move_with_cell(now, seen, pushed.sd);
  const Vector<double> moved = polar_radii(seen.contour, centre_, static_cast<int>(n));
  if (moved.empty()) {
    return;
  }
  // What differs by more than both may err has changed its shape.
  Vector<double> surprise(n), told(n);
  double more_than_expected = 0, still = 0, expected = 0;
  for (std::size_t i = 0; i < n; ++i) {
    told[i] = seen.variance[i] - seen.lasting[i];
    variance_[i] += change_ + pushed.sd[i] * pushed.sd[i];
    surprise[i] = std::pow(moved[i] - r_[i], 2) / (variance_[i] + told[i]);
    if (pushed.sd[i] < kPushed_px) {
      more_than_expected += (std::min(surprise[i], kFar) - 1) * (variance_[i] + told[i]);
      still += 1;
      expected += variance_[i] + told[i];
    }
  }
  if (expected > 0) {
    const double share = 1 + more_than_expected / expected;
    true_share_ = std::clamp(true_share_ + kTrueLearnt * (share - true_share_), kLeastTrue, 1.0);
  }
  change_ = std::clamp(change_ + kChangeLearnt * more_than_expected / std::max(still, 1.0),
                       kLeastChange_px * kLeastChange_px, kMostChange_px * kMostChange_px);
  constexpr std::size_t kReach = 7;  // angles
  double sum = 0;
  for (std::size_t k = n - kReach; k <= n + kReach; ++k) {
    sum += surprise[k % n];
  }
  Vector<double> more(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const double mean = sum / (2 * kReach + 1);
    if (mean > (pushed.sd[i] > kPushed_px ? kBrokenPushed : kBroken)) {
      more[i] = (mean - 1) * (variance_[i] + told[i]);
    }
    sum += surprise[(i + kReach + 1) % n] - surprise[(i + n - kReach) % n];
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double before = variance_[i] + more[i], gain = before / (before + told[i]);
    r_[i] += gain * (moved[i] - r_[i]);
    variance_[i] = (1 - gain) * before;
  }
}

// Weighted least squares for drift and turn, from what the needle does not change.
void CarriedOutline::move_with_cell(const Vector<double>& now, const SeenOutline& seen,
                                    const Vector<double>& pushed_sd) {
  const std::size_t n = now.size();
  cv::Vec3d motion = cv::Vec3d::all(0);
  cv::Matx33d a;
  const Vector<cv::Vec3d> effect = effects_of_motion(r_);
  Vector<double> variance(n), twice_sd(n);
  for (std::size_t i = 0; i < n; ++i) {
    variance[i] = variance_[i] + seen.variance[i] - seen.lasting[i];
    twice_sd[i] = 2 * std::sqrt(variance[i]);
  }
  const double learnt = std::max(kDriftLearnt, 1.0 / (1 + frames_));
  double drift = drift_;  // with what this frame shows
  for (int round = 0; round < 3; ++round) {
    constexpr double kAny_px = 10;
    a = cv::Matx33d::diag({1 / (kAny_px * kAny_px), 1 / (kAny_px * kAny_px), 1 / (kTurn_px * kTurn_px)});
    cv::Vec3d b = cv::Vec3d::all(0);
    for (std::size_t i = 0; i < n; ++i) {
      if (pushed_sd[i] > kPushed_px) {
        continue;
      }
      const cv::Vec3d& f = effect[i];
      const double e = now[i] - r_[i], off = std::abs(e - f.dot(motion)) / twice_sd[i];
      const double w = 1 / (kJoinedAngles * variance[i] * std::max(1.0, off));
      a += w * f * f.t();
      b += w * e * f;
    }
    const cv::Vec3d alone = a.solve(b, cv::DECOMP_CHOLESKY);
    const cv::Matx33d told = a.inv(cv::DECOMP_CHOLESKY);
    const double shown = 0.5 * (alone[0] * alone[0] + alone[1] * alone[1]),
                 by_noise = 0.5 * (told(0, 0) + told(1, 1));
    drift = std::clamp(drift_ + learnt * (shown - by_noise - drift_), kLeastDrift_px * kLeastDrift_px,
                       kMostDrift_px * kMostDrift_px);
    a(0, 0) += 1 / drift;
    a(1, 1) += 1 / drift;
    motion = a.solve(b, cv::DECOMP_CHOLESKY);
  }
  drift_ = drift;
  const cv::Matx33d covariance = a.inv(cv::DECOMP_CHOLESKY);
  Vector<double> turned(n);
  for (std::size_t i = 0; i < n; ++i) {
    const cv::Vec3d& f = effect[i];
    turned[i] = r_[i] + motion[2] * f[2];
    variance_[i] += f.dot(covariance * f);
  }
  centre_ += Point(motion[0], motion[1]);
  r_ = std::move(turned);
}

Contour CarriedOutline::contour() const { return from_polar(centre_, r_); }

Vector<double> CarriedOutline::sd() const {
  Vector<double> out(r_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = std::sqrt(true_share_ * variance_[i] + lasting_[i]);
  }
  return out;
}

}  // namespace punctum::vision
