// Active contour of eq. 2-3, minimised node by node over its neighbourhood (Williams & Shah 1992; fig. 4).
#pragma once

#include <opencv2/core.hpp>

#include "vision/config.hpp"
#include "vision/image/contour.hpp"

namespace punctum::vision {

// The three terms before they are normalised over the neighbourhood.
[[nodiscard]] double elastic_energy(const Point& previous, const Point& v,
                                    double mean_spacing);                                       // |d - |v_s||
[[nodiscard]] double bending_energy(const Point& previous, const Point& v, const Point& next);  // |v_ss|^2
// External energy of the gradient magnitude g in a neighbourhood with the extremes lo and hi:
// (lo - g) / (hi - lo). The spread is never taken smaller than `floor`, so that a flat neighbourhood does not
// pull.
[[nodiscard]] double external_energy(double g, double lo, double hi, double floor);

// Returns the nodes where they come to rest, on whole pixels, after at most params.iterations iterations.
// edge: what is large along the contour, CV_32F: the Sobel magnitude, or its square as in eq. 3; 0 where
// pipettes and impurities are. floor: spread that noise alone makes, in the units of edge. erased (CV_8U; or
// empty): a node on a pixel > 0 stays, since there only the bending would move it, and always inwards. Fewer
// than three nodes come back unchanged.
[[nodiscard]] Contour evolve(const cv::Mat& edge, Contour nodes, const SnakeParams& params, double floor,
                             const cv::Mat& erased = {});

}  // namespace punctum::vision
