// Phase of the insertion, from the pictures alone.
#pragma once

#include <optional>

#include "rt/station/phase.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// Motion of the tip from frame to frame.
struct TipMotion {
  std::optional<Point> last;  // empty: the last frame did not show it
  Point axis{-1, 0};
  double speed = 0;  // px per frame along the axis, > 0 into the cell, smoothed

  void update(const NeedlePose& needle);
  // All that the picture shows lies elsewhere, by that.
  void jump_with_picture(const Point& by) {
    if (last) {
      *last += by;
    }
  }
};

struct PhaseInput {
  double um_px = 1;              // px per micrometre
  std::optional<double> gap_px;  // tip to undeformed membrane, > 0 outside
  double wd_px = 0;
  double tip_speed = 0;  // px per frame
  bool contact = false;
  bool punctured = false;
};

[[nodiscard]] rt::Phase next_phase(rt::Phase last, const PhaseInput& now);

}  // namespace punctum::vision
