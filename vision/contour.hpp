// Closed contours in the picture: cubic spline through nodes, circle and axis geometry. Pixels throughout.
#pragma once

#include <opencv2/core/types.hpp>
#include <optional>
#include <span>
#include <vector>

namespace punctum::vision {

using Point = cv::Point2d;  // pixel centres at integers, origin top left
using Contour =
    std::vector<Point>;  // closed (the last point is not repeated), in order of rising polar angle

struct Circle {
  Point centre;
  double r = 0;
  double rms = 0;  // distance of the fitted points from it
};

// Points, equally spaced along the curve, of the periodic cubic spline (chord-length parameter) through the
// nodes. Empty for fewer than three distinct nodes.
[[nodiscard]] Contour spline_through(std::span<const Point> nodes, int points);

[[nodiscard]] Contour circle_contour(const Circle& circle, int points);
[[nodiscard]] double signed_area(std::span<const Point> contour);
[[nodiscard]] double mean_radius(std::span<const Point> contour);  // of the circle of the same area
[[nodiscard]] Point centroid(std::span<const Point> contour);      // of the area
[[nodiscard]] double distance_to(std::span<const Point> contour,
                                 const Point& p);  // to the polygon's edges, >= 0

// Least squares over the points with weight > 0, Tukey-reweighted against outliers. Weights may be empty (all
// 1).
[[nodiscard]] std::optional<Circle> fit_circle(std::span<const Point> points,
                                               std::span<const double> weights = {});

// Radius at `angles` equally spaced polar angles (from 0) seen from centre; empty if not star-shaped enough
// to tell.
[[nodiscard]] std::vector<double> polar_radii(std::span<const Point> contour, const Point& centre,
                                              int angles);
[[nodiscard]] Contour from_polar(const Point& centre, std::span<const double> radii);

[[nodiscard]] double polar_angle(int i, int angles);  // rad, of the i-th of so many equally spaced ones
[[nodiscard]] int polar_index(const Point& direction, int angles);  // of the nearest of them
[[nodiscard]] Point on_ray(const Point& centre, int i, int angles, double r);
[[nodiscard]] double angle_between(double a, double b);  // 0 .. pi

}  // namespace punctum::vision
