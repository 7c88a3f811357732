// What happens between needle and cell, from frame to frame: contact, puncture, the depth and the width of
// the dimple, and the phase.
#pragma once

#include <optional>

#include "vision/events/contact.hpp"
#include "vision/events/puncture.hpp"
#include "vision/events/velocity_reversal.hpp"
#include "vision/result.hpp"
#include "vision/seen_cell.hpp"
#include "vision/seen_needle.hpp"
#include "vision/stopwatch.hpp"

namespace punctum::vision {

class SeenEvents {
 public:
  explicit SeenEvents(const VisionConfig& config)
      : config_(config),
        puncture_(config.puncture_px),
        reversal_(config.puncture_px),
        inner_reversal_(config.puncture_px) {}

  // No frame was seen for a while: a puncture stays one while the tip stays inside. Sets the phase.
  void go_on_from(const SeenEvents& before, rt::Phase phase, Result& result);
  // The needle is not known to be the same one.
  void forget_puncture(Result& result);
  [[nodiscard]] const Touch& touch() const noexcept { return touch_; }

  // Each sets contact, punctures and dimple of the result: by the tracker's tests, as the paper has it, and
  // where no cell is found.
  void decide(const ClearedPicture& picture, const SeenNeedle& needle, const SeenCell& cell, Result& result,
              Stopwatch& watch);
  void decide_as_paper(const ClearedPicture& picture, const SeenNeedle& needle, const SeenCell& cell,
                       Result& result, Stopwatch& watch);
  void without_the_cell(Result& result);
  // Sets the phase.
  void end_frame(const SeenNeedle& needle, Result& result);

 private:
  void measure_depth(const SeenNeedle& needle, const SeenCell& cell, double membrane_px,
                     Result& result) const;

  const VisionConfig& config_;
  Touch touch_;
  double touched_blur_px_ = 0;  // of the outer membrane, when the needle touched it
  ContactTest contact_;
  Puncture puncture_;
  InnerPuncture inner_puncture_;
  VelocityReversal reversal_, inner_reversal_;  // in place of the two, as the paper has it
};

}  // namespace punctum::vision
