// The injection pipette between the outer faces of its walls, each taken as one line.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// Where light comes from one side each wall is two lines, and edges that are looked for station by station
// may be those of the outer one near the tip and of the inner one further back: the needle is then told
// turned and hardly widening. Empty where the pose lies along lines at both sides or does not look so. noise:
// grey levels.
[[nodiscard]] std::optional<NeedlePose> along_face_lines(const GradientField& field, double noise,
                                                         const NeedlePose& needle);

}  // namespace punctum::vision
