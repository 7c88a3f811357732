// Distance to a line of many short pieces, exactly and quickly. Any unit.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace punctum::report {

using Point2 = std::array<double, 2>;

class Polyline {
 public:
  // At least two points; closed: the last is joined to the first.
  explicit Polyline(std::vector<Point2> points, bool closed = false);
  [[nodiscard]] double distance(const Point2& p) const;  // to the nearest place on it, >= 0
  [[nodiscard]] std::span<const Point2> points() const noexcept { return points_; }

 private:
  // Pieces in a row and a circle round them.
  struct Run {
    std::size_t from, to;
    Point2 centre;
    double radius;
  };
  std::vector<Point2> points_;  // with the first repeated at the end when closed
  std::vector<Run> runs_;
};

}  // namespace punctum::report
