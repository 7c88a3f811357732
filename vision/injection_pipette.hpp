// Injection pipette: its axis, edges and tip. Found from the border it enters through, then followed by
// normalised correlation of the tip, and its edges fitted anew in every frame.
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "vision/pipette_trace.hpp"

namespace punctum::vision {

struct NeedleFix {
  bool ok = false;
  Point tip;              // sub-pixel: middle of the end face
  Point axis{-1, 0};      // unit, pointing out of the tip
  double half_width = 0;  // at the tip, px
  double taper = 0;       // growth of the half-width per px away from the tip
  double score = 0;       // centred correlation of the tip, 1 in the frame it was cut from
  std::string why;        // when not ok

  // Outside half-width at distance s behind the tip.
  [[nodiscard]] double half_width_at(double s) const { return half_width + taper * std::max(0.0, s); }
  // Place at distance s behind the tip (negative: ahead of it), u across.
  [[nodiscard]] Point at(double s, double u) const { return tip - s * axis + u * Point(-axis.y, axis.x); }
};

class InjectionPipette {
 public:
  // c_px: expected radius at the tip.
  InjectionPipette(Side side, double c_px) : side_(side), c_px_(c_px) {}

  // Looks for it from the border; true when a tip template was cut.
  [[nodiscard]] bool start(const GradientField& field, double noise);
  [[nodiscard]] NeedleFix find(const GradientField& field, double noise);
  // While nothing touches the tip its template may follow slow changes of focus and light.
  void learn(const GradientField& field, const NeedleFix& fix, double noise);

  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] Side side() const noexcept { return found_side_; }

 private:
  bool cut(const GradientField& field, const Point& tip);
  // Returns the share of the stations along the shaft whose edges lie on the two straight lines.
  double fit_edges(const GradientField& field, double noise, NeedleFix& fix) const;
  // Distance ahead of fix.tip at which both walls end, within +-reach: the steepest change of grey along
  // them.
  [[nodiscard]] std::optional<double> wall_step(const GradientField& field, const NeedleFix& fix,
                                                double reach, double floor) const;
  // Distance ahead of fix.tip (< 0: behind) at which the pattern of walls and lumen ends; sub-pixel.
  [[nodiscard]] std::optional<double> walls_end(const GradientField& field, const NeedleFix& fix, double back,
                                                double ahead, double noise) const;

  Side side_;
  double c_px_;
  bool started_ = false;
  Side found_side_ = Side::right;
  std::string why_;
  cv::Mat template_;
  Point tip_in_template_;
  NeedleFix last_;
  Point velocity_;
  int lost_ = 0;
  int jumps_ = 0;
  void calibrate_end(const GradientField& field, const NeedleFix& fix, double noise);

  double end_offset_ = 0;  // from where the walls' pattern ends to the end face, px
  int offset_frames_ = 0;
  double step_sign_ = 0;  // +1: brighter ahead of the walls
};

}  // namespace punctum::vision
