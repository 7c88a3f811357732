#include "vision/seen_cell.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/contact_points.hpp"
#include "vision/membrane/snakes.hpp"

namespace punctum::vision {

namespace {

constexpr double kMayTouch_px = 8;  // nearer, the needle may touch the membrane
constexpr double kClear_px = 3;     // further away, it does not: its blur ends before
constexpr int kOthersAfter = 25;  // frames in which a cell that was touched is missing: no other came before

}  // namespace

// Empty while there is more to do.
std::optional<StartedMembranes> SeenCell::search(const ClearedPicture& picture, bool at_once) {
  if (config_.method == Method::paper) {
    return start_snakes(picture, config_, seed_);
  }
  if (!search_) {
    const FollowedMembrane& lost = outermost();
    search_.emplace(seed_, lost.known ? std::optional(Circle{lost.centre, median_of(lost.r)}) : std::nullopt);
  }
  auto begun = search_->advance(picture, config_);
  while (!begun && at_once) {
    begun = search_->advance(picture, config_);
  }
  if (begun) {
    search_.reset();
  }
  return begun;
}

bool SeenCell::start(const ClearedPicture& picture, const Touch& touch, bool at_once, Result& result) {
  auto begun = search(picture, at_once);
  if (!begun) {
    result.outer.reason = "not found yet";
    return false;
  }
  result.outer.reason = begun->reason;
  const bool touched = touch.contact || touch.punctured;
  if (touched && outer_.known && outer_.rest.reliable() && ++frames_lost_ < kOthersAfter &&
      !(begun->outer.known &&
        undeformed_.same_cell(begun->outer.contour(), begun->outer.centre, result.needle))) {
    result.outer.reason = "not the cell that was touched";
    return false;
  }
  frames_lost_ = 0;
  take(std::move(*begun), touch, result);
  return outer_.known || inner_.known;
}

// Both membranes as found anew. The learnt rest shape is kept if this is the same cell in the same place. It
// is learnt anew if only a few frames told it, or if nothing touches the cell now.
void SeenCell::take(StartedMembranes&& begun, const Touch& touch, const Result& result) {
  const RestOutline outer_rest = std::move(outer_.rest), inner_rest = std::move(inner_.rest);
  outer_ = std::move(begun.outer);
  inner_ = std::move(begun.inner);
  const bool needed = touch.contact || touch.punctured || result.phase != rt::Phase::free;
  const bool compared = outer_.known && needed && outer_rest.reliable();
  if (compared && undeformed_.same_cell(outer_.contour(), outer_.centre, result.needle)) {
    outer_.rest = outer_rest;
    inner_.rest = inner_rest;
  } else {
    undeformed_.forget();
    another_ = compared;
  }
}

bool SeenCell::is_held(const ClearedPicture& picture) const {
  return vision::is_held({outermost().centre, median_of(outermost().r)}, picture);
}

// A bubble, or a cell that lies about, is given up for the one at the mouth of the holding pipette.
void SeenCell::look_for_a_held_one(const ClearedPicture& picture, const Touch& touch, const Result& result) {
  constexpr int kMostFrames = 200;
  if (touch.contact || touch.punctured || !picture.holder_face || is_held(picture)) {
    held_.reset();
    not_held_ = 0;
    next_look_ = kFirstLook;
    return;
  }
  if (!held_) {
    if (++not_held_ >= next_look_) {
      held_.emplace(std::nullopt);  // in the next frame, of which the whole picture is made ready
    }
    return;
  }
  if (auto begun = held_->advance(picture, config_)) {
    held_.reset();
    not_held_ = 0;
    next_look_ = std::min(2 * next_look_, kMostFrames);
    const FollowedMembrane& found = begun->outer.known ? begun->outer : begun->inner;
    if (found.known && vision::is_held({found.centre, median_of(found.r)}, picture)) {
      take(std::move(*begun), touch, result);
    }
  }
}

// What is followed as the outer membrane may be another edge for a part of the way, or all of it. Then no
// inner one is seen; a start in the present picture may show both.
void SeenCell::doubt_outer(const ClearedPicture& picture, const Touch& touch, const Result& result) {
  if (!config_.inner || !outer_.known || (inner_.known && !inner_.lost())) {
    inner_missing_ = 0;
    next_doubt_ = kFirstDoubt;
    return;
  }
  if (++inner_missing_ < next_doubt_) {
    return;
  }
  inner_missing_ = 0;
  next_doubt_ *= 2;
  CellSearch again(std::nullopt, Circle{outer_.centre, median_of(outer_.r)});
  if (auto begun = again.advance(picture, config_); begun && begun->outer.known && begun->inner.known) {
    take(std::move(*begun), touch, result);
  }
}

void SeenCell::see_edge(ClearedPicture& picture) {
  if (!outermost().known || outermost().lost()) {
    pattern_.forget();
  }
  if (!pattern_.known()) {
    return;
  }
  auto by = pattern_.nearby(picture.field);
  if (!by) {
    picture.compute_gradient({0, 0, picture.grey.cols, picture.grey.rows});
    by = pattern_.anywhere(picture.field);
  }
  if (by) {
    landmark_.seen(pattern_centre_ + *by);
  }
}

// With what holds it, or with the picture: where its edge is seen there rather than here, or where a frame
// between did not show what holds it, in which anything may have been taken for its edge.
void SeenCell::begin(ClearedPicture& picture, const SeenHolder& holder) {
  landmark_.begin();
  if (!holder.holds()) {
    see_edge(picture);
  }
  const Landmark& landmark = holder.holds() ? holder.landmark() : landmark_;
  carried_ = holder.holds() ? holder.landmark().moved() : std::nullopt;
  jump_ = {};
  const auto by = landmark.jump();
  if (!by || !outermost().known) {
    return;
  }
  double here = 0, there = 0;
  for (const Point& p : outermost().contour()) {
    const Point outwards = p - outermost().centre;
    here += std::abs(picture.field.gradient(p).dot(outwards));
    there += std::abs(picture.field.gradient(p + *by).dot(outwards));
  }
  if (there > here || !landmark.moved()) {
    outer_.jump_with_picture(*by);
    inner_.jump_with_picture(*by);
    undeformed_.jump_with_picture(*by);
    jump_ = *by;
    carried_ = Point();
  }
}

void SeenCell::follow(const ClearedPicture& picture, const SeenNeedle& needle, const Touch& touch, bool held,
                      Result& result, Stopwatch& watch) {
  if (config_.method == Method::paper) {
    follow_snakes(picture, result, watch);
    return;
  }
  look_for_a_held_one(picture, touch, result);
  doubt_outer(picture, touch, result);
  NeedlePose on_membrane = result.needle;  // its tip where the membrane on it is seen
  on_membrane.tip = needle.on_membrane(result.needle);
  // Everything is told as if neither it nor the needle had jumped.
  const Point needle_alone = needle.jump() - jump_;
  std::optional<Point> last_tip = needle.last_on_membrane();
  if (last_tip) {
    *last_tip -= needle_alone;
  }
  const auto surroundings = [&] {
    return Surroundings{
        .needle = on_membrane,
        .last_tip = last_tip,
        .expected_px = needle.expected_px(result.needle) + needle_alone.dot(result.needle.axis),
        .carried = carried_,
        .gone_odds = needle.membrane_gone_odds(),
        .punctured = touch.punctured,
        .wall_px = config_.px(config_.h_m),
        .dents_seen = result.needle.ok || !config_.needle || round_as_if_untouched(picture, touch, result),
        .undeformed = undeformed_.shape() ? &*undeformed_.shape() : nullptr};
  };
  Surroundings around_outer = surroundings();
  around_outer.within = &inner_;
  result.outer = vision::follow(outer_, picture, config_, around_outer);
  result.us.outer = watch.lap_us();
  // Where a scene has no inner membrane, one that is stronger than the outer one is kept apart from it.
  if (config_.inner || inner_.known) {
    const bool outer_seen = outer_.known && result.outer.ok;
    Surroundings around_inner = surroundings();
    if (outer_seen && (!inner_.known || inner_.lost())) {
      if (auto begun = start_inner(picture, config_, outer_, around_inner.dents_seen)) {
        begun->rest = std::move(inner_.rest);
        inner_ = std::move(*begun);
      }
    }
    around_inner.outermost = false;
    around_inner.around = outer_seen ? &outer_ : nullptr;
    Membrane inner = vision::follow(inner_, picture, config_, around_inner);
    if (config_.inner) {
      result.inner = std::move(inner);
    }
    result.us.inner = watch.lap_us();
  }
  if (!outer_.known && result.inner.ok) {
    result.outer.reason = "not found round the inner one (vision.inner = false follows that alone)";
  }
  const Membrane& outermost_now = outer_.known ? result.outer : result.inner;
  if (!held && outermost_now.ok) {
    pattern_.learn(picture, outermost_now.contour);
    pattern_centre_ = outermost().centre;
  }
}

void SeenCell::follow_snakes(const ClearedPicture& picture, Result& result, Stopwatch& watch) {
  if (result.needle.ok && outer_.known) {
    result.points = contact_points(picture, result.needle, outer_.contour(), outer_.level);
  }
  result.outer = follow_snake(outer_, picture, config_, result.points);
  result.us.outer = watch.lap_us();
  if (config_.inner) {
    result.inner = follow_snake(inner_, picture, config_, {});
    result.us.inner = watch.lap_us();
  }
}

// No needle that is not seen has dented the outer membrane, and so none has reached the inner one.
bool SeenCell::round_as_if_untouched(const ClearedPicture& picture, const Touch& touch,
                                     const Result& result) const {
  constexpr double kDent = 0.04;  // of the radius
  if (touch.punctured || !outer_.known || !result.outer.ok) {
    return false;
  }
  const auto weights =
      undeformed_weights(result.outer.contour, picture, std::nullopt,
                         result.holder.ok ? std::optional(result.holder.mouth) : std::nullopt);
  const auto now = fit_undeformed(result.outer.contour, weights);
  if (!now || !now->round) {
    return false;
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double off = cv::norm(result.outer.contour[i] - now->circle.centre) - now->circle.r;
    if (weights[i] > 0 && std::abs(off) > kDent * now->circle.r) {
      return false;
    }
  }
  return true;
}

bool SeenCell::measure(const ClearedPicture& picture, const Touch& touch, bool needle_hidden, bool held,
                       Result& result) {
  ahead_of_tip_px_.reset();
  if (inner_.known && result.inner.ok) {
    result.inner_radius_px = mean_radius(result.inner.contour);
  }
  if (!outer_.known || !result.outer.ok) {
    return true;
  }
  const int fitted = fit_undeformed_membrane(picture, touch, needle_hidden, held, result);
  if (result.undeformed && !is_of_the_scene(result.undeformed->r)) {
    give_up(result);
    return false;
  }
  if (fitted > 0 && result.needle.ok) {
    measure_gap(fitted, result);
  }
  return true;
}

// By its radius. The core allows as much beyond the limits of the scene.
bool SeenCell::is_of_the_scene(double r_px) const {
  constexpr double kBeyond = 0.1;
  return r_px > (1 - kBeyond) * config_.px(config_.R_min_m) &&
         r_px < (1 + kBeyond) * config_.px(config_.R_max_m);
}

// What was followed is no cell of the scene.
void SeenCell::give_up(Result& result) {
  const auto um = [](double m) { return std::to_string(std::lround(m * 1e6)); };
  const std::string reason = "radius of " + um(result.undeformed->r * config_.pixel_m) + " um, where " +
                             um(config_.R_min_m) + " to " + um(config_.R_max_m) + " um are expected";
  outer_ = {};
  inner_ = {};
  undeformed_.forget();
  result.undeformed.reset();
  result.inner_radius_px.reset();
  for (Membrane* m : {&result.outer, &result.inner}) {
    *m = {};
    m->reason = reason;
  }
}

// Returns the number of contour points that tell the undeformed membrane.
int SeenCell::fit_undeformed_membrane(const ClearedPicture& picture, const Touch& touch, bool needle_hidden,
                                      bool held, Result& result) {
  const Contour& contour = result.outer.contour;
  const NeedlePose& n = result.needle;
  std::optional<Point> entry;  // if the needle is near
  bool clear = !n.ok;
  if (n.ok) {
    entry = entry_point(undeformed_.known() ? undeformed_.at_rest().shape : contour, n.point(), n.axis);
    const double gap = entry ? (*entry - n.point()).dot(n.axis) : kMayTouch_px;
    clear = gap >= kClear_px;
    if (gap >= kMayTouch_px) {
      entry.reset();
    }
  }
  std::optional<Point> mouth;
  if (result.holder.ok) {
    mouth = result.holder.mouth;
  }
  const auto weights = undeformed_weights(contour, picture, entry, held ? mouth : std::nullopt);
  const auto now = fit_undeformed(contour, weights);
  if (!now) {
    return 0;
  }
  const bool touched_before = touch.contact || touch.punctured || needle_hidden;
  const bool touched = entry || touched_before;
  std::optional<LearntUndeformed::Mouth> certain;
  if (constexpr double kCertain_px = 0.25; mouth && result.holder.sd < kCertain_px) {
    certain = {*mouth, result.holder.sd};
  }
  const bool learns = clear && !touched_before;
  const LearntUndeformed::Moved moved = undeformed_.update(*now, touched, learns, certain, contour, weights);
  for (FollowedMembrane* m : {&outer_, &inner_}) {
    m->rest.centre += moved.shift;
    m->rest.turn(moved.turn);
  }
  if (learns) {
    outer_.rest.learn(outer_.centre, outer_.r);
    undeformed_.learn_outline(contour, outer_.centre);
    if (inner_.known && result.inner.ok) {
      inner_.rest.learn(inner_.centre, inner_.r);
    }
  } else if (outer_.rest.r.empty()) {  // it was never seen without the needle
    outer_.rest.r = polar_radii(undeformed_.shape()->shape, outer_.centre, config_.contour_points);
    outer_.rest.centre = outer_.centre;
  }
  if (inner_.rest.r.empty() && inner_.known && result.inner.ok && entry) {
    inner_.rest = outline_within(outer_.rest, inner_.centre, inner_.r, *entry);
  }
  result.undeformed = undeformed_.shape()->circle;
  double& r_sd = result.undeformed->r_sd;
  r_sd = math::hypot(r_sd, result.outer.rms_sd_px() / std::sqrt(Circle::kPieces));
  return static_cast<int>(std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; }));
}

void SeenCell::measure_gap(int fitted_points, Result& result) {
  const NeedlePose& n = result.needle;
  result.entry = entry_point(undeformed_.at_rest().shape, n.point(), n.axis);
  if (!result.entry) {
    return;
  }
  result.gap_px = (*result.entry - n.point()).dot(n.axis);
  entry_sd_px_ = 3 * result.outer.residual_px / std::sqrt(fitted_points);
  result.gap_sd_px = math::hypot(n.sd, entry_sd_px_);
  // Beside the needle, whose picture covers its own.
  constexpr double kBeside_px = 4, kDent_px = 3;
  const Point aside = (n.half_width + kBeside_px) * Point(-n.axis.y, n.axis.x);
  double dent = std::numeric_limits<double>::infinity();
  for (const Point& through : {n.tip + aside, n.tip - aside}) {
    const auto now = entry_point(result.outer.contour, through, n.axis),
               rest = entry_point(undeformed_.at_rest().shape, through, n.axis);
    dent = now && rest ? std::min(dent, (*now - *rest).dot(n.axis)) : 0;
  }
  if (dent > kDent_px) {
    ahead_of_tip_px_ = *result.gap_px + dent;
  }
}

}  // namespace punctum::vision
