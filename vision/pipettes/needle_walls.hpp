// The walls of the injection pipette: the straight lines along their outside, and where they end.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// Fits middle, axis, half-width and taper of the pose to the outer edges of the walls, which are looked for
// near where the pose has them. noise: grey levels. radius: expected at the tip, px. Returns the share of the
// stations along the shaft whose edges lie on the two straight lines; 0 when there are too few. The edges are
// averaged over no more than `longest` px of a wall, and looked for within `reach` px.
inline constexpr double kWallReach_px = 3, kWallReachAtStart_px = 7;
inline constexpr double kStraightWalls = 0.65;  // what a straight needle has of those stations, at least
inline constexpr double kLongestWall_px = 40;   // to average an edge over, at the start
inline constexpr double kShortestWall_px = 4;   // likewise, where it is clear
// In a needle with a smaller half-width no lumen is left between the walls, and a line across it looks like
// them.
inline constexpr double kLeastLumen_px = 4.5;
[[nodiscard]] double fit_walls(const GradientField& field, double noise, double radius, NeedlePose& needle,
                               double longest, double reach = kWallReach_px);

// Whether both walls go on from `from` to `ahead` px ahead of the tip: something lies across the needle
// there, and it does not end. shortest: of a wall that an edge is averaged over, px.
[[nodiscard]] bool walls_go_on(const GradientField& field, double noise, const NeedlePose& needle,
                               double from, double ahead, double shortest);

// Distance ahead of the tip (< 0: behind it) at which the cross profile of walls and lumen ends; sub-pixel.
// Searched from `back` px behind the tip to `ahead` px ahead of it. Empty when it does not end there.
[[nodiscard]] std::optional<double> end_of_profile(const GradientField& field, const NeedlePose& needle,
                                                   double back, double ahead, double noise);
// Puts the tip there, where there is such an end.
void put_at_end_of_walls(const GradientField& field, double noise, double back, double ahead,
                         NeedlePose& needle);

// Distance ahead of the tip, within +-reach px, of the steepest change of grey along both walls. sign: of
// that change going ahead; 0 = either. Changes below `floor` (grey levels per px) do not count.
[[nodiscard]] std::optional<double> steepest_wall_step(const GradientField& field, const NeedlePose& needle,
                                                       double reach, double floor, double sign);

}  // namespace punctum::vision
