// The search of one membrane in one frame: in a band round its last contour, pushed in by the needle or free
// of it.
#pragma once

#include <optional>
#include <utility>

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/followed_membrane.hpp"

namespace punctum::vision {

// What else is near the membrane.
struct Surroundings {
  const NeedlePose& needle;
  std::optional<Point> last_tip;  // one frame ago
  double expected_px = 0;         // by which it has moved since, along the axis
  std::optional<Point> carried;   // by which the cell has moved since, with what holds it
  double gone_odds = 0;           // log odds, across the needle's mouth, that the membrane is not on the tip
  bool punctured = false;
  double wall_px = 0;                        // of the outer membrane, by the scene
  bool dents_seen = true;                    // no needle that is not seen may dent it
  bool outermost = true;                     // the membrane is the outer one
  const FollowedMembrane* around = nullptr;  // the membrane outside of it, if this frame shows it
  const FollowedMembrane* within = nullptr;  // the membrane inside of it, one frame ago
  const Undeformed* undeformed = nullptr;    // of the outer membrane; or null

  // Nearer to the outer membrane's face the inner one never is: the wall of a cell may be thinner than the
  // scene says.
  [[nodiscard]] double least_wall_px() const noexcept {
    constexpr double kThinner = 0.8;
    return kThinner * wall_px;
  }
};

// Where the needle meets a membrane, seen from the centre of the band.
struct NeedleSeen {
  double entry_angle = 0;  // of the entry point; it is the angle of the axis only for a central needle
  int tip_index = 0;       // angle nearest to the tip
  double tip_r = 0;        // px
};

struct MembraneSearch {
  const FollowedMembrane& m;
  const ClearedPicture& picture;
  const Surroundings& surroundings;
  int angles;
  double usual_r;       // px
  double saturation;    // grey levels per px
  EdgeBand band;        // round the last contour
  Vector<double> rest;  // rest outline, seen from the centre of the band; empty: not known
  std::optional<NeedleSeen> needle;
  std::optional<double> free_by_motion;  // log odds that it has gone back against the needle

  MembraneSearch(const FollowedMembrane& followed, const ClearedPicture& cleared, const Surroundings& s);

  // Angle between the ray i and the entry of the needle, rad.
  [[nodiscard]] double from_needle(int i) const {
    return angle_between(polar_angle(i, angles), needle ? needle->entry_angle : 0);
  }
  [[nodiscard]] EdgePath path_in(const EdgeBand& b) const {
    return closed_path(picture.field, b, m.polarity, picture.edge_floor(), saturation);
  }
  [[nodiscard]] EdgePath path_free() const;
  [[nodiscard]] EdgePath path_pushed() const;
  [[nodiscard]] Vector<std::pair<int, double>> end_face() const;
  [[nodiscard]] double depth_of_tip() const;  // px below the face of the membrane at rest

 private:
  void keep_membranes_apart();
  void limit_depth_to_tip();
};

struct EdgeFound {
  EdgePath path;
  bool is_free = false;  // the needle is inside, but the membrane is at its rest outline
  bool held = true;      // see FollowedMembrane
  double dimple_px = 0;
  std::array<double, kDimpleShapes> dimple_odds{};
};

// The better of the two: the membrane pushed by the needle, or free of it.
[[nodiscard]] EdgeFound pushed_or_free(const MembraneSearch& search);

}  // namespace punctum::vision
