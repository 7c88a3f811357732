// The end of an injection pipette with light along it: its walls hardly show, and where the light's path
// through the glass ends there is a bright or dark line across the needle, far stronger than they are.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

struct EndLine {
  double ahead = 0;     // of the tip of the pose, px
  double strength = 0;  // grey levels over what lies beside it
  double sd = 0;        // of `ahead`, px
};

// The nearest such line from `from` to `to` px ahead of the tip of a blunt needle: alone, and even across it.
// noise: grey levels. in_relief: it is known that light comes from one side, so that a line that is no
// stronger than the walls is no glass that closes the needle.
[[nodiscard]] std::optional<EndLine> end_line(const GradientField& field, double noise,
                                              const NeedlePose& needle, double from, double to,
                                              bool in_relief);

// The same line within `reach` px of the tip, however much of a membrane lies on it.
[[nodiscard]] std::optional<EndLine> end_line_again(const GradientField& field, double noise,
                                                    const NeedlePose& needle, double strength, double reach);

// Where the walls lose most of their contrast towards the tip of the pose, they may go on unseen: puts the
// tip at the line that lies ahead of it, where there is one.
void go_to_end_of_fading_walls(const GradientField& field, double noise, NeedlePose& needle);

}  // namespace punctum::vision
