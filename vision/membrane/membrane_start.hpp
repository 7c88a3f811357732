// Start of the membranes. From circles: the strongest closed edge round one of them, a second closed edge
// inside or outside of it, and which of the two membranes each edge is.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "vision/image/hough_circles.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/membrane_following.hpp"

namespace punctum::vision {

struct StartedMembranes {
  FollowedMembrane outer, inner;  // either may stay unknown
  std::string reason;             // when none was found
};

// Where the holding pipette's mouth is on a cell, or as far outside of it as a zona may be round its ooplasm.
[[nodiscard]] bool is_held(const Circle& cell, const ClearedPicture& picture);

// The search of a cell of which nothing is known, in parts of about the same cost: where a frame has no time
// for all of them, each does its part in its own picture.
class CellSearch {
 public:
  // seed: a circle that replaces the Hough transform. last_seen: of a cell that was lost; there it is looked
  // for first.
  explicit CellSearch(const std::optional<Circle>& seed,
                      const std::optional<Circle>& last_seen = std::nullopt);

  // Does one part, of forty at most. Empty while there is more to do.
  [[nodiscard]] std::optional<StartedMembranes> advance(const ClearedPicture& picture,
                                                        const VisionConfig& config);

 private:
  // A cell that is held comes before any bubble, and before other cells, however clear; then the strength of
  // the closed edge round it counts.
  using Rank = std::pair<bool, double>;
  struct Candidate {
    Circle circle;
    Rank rank;
  };
  void vote(const ClearedPicture& picture, const VisionConfig& config);
  void choose_circles(CircleSearch& votes, const ClearedPicture& picture);
  void try_circles(const ClearedPicture& picture, const VisionConfig& config);
  void look_round(const Circle& circle);
  [[nodiscard]] std::optional<StartedMembranes> try_strongest(const ClearedPicture& picture,
                                                              const VisionConfig& config);
  [[nodiscard]] std::optional<StartedMembranes> begin_round(const Circle& circle,
                                                            const ClearedPicture& picture,
                                                            const VisionConfig& config) const;

  bool seeded_;
  std::optional<Circle> last_seen_;
  std::optional<CircleSearch> votes_;
  int parts_voted_ = 0;
  Vector<Circle> circles_;        // still to be tried
  Vector<Point> tried_;           // centres of the edges round those that were
  double saturation_ = 0;         // grey levels per px, the same for all circles
  Vector<Candidate> candidates_;  // the highest rank first
  // A membrane that was found alone, which may be a part of a cell.
  std::optional<StartedMembranes> alone_;
  Rank alone_rank_;
  int looks_ = 0;
  std::string reason_;  // why the last edge that was told apart is none
};

// The inner membrane alone, inside an outer membrane that is followed. faint_too: even if single rays do not
// show it.
[[nodiscard]] std::optional<FollowedMembrane> start_inner(const ClearedPicture& picture,
                                                          const VisionConfig& config,
                                                          const FollowedMembrane& outer, bool faint_too);

}  // namespace punctum::vision
