// Exact distance to a line of many short straight pieces. Any unit.
#pragma once

#include <cstddef>

#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

class Polyline {
 public:
  // At least two points. closed: the last is joined to the first.
  explicit Polyline(Vector<Point> points, bool closed = false);
  [[nodiscard]] double distance(const Point& p) const;  // to the nearest place on the line, >= 0

 private:
  // Consecutive pieces and a circle that encloses them.
  struct Run {
    std::size_t from, to;
    Point centre;
    double radius;
  };
  Vector<Point> points_;  // when closed, the first is repeated at the end
  Vector<Run> runs_;
};

}  // namespace punctum::vision
