// Closed edges of a whole cell, before anything is known of it.
#pragma once

#include <optional>
#include <vector>

#include "vision/config.hpp"
#include "vision/image/circle.hpp"
#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

inline constexpr double kEdgeClear_noise = 4;  // an edge is believed above so many times the gradient's noise

// A closed edge round a centre.
struct ClosedEdge {
  EdgePath path;
  Point centre;
  Polarity polarity = Polarity::any;
};

struct MainEdge {
  ClosedEdge edge;
  ClosedEdge of_any_sign;  // the same edge, followed whatever its sign is, about its own centre
};

struct SecondEdge {
  EdgePath path;  // about the centre of the first edge
  Polarity polarity = Polarity::any;
  double quality = 0;
};

// The strongest closed edge round a circle's centre, whichever membrane it is. seeded: the circle was given,
// so that the edge is near it. saturation: of the edge strength; <= 0: by the picture. Empty when no edge
// stands out.
[[nodiscard]] std::optional<MainEdge> strongest_closed_edge(const Circle& circle, bool seeded,
                                                            double saturation, const ClearedPicture& picture,
                                                            const VisionConfig& config);

// A second closed edge, at some distance outside or inside of one that is known: `r1`, per angle round the
// centre, of the sign `known_sign`. Its path is empty when there is none.
[[nodiscard]] SecondEdge find_second(const std::vector<double>& r1, const Point& centre, Polarity known_sign,
                                     bool outside, const ClearedPicture& picture, const VisionConfig& config);

// Whether a second edge is a membrane. first_level: level of the first edge, grey levels per px.
[[nodiscard]] bool clear_enough(const SecondEdge& edge, double first_level, const ClearedPicture& picture);

}  // namespace punctum::vision
