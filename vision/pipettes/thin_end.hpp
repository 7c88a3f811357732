// Where the glass of a needle ends that is so thin that its lumen is hardly seen.
#pragma once

#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_end.hpp"

namespace punctum::vision {

// What the needle takes of the light, summed across, is a step along it, and a line of glass that closes it a
// hump on this step: the walls alone seem to end up to a blur ahead of the glass. A single frame tells step
// and hump apart badly, so it is told from the mean of many. In relief what one side shows less what the
// other does is a step, and what both show is a line at the end itself. Taken to be cut at right angles.
class ThinEnd {
 public:
  void forget() { frames_ = 0; }
  // One more frame with nothing near the end that is followed. False, and none, at the border of the picture.
  bool add(const GradientField& field, const NeedlePose& followed, bool in_relief);
  [[nodiscard]] int frames() const noexcept { return frames_; }
  // The outermost glass, from the end that is followed. noise: grey levels, of a frame. Empty where that is
  // not certain to 0.45 px.
  [[nodiscard]] std::optional<GlassEnd> end(double noise) const;

 private:
  int frames_ = 0;
  bool in_relief_ = false;
  double half_width_ = 0;  // px
  // In each row, mean of the frames, grey levels times px: what is taken of the light, and what one side
  // shows less what the other does.
  Vector<double> taken_, unlike_;
};

}  // namespace punctum::vision
