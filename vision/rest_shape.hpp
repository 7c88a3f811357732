// What a membrane is without the needle: learnt while nothing touches it, remembered while something does.
#pragma once

#include <optional>
#include <vector>

#include "vision/cleared_picture.hpp"
#include "vision/dimple.hpp"

namespace punctum::vision {

// One membrane's contour.
struct RestOutline {
  Point centre;
  std::vector<double> r;  // px per angle; empty = not known
  int frames = 0;         // learnt from

  [[nodiscard]] bool mature() const noexcept;                                    // may be relied on
  [[nodiscard]] std::vector<double> seen_from(const Point& other_centre) const;  // empty when not known
  void learn(const Point& now_centre, const std::vector<double>& now_r);
};

// The outer membrane's fitted shape. It goes with the holding pipette.
class LearntUndeformed {
 public:
  // now: fitted to the frame; mouth: of the holding pipette, where it is seen. Returns how far the cell was
  // carried.
  [[nodiscard]] Point update(const Undeformed& now, bool touched, const std::optional<Point>& mouth);
  void forget();
  [[nodiscard]] bool known() const noexcept { return shape_.has_value(); }
  [[nodiscard]] const std::optional<Undeformed>& shape() const noexcept { return shape_; }
  // Whether an outer contour found anew is this cell in its place. The needle, if any, may dent it.
  [[nodiscard]] bool same_cell(const Contour& outer, const Point& centre, const NeedleFix& needle) const;

 private:
  std::optional<Undeformed> shape_;
  int frames_ = 0;  // learnt from
  std::optional<Point> mouth_;
};

// For fit_undeformed: 0 where the contour is hidden, dented at `entry`, or pressed by the holding pipette.
[[nodiscard]] std::vector<double> undeformed_weights(const Contour& contour, const ClearedPicture& picture,
                                                     const std::optional<Point>& entry,
                                                     const std::optional<Point>& mouth);

}  // namespace punctum::vision
