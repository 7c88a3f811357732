// What vision saw, drawn over the frame.
#pragma once

#include <opencv2/core.hpp>

#include "vision/tracker.hpp"

namespace punctum::vision {

// Colour picture, enlarged so that its longer side has at least 900 px: outer green, inner cyan, snake nodes
// as dots, undeformed circle dashed white, needle axis and edges yellow, tip red cross, contact points
// magenta, w_d orange between entry and membrane, holder's template blue, verdict as text.
[[nodiscard]] cv::Mat draw_overlay(const cv::Mat& grey, const Result& result, const VisionConfig& config);

}  // namespace punctum::vision
