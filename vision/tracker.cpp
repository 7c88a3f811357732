#include "vision/tracker.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "vision/image/binning.hpp"
#include "vision/image/median.hpp"
#include "vision/membrane/dimple.hpp"
#include "vision/seen_cell.hpp"
#include "vision/seen_events.hpp"
#include "vision/seen_holder.hpp"
#include "vision/seen_needle.hpp"
#include "vision/stopwatch.hpp"
#include "vision/surface/membrane_net.hpp"

namespace punctum::vision {

namespace {

constexpr double kNeedleMargin_px = 2.5;  // the blur reaches so far beyond the needle's edges
// The paper keeps the large variations of the gradient only. Of the usual edge of a membrane: with 0.4 needle
// and cell merge when they are still 4 px apart, with 0.75 they part again over a deep dimple.
constexpr double kLargeGradient = 0.6;

Side opposite(Side side) { return side == Side::right ? Side::left : Side::right; }

cv::Rect2d square_round(const Point& p, double half) { return {p.x - half, p.y - half, 2 * half, 2 * half}; }

VisionConfig checked(VisionConfig config) {
  config.contour_points =
      std::clamp(config.contour_points, VisionConfig::kLeastContourPoints, VisionConfig::kMostContourPoints);
  return config;
}

}  // namespace

struct Tracker::Impl {
  VisionConfig config;
  int width, height;
  Result result;
  ClearedPicture picture;
  SeenHolder holder;
  SeenNeedle needle;
  SeenCell cell;
  SeenEvents events;
  std::optional<NetFit> net_fit;  // where the scene asks for surfaces
  bool first_picture = true;      // of it everything is searched at once; later each frame bears a part

  Impl(const VisionConfig& c, int w, int h)
      : config(checked(c)),
        width(w),
        height(h),
        holder(config),
        needle(config),
        cell(config),
        events(config) {
    cv::setNumThreads(1);
    // Code for the newest registers gives other last bits, and is no faster here.
    cv::setUseOptimized(false);
    kept::prepare();
    if (config.surface) {
      net_fit.emplace(rt::MembraneSurface::kControlPoints);
    }
  }

  const Result& process(const hal::Frame& frame, const std::optional<Point>& stage);
  [[nodiscard]] bool load(const hal::Frame& frame);
  [[nodiscard]] Vector<Side> holder_sides() const;
  [[nodiscard]] cv::Rect area_to_search(bool starting) const;
  void clear_picture(double needle_margin);
  void compare_holder_with_cell();
  [[nodiscard]] bool start();
  void reconstruct_surfaces();
};

// Frames whose pixels are finer than the scene needs.
struct Tracker::Binned {
  Binning binning;
  int width, height;  // of the frames
  cv::Mat grey;
  Result result;

  Binned(int by, int w, int h) : binning{by}, width(w), height(h), grey(h / by, w / by, CV_8U) {}

  const Result& process(Impl& impl, const hal::Frame& frame, const std::optional<Point>& stage) {
    Stopwatch watch;
    const std::string lacks = ClearedPicture::lacking(frame, width, height);
    hal::Frame coarse = frame;
    coarse.pixels = nullptr;
    if (lacks.empty()) {
      binning.bin(frame.pixels, frame.stride, grey);
      coarse.pixels = grey.data;
      coarse.width = grey.cols;
      coarse.height = grey.rows;
      coarse.stride = static_cast<int>(grey.step);
    }
    const double binning_us = watch.lap_us();
    result = impl.process(coarse, stage ? std::optional(binning.coarse(*stage)) : std::nullopt);
    if (!lacks.empty()) {
      result.verdict = lacks;
    }
    tell_in_fine_pixels(result, binning);
    result.us.prepare += binning_us;
    result.us.total += binning_us;
    return result;
  }
};

Tracker::Tracker(const VisionConfig& config, int width, int height) {
  const int by = config.binning();
  VisionConfig coarse = config;
  coarse.pixel_m *= by;
  impl_ = std::make_unique<Impl>(coarse, width / by, height / by);
  if (by > 1) {
    binned_ = std::make_unique<Binned>(by, width, height);
  }
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::seed_circle(const Circle& circle) {
  const Binning binning = binned_ ? binned_->binning : Binning{};
  impl_->cell.seed({binning.coarse(circle.centre), circle.r / binning.by, circle.rms / binning.by});
}
void Tracker::holder_template(const cv::Mat& pattern) {
  if (!binned_) {
    impl_->holder.use_template(pattern);
    return;
  }
  const int by = binned_->binning.by;
  cv::Mat coarse(pattern.rows / by, pattern.cols / by, CV_8U);
  binned_->binning.bin(pattern.data, static_cast<int>(pattern.step), coarse);
  impl_->holder.use_template(coarse);
}
void Tracker::after_gap() {
  auto next = std::make_unique<Impl>(impl_->config, impl_->width, impl_->height);
  next->cell.go_on_from(impl_->cell);
  next->holder.go_on_from(impl_->holder);
  if (impl_->needle.started()) {
    next->needle.go_on_from(impl_->needle);
    next->events.go_on_from(impl_->events, impl_->result.phase, next->result);
  }
  impl_ = std::move(next);
}
const Result& Tracker::process(const hal::Frame& frame, const std::optional<Point>& stage) {
  return binned_ ? binned_->process(*impl_, frame, stage) : impl_->process(frame, stage);
}

const Result& Tracker::Impl::process(const hal::Frame& frame, const std::optional<Point>& stage) {
  Stopwatch total, watch;
  if (!load(frame)) {
    result.us.total = total.lap_us();
    return result;
  }
  const bool starting = cell.must_start();
  needle.clear_way(picture);
  needle.begin(stage);
  holder.begin();
  result.us.prepare = watch.lap_us();
  if (config.holder && !holder.due()) {  // its jump tells where all else is looked for
    result.holder = holder.locate(picture, holder_sides());
    result.us.holder = watch.lap_us();
  }
  picture.compute_gradient(area_to_search(starting));
  cell.begin(picture, holder);
  result.us.prepare += watch.lap_us();

  if (config.needle) {
    if (!needle.recognised(picture)) {
      events.forget_puncture(result);
    }
    const Landmark& landmark = holder.holds() ? holder.landmark() : cell.landmark();
    result.needle = needle.locate(picture, cell.outer(), events.touch(), landmark.place(), first_picture);
    result.us.needle = watch.lap_us();
  }
  if (config.holder && holder.due()) {
    result.holder = holder.locate(picture, holder_sides());
    if (holder.found()) {
      needle.forget_landmark();
    }
    result.us.holder = watch.lap_us();
  }

  // At the start a needle inside the cell must not split it, so the bright lines beside its walls are covered
  // as well.
  clear_picture(kNeedleMargin_px + (starting ? 0.7 * result.needle.half_width : 0));
  result.us.erase = watch.lap_us();

  bool found = !starting || start();
  if (starting) {
    result.us.start = watch.lap_us();
  }
  if (found) {
    cell.follow(picture, needle, events.touch(), holder.holds(), result, watch);
    found = cell.measure(picture, events.touch(), needle.hidden(result.needle), holder.holds(), result);
    if (found && config.method == Method::tracker) {
      compare_holder_with_cell();
    }
    result.us.measure = watch.lap_us();
  }
  if (found) {
    if (config.method == Method::paper) {
      events.decide_as_paper(picture, needle, cell, result, watch);
    } else {
      if (cell.is_another()) {
        events.forget_puncture(result);
      }
      events.decide(picture, needle, cell, result, watch);
      needle.learn_from_dent(result.needle, result.punctured ? std::nullopt : cell.ahead_of_tip_px());
    }
    if (!result.contact && !events.touch().contact) {  // nor while a touched cell is out of sight
      needle.learn(picture, result.needle, result.gap_px);
    }
    if (config.surface) {
      (void)watch.lap_us();
      reconstruct_surfaces();
      result.us.surface = watch.lap_us();
    }
  } else {
    events.without_the_cell(result);
  }
  needle.end_frame(result.needle);
  events.end_frame(needle, result);
  first_picture = false;
  result.verdict = verdict_on(result, config);
  result.us.total = total.lap_us();
  return result;
}

// False, with a verdict, where the frame cannot be used.
bool Tracker::Impl::load(const hal::Frame& frame) {
  const rt::Phase last_phase = result.phase;
  result = {};
  result.phase = last_phase;
  result.frame = frame.sequence;
  result.exposure_ns = frame.exposure_ns;
  result.verdict = picture.load(frame, width, height);
  result.usable = result.verdict.empty();
  result.noise = result.usable ? picture.noise : 0;
  picture.holder_face.reset();
  return result.usable;
}

// It enters through the border opposite to the needle's.
Vector<Side> Tracker::Impl::holder_sides() const {
  const Side known = needle.side();
  return known == Side::automatic ? Vector<Side>{Side::left, Side::right} : Vector<Side>{opposite(known)};
}

// The whole picture while cell or needle must be found; then their surroundings, and what lies between the
// cell and the holding pipette's border while that is looked for.
cv::Rect Tracker::Impl::area_to_search(bool starting) const {
  const cv::Rect whole(0, 0, width, height);
  const TipMotion& tip = needle.motion();
  if (starting || cell.looks_for_another() || needle.due() || (needle.started() && !tip.last)) {
    return whole;
  }
  const FollowedMembrane& m = cell.outermost();
  cv::Rect2d box = square_round(m.centre, 1.1 * *std::max_element(m.r.begin(), m.r.end()) + 22);
  if (holder.due()) {
    for (const Side side : holder_sides()) {
      box |= cv::Rect2d(side == Side::left ? 0 : width - 1, box.y, 1, box.height);
    }
  }
  if (needle.started()) {
    constexpr double kShaft_px = 180;  // of the shaft tell its direction
    box |= square_round(*tip.last, 40);
    box |= square_round(*tip.last - kShaft_px * tip.axis, 24) & cv::Rect2d(0, 0, width, height);
  }
  if (const auto jump = holder.landmark().jump()) {
    box |= box + cv::Point2d(*jump);
  }
  return whole & cv::Rect(static_cast<int>(box.x), static_cast<int>(box.y), static_cast<int>(box.width),
                          static_cast<int>(box.height));
}

void Tracker::Impl::clear_picture(double needle_margin) {
  Vector<Polygon> pipettes;
  if (result.needle.ok) {
    pipettes.push_back(needle_polygon(result.needle, picture.grey.size(), needle_margin, 1.5));
  }
  if (holder.found()) {
    pipettes.push_back(holder.polygon(picture, cell.outer()));
  }
  picture.cover(pipettes);

  Vector<Contour> membranes;
  for (const FollowedMembrane* m : {&cell.outer(), &cell.inner()}) {
    if (m->known) {
      membranes.push_back(m->contour());
    }
  }
  const double share = config.method == Method::paper ? kLargeGradient : 0.25;
  const double strong =
      std::max(5 * picture.gradient_noise, share * std::max(cell.outer().level, cell.inner().level));
  result.impurities = picture.cover_impurities(membranes, strong, 0.45 * median_of(cell.outermost().r));
}

void Tracker::Impl::compare_holder_with_cell() {
  if (!(cell.outer().known ? result.outer : result.inner).ok) {
    return;
  }
  const bool held = holder.holds();
  holder.compare_with_cell(cell.is_held(picture), result.holder);
  if (held != holder.holds()) {
    needle.forget_landmark();
  }
}

bool Tracker::Impl::start() {
  if (!cell.start(picture, events.touch(), first_picture, result)) {
    return false;
  }
  clear_picture(kNeedleMargin_px);
  return true;
}

// From where the needle meets the cell, or would; without one, from where one would come.
void Tracker::Impl::reconstruct_surfaces() {
  Point through = cell.outer().centre, axis(config.needle_from == Side::left ? 1 : -1, 0);
  if (needle.motion().last) {
    axis = needle.motion().axis;
  }
  if (result.needle.ok) {
    through = result.needle.tip;
    axis = result.needle.axis;
  }
  const double bent = dimple_reach(result.wd_px.value_or(0), result.needle.half_width);
  if (cell.outer().known && result.outer.ok) {
    net_fit->fit(result.outer.contour, through, axis, bent, result.outer_net.emplace());
  }
  if (cell.inner().known && result.inner.ok) {
    net_fit->fit(result.inner.contour, through, axis, bent, result.inner_net.emplace());
  }
}

}  // namespace punctum::vision
