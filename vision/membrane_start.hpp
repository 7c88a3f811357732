// How the membranes begin: from circles, the strongest closed edge round one of them, a second closed edge
// inside or outside it, and which of the two membranes each edge is.
#pragma once

#include <optional>
#include <string>

#include "vision/membrane_following.hpp"

namespace punctum::vision {

struct StartedMembranes {
  FollowedMembrane outer, inner;  // where one stays unknown following leaves it so
  std::string why;                // when none was found
};

// seed: instead of the Hough transform.
[[nodiscard]] StartedMembranes start_membranes(const ClearedPicture& picture, const VisionConfig& config,
                                               const std::optional<Circle>& seed);

// The inner membrane alone, inside an outer one that is followed.
[[nodiscard]] std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture,
                                                          const VisionConfig& config,
                                                          const FollowedMembrane& outer);

}  // namespace punctum::vision
