// Active contour of eq. 2-3, minimised node by node over its neighbourhood (Williams & Shah 1992; fig. 4).
#pragma once

#include <opencv2/core.hpp>

#include "vision/config.hpp"
#include "vision/contour.hpp"

namespace punctum::vision {

struct SnakeResult {
  Contour nodes;
  int iterations = 0;
  int moved_last = 0;  // nodes that still moved in the last iteration
  double energy = 0;   // mean over nodes, of the terms at the final position
};

// The three terms before the normalisation over the neighbourhood.
[[nodiscard]] double elastic_energy(const Point& previous, const Point& v,
                                    double mean_spacing);                                       // |d - |v_s||
[[nodiscard]] double bending_energy(const Point& previous, const Point& v, const Point& next);  // |v_ss|^2
// External energy of gradient magnitude g in a neighbourhood with extremes lo and hi: (lo - g) / (hi - lo),
// with the spread never taken smaller than `floor` so that a flat neighbourhood does not pull.
[[nodiscard]] double external_energy(double g, double lo, double hi, double floor);

// edge: Sobel magnitude, CV_32F, pipettes and impurities set to 0. floor: spread of the magnitude that noise
// alone makes, in the units of edge. Fewer than three nodes come back untouched.
[[nodiscard]] SnakeResult evolve(const cv::Mat& edge, Contour nodes, const SnakeParams& params, double floor);

}  // namespace punctum::vision
