// The injection pipette from frame to frame: it is looked for, followed, and put where the picture, the
// membrane on its tip and the manipulator together have it.
#pragma once

#include <optional>

#include "vision/config.hpp"
#include "vision/events/phase.hpp"
#include "vision/image/landmark.hpp"
#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/followed_membrane.hpp"
#include "vision/membrane/membrane_on_needle.hpp"
#include "vision/pipettes/gathered_frames.hpp"
#include "vision/pipettes/injection_pipette.hpp"
#include "vision/pipettes/still_specks.hpp"
#include "vision/pipettes/tip_by_stage.hpp"

namespace punctum::vision {

// Of needle and cell, as the frames before tell it.
struct Touch {
  bool contact = false;
  bool next = false;  // it was outside or just within, and will not be outside in this frame, by its speed
  bool punctured = false;  // the outer membrane

  [[nodiscard]] bool at_membrane() const noexcept { return !punctured && (contact || next); }
};

class SeenNeedle {
 public:
  explicit SeenNeedle(const VisionConfig& config)
      : config_(config), pipette_(config.needle_from, config.px(config.c_m)) {}

  // No frame was seen for a while: if it was followed, it is to be recognised in the next one.
  void go_on_from(SeenNeedle& before);
  // Whether it is where the manipulator has it, in the first frame after a gap. If not, all of it is
  // forgotten.
  [[nodiscard]] bool recognised(const ClearedPicture& picture);

  // Takes specks off the picture that lie still on its way.
  void clear_way(ClearedPicture& picture) { picture.grey = specks_.without(picture.grey); }
  // Once per frame, before anything else. stage: as in Tracker::process.
  void begin(const std::optional<Point>& stage);
  // landmark: of the rest of the picture, where this frame shows it. at_once: where it is missing, all of its
  // search is done in this frame.
  [[nodiscard]] NeedlePose locate(const ClearedPicture& picture, const FollowedMembrane& outer,
                                  const Touch& touch, const std::optional<Point>& landmark, bool at_once);
  // Another landmark takes its place.
  void forget_landmark() { landmark_.reset(); }
  // Takes in what is seen of it while nothing touches its tip. gap_px: empty where no cell is near.
  void learn(const ClearedPicture& picture, const NeedlePose& now, const std::optional<double>& gap_px);
  // A membrane that it has not gone through yet lies ahead of its tip by that: it is pushed by glass that is
  // not seen.
  void learn_from_dent(const NeedlePose& now, const std::optional<double>& ahead_px);
  void end_frame(const NeedlePose& now) {
    motion_.update(now);
    last_on_membrane_ = now.ok ? std::optional<Point>(on_membrane(now)) : std::nullopt;
  }

  [[nodiscard]] bool due() const noexcept { return due_; }  // looked for in this frame
  [[nodiscard]] bool started() const noexcept { return pipette_.started(); }
  // It was seen before and is not seen now, and so may be anywhere: it tells neither contact nor its end.
  [[nodiscard]] bool hidden(const NeedlePose& now) const { return pipette_.started() && !now.ok; }
  [[nodiscard]] Side side() const {  // the border it enters through, as far as known
    return config_.needle && pipette_.side_known() ? pipette_.side() : config_.needle_from;
  }
  [[nodiscard]] const TipMotion& motion() const noexcept { return motion_; }
  // By which it is expected to have moved along its axis since the last frame, px.
  [[nodiscard]] double expected_px(const NeedlePose& now) const {
    return by_stage_.moved() ? by_stage_.moved()->dot(now.axis) : motion_.speed;
  }
  // From the tip to the middle of the membrane that it pushes, as far as seen, px; where that lies; and where
  // it lay one frame ago, empty if that did not show it.
  [[nodiscard]] double wall_px() const noexcept { return wall_px_; }
  [[nodiscard]] Point on_membrane(const NeedlePose& now) const;
  [[nodiscard]] const std::optional<Point>& last_on_membrane() const noexcept { return last_on_membrane_; }
  // By which it, and where it lay, moved in this frame with the whole picture, px.
  [[nodiscard]] const Point& jump() const noexcept { return jump_; }
  // Log odds that the membrane is not on the tip, by what is seen across the mouth of the lumen.
  [[nodiscard]] double membrane_gone_odds() const noexcept { return gone_odds_; }
  // Standard deviation of what is seen on its tip: of the membrane that it pushes, px.
  [[nodiscard]] double on_tip_sd_px() const noexcept { return on_tip_sd_px_; }

 private:
  [[nodiscard]] bool looks_again(const ClearedPicture& picture, const Touch& touch);
  void learn_tip_again(const ClearedPicture& picture, const FollowedMembrane& outer);
  [[nodiscard]] bool search(const ClearedPicture& picture, const FollowedMembrane& outer, const Touch& touch,
                            bool at_once);
  [[nodiscard]] bool is_mistaken_again(const Point& end);
  [[nodiscard]] bool must_move_first() const;
  [[nodiscard]] Point jump_of_landmark(const std::optional<Point>& landmark) const;
  [[nodiscard]] NeedlePose find(const ClearedPicture& picture, const std::optional<Point>& landmark);
  [[nodiscard]] bool stays_or_jumps(const NeedlePose& n, const std::optional<Point>& landmark);
  void go_further(const NeedlePose& now, double px);
  void put_right_by_membrane(const ClearedPicture& picture, const FollowedMembrane& outer, NeedlePose& n);
  void put_right_by_stage(const ClearedPicture& picture, const Touch& touch, NeedlePose& n);
  void forget();

  const VisionConfig& config_;
  InjectionPipette pipette_;
  InjectionPipette::Start start_ = InjectionPipette::Start::failed;
  GatheredFrames gathered_;     // while it is missing in noise
  int frames_ = 0, tries_ = 0;  // that failed
  bool due_ = false;
  bool before_gap_ = false;  // it is not known yet whether it is still the same
  TipByStage by_stage_;
  std::optional<Point> mistaken_;  // where something was taken for its end that stayed while it moved
  int mistakes_ = 0;               // such things, far from it
  int doubted_ = 0;                // frames, since it was found
  NeedlePose seen_;                // as the picture alone tells it
  double on_tip_sd_px_ = 0;
  double wall_px_ = 0, gone_odds_ = 0;
  int pushes_unseen_ = 0;  // frames in a row
  std::optional<Point> last_on_membrane_;
  // While the landmark has jumped or is not seen, and the needle is not where it is expected: where both were
  // before; the needle as it was; the frames since.
  std::optional<Point> landmark_, tip_;
  std::optional<InjectionPipette> before_;
  int undecided_ = 0;
  Point jump_;
  TipOnMembrane tip_on_membrane_;
  StillSpecks specks_;
  TipMotion motion_;
};

}  // namespace punctum::vision
