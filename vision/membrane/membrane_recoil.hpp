// Whether a membrane that the needle pushed has gone back against it since the last frame: by what has moved
// along the needle, beside it, from one picture to the next, whatever it looks like.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "vision/membrane/cleared_picture.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class MembraneRecoil {
 public:
  // entry: where the needle meets the outline at rest, which is expected to move with the cell. carried_px:
  // by which the cell has moved along the axis since the last frame, where that is known better; moved_px: so
  // much has the tip. level: usual edge, grey levels per px. below_px: from the entry, how far down nothing
  // but this membrane moves. Log odds that the membrane has gone
  // back against the tip, against that it stayed or went on with it; empty where the last frame was not seen,
  // or the tip went back too far to tell.
  [[nodiscard]] std::optional<double> update(const ClearedPicture& picture, const NeedlePose& needle,
                                             const Point& entry, std::optional<double> carried_px,
                                             double moved_px, double level, double below_px);
  void forget() noexcept { seen_ = false; }

 private:
  static constexpr std::size_t kOneSide = 12, kLanes = 2 * kOneSide;  // lanes along the needle, beside it
  static constexpr std::size_t kPlaces = 80, kMost = 32;  // of a lane; by which two pictures are shifted
  struct Lane {
    // Change of grey along the axis, grey levels per px, and 1 where it is seen; from kMost before the first
    // place to as much after the last one.
    std::array<float, kPlaces + 2 * kMost> slope{}, seen{};
  };
  using Lanes = std::array<Lane, kLanes>;
  // Of each lane for each shift: squared differences between the two pictures, in all its places.
  using Unlike = std::array<std::array<float, 2 * kMost + 1>, kLanes>;

  void look(const ClearedPicture& picture, const NeedlePose& needle, const Point& entry, double below_px);
  void compare(double noise, Unlike& unlike) const;
  [[nodiscard]] const Lanes& now() const noexcept { return lanes_[now_]; }
  [[nodiscard]] const Lanes& last() const noexcept { return lanes_[1 - now_]; }

  bool seen_ = false;
  Point entry_;
  std::size_t now_ = 0;
  std::array<Lanes, 2> lanes_{};
};

}  // namespace punctum::vision
