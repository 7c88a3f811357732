// Where the point of a needle lies that is ground sharp, in relief: by the path of the light through its
// glass.
#pragma once

#include <array>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_bevel.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

struct SharpPoint {
  double ahead = 0, aside = 0;  // the foremost glass, of the tip of the pose and of its axis, px
  double sd = 0;                // of `ahead`, px, by the noise alone
  double tangent = 0;           // of the cut as it is seen, px along per px across; signed as Bevel
  double radius = 0;            // outer, px
  double explained = 0;         // of what is seen, squared, without what is straight across: 0 .. 1
  std::array<double, 8>
      glass{};  // and light, as they were fitted; first where it ends, behind the tip of the pose
};

// A hollow cone, cut by a plane that may be turned about the needle's axis out of the focal plane, lets light
// pass of which the picture shows the slope of its path along one direction, up to what the contrast can
// show. By least squares from what is known of the cut. Empty where the end is not in the field.
[[nodiscard]] std::optional<SharpPoint> sharp_point(const GradientField& field, double noise,
                                                    const NeedlePose& needle, const CutGlass& cut);
// In a further frame, in which the pose is followed: at little cost, from what was found before.
[[nodiscard]] std::optional<SharpPoint> sharp_point_again(const GradientField& field, double noise,
                                                          const NeedlePose& needle, const SharpPoint& before);

}  // namespace punctum::vision
