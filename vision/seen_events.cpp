#include "vision/seen_events.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"
#include "vision/membrane/dimple.hpp"
#include "vision/membrane/membrane_on_needle.hpp"

namespace punctum::vision {

namespace {

constexpr double kBeside_px = 12;         // further outside, no membrane lies on the needle
constexpr double kTouchesFrom_px = -3;    // further inside, it has touched before
constexpr double kTouchesTo_px = 8;       // further outside, it does not touch in the next frame
constexpr double kLeastDimple_px = 0.7;   // depth from which the width of a dimple can be measured
constexpr double kUnsharp = 1.6;          // times as blurred
constexpr double kRefocused_px = 0.5;     // in blur, against the frames before
constexpr double kContactPoint_px = 0.7;  // standard deviation of a membrane on the needle's side
// In relief, of the membrane at rest where the needle enters: how far beside what is seen its face lies,
// differs round a cell.
constexpr double kFaceAtEntry_px = 0.4;

// Where the inner membrane's contour crosses the lines beside the needle's edges.
std::optional<InnerOnNeedle> inner_on_needle(const FollowedMembrane& inner, const Result& result) {
  constexpr double kBesideEdge_px = 2.5;
  const NeedlePose& n = result.needle;
  if (!n.ok || !inner.known || !result.inner.ok) {
    return std::nullopt;
  }
  const Point across(-n.axis.y, n.axis.x);
  std::optional<InnerOnNeedle> nearer;
  for (const double side : {-1.0, 1.0}) {
    const double u = side * (n.half_width + kBesideEdge_px);
    const auto crossing = entry_point(result.inner.contour, n.tip + u * across, n.axis);
    if (!crossing) {
      return std::nullopt;
    }
    const double behind = -(*crossing - n.tip).dot(n.axis);
    if (!nearer || behind < nearer->behind_tip_px) {
      nearer = {behind, crossing->dot(n.axis)};
    }
  }
  return nearer;
}

// Of the membrane on the needle, over that where it faces the light: with the light across the needle, hardly
// anything of it is seen there.
double clearness_at_needle(const FollowedMembrane& outer, const Result& result) {
  constexpr double kLeast = 0.2;
  return outer.polarity == Polarity::relief
             ? std::max(std::abs(outer.relief.sign_at(-result.needle.axis)), kLeast)
             : 1;
}

}  // namespace

void SeenEvents::go_on_from(const SeenEvents& before, rt::Phase phase, Result& result) {
  if (before.touch_.punctured) {
    puncture_ = before.puncture_;
    inner_puncture_ = before.inner_puncture_;
    touch_.punctured = true;
    result.phase = phase;
  }
}

void SeenEvents::forget_puncture(Result& result) {
  puncture_ = Puncture(config_.puncture_px);
  inner_puncture_ = {};
  touch_.punctured = false;
  result.phase = rt::Phase::free;
}

void SeenEvents::decide(const ClearedPicture& picture, const SeenNeedle& needle, const SeenCell& cell,
                        Result& result, Stopwatch& watch) {
  PunctureInput in;
  // How far behind the tip the membrane lies on the needle.
  std::optional<double> behind_tip;
  if (result.needle.ok && result.outer.ok && !(result.gap_px && *result.gap_px > kBeside_px)) {
    const auto on_needle =
        membrane_on_needle(picture, result.needle, result.outer.contour,
                           cell.outer().polarity_at(-result.needle.axis), cell.outer().level);
    result.points = on_needle.points;
    behind_tip = on_needle.behind_tip;
    result.us.contact = watch.lap_us();
  }
  in.t_ns = result.exposure_ns;
  if (result.gap_px) {
    result.contact = contact_.update(*result.gap_px, result.gap_sd_px, needle.motion().speed);
  }
  // A frame that does not show needle and cell changes nothing; a needle that points past the cell is off it.
  const bool unseen = !(result.needle.ok && result.outer.ok);
  in.contact = result.contact || (unseen && touch_.contact);
  in.recoil = result.outer.ok ? cell.outer().recoil_odds : 0;
  in.gap_px = result.gap_px;
  in.radius_px = result.needle.half_width;
  in.points = behind_tip && result.entry;
  if (in.points) {
    in.tip_px = -result.gap_px.value_or(0);
    in.membrane_px = in.tip_px - *behind_tip;
    in.depth_px = in.membrane_px;
    // Out of the focus in which they touched, more than the membrane lies on the needle.
    const EdgeLearnt& edge = cell.outer().edge;
    touched_blur_px_ = touch_.contact && touched_blur_px_ > 0 ? touched_blur_px_ : edge.own_blur_px;
    const double blurred = touched_blur_px_ > 0 ? std::max(1.0, edge.blur_now_px / touched_blur_px_) : 1;
    in.sd_px = blurred * blurred * math::hypot(kContactPoint_px, result.needle.sd) /
               clearness_at_needle(cell.outer(), result);
    in.unsharp = blurred > kUnsharp;
    in.free = !cell.outer().held && !in.unsharp;
    in.refocused = std::abs(edge.blur_now_px - edge.own_blur_px) > kRefocused_px;
  }
  touch_.punctured = result.punctured = puncture_.update(in);
  result.inner_punctured = inner_puncture_.update(result.punctured, inner_on_needle(cell.inner(), result),
                                                  result.needle.half_width);
  result.membrane_velocity_px_s = puncture_.membrane_velocity_px_s();
  touch_.contact = in.contact;
  measure_depth(needle, cell, in.depth_px, result);
}

// Contact is when the two classes merge; a membrane is punctured when the velocity of its contact points
// reverses.
void SeenEvents::decide_as_paper(const ClearedPicture& picture, const SeenNeedle& needle,
                                 const SeenCell& cell, Result& result, Stopwatch& watch) {
  const NeedlePose& n = result.needle;
  std::optional<MembraneAtNeedle> outer_now, inner_now;
  double behind_tip = 0;
  if (n.ok && result.outer.ok) {
    result.merged = needle_merges_with_cell(picture, n, result.outer.contour, config_.dilation_px);
    result.contact = result.merged;
    const auto& [left, right] = result.points.point;
    if (left && right) {
      outer_now = {result.exposure_ns, 0.5 * (*left + *right), n.tip, n.axis};
      behind_tip = 0.5 * (result.points.behind_tip[0] + result.points.behind_tip[1]);
    }
    if (const auto seen = inner_on_needle(cell.inner(), result)) {
      inner_now = {result.exposure_ns, n.at(seen->behind_tip_px, 0), n.tip, n.axis};
    }
  }
  touch_.contact = needle.hidden(n) ? touch_.contact : result.contact;
  touch_.punctured = result.punctured = reversal_.update(touch_.contact, outer_now);
  result.inner_punctured = inner_reversal_.update(result.punctured, inner_now);
  result.membrane_velocity_px_s = reversal_.membrane_velocity_px_s();
  measure_depth(needle, cell, -result.gap_px.value_or(0) - behind_tip, result);
  result.us.contact = watch.lap_us();
}

void SeenEvents::without_the_cell(Result& result) {
  if (config_.method == Method::paper) {
    result.punctured = reversal_.update(touch_.contact, std::nullopt);
    result.inner_punctured = inner_reversal_.update(result.punctured, std::nullopt);
  } else {
    result.punctured = puncture_.update({.t_ns = result.exposure_ns, .contact = touch_.contact});
    result.inner_punctured = inner_puncture_.update(result.punctured, std::nullopt, 0);
  }
  touch_.punctured = result.punctured;
}

// membrane_px: depth of the contact points past the undeformed membrane.
void SeenEvents::measure_depth(const SeenNeedle& needle, const SeenCell& cell, double membrane_px,
                               Result& result) const {
  if (!result.gap_px) {
    return;
  }
  // Until the puncture the membrane lies on the tip. Afterwards its contour tells the rest of the dimple.
  const double depth = result.punctured ? membrane_px : needle.wall_px() - *result.gap_px;
  result.wd_px = result.contact ? std::max(0.0, depth) : 0.0;
  if (result.contact) {
    const double entry_sd_px =
        math::hypot(cell.entry_sd_px(), cell.outer().polarity == Polarity::relief ? kFaceAtEntry_px : 0);
    result.wd_sd_px = math::hypot(result.punctured ? kContactPoint_px : needle.on_tip_sd_px(), entry_sd_px);
  }
  if (*result.wd_px > kLeastDimple_px) {
    const auto half = dimple_half_width(result.outer.contour, cell.at_rest(), *result.entry, *result.wd_px,
                                        result.needle.half_width, result.outer.rms_sd_px());
    if (half) {
      result.a_px = half->a;
      result.a_sd_px = half->sd;
    }
  }
}

void SeenEvents::end_frame(const SeenNeedle& needle, Result& result) {
  const double speed = needle.motion().speed;
  touch_.next = result.gap_px && *result.gap_px > kTouchesFrom_px && *result.gap_px < kTouchesTo_px &&
                *result.gap_px < speed;
  if (needle.hidden(result.needle)) {
    return;
  }
  result.phase = next_phase(result.phase, {.um_px = config_.px(1e-6),
                                           .gap_px = result.gap_px,
                                           .wd_px = result.wd_px.value_or(0),
                                           .tip_speed = speed,
                                           .contact = result.contact,
                                           .punctured = result.punctured});
}

}  // namespace punctum::vision
