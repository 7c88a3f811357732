// The tip as the encoders of the manipulator tell it, once it is known how far off the picture they are.
#pragma once

#include <optional>

#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class TipByStage {
 public:
  // Once per frame, before anything else. stage: px, of any constant offset; empty: not known.
  void begin(const std::optional<Point>& stage);

  [[nodiscard]] std::optional<Point> moved() const { return moved_; }  // since the last frame
  // The tip without the picture. Empty where the stage is not known, or how far off it is.
  [[nodiscard]] std::optional<Point> tip() const;
  // What is seen lies elsewhere than a manipulator that did not jump has brought the tip: something else is
  // taken for it. Asked in every frame.
  [[nodiscard]] bool picture_strays(const NeedlePose& seen);
  // With the most likely tip along the axis, of what picture and stage tell; across it the picture is better.
  [[nodiscard]] NeedlePose most_likely(const NeedlePose& seen);
  // Takes in how far off the stage is. Only while nothing touches the tip.
  void learn(const NeedlePose& seen);
  [[nodiscard]] double sd() const;  // of tip() along the axis, px
  // All that the picture shows lies elsewhere, by that.
  void jump_with_picture(const Point& by);
  // No frame was seen for a while: it may have drifted, and moved by any distance.
  void after_gap();
  void forget();  // all but where the stage is
  // The manipulator has moved the needle, and what is seen as its tip stayed: it is something else.
  [[nodiscard]] bool picture_stays() const { return picture_stays_ || picture_stays_far_; }
  // Also over a way on which a speck on it would have been left behind.
  [[nodiscard]] bool picture_stays_far() const { return picture_stays_far_; }
  // It has moved with the manipulator, as far as that tells where it is.
  [[nodiscard]] bool picture_moves() const { return picture_moves_ || !stage_; }

 private:
  struct Compared {
    Point stage, tip;
    double fastest;  // of the manipulator since then, px per frame
  };
  void compare(const NeedlePose& seen);
  [[nodiscard]] bool stays(std::optional<Compared>& from, const Compared& now, const Point& way, double late);
  [[nodiscard]] bool far_apart(const NeedlePose& seen) const;

  std::optional<Point> stage_, moved_;
  Point off_;               // of the stage: tip in the picture minus stage, px
  double variance_ = 0;     // of off_ along the axis, px^2
  double constant_sd_ = 0;  // of the picture that off_ was learnt from
  double scatter_ = 0;      // variance of the stage from frame to frame, px^2
  int frames_ = 0;          // that it was learnt from
  int disagreements_ = 0;   // frames in a row
  std::optional<Compared> at_rest_, in_motion_;
  bool picture_stays_ = false, picture_stays_far_ = false, picture_moves_ = false;  // since it was found
  bool jumped_ = false;  // the manipulator, since both agreed
};

}  // namespace punctum::vision
