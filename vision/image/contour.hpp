// Closed contours in the picture. All lengths are in pixels.
#pragma once

#include <opencv2/core/types.hpp>
#include <span>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// The centres of the pixels are at integers, the origin is the centre of the top left pixel.
using Point = cv::Point2d;
// Closed: the last point is joined to the first, which is not repeated. In the order of rising polar angle.
using Contour = Vector<Point>;

[[nodiscard]] double signed_area(std::span<const Point> contour);
[[nodiscard]] double mean_radius(std::span<const Point> contour);  // of the circle with the same area
[[nodiscard]] Point centroid(std::span<const Point> contour);      // of the enclosed area

}  // namespace punctum::vision
