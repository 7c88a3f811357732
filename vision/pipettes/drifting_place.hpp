// The place of something that lies still or drifts, from frame to frame: one picture tells it less surely
// than all of them. A Kalman filter with a constant velocity, of which little changes from frame to frame; x
// and y alike.
#pragma once

#include "vision/image/contour.hpp"
#include "vision/image/drift_covariance.hpp"

namespace punctum::vision {

class DriftingPlace {
 public:
  struct Place {
    Point at;
    double sd = 0;  // px, in each direction
  };
  // Once per frame: where this picture alone shows it. What has jumped is followed at once.
  Place next(const Point& seen, double sd);
  // A frame does not show it.
  void unseen();

 private:
  bool known_ = false;
  Point at_, drift_;  // px, px per frame
  DriftCovariance covariance_;
};

}  // namespace punctum::vision
