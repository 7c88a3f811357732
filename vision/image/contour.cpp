#include "vision/image/contour.hpp"

#include <cmath>
#include <numbers>

namespace punctum::vision {

double signed_area(std::span<const Point> contour) {
  double sum = 0;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    sum += contour[i].cross(contour[(i + 1) % contour.size()]);
  }
  return 0.5 * sum;
}

double mean_radius(std::span<const Point> contour) {
  return std::sqrt(std::abs(signed_area(contour)) / std::numbers::pi);
}

Point centroid(std::span<const Point> contour) {
  if (contour.empty()) {
    return {};
  }
  const Point o = contour.front();
  double area = 0;
  Point sum;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point p = contour[i] - o, q = contour[(i + 1) % contour.size()] - o;
    const double c = p.cross(q);
    area += c;
    sum += c * (p + q);
  }
  return std::abs(area) > 1e-9 ? o + sum / (3 * area) : o;
}

}  // namespace punctum::vision
