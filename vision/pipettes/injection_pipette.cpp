#include "vision/pipettes/injection_pipette.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/correlation.hpp"
#include "vision/pipettes/moving_end.hpp"
#include "vision/pipettes/needle_bevel.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/needle_walls.hpp"
#include "vision/pipettes/steep_glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kLeastScore = 0.3;                  // of the centred correlation
constexpr int kNearAlong_px = 4, kNearAside_px = 2;  // from where it is expected
constexpr double kJump_px = 4;      // along the axis, from what motion and correlation predict
constexpr int kJumpsMax = 3;        // frames in a row; then it is where it is seen
constexpr double kAside_px = 2;     // across the axis; further aside the shaft must lie there, too
constexpr double kDoubtMax_px = 5;  // an end that is less certain is not seen
// By no more is the end put right once the walls are fitted there; where it was expected, by less.
constexpr double kAgain_px = 16, kAgainNear_px = 4;
constexpr double kSameEnd_px = 5;  // the walls end where the shape does, but for what either errs
// By which the walls may seem to end too early: 1.9 to 4.2 px in pictures of two renderers; later it is
// known.
constexpr double kStartReach_px = 7, kGlassReach_px = 4;
constexpr double kShortest_px = 4;   // of a wall that an edge is averaged over
constexpr double kFollowed_px = 24;  // of a faint one while it is followed: it may bend
// Standard deviation of the outermost glass with which a faint needle may begin, and of an end that is found
// together with its cut; out of focus, where a point may be a disc or a ring and not what is fitted; and of
// an end from which more is learnt later. A tip that is less certain does more harm than one that is not
// claimed: membranes are then taken for pushed that are free.
constexpr double kStartKnown_px = 2.5, kUnsharpKnown_px = 1.8, kEndKnown_px = 1.2;
// Further out of focus the lumen closes, and the end is somewhere in 3 px; the walls end up to 5 px from
// where the shape does, at a blur of the shaft that looks like the second.
constexpr double kSharp_px = 2.3, kWallsTell_px = 1.9;
// So far from where the walls end, a speck ended them, or nearer while the end is not certain: it is looked
// for again there, so often.
constexpr double kFar_px = 5, kNear_px = 2;
constexpr int kFurther = 8;
constexpr double kSteep = 0.8;        // px along per px across: of a steeper cut the two walls end far apart
constexpr std::size_t kGathered = 4;  // frames that tell an end which one of them does not
constexpr double kShaft_px = 180;     // of the shaft tell its direction
constexpr double kUsualBlur_px = 1.5;
constexpr double kAlone_px = 10;      // further from the cell, all of its end shows as it does without one
constexpr int kLooksFar = 3;          // frames
constexpr double kMostBlur_px = 3.6;  // the widest blur of which the end is known
// Frames in a row; then it is looked for from the border, too, in every other frame.
constexpr int kLostMax = 3;
constexpr const char* kEndNotClear = "the end of the needle is not clear";
constexpr const char* kNotRecognised = "tip not recognised";
constexpr int kWiderMost = 6;  // frames in a row; then the window for its tip grows no more

// Of the outermost glass, px.
double sd_of(const CutGlass& cut, double half_width) {
  return math::hypot(cut.end.sd, cut.bevel.sd * outer_radius_of_glass(half_width, cut.end.blur));
}

double radius_at_end(const Bevel& bevel, const NeedlePose& needle, double blur_px) {
  return bevel.radius > 0 ? bevel.radius : outer_radius_of_glass(needle.half_width, blur_px);
}

// By which the outermost glass lies ahead of the middle of the end, px.
double ahead_of_middle(const Bevel& bevel, const NeedlePose& needle, double blur_px) {
  return std::abs(bevel.tangent) * radius_at_end(bevel, needle, blur_px);
}

// Of its end, what lies beside it, and so much of its shaft.
cv::Rect area_of(const NeedlePose& needle, double shaft_px) {
  constexpr double kOfMedium_px = 40, kClear_px = 24;
  const Point a = needle.at(shaft_px, 0), b = needle.at(-kOfMedium_px, 0);
  const double beside = needle.half_width_at(shaft_px) + kClear_px;
  return {static_cast<int>(std::min(a.x, b.x) - beside), static_cast<int>(std::min(a.y, b.y) - beside),
          static_cast<int>(std::abs(a.x - b.x) + 2 * beside),
          static_cast<int>(std::abs(a.y - b.y) + 2 * beside)};
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
    reason_ = "what enters through the border is not a straight needle";
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
  const auto blur = blur_of_end(field);
  if (!blur) {
    return begin_in(frames->one(0, field.area, field.sigma), frames->noise_of_one(), clear_at, nullptr);
  }
  const auto end = go_to_moving_end(*blur, field.sigma, *frames);
  if (!end) {
    reason_ = kEndNotClear;
    return false;
  }
  const GradientField& moving =
      frames->moving(area_of(last_, kShaft_px), end->per_frame * last_.axis, field.sigma);
  put_at_end_of_walls(moving, noise, 2 * kStartReach_px, kStartReach_px, last_);
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
  const bool end_known = learn_end_anew(field, noise, moving != nullptr ? moving->motion_sd : 0);
  NeedlePose plain = last_;
  const bool faint = fit_walls(field, noise, radius_px_, plain, kShortest_px) < kStraightWalls;
  if ((moving != nullptr && !end_known) || (faint && !(end_known && clear_at(last_.tip)))) {
    reason_ = kEndNotClear;
    return false;
  }
  in_noise_ = lumen_ && glass_frames_ > 0 && (moving != nullptr || (faint && noise >= kNoisy_grey));
  looked_at_ = 1;
  longest_ = faint || in_noise_ ? kFollowed_px : kShortest_px;
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
  lost_ = 0;
  looks_far_ = kLooksFar;
  started_ = true;
  reason_.clear();
}

// Where no straight one is found in one frame without much noise. What is fitted to walls that are the same
// all along the needle would be wrong: at first its end is where its shape says.
bool InjectionPipette::begin_steep(const GradientField& field, double noise, const Clear& clear_at) {
  constexpr double kEnd_px = 1.5, kCut = 0.1;  // standard deviations; nothing is known of its cut
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
  shape_.forget();
  shape_.learn(field, last_);
  shape_offset_ = shape_.face().value_or(0);
  shape_origin_ = last_.tip;
  bevel_ = {.tangent = 0, .sd = kCut};
  glass_blur_ = 0;
  glass_scatter_ = kEnd_px * kEnd_px;
  glass_frames_ = looked_at_ = 1;
  longest_ = kShortest_px;
  step_sign_ = walls_offset_ = end_line_ = 0;
  offset_frames_ = 0;
  walls_tell_ = lumen_ = true;
  in_noise_ = false;
  begin();
  // The shape does not fit best just where it was learnt.
  const NeedlePose followed = follow(field, noise);
  started_ =
      followed.ok && std::abs((followed.tip - glass->tip).dot(glass->axis) - shape_offset_) < kSameEnd_px;
  if (started_) {
    glass_ahead_ = (glass->tip - followed.tip).dot(glass->axis);
    last_ = *glass;
    last_.tip -= glass_ahead_ * glass->axis;
    begin();
    found_side_ = side;
    side_known_ = true;
  } else {
    reason_ = kEndNotClear;
  }
  return started_;
}

// Where a cut can be told of it.
std::optional<double> InjectionPipette::blur_of_end(const GradientField& field) const {
  const auto blur =
      last_.half_width < kLeastLumen_px ? std::nullopt : blur_of_shaft(field, last_, kStartReach_px);
  return blur && *blur <= kMostBlur_px ? blur : std::nullopt;
}

bool InjectionPipette::look_again(double sigma_px, const Clear& clear_at, GatheredFrames& frames) {
  const GradientField& field = frames.at_rest(sigma_px);
  (void)fit_walls(field, frames.noise(), radius_px_, last_, kLongestWall_px);
  started_ = !blur_of_end(field) || settle(field, frames.noise(), clear_at, &frames);
  looked_at_ = frames.count();
  return started_;
}

// In all frames together. It is put there; empty where they do not tell it, or may not be put together.
std::optional<MovingEnd> InjectionPipette::go_to_moving_end(double blur_px, double sigma_px,
                                                            GatheredFrames& frames) {
  constexpr double kShaftOfEnd_px = 90;
  const cv::Rect area = area_of(last_, kShaftOfEnd_px);
  Vector<SeenEnds> seen;
  for (int age = 0; age < frames.count(); ++age) {
    if (const auto ends =
            likely_ends(frames.one(age, area, sigma_px), frames.noise_of_one(), last_, blur_px)) {
      seen.push_back({*ends, frames.way(age).dot(last_.axis), age});
    }
  }
  if (seen.size() < kGathered) {
    return std::nullopt;
  }
  const auto end = moving_end(seen, outer_radius_of_glass(last_.half_width, blur_px), frames.motion_known());
  last_.tip -= (end ? end->behind : 0) * last_.axis;
  return end;
}

// Its shape, cut and glass. motion_sd: of the end, px, where it is not certain how it moves. Whether the
// outermost glass is known well enough for a faint needle to begin.
bool InjectionPipette::learn_end_anew(const GradientField& field, double noise, double motion_sd) {
  const NeedlePose before = last_;
  const bool known = learn_end_by_glass(field, noise, motion_sd);
  if (known && bevel_.radius > 0) {  // an oblique cut is no line across
    return true;
  }
  const auto line = end_line(field, noise, before, -kStartReach_px, kStartReach_px, in_relief_);
  if (!line) {
    return known;
  }
  last_ = before;
  last_.tip += line->ahead * last_.axis;
  shape_.forget();
  shape_.learn(field, last_);
  shape_offset_ = 0;
  shape_origin_ = last_.tip;
  lumen_ = walls_tell_ = true;
  walls_agree_ = followed_ = false;
  ends_with(*line);
  return true;
}

bool InjectionPipette::learn_end_by_glass(const GradientField& field, double noise, double motion_sd) {
  step_sign_ = 0;
  walls_offset_ = 0.15 * last_.half_width;
  offset_frames_ = 0;
  end_line_ = 0;
  calibrate_walls(field, last_, noise);
  const Point end_by_walls = last_.tip + walls_offset_ * last_.axis;
  learn_shape_anew(field);
  const auto shaft_blur = blur_of_shaft(field, last_, kStartReach_px);
  walls_tell_ = !shaft_blur || *shaft_blur <= kWallsTell_px;
  walls_agree_ = walls_tell_ && std::abs((end_by_walls - last_.tip).dot(last_.axis)) <= kSameEnd_px;
  if (walls_agree_) {
    last_.tip = end_by_walls;
  }
  glass_ahead_ = glass_scatter_ = glass_blur_ = 0;
  glass_frames_ = 0;
  followed_ = false;
  lumen_ = last_.half_width >= kLeastLumen_px;
  thin_end_.forget();
  const auto known = [&](const CutGlass& cut) {
    return cut.end.blur <= kMostBlur_px && math::hypot(sd_of(cut, last_.half_width), motion_sd) <=
                                               (cut.end.blur > kSharp_px ? kUnsharpKnown_px : kStartKnown_px);
  };
  if (const auto cut = lumen_ ? go_to_cut(field, noise) : std::nullopt) {
    bevel_ = cut->bevel;
    learn_glass(cut->end);
    return known(*cut);
  }
  bevel_ = {};
  const auto end = end_of_glass(field, noise, last_, 0, kStartReach_px, kStartReach_px, in_relief_);
  if (!end || end->sd > kEndKnown_px) {
    return false;
  }
  if (lumen_) {
    learn_glass(*end);
  }
  return known({*end, bevel_});
}

// The glass and its cut about the middle of its end, with the blur of the shaft, or in relief with a usual
// one.
std::optional<CutGlass> InjectionPipette::cut_seen(const GradientField& field, double noise,
                                                   const NeedlePose& middle) {
  const double blur = blur_of_shaft(field, middle, kStartReach_px).value_or(kUsualBlur_px);
  return blur < kMostBlur_px ? cut_of_glass(field, noise, middle, blur, kStartReach_px, kStartReach_px)
                             : std::nullopt;
}

// How the needle is cut, and how far ahead the glass ends. It is put where they are when that is far from the
// end of the walls.
std::optional<CutGlass> InjectionPipette::go_to_cut(const GradientField& field, double noise) {
  NeedlePose needle = last_;
  auto cut = cut_seen(field, noise, needle);
  const auto middle_ahead = [&] {
    return cut->end.ahead - ahead_of_middle(cut->bevel, needle, cut->end.blur);
  };
  bool further = false;
  for (int round = 0; round < kFurther && cut &&
                      std::abs(middle_ahead()) > (cut->end.sd > kEndKnown_px ? kNear_px : kFar_px);
       ++round) {
    needle.tip += middle_ahead() * needle.axis;
    cut = cut_seen(field, noise, needle);
    further = true;
  }
  if (cut && further) {
    last_.tip = needle.tip;
    learn_shape_anew(field);
    walls_agree_ = false;
    cut->end.ahead += (needle.tip - last_.tip).dot(last_.axis);
  }
  return cut;
}

// The end that is followed is one that looks the same in every frame; the tip is the outermost glass.
NeedlePose InjectionPipette::find(const GradientField& field, double noise,
                                  const std::optional<Point>& moved) {
  velocity_ = moved.value_or(velocity_);
  NeedlePose needle = told(follow(field, noise), noise);
  if (needle.ok && in_noise_ && noise >= kNoisy_grey) {
    weigh_end(field, noise, needle);
  }
  return needle;
}

// In noise the shape errs by several px, where the likelihood of the glass with its cut, which is known, does
// not.
void InjectionPipette::weigh_end(const GradientField& field, double noise, NeedlePose& needle) const {
  constexpr double kReach_px = 6;
  NeedlePose middle = needle;
  middle.tip -= ahead_of_middle(bevel_, needle, glass_blur_) * needle.axis;
  if (const auto end = end_of_known_cut(field, noise, middle, bevel_, glass_blur_, kReach_px)) {
    needle.tip += end->ahead * needle.axis;
    needle.sd = std::max(needle.sd, math::hypot(end->sd, needle.constant_sd));
  }
}

NeedlePose InjectionPipette::as_found(double noise) const { return told(last_, noise); }

bool InjectionPipette::ends_apart() const noexcept {
  return bevel_.radius > 0 || std::abs(bevel_.tangent) > kSteep;
}

NeedlePose InjectionPipette::told(NeedlePose needle, double noise) const {
  needle.tip += glass_ahead_ * needle.axis;
  needle.point_aside =
      ends_apart() ? std::copysign(radius_at_end(bevel_, last_, glass_blur_), -bevel_.tangent) : 0;
  // Of a needle whose lumen is not seen only the walls tell the end at first, and its cut is not seen.
  constexpr double kWalls_px = 0.5, kBeyondWalls_px = 0.8, kUnseenCut_px = 0.4,
                   kLine_px = 0.1;  // of the end, where the line that it is stands
  const bool by_walls = !lumen_ && glass_frames_ == 0;
  needle.constant_sd = by_walls ? kBeyondWalls_px
                       : lumen_ ? bevel_.sd * radius_at_end(bevel_, last_, glass_blur_)
                                : kUnseenCut_px;
  // It is learnt in focus. Out of it the end seems to lie further back; beyond the blurs that are tried, as
  // far as its contrast lasts.
  constexpr double kBeyondBlurs_px = 6;
  const double unsharp = NeedleShape::beyond_blurs(view_) ? kBeyondBlurs_px : NeedleShape::blur_px(view_);
  needle.sd = math::hypot(math::hypot(by_walls                        ? kWalls_px
                                      : end_line_ != 0 && cut_sd_ > 0 ? math::hypot(cut_sd_, kLine_px)
                                                                      : std::max(tip_sd(noise), cut_sd_),
                                      needle.constant_sd),
                          unsharp);
  return needle;
}

// With nothing near it. Out of focus the lumen closes, and which of the shapes it is, is not certain.
double InjectionPipette::tip_sd(double noise) const {
  constexpr double kUsualFrames = 3;
  const double usual = 0.1 + 0.04 * noise;  // px, before it is known: of walls of usual contrast
  constexpr double kPerBlur = 0.8;
  const double of_frame =
      (kUsualFrames * usual * usual + glass_frames_ * glass_scatter_) / (kUsualFrames + glass_frames_);
  constexpr double kUnsettled_px = 2;  // the shape fits best so far ahead of where it was learnt
  const bool settled = walls_tell_ || glass_frames_ > 0 || !followed_;
  const double unsharp = settled ? kPerBlur * std::max(0.0, glass_blur_ - kSharp_px) : kUnsettled_px;
  return std::sqrt(of_frame * (1 + 1.0 / std::max(glass_frames_, 1)) + unsharp * unsharp);
}

void InjectionPipette::put(const Point& tip) { last_.tip = tip - glass_ahead_ * last_.axis; }

bool InjectionPipette::go_on_at(const GradientField& field, double noise, const Point& tip) {
  constexpr double kAstray_px = 2.5;  // across the axis
  const auto seen = by_shaft(field, noise, tip);
  if (!seen || std::abs((seen->tip - tip).cross(seen->axis)) > kAstray_px) {
    return false;
  }
  velocity_ = {};
  jumps_ = 0;
  search_next_ = walls_agree_ = false;
  backdrop_ = {};
  view_ = {};
  return true;
}

bool InjectionPipette::goes_on_to(const GradientField& field, double noise, const NeedlePose& seen,
                                  const Point& tip) const {
  constexpr double kSpeck_px = 5, kLeast_px = 8, kAveraged_px = 4;
  const double ahead = (tip - seen.tip).dot(seen.axis);
  return ahead > kLeast_px && std::abs((tip - seen.tip).cross(seen.axis)) < seen.half_width &&
         walls_go_on(field, noise, seen, kSpeck_px, ahead - kAveraged_px / 2, kAveraged_px);
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
  if (!p || p->score < kLeastScore) {
    needle.reason = kNotRecognised;
    velocity_ = {};
    search_next_ = ++lost_ > kLostMax;
    return needle;
  }
  // Across the needle the correlation tells its place.
  Point correlated = p->at + Point(window.x, window.y) + tip_in_template_;
  const Point across(-last_.axis.y, last_.axis.x);
  needle.tip = last_.tip + velocity_;
  needle.tip += aside(field, noise, needle, (correlated - needle.tip).dot(across)) * across;
  bool near = false;
  if (!find_end(field, noise, needle, near)) {
    needle.reason = "end of the needle not seen";
    velocity_ = {};
    ++lost_;
    return needle;
  }
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
  if (!std::exchange(followed_, true) && !walls_tell_) {
    glass_frames_ = 0;  // at the start the shape lay where it was learnt, not where it fits best
  }
  needle.ok = true;
  velocity_ = lost_ == 0 ? needle.tip - last_.tip : Point();
  lost_ = 0;
  last_ = needle;
  backdrop_.learn(field, needle);
  return needle;
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

// Where its learnt shape fits best: walls end at many a granule, a shape does not. Where the walls end there,
// too, they tell the place more finely.
bool InjectionPipette::find_end(const GradientField& field, double noise, NeedlePose& needle, bool& near) {
  // Its width is known: other lines beside the walls are not them.
  constexpr double kWidth_px = 1;
  const auto fit_to_walls = [&] {
    const NeedlePose before = needle;
    const double straight = fit_walls(field, noise, radius_px_, needle, longest_);
    if (end_line_ != 0 && straight < kStraightWalls) {  // with light along them they hardly show
      needle = before;
    } else if (std::abs(needle.half_width - last_.half_width) > kWidth_px) {
      if (bevel_.radius > 0) {  // in relief their middle is then not the needle's either
        needle = before;
      }
      needle.half_width = last_.half_width;
      needle.taper = last_.taper;
    }
  };
  fit_to_walls();
  cut_sd_ = 0;
  if (end_line_ != 0 ? go_to_known_line(field, noise, needle)
                     : bevel_.radius > 0 && go_to_known_cut(field, noise, needle)) {
    near = true;
    shape_origin_ = needle.tip - shape_offset_ * needle.axis;
    walls_agree_ = false;
    return true;
  }
  needle.tip -= shape_offset_ * needle.axis;
  // First near where the motion predicts it: what lies further ahead cannot be mistaken for it then.
  std::optional<NeedleShape::End> end;
  for (const double reach : {8, 18}) {
    end = end ? end : shape_.end(field, backdrop_, needle, reach, reach, view_);
  }
  near = end.has_value();
  if (!near) {
    end = shape_.end(field, backdrop_, needle, 36, 44, view_);
  }
  if (!end || end->doubt > kDoubtMax_px) {
    return false;
  }
  view_ = end->view;
  needle.tip += end->ahead * needle.axis;
  fit_to_walls();
  if (const auto again = shape_.end_near(view_, field, backdrop_, needle, near ? kAgainNear_px : kAgain_px)) {
    needle.tip += *again * needle.axis;
  }
  shape_origin_ = needle.tip;
  needle.tip += shape_offset_ * needle.axis;

  NeedlePose walls = needle;
  walls.tip -= walls_offset_ * walls.axis;
  const auto ahead = end_of_profile(field, walls, 16, 16, noise);
  walls_agree_ = walls_tell_ && std::abs(bevel_.tangent) < kSteep && view_.blur == 0 && ahead &&
                 std::abs(*ahead) <= kSameEnd_px;
  if (walls_agree_) {
    needle.tip += *ahead * needle.axis;
  }
  return true;
}

// In relief an oblique end tells its place better than its shape does. False where it is not near.
bool InjectionPipette::go_to_known_cut(const GradientField& field, double noise, NeedlePose& needle) {
  constexpr double kReach_px = 10, kEdge_px = 2.5;
  NeedlePose middle = needle;
  middle.tip += (glass_ahead_ - ahead_of_middle(bevel_, needle, glass_blur_)) * needle.axis;
  const auto end = end_of_known_cut(field, noise, middle, bevel_, glass_blur_, kReach_px);
  if (!end || end->sd > kDoubtMax_px || std::abs(end->ahead) > kReach_px - kEdge_px) {
    return false;
  }
  needle.tip += end->ahead * needle.axis;
  cut_sd_ = end->sd;
  return true;
}

// With light along it the line across its end does. False where that is not near.
bool InjectionPipette::go_to_known_line(const GradientField& field, double noise, NeedlePose& needle) {
  constexpr double kReach_px = 5;
  const auto line = end_line_again(field, noise, needle, end_line_, kReach_px);
  if (!line) {
    return false;
  }
  needle.tip += line->ahead * needle.axis;
  cut_sd_ = line->sd;
  view_ = {};  // in focus
  return true;
}

// Where the line is seen that light along the needle makes of its end, at most so far ahead, that is its end
// from then on.
bool InjectionPipette::go_to_end_line(const GradientField& field, double noise, double most_ahead) {
  const auto line = end_line(field, noise, last_, -kStartReach_px, most_ahead, in_relief_);
  if (!line) {
    return false;
  }
  last_.tip += line->ahead * last_.axis;
  if (line->ahead > kStartReach_px) {
    return learn_end_anew(field, noise, 0) && cut_template(field);
  }
  shape_offset_ += line->ahead;
  walls_offset_ += line->ahead;
  ends_with(*line);
  return true;
}

void InjectionPipette::ends_with(const EndLine& line) {
  end_line_ = line.strength;
  cut_sd_ = line.sd;
  bevel_ = {};
  glass_ahead_ = glass_scatter_ = 0;
  glass_blur_ = kUsualBlur_px;
  glass_frames_ = 1;
}

// The profile of the walls ends a little before the end face. How far, the steepest change of grey along the
// walls tells, averaged over 30 frames.
void InjectionPipette::calibrate_walls(const GradientField& field, const NeedlePose& walls, double noise) {
  if (glass_frames_ > 0) {  // it counts from where the walls end
    return;
  }
  const auto step = steepest_wall_step(field, walls, 3.5, 3 * field.noise_of_gradient(noise), step_sign_);
  if (!step) {
    return;
  }
  if (step_sign_ == 0) {
    const double e = field.gradient(walls.at(-*step, 0.8 * walls.half_width)).dot(walls.axis) +
                     field.gradient(walls.at(-*step, -0.8 * walls.half_width)).dot(walls.axis);
    step_sign_ = e > 0 ? 1 : -1;
  }
  walls_offset_ += (*step - walls_offset_) / std::min(++offset_frames_, 30);
}

// The profile tells only roughly where the needle ends: its walls are thin there.
void InjectionPipette::learn_shape_anew(const GradientField& field) {
  for (int round = 0; round < 3; ++round) {
    shape_.forget();
    shape_.learn(field, last_);
    last_.tip += shape_.face().value_or(0) * last_.axis;
  }
  shape_offset_ = 0;
  shape_origin_ = last_.tip;
}

// Nothing else may touch the tip: a membrane that it pushes looks like a line of glass.
void InjectionPipette::learn_glass(const GradientField& field, double noise, const NeedlePose& followed) {
  constexpr int kFrames = 30;  // by then the noise of one frame has fallen to a fifth
  if (!lumen_) {
    learn_thin_end(field, noise, followed);
    return;
  }
  if (glass_frames_ >= kFrames) {
    return;
  }
  const bool steep = walls_tell_ && ends_apart();
  const double behind = ahead_of_middle(bevel_, followed, glass_blur_);
  NeedlePose middle = followed;  // of its end, as far as it is known
  middle.tip += (glass_ahead_ - behind) * followed.axis;
  std::optional<GlassEnd> end;
  if (steep) {
    end = end_of_known_cut(field, noise, middle, bevel_, glass_blur_, kGlassReach_px);
  } else if (walls_tell_) {
    end = end_of_glass(field, noise, middle, bevel_.tangent, kGlassReach_px, kGlassReach_px, in_relief_);
  } else if (const auto cut = cut_seen(field, noise, middle)) {
    end = cut->end;
  }
  if (end && end->sd < kEndKnown_px) {
    end->ahead -= steep ? 0 : behind;  // a known cut tells the middle, the others the outermost glass
    learn_glass(*end);
  }
}

void InjectionPipette::learn_thin_end(const GradientField& field, double noise, const NeedlePose& followed) {
  constexpr int kFrames = 96, kTogether = 8;
  if (thin_end_.frames() >= kFrames || !thin_end_.add(field, followed, in_relief_) ||
      thin_end_.frames() % kTogether != 0) {
    return;
  }
  if (const auto end = thin_end_.end(noise)) {
    glass_ahead_ = end->ahead;
    glass_scatter_ = end->sd * end->sd;
    glass_blur_ = end->blur;
    glass_frames_ = thin_end_.frames();
  }
}

void InjectionPipette::learn_glass(const GlassEnd& end) {
  const double part = 1.0 / ++glass_frames_;
  glass_ahead_ += part * end.ahead;
  // With the deviation that its likelihood has.
  const double squares = glass_frames_ > 1 ? end.ahead * (1 - part) * end.ahead : end.sd * end.sd;
  glass_scatter_ += part * (squares - glass_scatter_);
  glass_blur_ += part * (end.blur - glass_blur_);
}

void InjectionPipette::learn(const GradientField& field, const NeedlePose& needle, double noise,
                             double free_px) {
  const bool alone = free_px > kAlone_px;
  // The shape of few frames is rough, and fits a little better when it is blurred.
  constexpr double kRough_px = 0.8;
  if (!needle.ok || template_.empty() || NeedleShape::blur_px(view_) > (walls_tell_ ? 0 : kRough_px)) {
    return;
  }
  NeedlePose followed = needle;
  followed.tip -= glass_ahead_ * needle.axis;
  if (alone && in_relief_ && end_line_ == 0 && bevel_.radius == 0) {
    constexpr double kFarthest_px = 150;
    const bool far = looks_far_ > 0;  // where its walls run parallel they do not show
    looks_far_ -= far ? 1 : 0;
    if (go_to_end_line(field, noise, far ? std::min(free_px - kAlone_px, kFarthest_px) : kStartReach_px)) {
      return;
    }
  }
  if ((alone || !walls_tell_) && cut_sd_ == 0 && end_line_ == 0) {
    learn_glass(field, noise, followed);
  }
  if (!alone) {
    return;
  }
  NeedlePose origin = followed;
  if (walls_agree_) {
    origin.tip = followed.tip - walls_offset_ * needle.axis;
    calibrate_walls(field, origin, noise);
  }
  // A needle that stands still shows the same specks beside it again and again.
  constexpr double kMoved_px = 1;
  if (cv::norm(followed.tip - learnt_at_) > kMoved_px) {
    learnt_at_ = followed.tip;
    origin.tip = shape_origin_;
    shape_.learn(field, origin);
    constexpr double kFaceRate_px = 0.2;  // per frame: the face moves by no more as the shape is averaged
    shape_offset_ += end_line_ != 0 ? 0
                                    : std::clamp(shape_.face().value_or(shape_offset_) - shape_offset_,
                                                 -kFaceRate_px, kFaceRate_px);
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
