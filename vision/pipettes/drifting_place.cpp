#include "vision/pipettes/drifting_place.hpp"

#include <cmath>

namespace punctum::vision {

namespace {

constexpr double kDrift_px = 0.3;     // per frame, at first
constexpr double kUneven_px = 0.01;   // of the drift, from frame to frame
constexpr double kJump2 = 3.5 * 3.5;  // variances: more is no noise and no drift

}  // namespace

void DriftingPlace::unseen() {
  if (known_) {
    at_ += drift_;
    covariance_.go_on(kUneven_px);
  }
}

DriftingPlace::Place DriftingPlace::next(const Point& seen, double sd) {
  const double variance = sd * sd;
  unseen();
  const Point beyond = seen - at_;
  if (!known_ || beyond.dot(beyond) > kJump2 * (covariance_.place + variance)) {
    known_ = true;
    at_ = seen;
    drift_ = {};
    covariance_ = {.place = variance, .drift = kDrift_px * kDrift_px};
    return {at_, sd};
  }
  const DriftCovariance::Gain gain = covariance_.see(variance);
  at_ += gain.of_place * beyond;
  drift_ += gain.of_drift * beyond;
  return {at_, std::sqrt(covariance_.place)};
}

}  // namespace punctum::vision
