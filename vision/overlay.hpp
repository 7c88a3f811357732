// The result of vision, drawn over the frame.
#pragma once

#include <opencv2/core.hpp>

#include "vision/result.hpp"

namespace punctum::vision {

// A colour picture whose longer side has at least 900 px. Outer membrane green, inner cyan, nodes of the
// snakes as dots, undeformed circle dashed white, axis and edges of the needle yellow, tip a red cross,
// contact points magenta, w_d orange from the entry point, template of the holding pipette blue, measures and
// verdict as text, a scale bar at the lower right.
[[nodiscard]] cv::Mat draw_overlay(const cv::Mat& grey, const Result& result, const VisionConfig& config);

}  // namespace punctum::vision
