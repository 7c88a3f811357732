#include "vision/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/events/contact.hpp"
#include "vision/events/phase.hpp"
#include "vision/events/puncture.hpp"
#include "vision/events/velocity_reversal.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/contact_points.hpp"
#include "vision/membrane/dimple.hpp"
#include "vision/membrane/membrane_on_needle.hpp"
#include "vision/membrane/membrane_start.hpp"
#include "vision/membrane/snakes.hpp"
#include "vision/pipettes/gathered_frames.hpp"
#include "vision/pipettes/holding_pipette.hpp"
#include "vision/pipettes/injection_pipette.hpp"
#include "vision/pipettes/tip_by_stage.hpp"
#include "vision/pipettes/wide_tube.hpp"
#include "vision/stopwatch.hpp"
#include "vision/surface/membrane_net.hpp"

namespace punctum::vision {

namespace {

constexpr int kHolderEvery = 8;  // frames between two searches for a tube that was not found
constexpr int kNeedleAtOnce = 6, kNeedleEvery = 8;  // likewise for the needle, after so many tries
constexpr int kFirstDoubt = 5;  // frames without the inner membrane; after twice as many again, and so on
constexpr double kNeedleMargin_px = 2.5;  // the blur reaches so far beyond the needle's edges
constexpr double kUntouched_px = 12;      // further outside, nothing touches the tip
// Further outside, the end of the needle shows beside the membrane, and all of it as it does without a cell.
constexpr double kEndShows_px = 2, kAlone_px = 10;
constexpr double kLeastDimple_px = 0.7;   // depth from which the width of a dimple can be measured
constexpr double kNear_px = 8;            // nearer, the needle may touch the membrane
constexpr double kClear_px = 3;           // further away, it does not: its blur ends before
constexpr double kContactPoint_px = 0.7;  // standard deviation of a membrane on the needle's side
constexpr double kWall_px =
    0.4;  // from the membrane, which is what is seen on the tip, to the outermost glass
constexpr double kAtMembrane_px = 0.45, kInside_px = 1.5;  // to which the picture alone shows the tip there
// By which it draws the end of the needle ahead: what is seen and put right; and where that is not seen, for
// each time that it is more blurred.
constexpr double kDrawn_px = 1.5, kDrawnBlurred_px = 3.5;
// The paper keeps the large variations of the gradient only. Of the usual edge of a membrane: with 0.4 needle
// and cell merge when they are still 4 px apart, with 0.75 they part again over a deep dimple.
constexpr double kLargeGradient = 0.6;

Side opposite(Side side) { return side == Side::right ? Side::left : Side::right; }

double rms(const Vector<double>& values) {
  double square = 0;
  for (const double v : values) {
    square += v * v / static_cast<double>(values.size());
  }
  return std::sqrt(square);
}

cv::Rect2d square_round(const Point& p, double half) { return {p.x - half, p.y - half, 2 * half, 2 * half}; }

VisionConfig checked(VisionConfig config) {
  config.contour_points = std::clamp(config.contour_points, 128, 1024);
  return config;
}

}  // namespace

struct Tracker::Impl {
  VisionConfig config;
  int width, height;
  std::optional<Circle> seed;
  Result result;
  ClearedPicture picture;

  HoldingPipette holder;
  std::optional<TubeTrace> holder_tube;
  bool template_given = false;
  int holder_frames = 0;  // without it
  InjectionPipette needle;
  InjectionPipette::Start needle_search = InjectionPipette::Start::failed;
  GatheredFrames gathered;                      // while it is missing in noise
  int needle_frames = 0, needle_tries = 0;      // that failed
  bool needle_due = false, holder_due = false;  // looked for in this frame
  bool needle_before_gap = false;               // it is not known yet whether it is still the same
  TipByStage by_stage;
  NeedlePose membrane_needle;  // its tip where the membrane on it is seen
  NeedlePose seen_needle;      // as the picture alone tells it
  double seen_tip_sd_px = 0;   // of its place in the picture, whatever hides the glass there
  double entry_sd_px = 0;
  double wall_px = 0;  // from the tip to the middle of the membrane that it pushes, as far as seen
  TipOnMembrane tip_on_membrane;
  TipMotion tip;

  FollowedMembrane outer, inner;
  std::optional<CellSearch> cell_search;            // while there is more to do
  int inner_missing = 0, next_doubt = kFirstDoubt;  // frames
  bool first_picture = true;    // of it everything is searched at once; later each frame bears a part
  LearntUndeformed undeformed;  // of the outer one
  bool was_contact = false;
  bool touches_next =
      false;  // it was outside or just within, and will not be outside in this frame, by its speed
  ContactTest contact;
  Puncture puncture;
  InnerPuncture inner_puncture;
  VelocityReversal reversal, inner_reversal;  // in place of the two, as the paper has it
  bool punctured = false;                     // the outer membrane
  std::optional<NetFit> net_fit;              // where the scene asks for surfaces

  Impl(const VisionConfig& c, int w, int h)
      : config(checked(c)),
        width(w),
        height(h),
        holder(c.holder.value_or(HolderVision{})),
        needle(c.needle_from, c.px(c.c_m)),
        puncture(c.puncture_px),
        reversal(c.puncture_px),
        inner_reversal(c.puncture_px) {
    cv::setNumThreads(1);
    // Code for the newest registers gives other last bits, and is no faster here.
    cv::setUseOptimized(false);
    kept::prepare();
    if (config.surface) {
      net_fit.emplace(rt::MembraneSurface::kControlPoints);
    }
  }

  const Result& process(const hal::Frame& frame, const std::optional<Point>& stage);

  // A needle that was seen before and is not seen now may be anywhere: it tells neither contact nor its end.
  [[nodiscard]] bool needle_hidden() const { return needle.started() && !result.needle.ok; }
  // The outer membrane is so many times as blurred as in focus.
  [[nodiscard]] double unsharp() const {
    return std::max(1.0, outer.edge.own_blur_px / TipOnMembrane::kUsualBlur_px);
  }
  // It touches the membrane, or will by its speed.
  [[nodiscard]] bool at_membrane() const { return !punctured && (was_contact || touches_next); }
  // No needle that is not seen has dented the outer membrane, and so none has reached the inner one.
  [[nodiscard]] bool round_as_if_untouched() const;
  [[nodiscard]] bool must_start() const;
  void decide_searches();
  [[nodiscard]] cv::Rect area_to_search(bool starting) const;
  [[nodiscard]] Vector<Side> holder_sides() const;
  [[nodiscard]] bool looks_again();
  void learn_tip_again();
  [[nodiscard]] bool search_needle();
  void forget_needle();
  void recognise_needle();
  void locate_needle();
  void learn_needle();
  void locate_holder();
  [[nodiscard]] Point end_of_holder() const;
  void clear_picture(double needle_margin);
  [[nodiscard]] std::optional<StartedMembranes> search_cell();
  [[nodiscard]] bool start();
  void take(StartedMembranes&& begun);
  void doubt_outer();
  void follow_membranes(Stopwatch& watch);
  [[nodiscard]] Surroundings surroundings();
  void measure();
  [[nodiscard]] int fit_undeformed_membrane();
  void measure_gap(int fitted_points);
  [[nodiscard]] std::optional<double> meet_on_needle();
  [[nodiscard]] std::optional<InnerOnNeedle> inner_on_needle() const;
  void classify_contact(const std::optional<double>& membrane_behind_tip);
  void events_of_the_paper();
  void events_without_the_cell();
  void measure_depth(double membrane_px);
  void reconstruct_surfaces();
  void decide_phase();
};

Tracker::Tracker(const VisionConfig& config, int width, int height)
    : impl_(std::make_unique<Impl>(config, width, height)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::seed_circle(const Circle& circle) { impl_->seed = circle; }
void Tracker::holder_template(const cv::Mat& pattern) {
  impl_->holder.use_template(pattern);
  impl_->template_given = true;
}
void Tracker::after_gap() {
  Impl& before = *impl_;
  auto next = std::make_unique<Impl>(before.config, before.width, before.height);
  next->seed = before.seed;
  if (before.template_given) {
    next->holder = std::move(before.holder);
    next->template_given = true;
  }
  if (before.needle.started()) {
    next->needle = std::move(before.needle);
    next->tip_on_membrane = before.tip_on_membrane;
    next->by_stage = before.by_stage;
    next->by_stage.after_gap();
    next->needle_before_gap = true;
    if (before.punctured) {  // it stays so while the tip stays inside
      next->puncture = before.puncture;
      next->inner_puncture = before.inner_puncture;
      next->punctured = true;
      next->result.phase = before.result.phase;
    }
  }
  impl_ = std::move(next);
}
const Result& Tracker::process(const hal::Frame& frame, const std::optional<Point>& stage) {
  return impl_->process(frame, stage);
}

const Result& Tracker::Impl::process(const hal::Frame& frame, const std::optional<Point>& stage) {
  Stopwatch total, watch;
  const rt::Phase last_phase = result.phase;
  result = {};
  result.phase = last_phase;
  result.frame = frame.sequence;
  result.exposure_ns = frame.exposure_ns;
  if (result.verdict = picture.load(frame, width, height); !result.verdict.empty()) {
    result.us.total = total.lap_us();
    return result;
  }
  result.usable = true;
  result.noise = picture.noise;
  by_stage.begin(config.method == Method::tracker ? stage : std::nullopt);
  const bool starting = must_start();
  decide_searches();
  picture.compute_gradient(area_to_search(starting));
  result.us.prepare = watch.lap_us();

  if (config.needle) {
    recognise_needle();
    locate_needle();
    result.us.needle = watch.lap_us();
  }
  picture.holder_face.reset();
  if (config.holder) {
    locate_holder();
    result.us.holder = watch.lap_us();
  }

  // At the start a needle inside the cell must not split it, so the bright lines beside its walls are covered
  // as well.
  clear_picture(kNeedleMargin_px + (starting ? 0.7 * result.needle.half_width : 0));
  result.us.erase = watch.lap_us();

  const bool found = !starting || start();
  if (starting) {
    result.us.start = watch.lap_us();
  }
  if (found) {
    follow_membranes(watch);
    measure();
    result.us.measure = watch.lap_us();
    if (config.method == Method::paper) {
      events_of_the_paper();
      result.us.contact = watch.lap_us();
    } else {
      std::optional<double> membrane_behind_tip;
      if (result.needle.ok && result.outer.ok && !(result.gap_px && *result.gap_px > kUntouched_px)) {
        membrane_behind_tip = meet_on_needle();
        result.us.contact = watch.lap_us();
      }
      classify_contact(membrane_behind_tip);
    }
    learn_needle();
    if (config.surface) {
      (void)watch.lap_us();
      reconstruct_surfaces();
      result.us.surface = watch.lap_us();
    }
  } else {
    events_without_the_cell();
  }
  decide_phase();
  first_picture = false;
  result.verdict = verdict_on(result, config);
  result.us.total = total.lap_us();
  return result;
}

bool Tracker::Impl::must_start() const { return outer.known ? outer.lost() : !inner.known || inner.lost(); }

// Of a faint needle not every frame shows the end: the first tries follow each other.
void Tracker::Impl::decide_searches() {
  needle_due = config.needle && !needle.started() &&
               (needle_tries < kNeedleAtOnce || needle_frames++ % kNeedleEvery == 0 ||
                needle_search == InjectionPipette::Start::more_to_do);
  holder_due = config.holder && !holder_tube && holder_frames++ % kHolderEvery == 0;
}

// It enters through the border opposite to the needle's.
Vector<Side> Tracker::Impl::holder_sides() const {
  const Side known = config.needle && needle.side_known() ? needle.side() : config.needle_from;
  return known == Side::automatic ? Vector<Side>{Side::left, Side::right} : Vector<Side>{opposite(known)};
}

// The whole picture while cell or needle must be found; then their surroundings, and what lies between the
// cell and the holding pipette's border while that is looked for.
cv::Rect Tracker::Impl::area_to_search(bool starting) const {
  const cv::Rect whole(0, 0, width, height);
  if (starting || needle_due || (needle.started() && !tip.last)) {
    return whole;
  }
  const FollowedMembrane& cell = outer.known ? outer : inner;
  cv::Rect2d box = square_round(cell.centre, 1.1 * *std::max_element(cell.r.begin(), cell.r.end()) + 22);
  if (holder_due) {
    for (const Side side : holder_sides()) {
      box |= cv::Rect2d(side == Side::left ? 0 : width - 1, box.y, 1, box.height);
    }
  }
  if (needle.started()) {
    constexpr double kShaft_px = 180;  // of the shaft tell its direction
    box |= square_round(*tip.last, 40);
    box |= square_round(*tip.last - kShaft_px * tip.axis, 24) & cv::Rect2d(0, 0, width, height);
  }
  return whole & cv::Rect(static_cast<int>(box.x), static_cast<int>(box.y), static_cast<int>(box.width),
                          static_cast<int>(box.height));
}

// Frames are kept while the needle is missing in noise, or was found in few of them. Whether there are enough
// by now to tell its end better.
bool Tracker::Impl::looks_again() {
  constexpr int kSome = 4;
  const bool told = needle.started() && !needle.doubtful(GatheredFrames::kMost);
  if (told || was_contact || punctured || picture.noise < InjectionPipette::kNoisy_grey) {
    gathered.forget();
    return false;
  }
  gathered.add(picture.grey, by_stage.moved());
  const int frames = gathered.count();
  return frames >= kSome && needle.doubtful(frames < GatheredFrames::kMost ? kSome : frames);
}

// From the frames in which the end is told now.
void Tracker::Impl::learn_tip_again() {
  constexpr int kBeside_px = 24;
  const NeedlePose now = needle.as_found(picture.noise);
  for (int age = gathered.count() - 1; age > 0 && outer.known; --age) {
    NeedlePose then = now;
    then.tip -= gathered.way(age) + age * needle.velocity();
    const auto entry = entry_point(outer.contour(), then.tip, then.axis);
    if (entry && (*entry - then.tip).dot(then.axis) > TipOnMembrane::kClearAhead_px) {
      tip_on_membrane.learn(
          gathered.one(age, cv::Rect(square_round(then.tip, kBeside_px)), picture.field.sigma), then);
    }
  }
}

// Whether this frame shows its end.
bool Tracker::Impl::search_needle() {
  // A membrane at the tip of a faint needle looks like its end.
  const auto clear_at = [this](const Point& end) {
    return !outer.known || cv::norm(end - outer.centre) > median_of(outer.r) + kUntouched_px;
  };
  if (looks_again()) {
    by_stage.forget();
    tip_on_membrane = {};
    const bool found = needle.look_again(picture.field.sigma, clear_at, gathered);
    if (found) {
      learn_tip_again();
    }
    return found;
  }
  if (!needle_due) {
    return false;
  }
  // What moves otherwise than along its axis, one frame shows better than the mean.
  constexpr int kAlone = 3;  // one try in so many
  const bool mean = gathered.count() > 1 && needle_tries % kAlone != 0;
  const GradientField& field = mean ? gathered.at_rest(picture.field.sigma) : picture.field;
  const double noise = mean ? gathered.noise() : picture.noise;
  do {
    needle_search = needle.advance_start(field, noise, clear_at, needle_tries < kNeedleAtOnce,
                                         mean ? &gathered : nullptr);
  } while (first_picture && needle_search == InjectionPipette::Start::more_to_do);
  needle_tries += needle_search == InjectionPipette::Start::failed ? 1 : 0;
  return needle_search == InjectionPipette::Start::found;
}

void Tracker::Impl::forget_needle() {
  needle = {config.needle_from, config.px(config.c_m)};
  needle_tries = 0;
  by_stage.forget();
  tip_on_membrane = {};
}

void Tracker::Impl::recognise_needle() {
  if (!std::exchange(needle_before_gap, false)) {
    return;
  }
  const auto told = by_stage.tip();
  if (!told || !needle.go_on_at(picture.field, picture.noise, *told)) {
    forget_needle();
    puncture = Puncture(config.puncture_px);
    inner_puncture = {};
    punctured = false;
    result.phase = rt::Phase::free;
    needle_due = true;
  }
}

void Tracker::Impl::locate_needle() {
  NeedlePose& n = result.needle;
  n = search_needle() ? needle.as_found(picture.noise)
                      : needle.find(picture.field, picture.noise, by_stage.moved());
  if (config.method == Method::tracker && n.ok && at_membrane() && outer.known) {
    const auto on = tip_on_membrane.ahead(picture.field, picture.noise, outer.edge, n);
    if (on) {
      n.tip += on->ahead * n.axis;
      const double surprising = std::max(0.0, std::abs(on->ahead) - kDrawn_px * unsharp());
      n.sd = math::hypot(math::hypot(n.sd, on->sd), surprising);
    } else {
      n.sd = math::hypot(n.sd, kDrawnBlurred_px * (unsharp() - 1));
    }
  }
  seen_tip_sd_px = n.sd;
  // A membrane on the tip draws its end aside, granules round it by several pixels.
  n.sd = math::hypot(n.sd, punctured ? kInside_px : at_membrane() ? kAtMembrane_px * unsharp() : 0);
  seen_needle = n;
  wall_px = 0;
  const auto tip_told = by_stage.tip();
  if (n.ok && tip_told && needle.goes_on_to(picture.field, picture.noise, n, *tip_told)) {
    n.ok = seen_needle.ok = false;
    n.reason = "a speck looks like its end";
  }
  if (tip_told && !n.ok) {
    n = needle.by_shaft(picture.field, picture.noise, *tip_told).value_or(n);
    n.sd = by_stage.sd();
  } else if (tip_told) {
    n.sd = math::hypot(n.sd, at_membrane() ? kWall_px : 0);
    n = by_stage.most_likely(n);
    needle.put(n.tip);
    // In contact the picture shows where the membrane is, on the tip; of a thin needle it draws the end back.
    if (at_membrane() && needle.shows_lumen()) {
      constexpr double kThick_px = 1;
      wall_px = std::clamp((seen_needle.tip - n.tip).dot(n.axis), -kThick_px, kThick_px);
    }
  }
}

// What is learnt of the needle while nothing touches its tip.
void Tracker::Impl::learn_needle() {
  if (!seen_needle.ok || result.contact) {
    return;
  }
  if (!result.gap_px || *result.gap_px > kEndShows_px) {
    needle.learn(picture.field, seen_needle, picture.noise, !result.gap_px || *result.gap_px > kAlone_px);
  }
  if (!result.gap_px || *result.gap_px > TipOnMembrane::kClearAhead_px) {
    by_stage.learn(seen_needle);
    if (by_stage.picture_stays()) {
      forget_needle();
      return;
    }
  }
  if (result.gap_px && *result.gap_px > TipOnMembrane::kClearAhead_px) {
    tip_on_membrane.learn(picture.field, result.needle);
  }
}

void Tracker::Impl::locate_holder() {
  if (holder_due) {
    holder_tube =
        find_holder_tube(picture.field, holder_sides(), height, config.px(config.R_max_m), picture.noise);
  }
  if (!holder.has_template()) {
    result.holder.reason = holder_tube ? holder.cut_template(picture.grey, *holder_tube, picture.noise)
                                       : "no wide tube enters through the border";
  }
  if (holder.has_template()) {
    result.holder = holder.find(picture.grey);
    if (config.method == Method::tracker) {
      holder.refine(picture.grey, result.holder);
    }
  }
  if (holder_tube) {
    // The middle of a given template need not be the mouth.
    const Point mouth = result.holder.ok && !template_given ? result.holder.mouth : holder_tube->end();
    picture.holder_face = {mouth, holder_tube->axis, holder_tube->end_half_width};
  }
}

// To which the holding pipette is erased. The paper's snake needs the membrane that the pipette touches:
// there the contact with the membrane is the end of what is erased.
Point Tracker::Impl::end_of_holder() const {
  constexpr double kInto_px = 2;  // the blur of the pipette's face reaches so far
  const Point mouth = picture.holder_face->mouth, axis = holder_tube->axis;
  if (config.method != Method::paper || !outer.known) {
    return mouth;
  }
  const auto membrane = entry_point(outer.contour(), mouth, axis);
  return membrane ? mouth - std::max(0.0, (mouth - *membrane).dot(axis) - kInto_px) * axis : mouth;
}

void Tracker::Impl::clear_picture(double needle_margin) {
  Vector<Polygon> pipettes;
  if (result.needle.ok) {
    pipettes.push_back(needle_polygon(result.needle, picture.grey.size(), needle_margin, 1.5));
  }
  if (picture.holder_face) {
    pipettes.push_back(holder_polygon(*holder_tube, end_of_holder(), picture.grey.size(), 2, -1));
  }
  picture.cover(pipettes);

  Vector<Contour> membranes;
  for (const FollowedMembrane* m : {&outer, &inner}) {
    if (m->known) {
      membranes.push_back(m->contour());
    }
  }
  const double share = config.method == Method::paper ? kLargeGradient : 0.25;
  const double strong = std::max(5 * picture.gradient_noise, share * std::max(outer.level, inner.level));
  const double cell_r = median_of(outer.known ? outer.r : inner.r);
  result.impurities = picture.cover_impurities(membranes, strong, 0.45 * cell_r);
}

// Of the cell; empty while there is more to do.
std::optional<StartedMembranes> Tracker::Impl::search_cell() {
  if (config.method == Method::paper) {
    return start_snakes(picture, config, seed);
  }
  if (!cell_search) {
    const FollowedMembrane& lost = outer.known ? outer : inner;
    cell_search.emplace(seed,
                        lost.known ? std::optional(Circle{lost.centre, median_of(lost.r)}) : std::nullopt);
  }
  auto begun = cell_search->advance(picture, config);
  while (!begun && first_picture) {
    begun = cell_search->advance(picture, config);
  }
  if (begun) {
    cell_search.reset();
  }
  return begun;
}

bool Tracker::Impl::start() {
  auto begun = search_cell();
  if (!begun) {
    result.outer.reason = "not found yet";
    return false;
  }
  result.outer.reason = begun->reason;
  take(std::move(*begun));
  if (!outer.known && !inner.known) {
    return false;
  }
  clear_picture(kNeedleMargin_px);
  return true;
}

// Both membranes as found anew. The learnt rest shape is kept if this is the same cell in the same place. It
// is learnt anew if only a few frames told it, or if nothing touches the cell now.
void Tracker::Impl::take(StartedMembranes&& begun) {
  const RestOutline outer_rest = std::move(outer.rest), inner_rest = std::move(inner.rest);
  outer = std::move(begun.outer);
  inner = std::move(begun.inner);
  const bool needed = was_contact || punctured || result.phase != rt::Phase::free;
  if (outer.known && needed && outer_rest.reliable() &&
      undeformed.same_cell(outer.contour(), outer.centre, result.needle)) {
    outer.rest = outer_rest;
    inner.rest = inner_rest;
  } else {
    undeformed.forget();
  }
}

// What is followed as the outer membrane may be another edge for a part of the way, or all of it. Then no
// inner one is seen; a start in the present picture may show both.
void Tracker::Impl::doubt_outer() {
  if (!config.inner || !outer.known || (inner.known && !inner.lost())) {
    inner_missing = 0;
    next_doubt = kFirstDoubt;
    return;
  }
  if (++inner_missing < next_doubt) {
    return;
  }
  inner_missing = 0;
  next_doubt *= 2;
  CellSearch again(std::nullopt, Circle{outer.centre, median_of(outer.r)});
  if (auto begun = again.advance(picture, config); begun && begun->outer.known && begun->inner.known) {
    take(std::move(*begun));
  }
}

Surroundings Tracker::Impl::surroundings() {
  membrane_needle = result.needle;
  membrane_needle.tip += wall_px * result.needle.axis;
  return {.needle = membrane_needle,
          .last_tip = tip.last,
          .expected_px = by_stage.moved() ? by_stage.moved()->dot(result.needle.axis) : tip.speed,
          .punctured = punctured,
          .dents_seen = result.needle.ok || !config.needle || round_as_if_untouched(),
          .undeformed = undeformed.shape() ? &*undeformed.shape() : nullptr};
}

void Tracker::Impl::follow_membranes(Stopwatch& watch) {
  if (config.method == Method::paper) {
    if (result.needle.ok && outer.known) {
      result.points = contact_points(picture, result.needle, outer.contour(), outer.level);
    }
    result.outer = follow_snake(outer, picture, config, result.points);
    result.us.outer = watch.lap_us();
    if (config.inner) {
      result.inner = follow_snake(inner, picture, config, {});
      result.us.inner = watch.lap_us();
    }
    return;
  }
  doubt_outer();
  Surroundings around_outer = surroundings();
  around_outer.within = &inner;
  result.outer = follow(outer, picture, config, around_outer);
  result.us.outer = watch.lap_us();
  if (config.inner) {
    const bool outer_seen = outer.known && result.outer.ok;
    if (outer_seen && (!inner.known || inner.lost())) {
      if (auto begun = start_inner(picture, config, outer, surroundings().dents_seen)) {
        begun->rest = std::move(inner.rest);
        inner = std::move(*begun);
      }
    }
    Surroundings around_inner = surroundings();
    around_inner.outermost = false;
    around_inner.around = outer_seen ? &outer : nullptr;
    result.inner = follow(inner, picture, config, around_inner);
    result.us.inner = watch.lap_us();
  }
}

bool Tracker::Impl::round_as_if_untouched() const {
  constexpr double kDent = 0.04;  // of the radius
  if (punctured || !outer.known || !result.outer.ok) {
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

void Tracker::Impl::measure() {
  if (inner.known && result.inner.ok) {
    result.inner_radius_px = mean_radius(result.inner.contour);
  }
  if (!outer.known || !result.outer.ok) {
    return;
  }
  const int fitted = fit_undeformed_membrane();
  if (fitted > 0 && result.needle.ok) {
    measure_gap(fitted);
  }
}

// Returns the number of contour points that tell the undeformed membrane.
int Tracker::Impl::fit_undeformed_membrane() {
  const Contour& contour = result.outer.contour;
  const NeedlePose& n = result.needle;
  std::optional<Point> entry;  // if the needle is near
  bool clear = !n.ok;
  if (n.ok) {
    entry = entry_point(undeformed.known() ? undeformed.at_rest().shape : contour, n.tip, n.axis);
    const double gap = entry ? (*entry - n.tip).dot(n.axis) : kNear_px;
    clear = gap >= kClear_px;
    if (gap >= kNear_px) {
      entry.reset();
    }
  }
  std::optional<Point> mouth;
  if (result.holder.ok) {
    mouth = result.holder.mouth;
  }
  const auto weights = undeformed_weights(contour, picture, entry, holder_tube ? mouth : std::nullopt);
  const auto now = fit_undeformed(contour, weights);
  if (!now) {
    return 0;
  }
  const bool touched_before = was_contact || punctured || needle_hidden();
  const bool touched = entry || touched_before;
  constexpr double kCertainMotion_px = 0.25;  // a less certain motion of the holding pipette is none
  const bool certain = result.holder.sd < kCertainMotion_px;
  const Point shift = undeformed.update(*now, touched, certain ? mouth : std::nullopt);
  for (FollowedMembrane* m : {&outer, &inner}) {
    m->rest.centre += shift;
  }
  if (clear && !touched_before) {
    outer.rest.learn(outer.centre, outer.r);
    undeformed.learn_outline(contour, outer.centre);
    if (inner.known && result.inner.ok) {
      inner.rest.learn(inner.centre, inner.r);
    }
  } else if (outer.rest.r.empty()) {  // it was never seen without the needle
    outer.rest.r = polar_radii(undeformed.shape()->shape, outer.centre, config.contour_points);
    outer.rest.centre = outer.centre;
  }
  if (inner.rest.r.empty() && inner.known && result.inner.ok && entry) {
    inner.rest = outline_within(outer.rest, inner.centre, inner.r, *entry);
  }
  result.undeformed = undeformed.shape()->circle;
  double& r_sd = result.undeformed->r_sd;
  r_sd = math::hypot(r_sd, rms(result.outer.sd_px) / std::sqrt(Circle::kPieces));
  return static_cast<int>(std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; }));
}

void Tracker::Impl::measure_gap(int fitted_points) {
  const NeedlePose& n = result.needle;
  result.entry = entry_point(undeformed.at_rest().shape, n.tip, n.axis);
  if (!result.entry) {
    return;
  }
  result.gap_px = (*result.entry - n.tip).dot(n.axis);
  entry_sd_px = 3 * result.outer.residual_px / std::sqrt(fitted_points);
  result.gap_sd_px = math::hypot(n.sd, entry_sd_px);
}

// Returns how far behind the tip the membrane lies on the needle.
std::optional<double> Tracker::Impl::meet_on_needle() {
  const MembraneOnNeedle on_needle = membrane_on_needle(picture, result.needle, result.outer.contour,
                                                        outer.polarity_at(-result.needle.axis), outer.level);
  result.points = on_needle.points;
  return on_needle.behind_tip;
}

// Where the inner membrane's contour crosses the lines beside the needle's edges.
std::optional<InnerOnNeedle> Tracker::Impl::inner_on_needle() const {
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

void Tracker::Impl::classify_contact(const std::optional<double>& membrane_behind_tip) {
  PunctureInput in;
  in.t_ns = result.exposure_ns;
  if (result.gap_px) {
    result.contact = contact.update(*result.gap_px, result.gap_sd_px, tip.speed);
  }
  // A frame that does not show needle and cell changes nothing; a needle that points past the cell is off it.
  const bool unseen = !(result.needle.ok && result.outer.ok);
  in.contact = result.contact || (unseen && was_contact);
  in.gap_px = result.gap_px.value_or(0);
  in.radius_px = result.needle.half_width;
  in.points = membrane_behind_tip && result.entry;
  if (in.points) {
    in.tip_px = -in.gap_px;
    in.membrane_px = in.tip_px - *membrane_behind_tip;
    in.depth_px = in.membrane_px;
    in.sd_px = math::hypot(kContactPoint_px, result.needle.sd);
    in.free = !outer.held;
  }
  punctured = result.punctured = puncture.update(in);
  result.inner_punctured =
      inner_puncture.update(result.punctured, inner_on_needle(), result.needle.half_width);
  result.membrane_velocity_px_s = puncture.membrane_velocity_px_s();
  was_contact = in.contact;
  measure_depth(in.depth_px);
}

// membrane_px: depth of the contact points past the undeformed membrane.
void Tracker::Impl::measure_depth(double membrane_px) {
  if (!result.gap_px) {
    return;
  }
  // Until the puncture the membrane lies on the tip. Afterwards its contour tells the rest of the dimple.
  const double depth = result.punctured ? membrane_px : wall_px - *result.gap_px;
  result.wd_px = result.contact ? std::max(0.0, depth) : 0.0;
  if (result.contact) {
    result.wd_sd_px = math::hypot(result.punctured ? kContactPoint_px : seen_tip_sd_px, entry_sd_px);
  }
  if (*result.wd_px > kLeastDimple_px) {
    const auto half = dimple_half_width(result.outer.contour, undeformed.at_rest(), *result.entry,
                                        *result.wd_px, result.needle.half_width, rms(result.outer.sd_px));
    if (half) {
      result.a_px = half->a;
      result.a_sd_px = half->sd;
    }
  }
}

// The cell is not found.
void Tracker::Impl::events_without_the_cell() {
  if (config.method == Method::paper) {
    result.punctured = reversal.update(was_contact, std::nullopt);
    result.inner_punctured = inner_reversal.update(result.punctured, std::nullopt);
  } else {
    result.punctured = puncture.update({.t_ns = result.exposure_ns});
    result.inner_punctured = inner_puncture.update(result.punctured, std::nullopt, 0);
  }
  punctured = result.punctured;
}

// Contact is when the two classes merge; a membrane is punctured when the velocity of its contact points
// reverses.
void Tracker::Impl::events_of_the_paper() {
  const NeedlePose& n = result.needle;
  std::optional<MembraneAtNeedle> outer_now, inner_now;
  double behind_tip = 0;
  if (n.ok && result.outer.ok) {
    result.merged = needle_merges_with_cell(picture, n, result.outer.contour, config.dilation_px);
    result.contact = result.merged;
    const auto& [left, right] = result.points.point;
    if (left && right) {
      outer_now = {result.exposure_ns, 0.5 * (*left + *right), n.tip, n.axis};
      behind_tip = 0.5 * (result.points.behind_tip[0] + result.points.behind_tip[1]);
    }
    if (const auto seen = inner_on_needle()) {
      inner_now = {result.exposure_ns, n.at(seen->behind_tip_px, 0), n.tip, n.axis};
    }
  }
  was_contact = needle_hidden() ? was_contact : result.contact;
  punctured = result.punctured = reversal.update(was_contact, outer_now);
  result.inner_punctured = inner_reversal.update(result.punctured, inner_now);
  result.membrane_velocity_px_s = reversal.membrane_velocity_px_s();
  measure_depth(-result.gap_px.value_or(0) - behind_tip);
}

// From where the needle meets the cell, or would; without one, from where one would come.
void Tracker::Impl::reconstruct_surfaces() {
  Point through = outer.centre, axis(config.needle_from == Side::left ? 1 : -1, 0);
  if (tip.last) {
    axis = tip.axis;
  }
  if (result.needle.ok) {
    through = result.needle.tip;
    axis = result.needle.axis;
  }
  const double bent = dimple_reach(result.wd_px.value_or(0), result.needle.half_width);
  if (outer.known && result.outer.ok) {
    net_fit->fit(result.outer.contour, through, axis, bent, result.outer_net.emplace());
  }
  if (inner.known && result.inner.ok) {
    net_fit->fit(result.inner.contour, through, axis, bent, result.inner_net.emplace());
  }
}

void Tracker::Impl::decide_phase() {
  tip.update(result.needle);
  touches_next =
      result.gap_px && *result.gap_px > -kClear_px && *result.gap_px < kNear_px && *result.gap_px < tip.speed;
  if (needle_hidden()) {
    return;
  }
  result.phase = next_phase(result.phase, {.um_px = config.px(1e-6),
                                           .gap_px = result.gap_px,
                                           .wd_px = result.wd_px.value_or(0),
                                           .tip_speed = tip.speed,
                                           .contact = result.contact,
                                           .punctured = result.punctured});
}

}  // namespace punctum::vision
