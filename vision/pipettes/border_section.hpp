// What crosses the strip along a border of the picture.
#pragma once

#include <cstdint>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

enum class Border : std::uint8_t { right, left, upper, lower };

struct WantedTube {
  double width_min, width_max;         // of the tube, px
  double strip;                        // from the border, px
  double relative;                     // weaker edges than this share of the strongest one do not count
  int tilt_min_deg = 0, tilt_max_deg;  // of the tube against the border's normal, to either side
  bool without_specks = false;         // outermost edges, which may be specks beside it
  double inset = kBlack_px;            // of the border, px

  static constexpr double kBlack_px = 4;  // borders of recorded pictures often are
};

// Tubes in the strip along a border: root, axis, half_width and edge_share of the traces are set. First the
// one with the strongest edges; then the same without its outermost edges on either side, which may be specks
// on the border, up to three on each. noise: grey levels.
[[nodiscard]] Vector<TubeTrace> border_sections(const GradientField& field, Border border,
                                                const WantedTube& wanted, double noise);

// Across the tube, pointing down in the picture.
[[nodiscard]] Point across_tube(const Point& axis);

}  // namespace punctum::vision
