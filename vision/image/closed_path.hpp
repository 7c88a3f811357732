// Refinement beyond the paper: the closed path of the strongest signed edge round a centre, sub-pixel at
// every angle, and smoothed where nothing is seen.
//
// The greedy snake with 16 nodes cannot follow a dimple: its spline is 2 um away from a dimple 10 um deep.
// The tracker measures the closed path.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "vision/image/gradient.hpp"

namespace punctum::vision {

enum class Polarity : std::uint8_t {
  any,           // the sign of the edge changes round the cell, as in phase contrast
  brighter_out,  // the outside is brighter than the inside
  darker_out,
};

// The band that is searched: one radius per angle +- half_width.
struct EdgeBand {
  Point centre;
  std::vector<double> middle;        // px, at equally spaced angles from 0
  double half_width = 8;             // px
  double step = 0.5;                 // px between samples
  double slope = 1.0;                // largest change of the offset from the middle, px per px of arc
  double stiffness = 0.25;           // cost of that change, per (px/px)^2 and angle
  std::vector<double> lower, upper;  // hard limits per angle; or empty
  std::vector<std::uint8_t> hidden;  // 1: nothing is visible along this ray; or empty
  bool measures_background = false;  // see EdgePath::background
  // CV_8U, of the whole picture; or empty. Not 0: the pixel belongs to something else (a pipette, an
  // impurity), where there is neither an edge nor a cost.
  cv::Mat covered;
  // Places that the contour passes (the needle's end face while it pushes): index of the angle, radius.
  std::vector<std::pair<int, double>> anchors;
};

struct EdgePath {
  std::vector<double> r;           // px per angle, sub-pixel, smoothed
  std::vector<double> raw;         // the same before smoothing
  std::vector<float> strength;     // signed edge at the path, grey levels per px; 0 where it is hidden
  std::vector<std::uint8_t> seen;  // 1: an edge above the floor supports this angle
  double support = 0;              // seen angles / visible angles
  double visible = 0;              // visible angles / all angles
  double mean_strength = 0;        // over the visible angles, saturated, 0 .. 1
  double residual = 0;             // robust standard deviation of raw - r over the seen angles, px
  double saturation = 0;           // the one that was used
  double level = 0;                // median edge along the path over the visible angles, grey levels per px
  double background = 0;  // median edge over the whole visible band, texture and noise; 0: not measured
};

// floor: an edge below it (grey levels per px) is noise. The strength saturates at `saturation`; if that is
// <= 0, at 0.7 times the median over the angles of each ray's strongest edge.
[[nodiscard]] EdgePath closed_path(const GradientField& field, const EdgeBand& band, Polarity polarity,
                                   double floor, double saturation);

}  // namespace punctum::vision
