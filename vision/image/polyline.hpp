// Exact distance to a line of many short straight pieces. Any unit.
#pragma once

#include <cstddef>
#include <vector>

#include "vision/image/contour.hpp"

namespace punctum::vision {

class Polyline {
 public:
  // At least two points. closed: the last is joined to the first.
  explicit Polyline(std::vector<Point> points, bool closed = false);
  [[nodiscard]] double distance(const Point& p) const;  // to the nearest place on the line, >= 0

 private:
  // Consecutive pieces and a circle that encloses them.
  struct Run {
    std::size_t from, to;
    Point centre;
    double radius;
  };
  std::vector<Point> points_;  // when closed, the first is repeated at the end
  std::vector<Run> runs_;
};

}  // namespace punctum::vision
