#include "vision/pipettes/injection_pipette.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/correlation.hpp"
#include "vision/pipettes/glass.hpp"
#include "vision/pipettes/moving_end.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/needle_walls.hpp"
#include "vision/pipettes/shaft_blur.hpp"
#include "vision/pipettes/steep_glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kLeastScore = 0.3;                  // of the centred correlation
constexpr int kNearAlong_px = 4, kNearAside_px = 2;  // from where it is expected
constexpr double kJump_px = 4;   // along the axis, from what motion and correlation predict
constexpr int kGoesOnMax = 2;    // frames in a row in which its walls go on beyond what is seen as its end
constexpr int kJumpsMax = 3;     // frames in a row; then it is where it is seen
constexpr double kAside_px = 2;  // across the axis; further aside the shaft must lie there, too
constexpr double kElsewhere_px = 8;   // along the axis: what is seen as its end is something else
constexpr double kFollowed_px = 24;   // of a faint one while it is followed: it may bend
constexpr std::size_t kGathered = 4;  // frames that tell an end which one of them does not
constexpr double kShaft_px = 180;     // of the shaft tell its direction
constexpr double kAlone_px = 10;      // further from the cell, all of its end shows as it does without one
constexpr int kLooksFar = 3;          // frames
// Frames in a row; then it is looked for from the border, too, in every other frame.
constexpr int kLostMax = 3;
constexpr const char* kEndNotClear = "the end of the needle is not clear";
constexpr const char* kEndNotSeen = "end of the needle not seen";
constexpr const char* kNotRecognised = "tip not recognised";
constexpr int kWiderMost = 6;  // frames in a row; then the window for its tip grows no more

// Of its end, what lies beside it, and so much of its shaft.
cv::Rect area_of(const NeedlePose& needle, double shaft_px) {
  constexpr double kOfMedium_px = 40, kClear_px = 24;
  const Point a = needle.at(shaft_px, 0), b = needle.at(-kOfMedium_px, 0);
  const double beside = needle.half_width_at(shaft_px) + kClear_px;
  return {static_cast<int>(std::min(a.x, b.x) - beside), static_cast<int>(std::min(a.y, b.y) - beside),
          static_cast<int>(std::abs(a.x - b.x) + 2 * beside),
          static_cast<int>(std::abs(a.y - b.y) + 2 * beside)};
}

// Where a cut can be told of it.
std::optional<double> blur_of_end(const GradientField& field, const NeedlePose& needle) {
  const auto blur = needle.half_width < kLeastLumen_px
                        ? std::nullopt
                        : blur_of_shaft(field, needle, LearntEnd::kStartReach_px);
  return blur && *blur <= LearntEnd::kMostBlur_px ? blur : std::nullopt;
}

// In all frames together. It is put there; empty where they do not tell it, or may not be put together.
std::optional<MovingEnd> go_to_moving_end(double blur_px, double sigma_px, GatheredFrames& frames,
                                          NeedlePose& needle) {
  constexpr double kShaftOfEnd_px = 90;
  const cv::Rect area = area_of(needle, kShaftOfEnd_px);
  Vector<SeenEnds> seen;
  for (int age = 0; age < frames.count(); ++age) {
    if (const auto ends =
            likely_ends(frames.one(age, area, sigma_px), frames.noise_of_one(), needle, blur_px)) {
      seen.push_back({*ends, frames.way(age).dot(needle.axis), age});
    }
  }
  if (seen.size() < kGathered) {
    return std::nullopt;
  }
  const auto end = moving_end(seen, outer_radius_of_glass(needle.half_width, blur_px), frames.motion_known());
  needle.tip -= (end ? end->behind : 0) * needle.axis;
  return end;
}

}  // namespace

bool InjectionPipette::cut_template(const GradientField& field) {
  // Shaft and end face, and almost nothing of what lies ahead of the tip.
  const double back = std::clamp(6 * last_.half_width, 14.0, 40.0), ahead = 2.5;
  const double wide = last_.half_width_at(back) + 4;
  const Point a = last_.at(back, 0), b = last_.at(-ahead, 0);
  const cv::Rect box = cv::Rect(static_cast<int>(std::lround(std::min(a.x, b.x))),
                                static_cast<int>(std::lround(std::min(a.y, b.y) - wide)),
                                static_cast<int>(std::lround(std::abs(a.x - b.x))) + 1,
                                static_cast<int>(std::lround(std::abs(a.y - b.y) + 2 * wide)) + 1) &
                       field.area;
  if (box.width < 8 || box.height < 6) {
    return false;
  }
  template_ = field.smooth(box - field.area.tl()).clone();
  tip_in_template_ = last_.tip - Point(box.x, box.y);
  return true;
}

bool InjectionPipette::start(const GradientField& field, double noise, const Clear& clear_at) {
  search_.begin_anew();
  steep_due_ = false;
  Start start = Start::more_to_do;
  while (start == Start::more_to_do) {
    start = advance_start(field, noise, clear_at, false);
  }
  return start == Start::found;
}

InjectionPipette::Start InjectionPipette::advance_start(const GradientField& field, double noise,
                                                        const Clear& clear_at, bool keep_tube,
                                                        GatheredFrames* frames) {
  if (std::exchange(steep_due_, false)) {
    return begin_steep(field, noise, clear_at) ? Start::found : Start::failed;
  }
  if (search_.advance(field, noise)) {
    return Start::more_to_do;
  }
  const auto without_straight_one = [&] {
    steep_due_ = frames == nullptr && noise < kNoisy_grey;
    return steep_due_ ? Start::more_to_do : Start::failed;
  };
  if (!search_.found_tube()) {
    reason_ = "no narrow tube enters through the border";
    search_.begin_anew();
    return without_straight_one();
  }
  const auto straight = search_.take_straight(field, noise);
  if (straight) {
    last_ = *straight;
    found_side_ = entered_from(last_.axis);
    side_known_ = true;
    if (settle(field, noise, clear_at, frames)) {
      search_.begin_anew();
      return Start::found;
    }
  } else {
    reason_ = search_.found_too_wide_a_one()
                  ? "what enters through the border is wider than the needle of the scene (membrane.c_um)"
                  : "what enters through the border is not a straight needle";
    if (search_.go_to_next_tube()) {
      return Start::more_to_do;
    }
  }
  search_.try_again();
  if (!keep_tube || (!straight && frames != nullptr)) {
    search_.begin_anew();
  }
  return straight ? Start::failed : without_straight_one();
}

// On the line of its walls, where it ends: where a cut can be told, in the mean of the frames as it moves.
bool InjectionPipette::settle(const GradientField& field, double noise, const Clear& clear_at,
                              GatheredFrames* frames) {
  if (frames == nullptr) {
    return begin_in(field, noise, clear_at, nullptr);
  }
  const auto blur = blur_of_end(field, last_);
  if (!blur) {
    return begin_in(frames->one(0, field.area, field.sigma), frames->noise_of_one(), clear_at, nullptr);
  }
  const auto end = go_to_moving_end(*blur, field.sigma, *frames, last_);
  if (!end) {
    reason_ = kEndNotClear;
    return false;
  }
  const GradientField& moving =
      frames->moving(area_of(last_, kShaft_px), end->per_frame * last_.axis, field.sigma);
  put_at_end_of_walls(moving, noise, 2 * LearntEnd::kStartReach_px, LearntEnd::kStartReach_px, last_);
  if (!begin_in(moving, noise, clear_at, &*end)) {
    return false;
  }
  velocity_ = end->per_frame * last_.axis;
  looked_at_ = frames->count();
  return true;
}

// moving: where the field is the mean of several frames.
bool InjectionPipette::begin_in(const GradientField& field, double noise, const Clear& clear_at,
                                const MovingEnd* moving) {
  const bool end_known = end_.learn_anew(field, noise, last_, moving != nullptr ? moving->motion_sd : 0);
  NeedlePose plain = last_;
  const bool faint = fit_walls(field, noise, radius_px_, plain, kShortestWall_px) < kStraightWalls;
  if ((moving != nullptr && !end_known) || (faint && !(end_known && clear_at(last_.tip)))) {
    reason_ = kEndNotClear;
    return false;
  }
  in_noise_ =
      end_.shows_lumen() && end_.glass_is_known() && (moving != nullptr || (faint && noise >= kNoisy_grey));
  looked_at_ = 1;
  longest_ = faint || in_noise_ ? kFollowed_px : kShortestWall_px;
  if (!cut_template(field)) {
    reason_ = "tip too close to the border";
    return false;
  }
  begin();
  return true;
}

void InjectionPipette::begin() {
  last_.ok = true;
  last_.score = 1;
  velocity_ = {};
  lost_ = goes_on_ = 0;
  looks_far_ = kLooksFar;
  started_ = true;
  reason_.clear();
}

// Where no straight one is found in one frame without much noise.
bool InjectionPipette::begin_steep(const GradientField& field, double noise, const Clear& clear_at) {
  const auto glass = steep_glass(field, noise);
  if (!glass || glass->half_width < kLeastLumen_px || glass->half_width > search_.widest_half_width() ||
      !clear_at(glass->tip)) {
    return false;
  }
  const Side side = entered_from(glass->axis);
  const NeedlePose before = std::exchange(last_, *glass);
  if ((side_ != Side::automatic && side_ != side) || !cut_template(field)) {
    last_ = before;
    return false;
  }
  end_.learn_steep(field, last_);
  looked_at_ = 1;
  longest_ = kShortestWall_px;
  in_noise_ = false;
  begin();
  // The shape does not fit best just where it was learnt.
  const NeedlePose followed = follow(field, noise);
  started_ = followed.ok && end_.learn_outermost(*glass, followed.tip);
  if (started_) {
    last_ = *glass;
    put(glass->tip);
    begin();
    found_side_ = side;
    side_known_ = true;
  } else {
    reason_ = kEndNotClear;
  }
  return started_;
}

bool InjectionPipette::look_again(double sigma_px, const Clear& clear_at, GatheredFrames& frames) {
  const GradientField& field = frames.at_rest(sigma_px);
  (void)fit_walls(field, frames.noise(), radius_px_, last_, kLongestWall_px);
  started_ = !blur_of_end(field, last_) || settle(field, frames.noise(), clear_at, &frames);
  looked_at_ = frames.count();
  return started_;
}

NeedlePose InjectionPipette::find(const GradientField& field, double noise,
                                  const std::optional<Point>& moved) {
  velocity_ = moved.value_or(velocity_);
  NeedlePose needle = end_.told(follow(field, noise), noise);
  if (needle.ok && in_noise_ && noise >= kNoisy_grey) {
    end_.weigh(field, noise, needle);
  }
  return needle;
}

NeedlePose InjectionPipette::as_found(double noise) const { return end_.told(last_, noise); }

void InjectionPipette::put(const Point& tip) { last_.tip = tip - end_.glass_ahead() * last_.axis; }

bool InjectionPipette::go_on_at(const GradientField& field, double noise, const Point& tip) {
  constexpr double kAstray_px = 2.5;  // across the axis
  const auto seen = by_shaft(field, noise, tip);
  if (!seen || std::abs((seen->tip - tip).cross(seen->axis)) > kAstray_px) {
    return false;
  }
  velocity_ = {};
  jumps_ = 0;
  search_next_ = false;
  end_.forget_surroundings();
  return true;
}

bool InjectionPipette::goes_on_to(const GradientField& field, double noise, const NeedlePose& seen,
                                  const Point& tip) const {
  constexpr double kSpeck_px = 5;
  const double ahead = (tip - seen.tip).dot(seen.axis);
  return ahead > kElsewhere_px && std::abs((tip - seen.tip).cross(seen.axis)) < seen.half_width &&
         walls_go_on(field, noise, seen, kSpeck_px, ahead - kShortestWall_px / 2, kShortestWall_px);
}

bool InjectionPipette::ends_before(const GradientField& field, double noise, const NeedlePose& seen,
                                   const Point& tip) const {
  const double ahead = (seen.tip - tip).dot(seen.axis);
  NeedlePose there = seen;
  there.tip = seen.at(ahead, 0);
  there.half_width = seen.half_width_at(ahead);
  return ahead > kElsewhere_px && !walls_go_on(field, noise, there, kShortestWall_px / 2,
                                               ahead - kShortestWall_px / 2, kShortestWall_px);
}

std::optional<NeedlePose> InjectionPipette::by_shaft(const GradientField& field, double noise,
                                                     const Point& tip) {
  NeedlePose needle = last_;
  needle.tip = tip;
  if (fit_walls(field, noise, radius_px_, needle, kLongestWall_px) < kStraightWalls) {
    return std::nullopt;
  }
  needle.ok = true;
  needle.reason.clear();
  last_ = needle;
  put(needle.tip);
  lost_ = 0;
  return needle;
}

NeedlePose InjectionPipette::follow(const GradientField& field, double noise) {
  NeedlePose needle = last_;
  needle.ok = false;
  needle.reason.clear();
  if (!started_) {
    needle.reason = reason_.empty() ? "not started" : reason_;
    return needle;
  }
  if (search_next_) {
    return search_from_border(field, noise, needle);
  }
  const cv::Rect all = field.area;
  const Point expected = last_.tip + velocity_ - tip_in_template_;
  cv::Rect window;
  const auto search = [&](int rx, int ry) {
    window = cv::Rect(static_cast<int>(std::lround(expected.x)) - rx,
                      static_cast<int>(std::lround(expected.y)) - ry, template_.cols + 2 * rx,
                      template_.rows + 2 * ry) &
             all;
    return peak(centred_correlation_map(field.smooth(window - all.tl()), template_));
  };
  // First near where the motion predicts it: across the needle that tells its place, unless a better one may
  // lie further aside.
  auto p = lost_ == 0 ? search(kNearAlong_px, kNearAside_px) : std::nullopt;
  const bool on_rim = p && (p->at.y <= 0 || p->at.y >= window.height - template_.rows);
  const bool narrow = p && !on_rim && p->score >= kLeastScore;
  const int wider = std::min(lost_, kWiderMost), wide_x = 24 + 8 * wider, wide_y = 10 + 6 * wider;
  if (!narrow) {
    p = search(wide_x, wide_y);
  }
  needle.score = p ? p->score : 0;
  const auto not_seen = [&](const char* reason) {
    needle.reason = reason;
    velocity_ = {};
    search_next_ = ++lost_ > kLostMax;
    return needle;
  };
  if (!p || p->score < kLeastScore) {
    return not_seen(kNotRecognised);
  }
  // Across the needle the correlation tells its place.
  Point correlated = p->at + Point(window.x, window.y) + tip_in_template_;
  const Point across(-last_.axis.y, last_.axis.x);
  needle.tip = last_.tip + velocity_;
  needle.tip += aside(field, noise, needle, (correlated - needle.tip).dot(across)) * across;
  LearntEnd::Seen end = end_.find(field, noise, longest_, needle);
  if (end == LearntEnd::Seen::no && lost_ > 0) {  // it may have gone further than an end is looked for
    needle.tip = correlated;
    needle.axis = last_.axis;
    needle.half_width = last_.half_width;
    needle.taper = last_.taper;
    end = end_.find(field, noise, longest_, needle);
  }
  const bool further = end != LearntEnd::Seen::no && go_beyond_speck(field, noise, needle);
  if (end == LearntEnd::Seen::no || goes_on_ > kGoesOnMax) {
    return not_seen(kEndNotSeen);
  }
  lost_ += further ? 1 : 0;
  if (lost_ <= kLostMax && ends_before(field, noise, needle, last_.tip + velocity_)) {
    return not_seen("something ahead of it looks like its end");
  }
  const bool near = end == LearntEnd::Seen::near;
  if (!near && narrow) {
    if (const auto anywhere = search(wide_x, wide_y)) {
      correlated = anywhere->at + Point(window.x, window.y) + tip_in_template_;
    }
  }
  // Far from where the motion predicts the end, and from where the whole tip is recognised: something else
  // crosses the needle.
  if (!near && std::abs((needle.tip - last_.tip - velocity_).dot(needle.axis)) > kJump_px &&
      std::abs((needle.tip - correlated).dot(needle.axis)) > kJump_px && ++jumps_ <= kJumpsMax) {
    needle.reason = "end of the needle jumped";
    return needle;
  }
  jumps_ = 0;
  needle.ok = true;
  velocity_ = lost_ == 0 ? needle.tip - last_.tip : Point();
  lost_ = 0;
  last_ = needle;
  end_.was_seen(field, needle);
  return needle;
}

// Where its walls go on, a speck was taken for its end. Granules may look like walls in single frames, with
// no end to them.
bool InjectionPipette::go_beyond_speck(const GradientField& field, double noise, NeedlePose& needle) {
  constexpr double kSpeck_px = 6, kBeyond_px = 16;
  constexpr int kSpecks = 2;
  NeedlePose there = needle;
  int specks = 0;
  while (walls_go_on(field, noise, there, kSpeck_px, kBeyond_px, kShortestWall_px)) {
    there.tip = there.at(-kBeyond_px, 0);
    LearntEnd end = end_;
    if (specks++ == kSpecks || end.find(field, noise, longest_, there) == LearntEnd::Seen::no) {
      ++goes_on_;
      return false;
    }
    end_ = std::move(end);
  }
  goes_on_ = 0;
  needle = there;
  return specks > 0;
}

// How far across the predicted needle it is, px, when its tip is recognised `correlated` px across. Granules
// may look like the tip, but not like the shaft: further aside the walls decide.
double InjectionPipette::aside(const GradientField& field, double noise, const NeedlePose& predicted,
                               double correlated) const {
  if (std::abs(correlated) <= kAside_px) {
    return correlated;
  }
  NeedlePose here = predicted, there = predicted;
  there.tip = predicted.at(0, correlated);
  return fit_walls(field, noise, radius_px_, there, longest_) >=
                 fit_walls(field, noise, radius_px_, here, longest_)
             ? correlated
             : 0;
}

// One part of the search from the border, in place of the look at where it was last.
NeedlePose InjectionPipette::search_from_border(const GradientField& field, double noise, NeedlePose needle) {
  search_next_ = false;
  const NeedlePose before = last_;
  if (advance_start(field, noise, [](const Point&) { return false; }, false) == Start::found) {
    return last_;
  }
  last_ = before;
  needle.reason = kNotRecognised;
  return needle;
}

// Where the line is seen that light along the needle makes of its end, at most so far ahead, that is its end
// from then on.
bool InjectionPipette::go_to_end_line(const GradientField& field, double noise, double most_ahead) {
  const auto line = end_line(field, noise, last_, -LearntEnd::kStartReach_px, most_ahead, end_.in_relief());
  if (!line) {
    return false;
  }
  NeedlePose needle = last_;
  needle.tip += line->ahead * needle.axis;
  if (line->ahead <= LearntEnd::kStartReach_px) {
    last_ = needle;
    end_.begin_line(*line);
    return true;
  }
  LearntEnd end = end_;
  if (!end.learn_anew(field, noise, needle, 0)) {
    return false;
  }
  const NeedlePose before = std::exchange(last_, needle);
  if (!cut_template(field)) {
    last_ = before;
    return false;
  }
  end_ = std::move(end);
  return true;
}

void InjectionPipette::learn(const GradientField& field, const NeedlePose& needle, double noise,
                             double free_px) {
  const bool alone = free_px > kAlone_px;
  if (!needle.ok || template_.empty() || !end_.is_sharp()) {
    return;
  }
  NeedlePose followed = needle;
  followed.tip -= end_.glass_ahead() * needle.axis;
  if (alone && end_.lacks_line()) {
    constexpr double kFarthest_px = 150;
    const bool far = looks_far_ > 0;  // where its walls run parallel they do not show
    looks_far_ -= far ? 1 : 0;
    if (go_to_end_line(field, noise,
                       far ? std::min(free_px - kAlone_px, kFarthest_px) : LearntEnd::kStartReach_px)) {
      return;
    }
  }
  end_.learn(field, noise, followed, alone);
  if (!alone) {
    return;
  }
  if (free_px > kAlone_px + RoundEnd::kReach_px) {
    end_.look_for_round_end(field, needle);
  }
  cv::Mat here = kept_picture(template_.size(), CV_32F);
  cv::getRectSubPix(field.smooth, template_.size(),
                    cv::Point2f(static_cast<float>(followed.tip.x - field.area.x - tip_in_template_.x +
                                                   (template_.cols - 1) / 2.0),
                                static_cast<float>(followed.tip.y - field.area.y - tip_in_template_.y +
                                                   (template_.rows - 1) / 2.0)),
                    here);
  for (int y = 0; y < here.rows; ++y) {
    std::transform(here.ptr<float>(y), here.ptr<float>(y) + here.cols, template_.ptr<float>(y),
                   template_.ptr<float>(y),
                   [](float now, float before) { return 0.9F * before + 0.1F * now; });
  }
}

}  // namespace punctum::vision
