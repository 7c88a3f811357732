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
#include "vision/pipettes/gathered_frames.hpp"
#include "vision/pipettes/learnt_end.hpp"
#include "vision/pipettes/moving_end.hpp"
#include "vision/pipettes/needle_pose.hpp"
#include "vision/pipettes/needle_search.hpp"

namespace punctum::vision {

class InjectionPipette {
 public:
  // side: the border through which it enters. radius_px: expected at the tip.
  InjectionPipette(Side side, double radius_px)
      : side_(side), radius_px_(radius_px), search_(side, radius_px), end_(radius_px) {}

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
  // All that the picture shows lies elsewhere, by that, and it was found there.
  void jump_with_picture(const Point& by) { velocity_ -= by; }
  // Where advance_start found it, in the frame that showed its end.
  [[nodiscard]] NeedlePose as_found(double noise) const;
  // It is known to be elsewhere along its axis than the picture shows.
  void put(const Point& tip);
  // Its glass reaches further ahead than the picture shows, by that. Returns how much of it is believed.
  [[nodiscard]] std::optional<double> round_end() const { return end_.round_end(); }
  double reaches_further(double px) noexcept { return end_.reaches_further(px); }
  // No frame was seen for a while, and its tip is known to be there now: what was learnt of the needle itself
  // is kept. False, and to be found anew, unless its shaft lies there.
  [[nodiscard]] bool go_on_at(const GradientField& field, double noise, const Point& tip);
  // What is taken for its end is a speck: its walls go on from there to a tip that is known otherwise.
  [[nodiscard]] bool goes_on_to(const GradientField& field, double noise, const NeedlePose& seen,
                                const Point& tip) const;
  // What is taken for its end lies ahead of it: its walls do not go on to there from a tip that is known
  // otherwise.
  [[nodiscard]] bool ends_before(const GradientField& field, double noise, const NeedlePose& seen,
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
  void in_relief(bool relief) noexcept { end_.in_relief(relief); }
  // By which it is expected to move in a frame, px.
  [[nodiscard]] const Point& velocity() const noexcept { return velocity_; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  // Walls and what lies between them were told apart at the start.
  [[nodiscard]] bool shows_lumen() const noexcept { return end_.shows_lumen(); }
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
  bool cut_template(const GradientField& field);
  [[nodiscard]] bool go_beyond_speck(const GradientField& field, double noise, NeedlePose& needle);
  [[nodiscard]] double aside(const GradientField& field, double noise, const NeedlePose& predicted,
                             double correlated) const;
  [[nodiscard]] bool go_to_end_line(const GradientField& field, double noise, double most_ahead);
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
  LearntEnd end_;
  NeedlePose last_;           // at the end that is followed
  Point velocity_;            // px per frame: what it is expected to move by
  int lost_ = 0;              // frames in a row without the tip
  int goes_on_ = 0;           // frames in a row in which its walls went on beyond what is seen as its end
  int jumps_ = 0;             // frames in a row in which the end lay somewhere else
  bool search_next_ = false;  // from the border, in the next frame

  bool in_noise_ = false;  // it was found there
  int looked_at_ = 0;      // frames that its end was found in
  int looks_far_ = 0;      // ahead for a line across its end, that are left
};

}  // namespace punctum::vision
