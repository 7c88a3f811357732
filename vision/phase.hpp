// Phase of the insertion, as the pictures alone tell it.
#pragma once

#include <optional>

#include "rt/station/telemetry.hpp"
#include "vision/injection_pipette.hpp"

namespace punctum::vision {

// The tip from frame to frame.
struct TipMotion {
  std::optional<Point> last;  // empty: not seen in the last frame
  Point axis{-1, 0};
  double speed = 0;  // px/frame along the axis, into the cell > 0, smoothed

  void update(const NeedleFix& needle);
};

struct PhaseSigns {
  double um_px = 1;              // a micrometre in the picture
  std::optional<double> gap_px;  // tip to undeformed membrane, > 0 outside
  double wd_px = 0;
  double tip_speed = 0;  // px/frame
  bool contact = false;
  bool punctured = false;
};

[[nodiscard]] rt::Phase next_phase(rt::Phase last, const PhaseSigns& now);

}  // namespace punctum::vision
