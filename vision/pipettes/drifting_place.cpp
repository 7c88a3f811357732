#include "vision/pipettes/drifting_place.hpp"

#include <cmath>

namespace punctum::vision {

namespace {

constexpr double kDrift_px = 0.3;     // per frame, at first
constexpr double kUneven_px = 0.01;   // of the drift, from frame to frame
constexpr double kJump2 = 3.5 * 3.5;  // variances: more is no noise and no drift

}  // namespace

void DriftingPlace::predict() {
  constexpr double kVariance = kUneven_px * kUneven_px;
  at_ += drift_;
  pp_ += 2 * pv_ + vv_ + kVariance / 4;
  pv_ += vv_ + kVariance / 2;
  vv_ += kVariance;
}

void DriftingPlace::unseen() {
  if (known_) {
    predict();
  }
}

DriftingPlace::Place DriftingPlace::next(const Point& seen, double sd) {
  const double variance = sd * sd;
  unseen();
  const Point beyond = seen - at_;
  if (!known_ || beyond.dot(beyond) > kJump2 * (pp_ + variance)) {
    known_ = true;
    at_ = seen;
    drift_ = {};
    pp_ = variance;
    pv_ = 0;
    vv_ = kDrift_px * kDrift_px;
    return {at_, sd};
  }
  const double of_place = pp_ / (pp_ + variance), of_drift = pv_ / (pp_ + variance);
  at_ += of_place * beyond;
  drift_ += of_drift * beyond;
  vv_ -= of_drift * pv_;
  pv_ *= 1 - of_place;
  pp_ *= 1 - of_place;
  return {at_, std::sqrt(pp_)};
}

}  // namespace punctum::vision
