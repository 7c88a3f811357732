// The surface of a membrane from its contour in one picture: a NURBS surface that is cubic from pole to pole,
// with a circle round the axis at every place between them.
//
// One picture does not tell the depth of a cell: it is taken as round across the picture. The contour is cut
// at its near pole and half of its length further on. The two places at equal distance from the near pole are
// the ends of a diameter, and a circle stands on it, across the picture. Where the halves of the contour
// mirror each other this is the exact surface of revolution; where they differ it blends them. Source: The
// NURBS Book, A9.2 (cubic through places with given slopes at its ends) and A7.1 (circle of nine control
// points).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/surface/cubic_basis.hpp"

namespace punctum::vision {

// A section of the surface: x and y of its circle's middle, x and y from there to the half of the contour
// along which the polar angle rises, and the radius across the picture. Also a control point of these five.
using Section = Eigen::Matrix<double, 5, 1>;

struct MembraneNet {
  static constexpr int kLargest = 64;

  bool ok = false;
  std::string_view reason;  // if not ok
  int size = 0;             // control points along the meridian
  std::array<Section, kLargest> control;
};

// The sum of four control points from `first` on.
[[nodiscard]] Section weighted(const MembraneNet& net, int first, const std::array<double, 4>& weight);

// A control point of the rational quadratic circle of radius 1, knots 0 0 0 1 1 2 2 3 3 4 4 4. With them a
// control point of the surface is middle + along * radius in the picture and across * depth out of it.
struct CirclePoint {
  double along, across, weight;
};
inline constexpr int kCirclePoints = 9;
[[nodiscard]] const std::array<CirclePoint, kCirclePoints>& circle_points();

// Makes nets with a fixed number of control points; it allocates nothing once it has seen a contour as long.
class NetFit {
 public:
  explicit NetFit(int control_points);  // 8 .. MembraneNet::kLargest

  // The near pole is where the line through `through` along `axis` first meets the contour.
  // dimple: the control points lie denser up to about this distance from it; 0: nowhere.
  void fit(std::span<const Point> contour, const Point& through, const Point& axis, double dimple,
           MembraneNet& net);

 private:
  [[nodiscard]] std::string_view measure_contour(std::span<const Point> contour);
  [[nodiscard]] bool find_pole(const Point& through, const Point& axis);
  [[nodiscard]] Point at(double s, Point* tangent = nullptr) const;
  void place_sections(double dimple);
  void interpolate(MembraneNet& net);
  [[nodiscard]] std::string_view check(const MembraneNet& net, const Point& axis);

  int control_points_;
  Vector<CubicBasis> rows_,
      checked_at_;                // at the sections that are interpolated; where the net is checked
  Vector<double> pivot_, upper_;  // factors of the interpolation's matrix
  Contour points_;                // in the order of rising polar angle
  Vector<double> length_;         // along the polygon, to each of its points and round
  double pole_ = 0;               // the near pole's place on it
  Vector<Section> section_;
  Section first_slope_, last_slope_;  // per unit of the parameter
  Vector<Section> checked_;
  Contour outline_, profile_;
};

// Up to where a membrane that a needle of radius c pushes in by w_d bends strongly, along its contour from
// the pole; 0 without a dimple. For the argument `dimple` of NetFit::fit.
[[nodiscard]] double dimple_reach(double wd, double c);

// Whether a closed polygon keeps clear of itself.
[[nodiscard]] bool is_simple(std::span<const Point> closed);

}  // namespace punctum::vision
