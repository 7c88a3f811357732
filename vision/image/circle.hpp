// Circles in the picture. All lengths are in pixels.
#pragma once

#include <optional>
#include <span>

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct Circle {
  Point centre;
  double r = 0;
  double rms = 0;   // distance of the fitted points from the circle
  double r_sd = 0;  // standard deviation of r, if the distances err independently in each of kPieces
  static constexpr int kPieces = 12;  // no cell is quite round
};

[[nodiscard]] Contour circle_contour(const Circle& circle, int points);

// Least squares over the points with weight > 0, reweighted by Tukey's biweight against outliers. No weights:
// all are 1. Empty when the points do not determine a circle.
[[nodiscard]] std::optional<Circle> fit_circle(std::span<const Point> points,
                                               std::span<const double> weights = {});

}  // namespace punctum::vision
