// Pipettes erased from the picture: each approximated by a polygon (segmented connected components), and the
// points where the membrane meets the injection pipette, by the grey level along its edges (fig. 5).
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "vision/injection_pipette.hpp"
#include "vision/membrane_edge.hpp"

namespace punctum::vision {

using Polygon = std::vector<Point>;

// From `ahead` px past the tip to the border, edges widened by `margin` px.
[[nodiscard]] Polygon needle_polygon(const NeedleFix& needle, cv::Size picture, double margin, double ahead);
[[nodiscard]] Polygon holder_polygon(const TubeTrace& tube, const Point& mouth, cv::Size picture,
                                     double margin, double ahead);

// Sets the polygons' pixels of mask (CV_8U) to 255.
void draw_mask(cv::Mat& mask, const std::vector<Polygon>& polygons);
// Sets the masked pixels of an edge picture (CV_32F, full picture or `offset` of it) to 0.
void erase(cv::Mat& edge, const cv::Mat& mask, cv::Point offset);

// One point on each edge of the needle, the membrane's first strong change of grey going along a line
// `outside` px beside the edge towards the tip and `past` px beyond. near: where it is expected (distance
// behind the tip, px) and how far around; empty = anywhere.
struct ContactPoints {
  std::array<std::optional<Point>, 2> point;  // left and right edge seen along the axis
  std::array<double, 2> behind_tip{};         // distance behind the tip, px
};
[[nodiscard]] ContactPoints contact_points(const GradientField& field, const NeedleFix& needle,
                                           Polarity polarity, double floor, double outside, double past,
                                           std::array<std::optional<double>, 2> near, double around);

}  // namespace punctum::vision
