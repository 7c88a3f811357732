// Injection pipette. It is found from the border through which it enters, and then followed by normalised
// correlation of its tip; its walls are fitted anew in every frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "vision/config.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/backdrop.hpp"
#include "vision/pipettes/end_line.hpp"
#include "vision/pipettes/gathered_frames.hpp"
#include "vision/pipettes/moving_end.hpp"
#include "vision/pipettes/needle_bevel.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/needle_search.hpp"
#include "vision/pipettes/needle_shape.hpp"
#include "vision/pipettes/thin_end.hpp"

namespace punctum::vision {

class InjectionPipette {
 public:
  // side: the border through which it enters. radius_px: expected at the tip.
  InjectionPipette(Side side, double radius_px)
      : side_(side), radius_px_(radius_px), search_(side, radius_px) {}

  // Looks for it from the border. True when a template of the tip was cut. noise: grey levels. Faint walls
  // are averaged over much of their length; then the end must be certain, and clear_at(tip) tell that nothing
  // else lies near.
  using Clear = std::function<bool(const Point& tip)>;
  [[nodiscard]] bool start(const GradientField& field, double noise, const Clear& clear_at);
  // The same in parts, each in the picture of its frame: what crosses each border, the tube from there,
  // then its end. keep_tube: where that end is not a needle's or not clear, the next part looks at it once
  // more.
  enum class Start : std::uint8_t { more_to_do, failed, found };
  // frames: where `field` is their mean at rest.
  [[nodiscard]] Start advance_start(const GradientField& field, double noise, const Clear& clear_at,
                                    bool keep_tube, GatheredFrames* frames = nullptr);
  // moved: what the manipulator has moved it by since the last frame, px, where that is known.
  [[nodiscard]] NeedlePose find(const GradientField& field, double noise, const std::optional<Point>& moved);
  // Where advance_start found it, in the frame that showed its end.
  [[nodiscard]] NeedlePose as_found(double noise) const;
  // It is known to be elsewhere along its axis than the picture shows.
  void put(const Point& tip);
  // No frame was seen for a while, and its tip is known to be there now: what was learnt of the needle itself
  // is kept. False, and to be found anew, unless its shaft lies there.
  [[nodiscard]] bool go_on_at(const GradientField& field, double noise, const Point& tip);
  // What is taken for its end is a speck: its walls go on from there to a tip that is known otherwise.
  [[nodiscard]] bool goes_on_to(const GradientField& field, double noise, const NeedlePose& seen,
                                const Point& tip) const;
  // Its shaft is seen behind a tip that is known otherwise; its axis and width are then as seen.
  [[nodiscard]] std::optional<NeedlePose> by_shaft(const GradientField& field, double noise,
                                                   const Point& tip);
  // Lets the template of the tip follow slow changes of focus and light. Only while nothing touches the tip.
  // free_px: from there to the cell; where that is near, only out of focus the glass is told by this frame.
  void learn(const GradientField& field, const NeedlePose& needle, double noise,
             double free_px = std::numeric_limits<double>::infinity());

  // In more noise one frame hardly shows its end.
  static constexpr double kNoisy_grey = 6;
  // It was found in noise, in fewer frames than that.
  [[nodiscard]] bool doubtful(int frames) const noexcept {
    return started_ && in_noise_ && looked_at_ < frames;
  }
  // Its end in all those frames, the last of which it was followed to. False, and to be found anew, where
  // they do not tell it.
  [[nodiscard]] bool look_again(double sigma_px, const Clear& clear_at, GatheredFrames& frames);
  // Whether the light comes from one side, as the membranes tell.
  void in_relief(bool relief) noexcept { in_relief_ = relief; }
  // By which it is expected to move in a frame, px.
  [[nodiscard]] const Point& velocity() const noexcept { return velocity_; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  // Walls and what lies between them were told apart at the start.
  [[nodiscard]] bool shows_lumen() const noexcept { return lumen_; }
  // The border through which a straight needle enters, even where its end is not clear.
  [[nodiscard]] bool side_known() const noexcept { return side_known_; }
  [[nodiscard]] Side side() const noexcept { return found_side_; }

 private:
  [[nodiscard]] bool settle(const GradientField& field, double noise, const Clear& clear_at,
                            GatheredFrames* frames);
  [[nodiscard]] bool begin_in(const GradientField& field, double noise, const Clear& clear_at,
                              const MovingEnd* moving);
  [[nodiscard]] bool begin_steep(const GradientField& field, double noise, const Clear& clear_at);
  void begin();
  [[nodiscard]] std::optional<double> blur_of_end(const GradientField& field) const;
  [[nodiscard]] std::optional<MovingEnd> go_to_moving_end(double blur_px, double sigma_px,
                                                          GatheredFrames& frames);
  [[nodiscard]] bool learn_end_anew(const GradientField& field, double noise, double motion_sd);
  [[nodiscard]] bool learn_end_by_glass(const GradientField& field, double noise, double motion_sd);
  bool cut_template(const GradientField& field);
  void weigh_end(const GradientField& field, double noise, NeedlePose& needle) const;
  [[nodiscard]] double aside(const GradientField& field, double noise, const NeedlePose& predicted,
                             double correlated) const;
  // Along the needle its shaft looks the same everywhere, so there its end tells its place.
  // `near`: it was found near where the motion predicts it.
  [[nodiscard]] bool find_end(const GradientField& field, double noise, NeedlePose& needle, bool& near);
  [[nodiscard]] bool go_to_known_cut(const GradientField& field, double noise, NeedlePose& needle);
  [[nodiscard]] bool go_to_known_line(const GradientField& field, double noise, NeedlePose& needle);
  [[nodiscard]] bool go_to_end_line(const GradientField& field, double noise, double most_ahead);
  void ends_with(const EndLine& line);
  void calibrate_walls(const GradientField& field, const NeedlePose& walls, double noise);
  void learn_shape_anew(const GradientField& field);
  [[nodiscard]] static std::optional<CutGlass> cut_seen(const GradientField& field, double noise,
                                                        const NeedlePose& middle);
  [[nodiscard]] std::optional<CutGlass> go_to_cut(const GradientField& field, double noise);
  void learn_glass(const GradientField& field, double noise, const NeedlePose& followed);
  void learn_glass(const GlassEnd& end);
  void learn_thin_end(const GradientField& field, double noise, const NeedlePose& followed);
  [[nodiscard]] double tip_sd(double noise) const;
  // The two walls, along the needle.
  [[nodiscard]] bool ends_apart() const noexcept;
  // The end that is followed, as the outermost glass.
  [[nodiscard]] NeedlePose told(NeedlePose needle, double noise) const;
  [[nodiscard]] NeedlePose follow(const GradientField& field, double noise);
  [[nodiscard]] NeedlePose search_from_border(const GradientField& field, double noise, NeedlePose needle);

  Side side_;
  double radius_px_;
  bool started_ = false;
  NeedleSearch search_;
  bool steep_due_ = false;  // none was straight: one that widens steeply is looked for next
  double longest_ = 0;      // of a wall that an edge is averaged over, px
  Side found_side_ = Side::right;
  bool side_known_ = false;
  std::string reason_;  // why it was not started
  cv::Mat template_;
  Point tip_in_template_;
  NeedleShape shape_;
  Backdrop backdrop_;
  NeedleShape::View view_;  // of the last frame
  Point learnt_at_;         // the tip in the last frame that the shape was learnt from
  Point shape_origin_;      // where the shape was seen in the last frame
  NeedlePose last_;
  Point velocity_;            // px per frame: what it is expected to move by
  int lost_ = 0;              // frames in a row without the tip
  int jumps_ = 0;             // frames in a row in which the end lay somewhere else
  bool search_next_ = false;  // from the border, in the next frame

  double shape_offset_ = 0;   // from where the learnt shape has its origin to the end face, px
  double walls_offset_ = 0;   // from where the profile of the walls ends to the end face, px
  int offset_frames_ = 0;     // that walls_offset_ was learnt from
  bool in_noise_ = false;     // it was found there
  int looked_at_ = 0;         // frames that its end was found in
  bool lumen_ = true;         // shows between the walls, in focus
  Bevel bevel_;               // of its end, as it was found
  double glass_ahead_ = 0;    // of the end that is followed: the outermost glass, px
  int glass_frames_ = 0;      // that it was learnt from
  bool followed_ = false;     // since it was found
  double glass_scatter_ = 0;  // variance of where the end that is followed seems to be from it, px^2
  double glass_blur_ = 0;     // px
  double cut_sd_ = 0;         // of the end in the last frame, where its cut or a line told it, px
  int looks_far_ = 0;         // ahead for a line across its end, that are left
  double end_line_ = 0;       // that tells its end with light along it, grey levels; 0: none does
  ThinEnd thin_end_;          // tells the same of a needle whose lumen is not seen
  double step_sign_ = 0;      // +1: it is brighter ahead of the walls, -1: darker, 0: not known yet
  bool in_relief_ = false;
  bool walls_tell_ = true;    // where it ends, more finely than the shape does: in focus
  bool walls_agree_ = false;  // with the shape, in the last frame
};

}  // namespace punctum::vision
