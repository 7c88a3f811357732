// The outline of a membrane carried from frame to frame: what a frame shows is weighed against what the
// frames before it showed, angle by angle as a Kalman filter does. Meanwhile the cell may drift and turn.
#pragma once

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/seen_outline.hpp"

namespace punctum::vision {

class CarriedOutline {
 public:
  // By a needle, since the last frame; px outwards, per point.
  struct Change {
    Vector<double> by, sd;  // expected, and how far that may err
  };
  void update(const SeenOutline& seen, const Change& pushed);

  void jump_with_picture(const Point& by) { centre_ += by; }

  [[nodiscard]] Contour contour() const;
  [[nodiscard]] Vector<double> sd() const;  // px, per point of the contour

 private:
  void move_with_cell(const Vector<double>& now, const SeenOutline& seen, const Vector<double>& pushed_sd);

  Point centre_;
  double drift_ = 0;       // variance of its drift in a frame in either direction, px^2
  double change_ = 0;      // variance by which the shape changes in a frame where no needle pushes, px^2
  double true_share_ = 1;  // of the variances, by how frames differ
  int frames_ = 0;         // that followed the first
  Vector<double> r_, variance_, lasting_;  // per angle
};

}  // namespace punctum::vision
