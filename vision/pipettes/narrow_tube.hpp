// A narrow glass tube (the injection pipette), followed from the border to its end by its cross profile.
#pragma once

#include <cstddef>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/border_section.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

// What crosses the border with a total width of width_min .. width_max px. noise: grey levels.
// without_specks: its outermost edges where they are faint, or in a half of the strip.
[[nodiscard]] std::optional<TubeTrace> narrow_tube_at_border(const GradientField& field, Border border,
                                                             double width_min, double width_max, double noise,
                                                             bool without_specks);

// Follows a tube by its cross profile, which it learns on the way; in parts, each in the picture of its
// frame.
class NarrowTubeTrace {
 public:
  explicit NarrowTubeTrace(const TubeTrace& at_border);

  // False while there is more to follow.
  [[nodiscard]] bool advance(const GradientField& field);
  // Empty when what crosses the border is not straight, has not the same profile along its length, or does
  // not end in the picture.
  [[nodiscard]] std::optional<TubeTrace> tube(const GradientField& field);

 private:
  [[nodiscard]] bool learn_at_border(const GradientField& field);
  void step(const GradientField& field, double s);
  [[nodiscard]] Vector<double> profile(const GradientField& field, const Point& at, double length,
                                       int samples, double apart) const;
  [[nodiscard]] double half_width_near_end(const GradientField& field, const TubeTrace& t) const;

  TubeTrace at_border_;
  Point across_;
  int n_;  // samples of a profile, 1 px apart
  Vector<double> learnt_;
  double contrast_ = 0;
  double lateral_ = 0;  // of the tube at the present station, px
  Vector<double> along_, shift_, similarity_;
  double sum_ = 0, sum_best_ = 0;  // of (similarity - 0.5)
  std::size_t last_ = 0;           // station where that is largest
};

}  // namespace punctum::vision
