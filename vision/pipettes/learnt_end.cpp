#include "vision/pipettes/learnt_end.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/pipettes/glass.hpp"
#include "vision/pipettes/needle_walls.hpp"
#include "vision/pipettes/shaft_blur.hpp"
#include "vision/pipettes/sharp_point.hpp"

namespace punctum::vision {

namespace {

constexpr double kDoubtMax_px = 5;  // an end that is less certain is not seen
// By no more is the end put right once the walls are fitted there; where it was expected, by less.
constexpr double kAgain_px = 16, kAgainNear_px = 4;
constexpr double kSameEnd_px = 5;     // the walls end where the shape does, but for what either errs
constexpr double kGlassReach_px = 4;  // by which the walls may seem to end too early, once it is known
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
constexpr double kFarBehind_px = 30;
constexpr double kSteep = 0.8;  // px along per px across: of a steeper cut the two walls end far apart
constexpr double kUsualBlur_px = 1.5;
// Half-widths by which glass may reach ahead unseen: the length of a cut of 27 degrees, sharper than is
// usual.
constexpr double kMostUnseen = 4;
constexpr double kExplained = 0.9;  // by its glass, of what is seen of a sharp point in relief

// Of the outermost glass, px.
double sd_of(const CutGlass& cut, double half_width) {
  return math::hypot(cut.end.sd, cut.bevel.sd * outer_radius_of_glass(half_width, cut.end.blur));
}

double radius_at_end(const Bevel& bevel, const NeedlePose& needle, double blur_px) {
  return bevel.radius > 0 ? bevel.radius : outer_radius_of_glass(needle.half_width, blur_px);
}

// By which the outermost glass lies ahead of the middle of the end, px.
double ahead_of_middle(const Bevel& bevel, const NeedlePose& needle, double blur_px) {
  return bevel.point_ahead > 0 ? bevel.point_ahead
                               : std::abs(bevel.tangent) * radius_at_end(bevel, needle, blur_px);
}

// The glass and its cut about the middle of its end, with the blur of the shaft, or in relief with a usual
// one.
std::optional<CutGlass> cut_seen(const GradientField& field, double noise, const NeedlePose& middle) {
  const double blur = blur_of_shaft(field, middle, LearntEnd::kStartReach_px).value_or(kUsualBlur_px);
  return blur < LearntEnd::kMostBlur_px
             ? cut_of_glass(field, noise, middle, blur, LearntEnd::kStartReach_px, LearntEnd::kStartReach_px)
             : std::nullopt;
}

// Across the needle much of the picture is then its own mirror reversed, and not its own mirror.
bool lit_from_aside(const GradientField& field, const NeedlePose& needle) {
  constexpr double kFrom_px = 10, kEvery_px = 2, kBeside_px = 3, kReversed = 0.3;
  constexpr int kStations = 30;
  const auto lanes = static_cast<std::size_t>(needle.half_width + kBeside_px);
  Vector<double> low(lanes, 0.0), high(lanes, 0.0);
  double mean = 0;
  for (int i = 0; i < kStations; ++i) {
    const double s = kFrom_px + kEvery_px * i;
    for (std::size_t k = 0; k < lanes; ++k) {
      const double u = static_cast<double>(k) + 0.5;
      low[k] += field.grey(needle.at(s, -u)) / kStations;
      high[k] += field.grey(needle.at(s, u)) / kStations;
    }
  }
  for (std::size_t k = 0; k < lanes; ++k) {
    mean += (low[k] + high[k]) / (2.0 * static_cast<double>(lanes));
  }
  double alike = 0, reversed = 0;
  for (std::size_t k = 0; k < lanes; ++k) {
    const double sum = low[k] + high[k] - 2 * mean, difference = high[k] - low[k];
    alike += sum * sum;
    reversed += difference * difference;
  }
  return reversed > kReversed * alike;
}

}  // namespace

// Its cut is told first: an oblique one is no line across.
bool LearntEnd::learn_anew(const GradientField& field, double noise, NeedlePose& needle, double motion_sd) {
  const NeedlePose before = needle;
  const bool known = learn_by_glass(field, noise, needle, motion_sd);
  half_width_at_start_ = needle.half_width;
  if (known && bevel_.radius > 0) {
    return true;
  }
  const auto line = end_line(field, noise, before, -kStartReach_px, kStartReach_px, in_relief_);
  if (!line) {
    return known;
  }
  needle = before;
  needle.tip += line->ahead * needle.axis;
  shape_.forget();
  shape_.learn(field, needle);
  shape_offset_ = 0;
  shape_origin_ = needle.tip;
  lumen_ = walls_tell_ = true;
  walls_agree_ = followed_ = false;
  ends_with(*line);
  return true;
}

void LearntEnd::learn_steep(const GradientField& field, const NeedlePose& needle) {
  constexpr double kEnd_px = 1.5, kCut = 0.1;  // standard deviations; nothing is known of its cut
  shape_.forget();
  shape_.learn(field, needle);
  shape_offset_ = shape_.face().value_or(0);
  shape_origin_ = needle.tip;
  bevel_ = {.tangent = 0, .sd = kCut};
  glass_blur_ = 0;
  glass_scatter_ = kEnd_px * kEnd_px;
  glass_frames_ = 1;
  step_sign_ = walls_offset_ = end_line_ = 0;
  offset_frames_ = 0;
  walls_tell_ = lumen_ = true;
}

bool LearntEnd::learn_outermost(const NeedlePose& needle, const Point& followed) {
  const double behind = (followed - needle.tip).dot(needle.axis);
  if (std::abs(behind - shape_offset_) >= kSameEnd_px) {
    return false;
  }
  glass_ahead_ = (needle.tip - followed).dot(needle.axis);
  unseen_ahead_ = 0;
  return true;
}

void LearntEnd::look_for_round_end(const GradientField& field, const NeedlePose& told) {
  if (in_relief_ || !lumen_ || ends_apart() || unseen_ahead_ > 0 || !round_end_.add(field, told)) {
    round_end_.forget();
  }
}

std::optional<double> LearntEnd::round_end() const { return round_end_.ahead(); }

double LearntEnd::reaches_further(double px) noexcept {
  const double by = std::min(px, kMostUnseen * half_width_at_start_ - unseen_ahead_);
  unseen_ahead_ += by;
  return by;
}

bool LearntEnd::learn_by_glass(const GradientField& field, double noise, NeedlePose& needle,
                               double motion_sd) {
  step_sign_ = 0;
  walls_offset_ = 0.15 * needle.half_width;
  offset_frames_ = 0;
  end_line_ = 0;
  calibrate_walls(field, needle, noise);
  const Point end_by_walls = needle.tip + walls_offset_ * needle.axis;
  learn_shape_anew(field, needle);
  const auto shaft_blur = blur_of_shaft(field, needle, kStartReach_px);
  walls_tell_ = !shaft_blur || *shaft_blur <= kWallsTell_px;
  walls_agree_ = walls_tell_ && std::abs((end_by_walls - needle.tip).dot(needle.axis)) <= kSameEnd_px;
  if (walls_agree_) {
    needle.tip = end_by_walls;
  }
  glass_ahead_ = unseen_ahead_ = glass_scatter_ = glass_blur_ = 0;
  round_end_.forget();
  glass_frames_ = 0;
  followed_ = false;
  lumen_ = needle.half_width >= kLeastLumen_px;
  thin_end_.forget();
  const auto known = [&](const CutGlass& cut) {
    return cut.end.blur <= kMostBlur_px && math::hypot(sd_of(cut, needle.half_width), motion_sd) <=
                                               (cut.end.blur > kSharp_px ? kUnsharpKnown_px : kStartKnown_px);
  };
  const auto cut = lumen_ ? go_to_cut(field, noise, needle) : std::nullopt;
  // Granules ahead of it may go on in line with its walls: then it ends further back. Light from aside may
  // hide one of them, and the cut is then told as well as it can be.
  const bool as_cut = cut && (known(*cut) || in_relief_ || lit_from_aside(field, needle));
  const auto end = as_cut ? std::nullopt
                          : end_of_glass(field, noise, needle, 0, kFarBehind_px, kStartReach_px, in_relief_);
  if (cut && !(end && end->sd <= kEndKnown_px)) {
    bevel_ = cut->bevel;
    learn_glass(cut->end);
    return known(*cut);
  }
  bevel_ = {};
  if (!end || end->sd > kEndKnown_px) {
    return false;
  }
  if (lumen_) {
    learn_glass(*end);
  }
  return known({*end, bevel_});
}

// How the needle is cut, and how far ahead the glass ends. It is put where they are when that is far from the
// end of the walls.
std::optional<CutGlass> LearntEnd::go_to_cut(const GradientField& field, double noise, NeedlePose& last) {
  NeedlePose needle = last;
  auto cut = cut_seen(field, noise, needle);
  const auto middle_ahead = [&] {
    return cut->end.ahead - ahead_of_middle(cut->bevel, needle, cut->end.blur);
  };
  bool further = false;
  for (int round = 0; round < kFurther && cut &&
                      std::abs(middle_ahead()) > (cut->end.sd > kEndKnown_px ? kNear_px : kFar_px);
       ++round) {
    const double ahead = middle_ahead();
    if (ahead > kFar_px && !in_relief_ && !lit_from_aside(field, needle) &&
        !walls_go_on(field, noise, needle, kNear_px, ahead - kNear_px, kShortestWall_px)) {
      return std::nullopt;  // a speck ahead of it
    }
    needle.tip += ahead * needle.axis;
    cut = cut_seen(field, noise, needle);
    further = true;
  }
  if (cut) {
    go_to_point(field, noise, needle, *cut);
  }
  if (cut && further) {
    last.tip = needle.tip;
    learn_shape_anew(field, last);
    walls_agree_ = false;
    const double moved = (needle.tip - last.tip).dot(last.axis);
    cut->end.ahead += moved;
    point_.glass.front() -= moved;
  }
  return cut;
}

// The point of a sharp needle in relief, by its glass: the walls alone tell how steep its cut is, and so
// where its foremost glass lies, less surely, and may look like those of one in bright field. As it is where
// the glass does not explain what is seen.
void LearntEnd::go_to_point(const GradientField& field, double noise, const NeedlePose& needle,
                            CutGlass& cut) {
  constexpr double kReach_px = 4, kKnown_px = 0.9, kSharp = 0.5;
  if (!(cut.bevel.radius > 0) && (std::abs(cut.bevel.tangent) < kSharp || !lit_from_aside(field, needle))) {
    return;
  }
  const auto point = sharp_point(field, noise, needle, cut);
  if (!point || point->explained < kExplained || !(point->sd < kKnown_px)) {
    return;
  }
  Bevel bevel{.tangent = point->tangent, .sd = 0, .radius = point->radius};
  NeedlePose middle = needle;
  const double to_middle = point->ahead - std::abs(bevel.tangent) * bevel.radius;
  middle.tip += to_middle * needle.axis;
  const auto end = end_of_known_cut(field, noise, middle, bevel, cut.end.blur, kReach_px);
  if (!end) {
    return;
  }
  bevel.point_ahead = point->ahead - to_middle - end->ahead;
  bevel.point_aside = point->aside;
  cut.bevel = bevel;
  cut.end.ahead = point->ahead;
  cut.end.sd = point->sd;
  point_ = *point;
  point_frames_ = 1;
}

// Noise moves it by a quarter of a pixel in one frame at noise 5. Its cut is followed all the same.
void LearntEnd::learn_point(const GradientField& field, double noise, const NeedlePose& followed) {
  constexpr int kFrames = 8;
  if (!by_point() || point_frames_ >= kFrames) {
    return;
  }
  const auto point = sharp_point_again(field, noise, followed, point_);
  if (!point || point->explained < kExplained) {
    return;
  }
  const double part = 1.0 / ++point_frames_, off = point->ahead - glass_ahead_, further = part * off;
  glass_frames_ = point_frames_;
  glass_scatter_ += part * (off * off - glass_scatter_);
  glass_ahead_ += further;
  bevel_.point_ahead += further;
  bevel_.point_aside += part * (point->aside - bevel_.point_aside);
  point_ = *point;
}

void LearntEnd::weigh(const GradientField& field, double noise, NeedlePose& needle) const {
  constexpr double kReach_px = 6;
  NeedlePose middle = needle;
  middle.tip -= (unseen_ahead_ + ahead_of_middle(bevel_, needle, glass_blur_)) * needle.axis;
  if (const auto end = end_of_known_cut(field, noise, middle, bevel_, glass_blur_, kReach_px)) {
    needle.tip += end->ahead * needle.axis;
    needle.sd = std::max(needle.sd, math::hypot(end->sd, needle.constant_sd));
  }
}

bool LearntEnd::ends_apart() const noexcept { return bevel_.radius > 0 || std::abs(bevel_.tangent) > kSteep; }

NeedlePose LearntEnd::told(NeedlePose needle, double noise) const {
  needle.tip += glass_ahead() * needle.axis;
  if (by_point()) {
    needle.point_aside = bevel_.point_aside;
  } else {
    needle.point_aside =
        ends_apart() ? std::copysign(radius_at_end(bevel_, needle, glass_blur_), -bevel_.tangent) : 0;
  }
  // Of a needle whose lumen is not seen only the walls tell the end at first, and its cut is not seen.
  constexpr double kWalls_px = 0.5, kBeyondWalls_px = 0.8, kUnseenCut_px = 0.4,
                   kLine_px = 0.1;  // of the end, where the line that it is stands
  const bool by_walls = !lumen_ && glass_frames_ == 0;
  needle.constant_sd = by_walls ? kBeyondWalls_px
                       : lumen_ ? bevel_.sd * radius_at_end(bevel_, needle, glass_blur_)
                                : kUnseenCut_px;
  // Light from one side shows slopes of glass: where the end lies beside what is seen of them differs from
  // needle to needle by so much.
  constexpr double kOfRelief_px = 0.6, kOfPoint_px = 0.2;  // of a point whose glass was fitted
  if (by_point()) {
    needle.constant_sd = math::hypot(kOfPoint_px, std::sqrt(glass_scatter_ / point_frames_));
  } else if (in_relief_) {
    needle.constant_sd = math::hypot(needle.constant_sd, kOfRelief_px);
  }
  // It is learnt in focus. Out of it the end seems to lie further back; beyond the blurs that are tried, as
  // far as its contrast lasts.
  constexpr double kBeyondBlurs_px = 6;
  const double unsharp = NeedleShape::beyond_blurs(view_) ? kBeyondBlurs_px : NeedleShape::blur_px(view_);
  const bool by_one_cue = cut_sd_ > 0 && (end_line_ != 0 || by_point());
  const double of_frame = by_walls     ? kWalls_px
                          : by_one_cue ? math::hypot(cut_sd_, end_line_ != 0 ? kLine_px : 0)
                                       : std::max(tip_sd(noise), cut_sd_);
  needle.sd = math::hypot(math::hypot(of_frame, needle.constant_sd), unsharp);
  return needle;
}

// With nothing near it. Out of focus the lumen closes, and which of the shapes it is, is not certain.
double LearntEnd::tip_sd(double noise) const {
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

// Where its learnt shape fits best: walls end at many a granule, a shape does not. Where the walls end there,
// too, they tell the place more finely.
LearntEnd::Seen LearntEnd::find(const GradientField& field, double noise, double longest,
                                NeedlePose& needle) {
  // Its width is known: other lines beside the walls are not them. In relief each wall is two lines, and a
  // fit to the inner one at some stations makes a needle narrower by less than that, frame by frame.
  constexpr double kWidth_px = 1, kInRelief_px = 0.5;
  const double half_width = needle.half_width, taper = needle.taper;
  const auto fit_to_walls = [&] {
    const NeedlePose before = needle;
    const double straight = fit_walls(field, noise, radius_px_, needle, longest);
    if (end_line_ != 0 && straight < kStraightWalls) {  // with light along them they hardly show
      needle = before;
    } else if (bevel_.radius > 0) {
      if (std::abs(needle.half_width - half_width_at_start_) > kInRelief_px) {  // nor is their middle its own
        needle = before;
      }
    } else if (std::abs(needle.half_width - half_width) > kWidth_px) {
      needle.half_width = half_width;
      needle.taper = taper;
    }
  };
  fit_to_walls();
  cut_sd_ = 0;
  if (end_line_ != 0 ? go_to_known_line(field, noise, needle)
                     : bevel_.radius > 0 && go_to_known_cut(field, noise, needle)) {
    shape_origin_ = needle.tip - shape_offset_ * needle.axis;
    walls_agree_ = false;
    return Seen::near;
  }
  needle.tip -= shape_offset_ * needle.axis;
  // First near where the motion predicts it: what lies further ahead cannot be mistaken for it then.
  std::optional<NeedleShape::End> end;
  for (const double reach : {8, 18}) {
    end = end ? end : shape_.end(field, backdrop_, needle, reach, reach, view_);
  }
  const bool near = end.has_value();
  if (!near) {
    end = shape_.end(field, backdrop_, needle, 36, 44, view_);
  }
  if (!end || end->doubt > kDoubtMax_px) {
    return Seen::no;
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
  return near ? Seen::near : Seen::far;
}

// In relief an oblique end tells its place better than its shape does. False where it is not near.
bool LearntEnd::go_to_known_cut(const GradientField& field, double noise, NeedlePose& needle) {
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
bool LearntEnd::go_to_known_line(const GradientField& field, double noise, NeedlePose& needle) {
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

void LearntEnd::begin_line(const EndLine& line) {
  shape_offset_ += line.ahead;
  walls_offset_ += line.ahead;
  ends_with(line);
}

void LearntEnd::ends_with(const EndLine& line) {
  end_line_ = line.strength;
  cut_sd_ = line.sd;
  bevel_ = {};
  glass_ahead_ = glass_scatter_ = 0;
  glass_blur_ = kUsualBlur_px;
  glass_frames_ = 1;
}

// The profile of the walls ends a little before the end face. How far, the steepest change of grey along the
// walls tells, averaged over 30 frames.
void LearntEnd::calibrate_walls(const GradientField& field, const NeedlePose& walls, double noise) {
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
void LearntEnd::learn_shape_anew(const GradientField& field, NeedlePose& needle) {
  for (int round = 0; round < 3; ++round) {
    shape_.forget();
    shape_.learn(field, needle);
    needle.tip += shape_.face().value_or(0) * needle.axis;
  }
  shape_offset_ = 0;
  shape_origin_ = needle.tip;
}

// Nothing else may touch the tip: a membrane that it pushes looks like a line of glass.
void LearntEnd::learn_glass(const GradientField& field, double noise, const NeedlePose& followed) {
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

void LearntEnd::learn_thin_end(const GradientField& field, double noise, const NeedlePose& followed) {
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

void LearntEnd::learn_glass(const GlassEnd& end) {
  const double part = 1.0 / ++glass_frames_;
  glass_ahead_ += part * end.ahead;
  // With the deviation that its likelihood has.
  const double squares = glass_frames_ > 1 ? end.ahead * (1 - part) * end.ahead : end.sd * end.sd;
  glass_scatter_ += part * (squares - glass_scatter_);
  glass_blur_ += part * (end.blur - glass_blur_);
}

void LearntEnd::learn(const GradientField& field, double noise, const NeedlePose& followed, bool alone) {
  if (alone && cut_sd_ > 0) {
    learn_point(field, noise, followed);
  }
  if ((alone || !walls_tell_) && cut_sd_ == 0 && end_line_ == 0) {
    learn_glass(field, noise, followed);
  }
  if (!alone) {
    return;
  }
  NeedlePose origin = followed;
  if (walls_agree_) {
    origin.tip = followed.tip - walls_offset_ * followed.axis;
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
}

void LearntEnd::was_seen(const GradientField& field, const NeedlePose& needle) {
  if (!std::exchange(followed_, true) && !walls_tell_) {
    glass_frames_ = 0;  // at the start the shape lay where it was learnt, not where it fits best
  }
  backdrop_.learn(field, needle);
}

void LearntEnd::forget_surroundings() {
  walls_agree_ = false;
  backdrop_ = {};
  view_ = {};
}

// The shape of few frames is rough, and fits a little better when it is blurred.
bool LearntEnd::is_sharp() const {
  constexpr double kRough_px = 0.8;
  return NeedleShape::blur_px(view_) <= (walls_tell_ ? 0 : kRough_px);
}

}  // namespace punctum::vision
