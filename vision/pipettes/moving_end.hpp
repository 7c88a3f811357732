// The end of a needle that moves evenly, by several noisy frames together: none of them tells it alone.
#pragma once

#include <optional>

#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_bevel.hpp"

namespace punctum::vision {

// In one frame.
struct SeenEnds {
  LikelyEnds ends;
  double behind;  // by which the end was further back then, as far as its motion is known, px
  int age;        // frames since then
};

struct MovingEnd {
  double behind = 0;     // of the tip of the pose, in the last frame, px
  double per_frame = 0;  // by which it moves forward, besides what is known, px
  double motion_sd = 0;  // of the outermost glass, px: what is not known of the motion
};

// The likeliest; a motion is the mean over all. Up to 3 px per frame: empty where it may be faster.
// radius_px: of the glass.
[[nodiscard]] std::optional<MovingEnd> moving_end(const Vector<SeenEnds>& frames, double radius_px,
                                                  bool motion_known);

}  // namespace punctum::vision
