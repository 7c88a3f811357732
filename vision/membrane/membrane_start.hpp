// Start of the membranes. From circles: the strongest closed edge round one of them, a second closed edge
// inside or outside of it, and which of the two membranes each edge is.
#pragma once

#include <optional>
#include <string>

#include "vision/membrane/membrane_following.hpp"

namespace punctum::vision {

struct StartedMembranes {
  FollowedMembrane outer, inner;  // either may stay unknown
  std::string reason;             // when none was found
};

// seed: a circle that replaces the Hough transform.
[[nodiscard]] StartedMembranes start_membranes(const ClearedPicture& picture, const VisionConfig& config,
                                               const std::optional<Circle>& seed);

// The inner membrane alone, inside an outer membrane that is followed. faint_too: even if single rays do not
// show it.
[[nodiscard]] std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture,
                                                          const VisionConfig& config,
                                                          const FollowedMembrane& outer, bool faint_too);

}  // namespace punctum::vision
