#include "vision/surface/cubic_basis.hpp"

#include <algorithm>

namespace punctum::vision {

double cubic_knot(int control_points, int i) {
  const int spans = control_points - 3;
  return static_cast<double>(std::clamp(i - 3, 0, spans)) / spans;
}

CubicBasis cubic_basis(int control_points, double u) {
  const int spans = control_points - 3;
  CubicBasis basis;
  constexpr double kRounding = 1e-9;  // a knot belongs to the span that begins there
  basis.first = std::clamp(static_cast<int>(u * spans + kRounding), 0, spans - 1);
  const int span = basis.first + 3;  // u lies between its knot and the next
  const auto knot = [control_points](int i) { return cubic_knot(control_points, i); };
  std::array<double, 4>& n = basis.value;
  n[0] = 1;
  for (int degree = 1; degree <= 3; ++degree) {
    if (degree == 3) {  // the slope of a cubic, from the quadratics
      for (int i = 0; i <= 3; ++i) {
        const auto part = [&](int k) {
          const auto j = static_cast<std::size_t>(k);
          return n[j] / (knot(span + 1 + k) - knot(span - 2 + k));
        };
        basis.slope[static_cast<std::size_t>(i)] = 3 * ((i > 0 ? part(i - 1) : 0) - (i < 3 ? part(i) : 0));
      }
    }
    double saved = 0;
    for (int k = 0; k < degree; ++k) {
      const double right = knot(span + 1 + k), left = knot(span + 1 + k - degree);
      const double share = n[static_cast<std::size_t>(k)] / (right - left);
      n[static_cast<std::size_t>(k)] = saved + (right - u) * share;
      saved = (u - left) * share;
    }
    n[static_cast<std::size_t>(degree)] = saved;
  }
  return basis;
}

}  // namespace punctum::vision
