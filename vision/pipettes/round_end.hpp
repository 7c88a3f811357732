// The end of a glass that was melted round: its walls bend together, and seem to end where they do. What
// closes it ahead of there is a pale line across.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// A single frame shows that line little better than anything that lies ahead. So it is told from two means of
// frames between which the needle moved: what goes with it is in the same place in both.
class RoundEnd {
 public:
  static constexpr double kReach_px = 14;  // ahead of the tip, in which nothing else may lie

  void forget() { first_ = then_ = {}; }
  // One more frame in which nothing lies within kReach_px. False at the border of the picture.
  bool add(const GradientField& field, const NeedlePose& needle);
  // The outermost glass, from the tip of the poses, px. Empty where it is not seen further ahead, or where
  // the frames are too few.
  [[nodiscard]] std::optional<double> ahead() const;

 private:
  struct Mean {
    int frames = 0;
    double walls = 0;       // how much darker they are than the medium, grey levels
    double half_width = 0;  // px
    Vector<double> across;  // grey levels, at places along the needle
    void add(const GradientField& field, const NeedlePose& needle);
    [[nodiscard]] std::optional<double> line() const;  // its place ahead of the tip, px
  };
  Point from_;  // the tip in the first frame
  Mean first_, then_;
};

}  // namespace punctum::vision
