// In relief contrast, where light comes from one side, one wall of the injection pipette may be a strong line
// and the other a faint one: the strong line alone looks like a thin needle, and its inner face like a wall.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// The needle between the strongest line along the pose and a fainter one on one side of it. noise: grey
// levels. radius: expected at the tip, px. Empty where no such line stands out, or lines do on both sides, or
// it is not much fainter.
[[nodiscard]] std::optional<NeedlePose> with_faint_wall(const GradientField& field, double noise,
                                                        double radius, const NeedlePose& needle);

// The needle up to the lines that lie outside the walls of the pose, dark where those are bright or the
// reverse: of four lines, as the faces of two walls are in relief, three look like a needle, and two like a
// thin one. Empty where there are none, or such as a fringe has: alike on either side.
[[nodiscard]] std::optional<NeedlePose> with_outer_line(const GradientField& field, double noise,
                                                        const NeedlePose& needle);

}  // namespace punctum::vision
