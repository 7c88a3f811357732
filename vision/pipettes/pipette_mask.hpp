// Pipettes as polygons, by which they are erased from the picture.
#pragma once

#include <opencv2/core.hpp>
#include <span>

#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

using Polygon = Vector<Point>;

// From `ahead` px past the tip or mouth to the border, widened by `margin` px on either side.
[[nodiscard]] Polygon needle_polygon(const NeedlePose& needle, cv::Size picture, double margin, double ahead);
[[nodiscard]] Polygon holder_polygon(const TubeTrace& tube, const Point& mouth, cv::Size picture,
                                     double margin, double ahead);

// Columns of the pixels in row y that a convex polygon touches; from 0 to `columns`.
[[nodiscard]] cv::Range touched_in_row(const Polygon& polygon, int y, int columns);
// Sets the pixels that the polygons touch in mask (CV_8U) to 255; the polygons are convex.
void draw_mask(cv::Mat& mask, std::span<const Polygon> polygons);

}  // namespace punctum::vision
