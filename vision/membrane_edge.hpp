// Refinement beyond the paper: a membrane as the closed path of strongest signed edge round a centre, moved
// to the sub-pixel edge at every angle and smoothed where nothing is seen.
//
// The 16-node greedy snake cannot follow a dimple (16 cubic nodes are 2 um away from one 10 um deep); it
// gives the start and the motion from frame to frame, this gives the contour that is measured.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "vision/gradient.hpp"

namespace punctum::vision {

enum class Polarity : std::uint8_t {
  any,           // phase-like pictures: the sign of the edge changes round the cell
  brighter_out,  // outside is brighter than inside
  darker_out,
};

// The band searched: one radius per angle +- half_width.
struct EdgeBand {
  Point centre;
  std::vector<double> middle;        // px, at equally spaced angles from 0
  double half_width = 8;             // px
  double step = 0.5;                 // px between samples
  double slope = 1.0;                // largest change of offset from middle, px per px of arc
  double stiffness = 0.25;           // cost of that change, per (px/px)^2 and angle
  std::vector<double> lower, upper;  // hard limits per angle, or empty
  std::vector<std::uint8_t> hidden;  // 1 = this whole ray tells nothing; or empty
  // 0 = a pixel that belongs to something else (pipette, impurity, outside): neutral, no edge and no cost.
  std::function<double(const Point&)> visible;
  // Places the contour is known to pass (the needle's end face while it pushes): angle index and radius.
  std::vector<std::pair<int, double>> anchors;
};

struct EdgePath {
  std::vector<double> r;           // sub-pixel, smoothed; px per angle
  std::vector<double> raw;         // sub-pixel before smoothing
  std::vector<float> strength;     // signed edge in grey levels per px at the path; 0 where hidden
  std::vector<std::uint8_t> seen;  // 1 = an edge above the floor supports this angle
  double support = 0;              // share of the visible angles that are seen
  double visible = 0;              // share of the angles that are visible
  double mean_strength = 0;        // over visible angles, saturated, 0 .. 1
  double residual = 0;             // robust sd of raw - r over the seen angles, px
  double saturation = 0;           // the one that was used
  double level = 0;                // median edge along the path over visible angles, grey levels per px
  double background = 0;           // median edge over the whole visible band: texture and noise
};

// floor: edge strength (grey levels per px) below which nothing is believed. Strength saturates at
// `saturation`;
// <= 0: at 0.7 times the median over angles of each ray's strongest edge.
[[nodiscard]] EdgePath closed_path(const GradientField& field, const EdgeBand& band, Polarity polarity,
                                   double floor, double saturation);

// Penalised least squares on a closed line: min sum w (r - x)^2 + sum stiffness_i (x_{i-1} - 2 x_i +
// x_{i+1})^2.
[[nodiscard]] std::vector<double> smooth_closed(const std::vector<double>& r,
                                                const std::vector<double>& weight,
                                                const std::vector<double>& stiffness);

}  // namespace punctum::vision
