// The gradient along the edge of a cell as one frame shows it, to find the edge again when the picture jumps.
#pragma once

#include <array>
#include <optional>

#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

class EdgePattern {
 public:
  // Where nothing hides the contour.
  void learn(const ClearedPicture& picture, const Contour& contour);
  void forget() { count_ = 0; }
  // In noise another frame of the same edge looks too different.
  [[nodiscard]] bool known() const noexcept { return count_ >= kLeast && expected_ > kClear; }

  // By how much it has moved, px. nearby: empty where that is not less than kNear_px in x and y, or it is not
  // seen. anywhere: empty where it is seen nowhere within kReach_px in x and y; 80 000 lookups of a gradient.
  [[nodiscard]] std::optional<Point> nearby(const GradientField& field) const;
  [[nodiscard]] std::optional<Point> anywhere(const GradientField& field) const;

 private:
  struct Place {
    Point at, gradient;
  };
  // Correlation of its gradient with that at the places moved by `by`: -1 .. 1.
  [[nodiscard]] double likeness(const GradientField& field, const Point& by) const;
  [[nodiscard]] Point between_pixels(const GradientField& field, const Point& best) const;

  static constexpr int kNear_px = 3, kReach_px = 32;
  static constexpr int kMost = 64, kLeast = 16;  // places along the contour
  static constexpr double kClear = 0.7;
  std::array<Place, kMost> places_;
  int count_ = 0;
  double power_ = 0;     // sum of squares of its gradient
  double expected_ = 0;  // likeness to another frame of the same edge, by the noise
};

}  // namespace punctum::vision
