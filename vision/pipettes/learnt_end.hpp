// The end of the needle that is followed: what is learnt of it, and where that is seen in a frame. In focus
// its shape and its walls tell it, in relief its oblique cut or the line across it, of a thin needle the mean
// of many frames.
#pragma once

#include <cstdint>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/backdrop.hpp"
#include "vision/pipettes/end_line.hpp"
#include "vision/pipettes/needle_bevel.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/needle_shape.hpp"
#include "vision/pipettes/round_end.hpp"
#include "vision/pipettes/sharp_point.hpp"
#include "vision/pipettes/thin_end.hpp"

namespace punctum::vision {

// The end that is followed is one that looks the same in every frame, and the tip of a pose lies there. The
// outermost glass lies ahead of it: told() adds that.
class LearntEnd {
 public:
  // By which the walls may seem to end too early at first: 1.9 to 4.2 px in pictures of two renderers.
  static constexpr double kStartReach_px = 7;
  static constexpr double kMostBlur_px = 3.6;  // the widest blur of which the end is known

  // radius_px: expected of the needle.
  explicit LearntEnd(double radius_px) : radius_px_(radius_px) {}

  // From one picture, in which the needle ends near that tip; it is put at its end. noise: grey levels.
  // motion_sd: of the end, px, where it is not certain how it moves. Whether the outermost glass is known
  // well enough for a faint needle to begin.
  [[nodiscard]] bool learn_anew(const GradientField& field, double noise, NeedlePose& needle,
                                double motion_sd);
  // Of a needle that widens steeply, by its shape alone: what is fitted to walls that are the same all along
  // a needle would be wrong.
  void learn_steep(const GradientField& field, const NeedlePose& needle);
  // It ends at this tip, and what is followed of it at that one. False where it cannot be the same end.
  [[nodiscard]] bool learn_outermost(const NeedlePose& needle, const Point& followed);
  // The tip of `needle` has been put at that line, which tells the end from then on.
  void begin_line(const EndLine& line);
  // A frame that shows it in focus, with nothing near; where something is near, only what may be learnt then.
  void learn(const GradientField& field, double noise, const NeedlePose& followed, bool alone);

  // Puts a pose that is on the needle's axis at its end; its walls are fitted there, over at most `longest`
  // px.
  enum class Seen : std::uint8_t { no, far, near };  // from where the pose was
  [[nodiscard]] Seen find(const GradientField& field, double noise, double longest, NeedlePose& needle);
  // What the picture shows beside a needle that is seen is not of it.
  void was_seen(const GradientField& field, const NeedlePose& needle);
  // What was seen round it is gone: a gap in the frames.
  void forget_surroundings();
  // In noise the shape errs by several px, where the likelihood of the glass with its cut, which is known,
  // does not: puts what was told right.
  void weigh(const GradientField& field, double noise, NeedlePose& told) const;

  // The pose with the outermost glass as its tip, and how certain that is.
  [[nodiscard]] NeedlePose told(NeedlePose followed, double noise) const;
  // The outermost glass over the end that is followed, px.
  [[nodiscard]] double glass_ahead() const noexcept { return glass_ahead_ + unseen_ahead_; }
  // A frame in which nothing lies within the reach of RoundEnd.
  void look_for_round_end(const GradientField& field, const NeedlePose& told);
  // By which its outermost glass lies ahead of what is told, where it is round.
  [[nodiscard]] std::optional<double> round_end() const;
  // It reaches further than it is seen, by that. Returns how much of it is believed.
  double reaches_further(double px) noexcept;
  [[nodiscard]] bool glass_is_known() const noexcept { return glass_frames_ > 0; }
  // Walls and what lies between them were told apart at the start.
  [[nodiscard]] bool shows_lumen() const noexcept { return lumen_; }
  // It was in focus in the last frame, so that its shape may be learnt.
  [[nodiscard]] bool is_sharp() const;
  // Whether the light comes from one side, as the membranes tell.
  void in_relief(bool relief) noexcept { in_relief_ = relief; }
  [[nodiscard]] bool in_relief() const noexcept { return in_relief_; }
  // In relief: neither a line across it nor an oblique cut tells it yet.
  [[nodiscard]] bool lacks_line() const noexcept {
    return in_relief_ && end_line_ == 0 && bevel_.radius == 0;
  }

 private:
  [[nodiscard]] bool learn_by_glass(const GradientField& field, double noise, NeedlePose& needle,
                                    double motion_sd);
  [[nodiscard]] std::optional<CutGlass> go_to_cut(const GradientField& field, double noise,
                                                  NeedlePose& needle);
  void go_to_point(const GradientField& field, double noise, const NeedlePose& needle, CutGlass& cut);
  void learn_point(const GradientField& field, double noise, const NeedlePose& followed);
  void learn_shape_anew(const GradientField& field, NeedlePose& needle);
  void calibrate_walls(const GradientField& field, const NeedlePose& walls, double noise);
  void learn_glass(const GradientField& field, double noise, const NeedlePose& followed);
  void learn_glass(const GlassEnd& end);
  void learn_thin_end(const GradientField& field, double noise, const NeedlePose& followed);
  void ends_with(const EndLine& line);
  [[nodiscard]] bool go_to_known_cut(const GradientField& field, double noise, NeedlePose& needle);
  [[nodiscard]] bool go_to_known_line(const GradientField& field, double noise, NeedlePose& needle);
  [[nodiscard]] double tip_sd(double noise) const;
  // The two walls, along the needle.
  [[nodiscard]] bool ends_apart() const noexcept;
  // The glass of its sharp point was fitted.
  [[nodiscard]] bool by_point() const noexcept { return bevel_.point_ahead > 0; }

  double radius_px_;
  bool in_relief_ = false;
  bool lumen_ = true;      // shows between the walls, in focus
  bool followed_ = false;  // since it was learnt anew

  NeedleShape shape_;
  NeedleShape::View view_;  // of the last frame
  Backdrop backdrop_;
  Point shape_origin_;       // where the shape was seen in the last frame
  Point learnt_at_;          // the tip in the last frame that the shape was learnt from
  double shape_offset_ = 0;  // from where the shape has its origin to the end face, px

  double walls_offset_ = 0;   // from where the profile of the walls ends to the end face, px
  int offset_frames_ = 0;     // that walls_offset_ was learnt from
  double step_sign_ = 0;      // +1: it is brighter ahead of the walls, -1: darker, 0: not known yet
  bool walls_tell_ = true;    // where it ends, more finely than the shape does: in focus
  bool walls_agree_ = false;  // with the shape, in the last frame

  Bevel bevel_;                     // as it was found
  SharpPoint point_;                // of a sharp needle in relief, in the last frame that it was learnt from
  int point_frames_ = 0;            // that bevel_.point_ahead was learnt from
  double half_width_at_start_ = 0;  // px
  double glass_ahead_ = 0;          // of the end that is followed: the outermost glass, px
  double unseen_ahead_ = 0;         // of that: glass which only a membrane or its round end tells, px
  int glass_frames_ = 0;            // that it was learnt from
  double glass_scatter_ = 0;        // variance of where the end that is followed seems to be from it, px^2
  double glass_blur_ = 0;           // px
  RoundEnd round_end_;
  ThinEnd thin_end_;     // tells the same of a needle whose lumen is not seen
  double end_line_ = 0;  // that tells the end with light along the needle, grey levels; 0: none does
  double cut_sd_ = 0;    // of the end in the last frame, where its cut or a line told it, px
};

}  // namespace punctum::vision
