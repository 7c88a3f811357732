// The membranes as the paper finds and follows them: circles by the Hough transform, then one snake each
// (eq. 2-3, fig. 4), whose contour is the spline through its nodes.
#pragma once

#include "vision/membrane/contact_points.hpp"
#include "vision/membrane/membrane_start.hpp"

namespace punctum::vision {

// Both membranes are circles at the start. seed: a circle that replaces that of the Hough transform.
[[nodiscard]] StartedMembranes start_snakes(const ClearedPicture& picture, const VisionConfig& config,
                                            const std::optional<Circle>& seed);

// contact: points where the membrane meets the needle; the contour passes through them.
[[nodiscard]] Membrane follow_snake(FollowedMembrane& m, const ClearedPicture& picture,
                                    const VisionConfig& config, const ContactPoints& contact);

}  // namespace punctum::vision
