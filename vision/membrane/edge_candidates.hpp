// Closed edges of a whole cell, before anything is known of it.
#pragma once

#include <optional>

#include "vision/config.hpp"
#include "vision/image/circle.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

inline constexpr double kEdgeClear_noise = 4;  // an edge is believed above so many times the gradient's noise

// A closed edge round a centre.
struct ClosedEdge {
  EdgePath path;
  Point centre;
  Polarity polarity = Polarity::any;
  Relief relief;
};

struct MainEdge {
  ClosedEdge edge;
  ClosedEdge of_any_sign;  // the same edge, followed whatever its sign is, about its own centre
};

struct SecondEdge {
  EdgePath path;  // about the centre of the first edge
  Polarity polarity = Polarity::any;
  Relief relief;
  double quality = 0;
};

// The closed edge round a circle's centre, whatever its sign is; the centroid of the edge becomes the next
// centre. seeded: the circle was given, so that the edge is near it. saturation: of the edge strength; <= 0:
// by the picture. tried: centres of edges that are known already. Empty when it is one of those, or when no
// edge stands out.
[[nodiscard]] std::optional<ClosedEdge> closed_edge_round(const Circle& circle, bool seeded,
                                                          double saturation, Vector<Point>& tried,
                                                          const ClearedPicture& picture,
                                                          const VisionConfig& config);

// The same edge, finely and by its sign, where it has one. Empty when that edge does not stand out.
[[nodiscard]] std::optional<MainEdge> edge_by_its_sign(const ClosedEdge& coarse, const Circle& circle,
                                                       bool seeded, const ClearedPicture& picture,
                                                       const VisionConfig& config);

// A second closed edge of an opposite (or the same) sign in relief, between two distances outside of a known
// one (inside: negative), px.
[[nodiscard]] SecondEdge find_in_relief(const Vector<double>& r1, const Point& centre, const Relief& relief,
                                        double from, double to, const ClearedPicture& picture);

// A second closed edge, at some distance outside or inside of one that is known: `r1`, per angle round the
// centre, of the sign `known_sign`. Its path is empty when there is none.
[[nodiscard]] SecondEdge find_second(const Vector<double>& r1, const Point& centre, Polarity known_sign,
                                     bool outside, const ClearedPicture& picture, const VisionConfig& config);

// Whether a second edge is a membrane. first_level: level of the first edge, grey levels per px.
[[nodiscard]] bool clear_enough(const SecondEdge& edge, double first_level, const ClearedPicture& picture);

}  // namespace punctum::vision
