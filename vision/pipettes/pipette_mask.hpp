// Pipettes as polygons, by which they are erased from the picture.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

using Polygon = std::vector<Point>;

// From `ahead` px past the tip or mouth to the border, widened by `margin` px on either side.
[[nodiscard]] Polygon needle_polygon(const NeedlePose& needle, cv::Size picture, double margin, double ahead);
[[nodiscard]] Polygon holder_polygon(const TubeTrace& tube, const Point& mouth, cv::Size picture,
                                     double margin, double ahead);

// Sets the pixels of the polygons in mask (CV_8U) to 255.
void draw_mask(cv::Mat& mask, const std::vector<Polygon>& polygons);

}  // namespace punctum::vision
