// The search for the needle from the borders of the picture: what crosses them, the tubes from there, and the
// straight walls along each. In parts of about the same cost, each in the picture of its frame.
#pragma once

#include <cstddef>
#include <optional>

#include "vision/config.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/narrow_tube.hpp"
#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

// The half of the picture in which a needle with that axis enters.
[[nodiscard]] inline Side entered_from(const Point& axis) { return axis.x < 0 ? Side::right : Side::left; }

class NeedleSearch {
 public:
  // side: the border through which it enters. radius_px: expected at the tip.
  NeedleSearch(Side side, double radius_px) : side_(side), radius_px_(radius_px) {}

  // The next part is the first one. Tubes that were found are forgotten.
  void begin_anew();
  // The next part is the walls along the likeliest tube once more.
  void try_again() { tubes_tried_ = 0; }

  // Does one part. False when nothing is left to do but to take a straight needle from the tube that is
  // tried, if there is one. noise: grey levels.
  [[nodiscard]] bool advance(const GradientField& field, double noise);
  [[nodiscard]] bool found_tube() const noexcept { return !tubes_.empty(); }
  // On its walls, up to where they end. Empty where what enters is no straight needle.
  [[nodiscard]] std::optional<NeedlePose> take_straight(const GradientField& field, double noise);
  // False when there is none.
  [[nodiscard]] bool go_to_next_tube() { return ++tubes_tried_ < tubes_.size(); }

  // In this search something straight was found that is no needle, for its width.
  [[nodiscard]] bool found_too_wide_a_one() const noexcept { return too_wide_; }
  [[nodiscard]] double widest_half_width() const noexcept { return 2 * radius_px_ + 1; }  // at the tip, px

 private:
  struct WallsTried {
    NeedlePose needle;  // on the straightest
    double straight;
    std::size_t reaches;  // that were tried
  };
  [[nodiscard]] bool trace_next_border(const GradientField& field, double noise);
  [[nodiscard]] bool fit_walls_further(const GradientField& field, double noise);
  [[nodiscard]] double lie_between_walls(const GradientField& field, double noise, const TubeTrace& tube,
                                         NeedlePose& needle) const;

  Side side_;
  double radius_px_;
  std::size_t sections_looked_at_ = 0;  // of each border two
  double section_half_width_ = 0;       // of the last one, px
  std::optional<NarrowTubeTrace> trace_;
  Vector<TubeTrace> tubes_;  // through those, the most likely one first
  std::size_t tubes_tried_ = 0;
  std::optional<WallsTried> walls_tried_;
  bool too_wide_ = false;
};

}  // namespace punctum::vision
