// Points and normals of a membrane's surface on a fixed grid: along the meridian at equal steps of the
// parameter, from the near pole to the far one, and round the axis at equal angles.
#pragma once

#include <span>

#include "vision/image/kept_vector.hpp"
#include "vision/surface/membrane_net.hpp"

namespace punctum::vision {

// One vector per place of the grid, [along][around] in a row each. Units and axes of the net's contour; z
// points away from the observer, as the world's frame has it (hal/frames.hpp).
struct GridVectors {
  Vector<double> x, y, z;
};

// The basis functions are evaluated once. What fills a grid allocates nothing when the vectors have been used
// before.
class SurfaceGrid {
 public:
  SurfaceGrid(int control_points, int along, int around);  // along: at least 2
  [[nodiscard]] int along() const { return static_cast<int>(rows_.size()); }
  [[nodiscard]] int around() const { return static_cast<int>(cosine_.size()); }

  // The net must have the number of control points that the grid was made for.
  void points(const MembraneNet& net, GridVectors& points) const;
  // normals: of length 1, outwards.
  void points_and_normals(const MembraneNet& net, GridVectors& points, GridVectors& normals) const;

 private:
  Vector<CubicBasis> rows_;
  Vector<double> cosine_, sine_;
};

}  // namespace punctum::vision
