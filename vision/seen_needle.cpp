#include "vision/seen_needle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr int kNeedleAtOnce = 6, kNeedleEvery = 8;  // frames between two tries, after so many of them
constexpr double kUntouched_px = 12;                // further outside, nothing touches the tip
constexpr double kEndShows_px = 2;  // further outside, the end of the needle shows beside the membrane
constexpr double kWall_px =
    0.4;  // from the membrane, which is what is seen on the tip, to the outermost glass
constexpr double kAtMembrane_px = 0.3, kInside_px = 1.5;  // to which the picture alone shows the tip there
// By which the membrane draws the end of the needle ahead: what is seen and put right; and where that is not
// seen, for each time that it is more blurred.
constexpr double kDrawn_px = 1.5, kDrawnBlurred_px = 3.5;

// The outer membrane is so many times as blurred as in focus.
double unsharp(const FollowedMembrane& outer) {
  return std::max(1.0, outer.edge.own_blur_px / TipOnMembrane::kUsualBlur_px);
}

cv::Rect square_round(const Point& p, double half) {
  return cv::Rect(cv::Rect2d(p.x - half, p.y - half, 2 * half, 2 * half));
}

}  // namespace

void SeenNeedle::go_on_from(SeenNeedle& before) {
  if (before.started()) {
    pipette_ = std::move(before.pipette_);
    tip_on_membrane_ = before.tip_on_membrane_;
    by_stage_ = before.by_stage_;
    by_stage_.after_gap();
    before_gap_ = true;
  }
}

bool SeenNeedle::recognised(const ClearedPicture& picture) {
  if (!std::exchange(before_gap_, false)) {
    return true;
  }
  const auto told = by_stage_.tip();
  if (!told || !pipette_.go_on_at(picture.field, picture.noise, *told)) {
    forget();
    due_ = true;
    return false;
  }
  return true;
}

// Of a faint needle not every frame shows the end: the first tries follow each other.
void SeenNeedle::begin(const std::optional<Point>& stage) {
  by_stage_.begin(config_.method == Method::tracker ? stage : std::nullopt);
  due_ = config_.needle && !pipette_.started() &&
         (tries_ < kNeedleAtOnce || frames_++ % kNeedleEvery == 0 ||
          start_ == InjectionPipette::Start::more_to_do);
}

void SeenNeedle::forget() {
  pipette_ = {config_.needle_from, config_.px(config_.c_m)};
  tries_ = 0;
  by_stage_.forget();
  tip_on_membrane_ = {};
  landmark_.reset();
  doubted_ = 0;
}

// Frames are kept while the needle is missing in noise, or was found in few of them. Whether there are enough
// by now to tell its end better.
bool SeenNeedle::looks_again(const ClearedPicture& picture, const Touch& touch) {
  constexpr int kSome = 4;
  const bool told = pipette_.started() && !pipette_.doubtful(GatheredFrames::kMost);
  if (told || touch.contact || touch.punctured || picture.noise < InjectionPipette::kNoisy_grey) {
    gathered_.forget();
    return false;
  }
  gathered_.add(picture.grey, by_stage_.moved());
  const int frames = gathered_.count();
  return frames >= kSome && pipette_.doubtful(frames < GatheredFrames::kMost ? kSome : frames);
}

// From the frames in which the end is told now.
void SeenNeedle::learn_tip_again(const ClearedPicture& picture, const FollowedMembrane& outer) {
  constexpr int kBeside_px = 24;
  const NeedlePose now = pipette_.as_found(picture.noise);
  for (int age = gathered_.count() - 1; age > 0 && outer.known; --age) {
    NeedlePose then = now;
    then.tip -= gathered_.way(age) + age * pipette_.velocity();
    const auto entry = entry_point(outer.contour(), then.tip, then.axis);
    if (entry && (*entry - then.tip).dot(then.axis) > TipOnMembrane::kClearAhead_px) {
      tip_on_membrane_.learn(gathered_.one(age, square_round(then.tip, kBeside_px), picture.field.sigma),
                             then);
    }
  }
}

// Whether this frame shows its end.
bool SeenNeedle::search(const ClearedPicture& picture, const FollowedMembrane& outer, const Touch& touch,
                        bool at_once) {
  // A membrane at the tip of a faint needle looks like its end.
  const auto clear_at = [&outer](const Point& end) {
    return !outer.known || cv::norm(end - outer.centre) > median_of(outer.r) + kUntouched_px;
  };
  if (looks_again(picture, touch)) {
    by_stage_.forget();
    tip_on_membrane_ = {};
    const bool found = pipette_.look_again(picture.field.sigma, clear_at, gathered_);
    if (found) {
      learn_tip_again(picture, outer);
    }
    return found;
  }
  if (!due_) {
    return false;
  }
  // What moves otherwise than along its axis, one frame shows better than the mean.
  constexpr int kAlone = 3;  // one try in so many
  const bool mean = gathered_.count() > 1 && tries_ % kAlone != 0;
  const GradientField& field = mean ? gathered_.at_rest(picture.field.sigma) : picture.field;
  const double noise = mean ? gathered_.noise() : picture.noise;
  do {
    start_ =
        pipette_.advance_start(field, noise, clear_at, tries_ < kNeedleAtOnce, mean ? &gathered_ : nullptr);
  } while (at_once && start_ == InjectionPipette::Start::more_to_do);
  if (start_ == InjectionPipette::Start::found && is_mistaken_again(pipette_.as_found(noise).tip)) {
    pipette_ = {config_.needle_from, config_.px(config_.c_m)};
    start_ = InjectionPipette::Start::failed;
  }
  tries_ += start_ == InjectionPipette::Start::failed ? 1 : 0;
  return start_ == InjectionPipette::Start::found;
}

// What stayed while the needle moved is a speck. A needle that is not seen cannot be moved inward: in the end
// it is believed.
bool SeenNeedle::is_mistaken_again(const Point& end) {
  constexpr double kSame_px = 5;
  constexpr int kMostTries = 25;
  const bool again = mistaken_ && cv::norm(end - *mistaken_) < kSame_px && tries_ < kMostTries;
  if (!again) {
    mistaken_.reset();
  }
  return again;
}

NeedlePose SeenNeedle::locate(const ClearedPicture& picture, const FollowedMembrane& outer,
                              const Touch& touch, const std::optional<Point>& landmark, bool at_once) {
  pipette_.in_relief(outer.known && outer.polarity == Polarity::relief);
  wall_px_ = gone_odds_ = 0;
  before_.reset();
  NeedlePose n =
      search(picture, outer, touch, at_once) ? pipette_.as_found(picture.noise) : find(picture, landmark);
  on_tip_sd_px_ = n.sd;
  if (!stays_or_jumps(n, landmark)) {
    n.ok = seen_.ok = false;
    n.reason = "the picture has jumped";
    return n;
  }
  if (config_.method == Method::tracker && n.ok && touch.at_membrane() && outer.known) {
    put_right_by_membrane(picture, outer, n);
  }
  // A membrane on the tip draws its end aside, granules round it by several pixels.
  n.sd = math::hypot(n.sd, touch.punctured       ? kInside_px
                           : touch.at_membrane() ? kAtMembrane_px * unsharp(outer)
                                                 : 0);
  seen_ = n;
  put_right_by_stage(picture, touch, n);
  if (n.ok && must_move_first()) {
    ++doubted_;
    n.ok = false;
    n.reason = "it has not moved with the manipulator yet";
  }
  return n;
}

// Something else was taken for it twice. It is believed once it is seen to move, or in the end: without it
// the manipulator may wait.
bool SeenNeedle::must_move_first() const {
  constexpr int kMistakes = 2, kMostFrames = 100;
  return mistakes_ >= kMistakes && !by_stage_.picture_moves() && doubted_ < kMostFrames;
}

// Since the needle was last where it was expected; none where that is no more than it may drift.
Point SeenNeedle::jump_of_landmark(const std::optional<Point>& landmark) const {
  const Point way = landmark && landmark_ ? *landmark - *landmark_ : Point();
  return cv::norm(way) > Landmark::kDrift_px ? way : Point();
}

// First where it would be if the whole picture had jumped.
NeedlePose SeenNeedle::find(const ClearedPicture& picture, const std::optional<Point>& landmark) {
  const std::optional<Point> moved = by_stage_.moved();
  const Point jump = jump_of_landmark(landmark);
  if (landmark_ && (!landmark || jump != Point())) {
    before_ = pipette_;
  }
  if (jump != Point()) {
    const NeedlePose n =
        pipette_.find(picture.field, picture.noise, moved.value_or(pipette_.velocity()) + jump);
    if (n.ok) {
      return n;
    }
    pipette_ = *before_;
  }
  return pipette_.find(picture.field, picture.noise, moved);
}

// A picture that jumps moves landmark and needle by the same; neither hand nor manipulator has moved the
// needle then. False while it is neither where it was, nor as far from there as a landmark that has jumped;
// or not where it was, and that is out of sight.
bool SeenNeedle::stays_or_jumps(const NeedlePose& n, const std::optional<Point>& landmark) {
  constexpr double kSame_px = 1.5, kSameAlone_px = 4, kShare = 0.4;
  constexpr int kMostFrames = 12;
  jump_ = {};
  const auto told = by_stage_.tip(), expected = told ? told : tip_;
  if (before_ && ++undecided_ < kMostFrames && expected) {
    const Point jump = jump_of_landmark(landmark), off = n.tip - *expected;
    const double of_picture = std::max(told ? kSame_px : kSameAlone_px, 2 * n.sd),
                 near = landmark ? std::min(of_picture, kShare * cv::norm(jump)) : of_picture;
    if (!n.ok ? landmark.has_value() : std::min(cv::norm(off), cv::norm(off - jump)) > near) {
      pipette_ = *before_;
      return false;
    }
    if (n.ok && cv::norm(off - jump) < cv::norm(off)) {
      jump_ = jump;
      by_stage_.jump_with_picture(jump);
      motion_.jump_with_picture(jump);
      pipette_.jump_with_picture(jump);
      if (last_on_membrane_) {
        *last_on_membrane_ += jump;
      }
    }
  }
  const Point way = motion_.speed * motion_.axis;
  if (landmark || !before_ || undecided_ >= kMostFrames) {
    undecided_ = 0;
    landmark_ = landmark;
    tip_ = n.ok ? std::optional(n.tip + way) : std::nullopt;
  } else if (tip_) {
    *tip_ += way;
  }
  return true;
}

void SeenNeedle::put_right_by_membrane(const ClearedPicture& picture, const FollowedMembrane& outer,
                                       NeedlePose& n) {
  if (n.point_aside != 0) {  // on a sharp point it lies at one wall, and not across the lumen
    return;
  }
  const auto on = tip_on_membrane_.ahead(picture.field, picture.noise, outer.edge, n);
  if (on) {
    n.tip += on->ahead * n.axis;
    const double surprising = std::max(0.0, std::abs(on->ahead) - kDrawn_px * unsharp(outer)),
                 found_sd = n.sd;
    n.sd = on_tip_sd_px_ = math::hypot(math::hypot(n.sd, on->sd), surprising);
    if (pipette_.shows_lumen()) {  // across the mouth of a thin one its walls are what is seen
      wall_px_ = on->membrane;
      gone_odds_ = on->gone_odds;
      on_tip_sd_px_ = math::hypot(on->membrane_sd > 0 ? on->membrane_sd : found_sd, surprising);
    }
  } else {
    on_tip_sd_px_ = n.sd = math::hypot(n.sd, kDrawnBlurred_px * (unsharp(outer) - 1));
  }
}

void SeenNeedle::put_right_by_stage(const ClearedPicture& picture, const Touch& touch, NeedlePose& n) {
  const auto told = by_stage_.tip();
  if (!told) {
    return;
  }
  const bool strays = by_stage_.picture_strays(n);
  if (n.ok && pipette_.goes_on_to(picture.field, picture.noise, n, *told)) {
    n.ok = seen_.ok = false;
    n.reason = "a speck looks like its end";
  } else if (strays && touch.at_membrane() && pipette_.ends_before(picture.field, picture.noise, n, *told)) {
    n.ok = seen_.ok = false;
    n.reason = "something ahead of it looks like its end";
  } else if (strays && touch.punctured) {
    n.ok = seen_.ok = false;
    n.reason = "something within the cell looks like its end";
  }
  if (!n.ok) {
    n = pipette_.by_shaft(picture.field, picture.noise, *told).value_or(n);
    n.sd = by_stage_.sd();
    on_tip_sd_px_ = math::hypot(n.sd, touch.at_membrane() ? kWall_px : 0);
    wall_px_ = gone_odds_ = 0;
    return;
  }
  n.sd = math::hypot(n.sd, touch.at_membrane() ? kWall_px : 0);
  const double seen_sd = n.sd;
  n = by_stage_.most_likely(n);
  if (n.sd > seen_sd) {  // the two do not agree
    on_tip_sd_px_ = math::hypot(on_tip_sd_px_, n.sd);
  }
  pipette_.put(n.tip);
  // In contact the picture shows where the membrane is, on the tip; of a thin needle it draws the end back.
  if (touch.at_membrane() && pipette_.shows_lumen()) {
    constexpr double kThick_px = 1;  // of a membrane that is still on it
    const double wall = wall_px_ + (seen_.tip - n.tip).dot(n.axis);
    wall_px_ = gone_odds_ > 0 ? wall : std::clamp(wall, -kThick_px, kThick_px);
  }
}

// One that went back is no membrane on the tip; a tip that is told too far ahead leaves it where it was.
Point SeenNeedle::on_membrane(const NeedlePose& now) const {
  constexpr double kBack_px = 1;
  const Point there = now.tip + wall_px_ * now.axis;
  const bool back =
      gone_odds_ > 0 && !(last_on_membrane_ && (there - *last_on_membrane_).dot(now.axis) > -kBack_px);
  return back ? now.tip : there;
}

void SeenNeedle::learn(const ClearedPicture& picture, const NeedlePose& now,
                       const std::optional<double>& gap_px) {
  if (!seen_.ok) {
    return;
  }
  const bool clear = !gap_px || *gap_px > TipOnMembrane::kClearAhead_px;
  const double gap = gap_px.value_or(std::numeric_limits<double>::infinity());
  if (!must_move_first()) {
    specks_.learn(picture.field, picture.noise, now, gap);
    if (gap > kEndShows_px) {
      pipette_.learn(picture.field, seen_, picture.noise, gap);
    }
    if (gap_px && clear) {
      tip_on_membrane_.learn(picture.field, now);
    }
  }
  if (clear) {
    by_stage_.learn(seen_);
    if (by_stage_.picture_stays()) {
      mistakes_ += by_stage_.picture_stays_far() ? 1 : 0;
      forget();
      mistaken_ = now.tip;
      return;
    }
  }
  if (const auto further = pipette_.round_end()) {
    go_further(now, *further);
  }
}

void SeenNeedle::learn_from_dent(const NeedlePose& now, const std::optional<double>& ahead_px) {
  constexpr double kLeast_px = 3, kLeast_sd = 2;
  constexpr int kFrames = 2;
  const bool pushes = seen_.ok && ahead_px && *ahead_px > std::max(kLeast_px, kLeast_sd * now.sd);
  pushes_unseen_ = pushes ? pushes_unseen_ + 1 : 0;
  if (pushes_unseen_ < kFrames) {
    return;
  }
  pushes_unseen_ = 0;
  go_further(now, *ahead_px);
}

// Its outermost glass lies further ahead than it is told.
void SeenNeedle::go_further(const NeedlePose& now, double px) {
  const Point by = pipette_.reaches_further(px) * now.axis;
  by_stage_.jump_with_picture(by);
  motion_.jump_with_picture(by);
  if (last_on_membrane_) {
    *last_on_membrane_ += by;
  }
  tip_on_membrane_ = {};
}

}  // namespace punctum::vision
