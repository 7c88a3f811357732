// Something that lies still in the picture, or drifts: by how much it has moved since it was last seen, and
// whether that is a jump, as when somebody knocks against the microscope.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/contour.hpp"

namespace punctum::vision {

class Landmark {
 public:
  static constexpr double kDrift_px = 2;  // per frame: more is a jump

  // Once per frame, before it is seen in it, if it is.
  void begin() {
    ++ago_;
    way_.reset();
  }
  void seen(const Point& at) {
    if (at_) {
      way_ = at - *at_;
      apart_ = ago_;
    }
    at_ = at;
    ago_ = 0;
  }
  // px; empty where this frame does not show it, and the second also where the last one does not.
  [[nodiscard]] std::optional<Point> place() const { return ago_ == 0 ? at_ : std::nullopt; }
  [[nodiscard]] std::optional<Point> moved() const { return apart_ == 1 ? way_ : std::nullopt; }
  // Since the last frame that shows it.
  [[nodiscard]] std::optional<Point> jump() const {
    return way_ && cv::norm(*way_) > kDrift_px * apart_ ? way_ : std::nullopt;
  }

 private:
  std::optional<Point> at_;   // in the last frame that showed it
  std::optional<Point> way_;  // there from the one before, if that is this frame
  int apart_ = 0, ago_ = 0;   // frames: those two; the last of them and this one
};

}  // namespace punctum::vision
