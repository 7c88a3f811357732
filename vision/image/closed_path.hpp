// Refinement beyond the paper: the closed path of the strongest signed edge round a centre, sub-pixel at
// every angle, and smoothed where nothing is seen.
//
// The greedy snake with 16 nodes cannot follow a dimple: its spline is 2 um away from a dimple 10 um deep.
// The tracker measures the closed path.
#pragma once

#include <cstdint>

#include "vision/image/edge_band.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

struct EdgePath {
  Vector<double> r;           // px per angle, sub-pixel, smoothed
  Vector<double> raw;         // the same before smoothing
  Vector<float> strength;     // signed edge at the path, grey levels per px; 0 where it is hidden
  Vector<std::uint8_t> seen;  // 1: an edge above the floor supports this angle
  double support = 0;         // seen angles / visible angles
  double visible = 0;         // visible angles / all angles
  double mean_strength = 0;   // over the visible angles, saturated, 0 .. 1
  double residual = 0;        // robust standard deviation of raw - r over the seen angles, px
  double saturation = 0;      // the one that was used
  double level = 0;           // median edge along the path over the visible angles, grey levels per px
  double background = 0;      // median edge over the whole visible band, texture and noise; 0: not measured
};

// floor: an edge below it (grey levels per px) is noise. The strength saturates at `saturation`; if that is
// <= 0, at 0.7 times the median over the angles of each ray's strongest edge.
[[nodiscard]] EdgePath closed_path(const GradientField& field, const EdgeBand& band, Polarity polarity,
                                   double floor, double saturation);

}  // namespace punctum::vision
