// The covariance of a Kalman filter for a place, in any unit, that drifts with a velocity of which little
// changes from frame to frame.
#pragma once

namespace punctum::vision {

struct DriftCovariance {
  double place = 0, both = 0, drift = 0;

  // One frame later. uneven: sd by which the drift changes in a frame.
  void go_on(double uneven) {
    const double variance = uneven * uneven;
    place += 2 * both + drift + variance / 4;
    both += drift + variance / 2;
    drift += variance;
  }

  // By how much place and drift follow what is seen beyond what was expected, with this variance.
  struct Gain {
    double of_place, of_drift;
  };
  Gain see(double variance) {
    const Gain gain{place / (place + variance), both / (place + variance)};
    drift -= gain.of_drift * both;
    both *= 1 - gain.of_place;
    place *= 1 - gain.of_place;
    return gain;
  }
};

}  // namespace punctum::vision
