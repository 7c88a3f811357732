#include "vision/tracker.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "vision/circle_start.hpp"
#include "vision/contact.hpp"
#include "vision/dimple.hpp"
#include "vision/impurities.hpp"
#include "vision/membrane_edge.hpp"
#include "vision/noise.hpp"
#include "vision/puncture.hpp"
#include "vision/snake.hpp"

namespace punctum::vision {

namespace {

using Seconds = std::chrono::steady_clock;

constexpr int kRestMature = 6;  // frames without touch after which the undeformed outline is relied on
constexpr double kNeedleMargin_px = 2.5;  // what blur spreads beyond the needle's edges
constexpr double kFaceReach_px = 6.5;  // so near the face of the holding pipette an edge is blurred into it

class Stopwatch {
 public:
  double lap_us() {
    const auto now = Seconds::now();
    const double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    return us;
  }

 private:
  Seconds::time_point last_ = Seconds::now();
};

double median_of(std::vector<double> v) {
  if (v.empty()) {
    return 0;
  }
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::numbers::pi)); }

}  // namespace

struct Tracker::Impl {
  // A membrane that is being followed.
  struct Followed {
    bool known = false;
    Point centre;
    std::vector<double> r;     // per angle
    std::vector<double> rest;  // the same without needle, about rest_centre; empty = not known
    Point rest_centre;
    int rest_frames = 0;
    Polarity polarity = Polarity::any;
    double level = 0;  // usual edge along it
    Contour nodes;     // of the snake
    int bad = 0;       // frames in a row
  };

  VisionConfig config;
  int width, height;
  int angles;
  Result result;
  cv::Mat grey, mask, impurity_mask, binary, needle_pixels, cell_pixels, edge;
  GradientField field;
  HoldingPipette holder;
  InjectionPipette needle;
  std::optional<TubeTrace> holder_tube;
  bool holder_given = false;
  int holder_tries = 0;
  std::optional<Circle> seed;
  Puncture puncture;
  Followed outer, inner;
  std::optional<Undeformed> rest;  // undeformed outer membrane, learnt while nothing touches it
  int rest_frames = 0;
  std::optional<Point> rest_holder;  // where the holder was then
  std::array<std::optional<double>, 2> last_contact_s;
  bool was_contact = false;
  std::optional<Point> last_tip;
  Point last_axis{-1, 0};
  double tip_speed = 0;  // px/frame along the axis, smoothed
  int frames = 0;
  int starts = 0;
  double gn = 0;  // noise of the gradient

  Impl(const VisionConfig& c, int w, int h)
      : config(c),
        width(w),
        height(h),
        angles(std::clamp(c.contour_points, 128, 1024)),
        holder(c.holder.value_or(HolderVision{})),
        needle(c.needle_from, c.c_m / c.pixel_m),
        puncture(c.puncture_px) {
    cv::setNumThreads(1);
  }

  [[nodiscard]] double px(double m) const { return m / config.pixel_m; }

  [[nodiscard]] Point from_angle(const Point& centre, int i, double r) const {
    const double t = 2 * std::numbers::pi * i / angles;
    return centre + r * Point(std::cos(t), std::sin(t));
  }
  [[nodiscard]] bool hidden(const Point& p) const {
    const int x = static_cast<int>(p.x + 0.5), y = static_cast<int>(p.y + 0.5);
    return x < 0 || y < 0 || x >= mask.cols || y >= mask.rows || mask.at<std::uint8_t>(y, x) > 0;
  }

  void locate_pipettes(Stopwatch& watch);
  void tip_on_membrane();
  void erase_pipettes(double needle_margin);
  bool start_membranes();
  struct Found {
    EdgePath path;
    Point centre;
    Polarity polarity = Polarity::any;
    EdgePath unsigned_path;  // the same whatever its sign, about its own centre
    Point unsigned_centre;
  };
  [[nodiscard]] std::optional<Found> strongest_closed_edge(const Circle& circle, double saturation);
  struct Second {
    EdgePath path;
    Polarity polarity = Polarity::any;
    double quality = 0;
  };
  [[nodiscard]] Second find_second(const std::vector<double>& r1, const Point& centre, Polarity known_sign,
                                   bool outside);
  [[nodiscard]] bool clear_enough(const Second& s, double other_level) const;
  bool start_pair(const Found& main);
  void start_inner();
  void start_by_snake(const Circle& circle);
  EdgePath search(const Point& centre, double lo, double hi, double expected, Polarity polarity,
                  double saturation);
  void follow(Followed& m, Membrane& out, const Followed* inside_of, const Followed* outside_of);
  void behind_holder(EdgeBand& band, const std::vector<double>& expected) const;
  void remove_impurities();
  void measure();
  [[nodiscard]] bool strays(const Followed& m, const std::vector<double>& rested, const EdgePath& path,
                            double needle_angle) const;
  [[nodiscard]] double thin_wall_bias(const Followed& m, const EdgePath& path, const Point& centre) const;
  void keep_rest(const Followed& outer_before, const Followed& inner_before);
  void learn_rest(Followed& m, const Membrane& seen, bool touched);
  void classify_contact();
  void decide_phase();
  void write_verdict();
  const Result& process(const hal::Frame& frame);
};

Tracker::Tracker(const VisionConfig& config, int width, int height)
    : impl_(std::make_unique<Impl>(config, width, height)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::seed_circle(const Circle& circle) { impl_->seed = circle; }
void Tracker::holder_template(const cv::Mat& pattern) {
  impl_->holder.use_template(pattern);
  impl_->holder_given = true;
}
const Result& Tracker::process(const hal::Frame& frame) { return impl_->process(frame); }

// ---- pipettes ----

void Tracker::Impl::locate_pipettes(Stopwatch& watch) {
  if (config.needle) {
    if (!needle.started()) {
      (void)needle.start(field, result.noise);
    }
    result.needle = needle.find(field, result.noise);
    tip_on_membrane();
  }
  result.us.needle = watch.lap_us();
  if (config.holder) {
    // It comes from the border opposite to the needle.
    if (!holder_tube && field.area.width == width && holder_tries++ % 8 == 0) {
      std::vector<Side> sides;
      if (config.needle && needle.started()) {
        sides = {needle.side() == Side::right ? Side::left : Side::right};
      } else if (config.needle_from != Side::automatic) {
        sides = {config.needle_from == Side::right ? Side::left : Side::right};
      } else {
        sides = {Side::left, Side::right};
      }
      for (const Side s : sides) {
        const auto t =
            trace_wide_tube(field, s, 20, std::min(0.7 * height, 2.2 * px(config.R_max_m)), result.noise);
        const auto worth = [](const TubeTrace& x) {
          return x.likeness * x.clarity * std::min(x.length, 60.0);
        };
        if (t && t->likeness > 0.5 && t->length > 10 && std::abs(t->axis.y) < 0.25 &&
            (!holder_tube || worth(*t) > worth(*holder_tube))) {
          holder_tube = t;
        }
      }
    }
    if (!holder.has_template()) {
      result.holder.why = holder_tube ? holder.cut_template(grey, *holder_tube, result.noise)
                                      : "no wide tube enters through the border";
    }
    if (holder.has_template()) {
      result.holder = holder.find(grey);
    }
  }
  result.us.holder = watch.lap_us();
}

// While the needle pushes, the membrane's outer face lies on its end face and blurs into the walls' ends;
// across the lumen's mouth it is seen by itself.
void Tracker::Impl::tip_on_membrane() {
  NeedleFix& n = result.needle;
  if (!n.ok || !was_contact || puncture.punctured() || !outer.known) {
    return;
  }
  constexpr double kStep = 0.25, kBehind = 2.0, kAhead = 3.5;
  std::vector<double> e;
  for (double s = -kBehind; s <= kAhead; s += kStep) {
    double sum = 0;
    for (const double u : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
      const double g = field.gradient(n.at(-s, u * n.half_width)).dot(n.axis) / 5;
      sum += outer.polarity == Polarity::any            ? std::abs(g)
             : outer.polarity == Polarity::brighter_out ? -g
                                                        : g;
    }
    e.push_back(sum);
  }
  const auto top = std::max_element(e.begin() + 1, e.end() - 1);
  const std::size_t i = static_cast<std::size_t>(top - e.begin());
  if (*top < 0.35 * outer.level || *top < e[i - 1] || *top < e[i + 1]) {
    return;
  }
  const double curve = e[i - 1] - 2 * *top + e[i + 1];
  const double offset = curve < -1e-12 ? std::clamp(0.5 * (e[i - 1] - e[i + 1]) / curve, -0.5, 0.5) : 0;
  n.tip += (-kBehind + (static_cast<double>(i) + offset) * kStep) * n.axis;
}

void Tracker::Impl::erase_pipettes(double needle_margin) {
  mask.create(grey.size(), CV_8U);
  mask.setTo(0);
  std::vector<Polygon> polygons;
  if (result.needle.ok) {
    polygons.push_back(needle_polygon(result.needle, grey.size(), needle_margin, 1.5));
  }
  if (holder_tube && config.holder) {
    TubeTrace t = *holder_tube;
    Point mouth = t.end();
    if (result.holder.ok && !holder_given) {
      mouth = result.holder.mouth;
    }
    polygons.push_back(holder_polygon(t, mouth, grey.size(), 2, -1));
  }
  draw_mask(mask, polygons);
}

void Tracker::Impl::remove_impurities() {
  const double threshold = std::max(5 * gn, 0.25 * std::max(outer.level, inner.level));
  cv::compare(field.sobel, threshold, binary, cv::CMP_GT);
  cv::Mat open = binary.clone();
  open.setTo(0, mask(field.area));
  std::vector<Contour> keep;
  for (const Followed* m : {&outer, &inner}) {
    if (m->known) {
      Contour c = from_polar(m->centre, m->r);
      for (Point& p : c) {
        p -= Point(field.area.x, field.area.y);
      }
      keep.push_back(std::move(c));
    }
  }
  result.impurities = 0;
  if (!keep.empty()) {
    const double R = outer.known ? median_of(outer.r) : median_of(inner.r);
    const auto found = find_impurities(open, keep, 0.45 * R, 6, 4, impurity_mask);
    result.impurities = static_cast<int>(found.size());
    cv::Mat grown;
    cv::dilate(impurity_mask, grown, cv::Mat::ones(3, 3, CV_8U));
    mask(field.area).setTo(255, grown);
    binary.setTo(0, grown);
  }
  edge = field.sobel.clone();
  erase(edge, mask, field.area.tl());
}

// A membrane pressed against the holding pipette: behind its mouth's face nothing of it can be, and along the
// face, whose own dark line hides it, nothing is seen of it.
void Tracker::Impl::behind_holder(EdgeBand& band, const std::vector<double>& expected) const {
  if (!holder_tube || !config.holder) {
    return;
  }
  const Point mouth = result.holder.ok && !holder_given ? result.holder.mouth : holder_tube->end();
  const Point& a = holder_tube->axis;
  const double face =
      (mouth - band.centre).dot(a);  // < 0: the face is behind the centre, seen along the tube
  if (face >= -2) {
    return;
  }
  const std::size_t n = band.middle.size();
  band.hidden.resize(n, 0);
  if (band.upper.empty()) {
    band.upper.assign(n, 1e9);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
    const Point d(std::cos(t), std::sin(t));
    if (d.dot(a) > -0.2) {
      continue;
    }
    const double r = face / d.dot(a);
    const double u = a.cross(band.centre + r * d - mouth);
    if (std::abs(u) > holder_tube->end_half_width + 2) {
      continue;
    }
    band.upper[i] = std::min(band.upper[i], r);
    if (expected[i] > r - kFaceReach_px) {
      band.hidden[i] = 1;
    }
  }
}

// ---- membranes ----

EdgePath Tracker::Impl::search(const Point& centre, double lo, double hi, double expected, Polarity polarity,
                               double saturation) {
  EdgeBand band;
  band.centre = centre;
  band.step = std::max(0.5, (hi - lo) / 160);
  band.half_width = (hi - lo) / 2;
  band.middle.assign(static_cast<std::size_t>(angles), (lo + hi) / 2);
  band.slope = 1.5;
  band.stiffness = 0.5;
  band.visible = [this](const Point& p) { return hidden(p) ? 0.0 : 1.0; };
  behind_holder(band, std::vector<double>(band.middle.size(), 1.08 * expected));
  return closed_path(field, band, polarity, 3 * gn, saturation);
}

// The strongest closed edge round a circle's centre, whatever it is; its centroid becomes the next centre.
std::optional<Tracker::Impl::Found> Tracker::Impl::strongest_closed_edge(const Circle& circle,
                                                                         double saturation) {
  // Cells are not round: the radius seen from the centre varies more than the radius of the circle.
  const double lo = seed ? 0.75 * circle.r : 0.6 * px(config.R_min_m);
  const double hi = seed ? 1.25 * circle.r : 1.3 * px(config.R_max_m);
  const auto settle = [&](Point centre, Polarity polarity, double level, int rounds) {
    Found f;
    f.polarity = polarity;
    for (int i = 0; i < rounds; ++i) {
      f.path = search(centre, lo, hi, circle.r, polarity, level);
      f.centre = centre;
      if (f.path.r.empty()) {
        break;
      }
      centre = centroid(from_polar(centre, f.path.r));
      if (cv::norm(centre - f.centre) < 0.5) {
        break;
      }
    }
    return f;
  };
  Found best = settle(circle.centre, Polarity::any, saturation, 6);
  if (best.path.r.empty()) {
    return std::nullopt;
  }
  // A picture in which the edge has one sign all round (bright field) is followed by that sign: it tells the
  // two faces of a membrane apart. Where the sign changes round the cell, some arcs of a signed path are
  // weak.
  const auto weak = [](const EdgePath& p) {
    int n = 0;
    for (float e : p.strength) {
      n += static_cast<double>(e) < 0.5 * p.saturation;
    }
    return (n - (1 - p.visible) * static_cast<double>(p.strength.size())) /
           static_cast<double>(p.strength.size());
  };
  Found one_sign;
  for (const Polarity q : {Polarity::brighter_out, Polarity::darker_out}) {
    Found f = settle(best.centre, q, best.path.saturation, 2);
    if (!f.path.r.empty() && f.path.mean_strength > 0.93 * best.path.mean_strength &&
        weak(f.path) < weak(best.path) + 0.015 &&
        (one_sign.path.r.empty() || f.path.mean_strength > one_sign.path.mean_strength)) {
      one_sign = std::move(f);
    }
  }
  best.unsigned_path = best.path;
  best.unsigned_centre = best.centre;
  if (!one_sign.path.r.empty()) {
    one_sign.unsigned_path = std::move(best.unsigned_path);
    one_sign.unsigned_centre = best.unsigned_centre;
    best = std::move(one_sign);
  }
  if (best.path.visible < 0.45 || best.path.support < 0.6 || best.path.level < 1.8 * best.path.background ||
      best.path.level < 4 * gn) {
    return std::nullopt;
  }
  return best;
}

// A second closed edge inside or outside one that is known (r1 round centre), ordered, with a gap.
Tracker::Impl::Second Tracker::Impl::find_second(const std::vector<double>& r1, const Point& centre,
                                                 Polarity known_sign, bool outside) {
  const double r_max = px(config.R_max_m), mean = median_of(r1);

  Second best;
  for (const Polarity q : {Polarity::brighter_out, Polarity::darker_out, Polarity::any}) {
    // Two edges of known sign may lie close together; a line whose sign is not known has two flanks.
    const bool known = q != Polarity::any && known_sign != Polarity::any;
    const double gap =
        known ? std::max(2.5, 0.02 * mean) : std::max({3.5, 0.035 * mean, 1.2 * px(config.h_m)});
    const double from = outside ? gap : -0.62 * mean,
                 to = outside ? std::min(0.6 * mean, 1.3 * r_max - mean) : -gap;
    if (to - from < 4) {
      continue;
    }
    EdgeBand band;
    band.centre = centre;
    band.half_width = (to - from) / 2;
    band.step = std::max(0.5, (to - from) / 120);
    band.middle = r1;
    behind_holder(band, outside ? std::vector<double>(r1.size(), mean + gap) : r1);
    for (double& r : band.middle) {
      r += (from + to) / 2;
    }
    band.slope = 1.0;
    band.stiffness = 0.8;
    band.visible = [this](const Point& p) { return hidden(p) ? 0.0 : 1.0; };
    EdgePath p = closed_path(field, band, q, 3 * gn, 0);
    if (p.r.empty() || p.visible < 0.4) {
      continue;
    }
    // Hugging the limit: the flank of the first edge, no second one.
    std::vector<double> offsets;
    for (std::size_t i = 0; i < p.r.size(); ++i) {
      offsets.push_back(std::abs(p.r[i] - r1[i]));
    }
    if (median_of(offsets) < gap + 1.0) {
      continue;
    }
    const double handicap = q == known_sign && q != Polarity::any ? 1.15 : q == Polarity::any ? 0.8 : 1.0;
    const double quality =
        handicap * p.level * p.support * std::min(1.0, p.visible / 0.8) / std::max({p.background, gn, 0.02});
    if (quality > best.quality) {
      best = {std::move(p), q, quality};
    }
  }
  return best;
}

bool Tracker::Impl::clear_enough(const Second& s, double other_level) const {
  constexpr double kNeeded = 4;  // times the median edge of its band
  if (s.quality < kNeeded || s.path.level < 4 * gn || s.path.level < 0.12 * other_level) {
    return false;
  }
  // A cell is nearly an oval: what strays further from one has followed something else.
  const std::vector<double>& r = s.path.r;
  double c[5] = {};
  const double n = static_cast<double>(r.size());
  const auto f = [n](std::size_t i, int k) {
    const double t = 2 * std::numbers::pi * static_cast<double>(i) / n;
    return k == 0   ? 1.0
           : k == 1 ? std::cos(t)
           : k == 2 ? std::sin(t)
           : k == 3 ? std::cos(2 * t)
                    : std::sin(2 * t);
  };
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (int k = 0; k < 5; ++k) {
      c[k] += r[i] * f(i, k) * (k == 0 ? 1 : 2) / n;
    }
  }
  double ss = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    double e = r[i];
    for (int k = 0; k < 5; ++k) {
      e -= c[k] * f(i, k);
    }
    ss += e * e / n;
  }
  return std::sqrt(ss) < 0.055 * c[0];
}

bool Tracker::Impl::start_pair(const Found& main) {
  const double r_min = px(config.R_min_m);
  const Contour contour = from_polar(main.centre, main.path.r);
  const Point centre = centroid(contour);
  const std::vector<double> r1 = polar_radii(contour, centre, angles);
  if (r1.empty()) {
    result.outer.why = "closed edge not star-shaped";
    return false;
  }
  const double mean = median_of(r1);
  Second in = find_second(r1, centre, main.polarity, false),
         out = find_second(r1, centre, main.polarity, true);
  const auto good = [&](const Second& x) { return clear_enough(x, main.path.level); };
  const auto set = [&](Followed& m, const std::vector<double>& r, Polarity q, double level) {
    m = {};
    m.known = true;
    m.centre = centre;
    m.r = r;
    m.polarity = q;
    m.level = level;
  };
  outer = {};
  inner = {};
  const bool only_inner_possible = mean < 0.9 * r_min;  // too small for the outer one
  if (!config.inner) {
    // The outermost edge that is clear.
    if (good(out) && out.path.level > 0.5 * main.path.level) {
      set(outer, out.path.r, out.polarity, out.path.level);
    } else {
      set(outer, r1, main.polarity, main.path.level);
    }
    return true;
  }
  // Two flanks of one dark line belong to one membrane.
  const auto flank = [&](const Second& x) {
    return main.polarity != Polarity::any && x.polarity != Polarity::any && x.polarity != main.polarity &&
           std::abs(median_of(x.path.r) - mean) < 0.13 * mean;
  };
  const bool out_is_flank = good(out) && flank(out), in_is_flank = good(in) && flank(in);
  const std::vector<double>& face = out_is_flank ? out.path.r : r1;  // outer face of what main belongs to
  const Polarity face_sign = out_is_flank ? out.polarity : main.polarity;
  const double face_level = out_is_flank ? out.path.level : main.path.level;
  if (good(in) && !in_is_flank) {
    set(outer, face, face_sign, face_level);
    set(inner, in.path.r, in.polarity, in.path.level);
    if (good(out) && !out_is_flank && out.quality > in.quality) {
      set(outer, out.path.r, out.polarity, out.path.level);
      set(inner, r1, main.polarity, main.path.level);
    }
    return true;
  }
  if (good(out) && !out_is_flank) {
    set(outer, out.path.r, out.polarity, out.path.level);
    set(inner, r1, main.polarity, main.path.level);
    return true;
  }
  // Only one: is it the zona, with a brighter space inside it and the ooplasm too faint, or the ooplasm
  // itself?
  bool is_outer = in.quality > out.quality;
  if (out_is_flank || in_is_flank) {
    const std::vector<double>& inside_face = out_is_flank ? r1 : in.path.r;
    double near = 0, deep = 0, outside = 0, wall = 0;
    for (int i = 0; i < angles; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const double middle = 0.5 * (face[k] + inside_face[k]);
      near += field.grey(from_angle(centre, i, inside_face[k] - 3)) / angles;
      deep += field.grey(from_angle(centre, i, inside_face[k] - 14)) / angles;
      wall += field.grey(from_angle(centre, i, middle)) / angles;
      outside += field.grey(from_angle(centre, i, face[k] + 5)) / angles;
    }
    is_outer = near - deep > 0.25 * std::abs(outside - wall);
  }
  if (is_outer && !only_inner_possible) {
    set(outer, face, face_sign, face_level);
  } else {
    // An edge of oolemma in phase-like contrast has flanks of both signs.
    set(inner, main.unsigned_path.r, Polarity::any, main.unsigned_path.level);
    inner.centre = main.unsigned_centre;
  }
  return true;
}

// The inner membrane alone, inside an outer one that is followed.
void Tracker::Impl::start_inner() {
  const Second in = find_second(outer.r, outer.centre, outer.polarity, false);
  if (!clear_enough(in, outer.level)) {
    return;
  }
  const Followed before = std::move(inner);
  inner = {};
  inner.known = true;
  inner.centre = outer.centre;
  inner.r = in.path.r;
  inner.polarity = in.polarity;
  inner.level = in.path.level;
  inner.rest = before.rest;
  inner.rest_centre = before.rest_centre;
  inner.rest_frames = before.rest_frames;
}

void Tracker::Impl::start_by_snake(const Circle& circle) {
  outer = {};
  outer.known = true;
  outer.centre = circle.centre;
  outer.r.assign(static_cast<std::size_t>(angles), circle.r);
  outer.nodes = circle_contour(circle, config.snake.nodes);
  inner = {};
  if (config.inner) {
    Circle c = circle;
    c.r *= 0.86;
    inner = outer;
    inner.r.assign(static_cast<std::size_t>(angles), c.r);
    inner.nodes = circle_contour(c, config.snake.nodes);
  }
}

bool Tracker::Impl::start_membranes() {
  ++starts;
  const double r_min = px(config.R_min_m), r_max = px(config.R_max_m);
  std::vector<Circle> circles;
  if (seed) {
    circles.push_back(*seed);
  } else {
    // The threshold follows the noise, and in pictures rich in texture the texture.
    cv::Mat sample;
    cv::resize(field.sobel, sample, cv::Size(), 0.25, 0.25, cv::INTER_NEAREST);
    std::vector<float> v(sample.begin<float>(), sample.end<float>());
    double texture = 0;
    if (!v.empty()) {
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(7 * v.size() / 10), v.end());
      texture = static_cast<double>(v[7 * v.size() / 10]);
    }
    for (const CircleCandidate& c : find_circles(field, mask, std::max(4 * gn, texture), r_min, r_max, 6)) {
      if (c.score >= 0.35) {
        circles.push_back(c.circle);
      }
    }
    if (circles.empty()) {
      result.outer.why = "no circle found between " + std::to_string(std::lround(r_min)) + " and " +
                         std::to_string(std::lround(r_max)) + " px radius";
      return false;
    }
  }
  if (!config.refine) {
    start_by_snake(circles.front());
    return true;
  }
  // A long cell gives a circle at either end: the middle of them is worth a try as well.
  if (circles.size() > 2) {
    Circle mean = circles[0];
    mean.centre = (circles[0].centre + circles[1].centre + circles[2].centre) / 3;
    circles.push_back(mean);
  }
  std::optional<Found> best;
  double saturation = 0;
  for (const Circle& c : circles) {
    auto f = strongest_closed_edge(c, saturation);
    if (f && saturation <= 0) {
      saturation = f->path.saturation;  // one measure for all
    }
    if (f && (!best || f->path.mean_strength > best->path.mean_strength)) {
      best = std::move(f);
    }
  }
  if (!best) {
    result.outer.why = "no closed edge stands out";
    return false;
  }
  return start_pair(*best);
}

void Tracker::Impl::follow(Followed& m, Membrane& out, const Followed* inside_of,
                           const Followed* outside_of) {
  out = {};
  if (!m.known) {
    out.why = "not found";
    return;
  }
  // 1. The greedy snake from the last contour: structure, and the motion of the whole.
  const Contour last = from_polar(m.centre, m.r);
  Contour nodes = config.refine || m.nodes.size() < 3 ? spline_through(last, config.snake.nodes) : m.nodes;
  const Point offset(field.area.x, field.area.y);
  Contour local = nodes;
  for (Point& p : local) {
    p -= offset;
  }
  SnakeResult snake = evolve(edge, local, config.snake, 4 * gn);
  for (Point& p : snake.nodes) {
    p += offset;
  }
  out.nodes = snake.nodes;
  out.snake_iterations = snake.iterations;
  m.nodes = snake.nodes;
  if (!config.refine) {
    out.contour = spline_through(snake.nodes, angles);
    const std::vector<double> r = polar_radii(out.contour, centroid(out.contour), angles);
    const double area = signed_area(out.contour), before = signed_area(last);
    double strength = 0;
    for (const Point& p : snake.nodes) {
      strength += cv::norm(field.gradient(p)) / static_cast<double>(snake.nodes.size());
    }
    if (r.empty() || area < 0.6 * before || area > 1.6 * before || strength < 3 * gn) {
      out.why = "snake lost the edge";
      m.known = false;
      return;
    }
    m.centre = centroid(out.contour);
    m.r = r;
    out.support = 1;
    out.visible = 1;
    out.ok = true;
    return;
  }
  std::vector<double> dx, dy;
  for (std::size_t i = 0; i < nodes.size() && i < snake.nodes.size(); ++i) {
    dx.push_back(snake.nodes[i].x - nodes[i].x);
    dy.push_back(snake.nodes[i].y - nodes[i].y);
  }
  Point shift(std::clamp(median_of(dx), -2.0, 2.0), std::clamp(median_of(dy), -2.0, 2.0));
  if (cv::norm(shift) < 1.2) {  // the snake stands on whole pixels: less is no motion
    shift = {};
  }

  // 2. The sub-pixel edge in a band round it; two hypotheses where the needle is: pushed in, or free.
  const double R = median_of(m.r);
  double usual_gap = 0;  // between the two membranes
  if (outer.known && inner.known) {
    usual_gap = std::max(
        0.0, std::sqrt(std::abs(signed_area(from_polar(outer.centre, outer.r))) / std::numbers::pi) -
                 std::sqrt(std::abs(signed_area(from_polar(inner.centre, inner.r))) / std::numbers::pi));
  }
  EdgeBand band;
  band.centre = m.centre + shift;
  const std::vector<double> rested =
      m.rest.empty() ? m.rest : polar_radii(from_polar(m.rest_centre, m.rest), band.centre, angles);
  band.middle = m.r;
  band.half_width = std::clamp(0.11 * R, 6.0, 14.0);
  band.slope = 1.0;
  band.visible = [this](const Point& p) { return hidden(p) ? 0.0 : 1.0; };
  if (inside_of && inside_of->known) {
    band.upper = polar_radii(from_polar(inside_of->centre, inside_of->r), band.centre, angles);
    for (double& r : band.upper) {
      r -= std::max(2.0, 0.5 * usual_gap);
    }
  }
  if (outside_of && outside_of->known) {
    band.lower = polar_radii(from_polar(outside_of->centre, outside_of->r), band.centre, angles);
    for (int i = 0; i < angles && !band.lower.empty(); ++i) {
      // It was there one frame ago; near the needle it may have moved on.
      const double t = 2 * std::numbers::pi * i / angles;
      const bool near = last_tip && angle_between(t, std::atan2(last_tip->y - band.centre.y,
                                                                last_tip->x - band.centre.x)) < 0.5;
      band.lower[static_cast<std::size_t>(i)] += near ? -4.0 : std::max(2.5, 0.35 * usual_gap);
    }
  }
  EdgePath path;
  bool is_free = false;
  const double saturation = 0.7 * m.level;
  const bool is_outer = &m == &outer;
  std::vector<double> expected = m.r;
  if (is_outer && rest && rest->round) {  // what once slipped inwards along the holder comes back
    const std::vector<double> free = polar_radii(rest->shape, band.centre, angles);
    for (std::size_t i = 0; i < free.size(); ++i) {
      expected[i] = std::max(expected[i], free[i]);
    }
  }
  behind_holder(band, expected);
  // Nothing presses it in further than the tip has come.
  double tip_depth = 0;
  if (result.needle.ok && rested.size() == m.r.size()) {
    const Point d = result.needle.tip - band.centre;
    const int i =
        static_cast<int>(std::lround((std::atan2(d.y, d.x) / (2 * std::numbers::pi) + 1) * angles)) % angles;
    if (d.dot(result.needle.axis) < 0) {
      tip_depth = std::max(0.0, rested[static_cast<std::size_t>(i)] - cv::norm(d));
    }
    if (band.lower.empty()) {
      band.lower.assign(static_cast<std::size_t>(angles), 0.0);
    }
    for (std::size_t k = 0; k < band.lower.size(); ++k) {
      band.lower[k] = std::max(band.lower[k], rested[k] - tip_depth - 6);
    }
  }
  std::optional<std::pair<int, double>> anchor;
  double needle_angle = 0;
  bool tip_inside = false;
  if (result.needle.ok) {
    const Point d = result.needle.tip - band.centre;
    needle_angle = std::atan2(-result.needle.axis.y, -result.needle.axis.x);
    // Direction of the entry, not of the axis: a needle off the middle enters at another angle.
    if (const auto e = entry_point(last, result.needle.tip, result.needle.axis)) {
      const Point f = *e - band.centre;
      needle_angle = std::atan2(f.y, f.x);
    }
    const double ta = std::atan2(d.y, d.x);
    const int index = static_cast<int>(std::lround(ta / (2 * std::numbers::pi) * angles) + angles) % angles;
    anchor = std::make_pair(index, cv::norm(d));
    const std::vector<double>& free = rested.empty() ? m.r : m.rest;
    tip_inside = cv::norm(d) < free[static_cast<std::size_t>(index)] - 1.0;
  }
  path = closed_path(field, band, m.polarity, 3 * gn, saturation);
  if (result.needle.ok && anchor && tip_inside && !rested.empty()) {
    // Beside the needle: how well an edge is seen there, and how far two contours are apart.
    const auto beside = [&](const auto& f) {
      double sum = 0;
      int n = 0;
      for (int i = 0; i < angles; ++i) {
        const double a = angle_between(2 * std::numbers::pi * i / angles, needle_angle);
        if (a < 0.24 && !hidden(from_angle(band.centre, i, rested[static_cast<std::size_t>(i)]))) {
          sum += f(static_cast<std::size_t>(i));
          ++n;
        }
      }
      return n > 0 ? sum / n : 0.0;
    };
    const auto seen = [&](const EdgePath& p) {
      return beside([&](std::size_t i) {
        return std::clamp(static_cast<double>(p.strength[i]) / saturation, 0.0, 1.0);
      });
    };
    // Free: the membrane is back where it was without needle.
    EdgeBand released = band;
    for (int i = 0; i < angles; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const double a = angle_between(2 * std::numbers::pi * i / angles, needle_angle);
      const double w = std::clamp((1.1 - a) / 0.3, 0.0, 1.0);
      released.middle[k] += w * (rested[k] - released.middle[k]);
    }
    released.half_width = std::min(band.half_width, 7.0);
    EdgePath p_free = closed_path(field, released, m.polarity, 3 * gn, saturation);
    // Pushed in: it lies on the tip, and the dimple goes on with the needle.
    EdgeBand pushed = band;
    const std::size_t k = static_cast<std::size_t>(anchor->first);
    if (is_outer) {
      const double move = anchor->second - pushed.middle[k];
      for (int i = 0; i < angles; ++i) {
        const double a =
            angle_between(2 * std::numbers::pi * i / angles, 2 * std::numbers::pi * anchor->first / angles);
        const double u = a * R / std::max(4.0, 2.0 * result.needle.half_width);
        pushed.middle[static_cast<std::size_t>(i)] += move / (1 + u * u);
      }
      pushed.anchor = anchor;
      pushed.slope = 3;
      pushed.stiffness = 0.1;
    }
    EdgePath p_pushed = is_outer ? closed_path(field, pushed, m.polarity, 3 * gn, saturation) : path;
    // Where an edge lies further out than the dimple and is as well seen, the dimple is another membrane's.
    const double apart = beside([&](std::size_t i) { return std::max(0.0, p_free.r[i] - p_pushed.r[i]); });
    is_free = puncture.punctured() && is_outer ? seen(p_free) > 0.4 : apart > 1.5 && seen(p_free) > 0.7;
    path = is_free ? std::move(p_free) : std::move(p_pushed);
  }
  if (path.r.empty()) {
    out.why = "no band to search";
    ++m.bad;
    return;
  }
  out.contour = from_polar(band.centre, path.r);
  if (is_outer) {
    if (const double bias = thin_wall_bias(m, path, band.centre); bias > 0) {
      std::vector<double> moved_in = path.r;
      for (double& r : moved_in) {
        r -= bias;
      }
      out.contour = from_polar(band.centre, moved_in);
    }
  }
  out.support = path.support;
  out.visible = path.visible;
  out.residual_px = path.residual;
  // 3. Is it still the same edge?
  std::vector<double> jump;
  for (int i = 0; i < angles; ++i) {
    if (is_free && angle_between(2 * std::numbers::pi * i / angles, needle_angle) < 1.2) {
      continue;
    }
    jump.push_back(std::abs(path.r[static_cast<std::size_t>(i)] - m.r[static_cast<std::size_t>(i)]));
  }
  const double moved = median_of(jump) + cv::norm(shift);
  if (path.visible < 0.35) {
    out.why = "mostly hidden";
  } else if (path.support < 0.55) {
    out.why = "edge seen over " + std::to_string(std::lround(100 * path.support)) + " % only";
  } else if (path.level < 0.35 * m.level) {
    out.why = "edge has faded";
  } else if (moved > 0.6 * band.half_width) {
    out.why = "contour jumped";
  } else if (strays(m, rested, path, needle_angle)) {
    out.why = "contour left the cell's outline";
  } else {
    out.ok = true;
  }
  if (!out.ok) {
    ++m.bad;
    return;
  }
  m.bad = 0;
  m.level += 0.1 * (path.level - m.level);
  const Point centre = centroid(out.contour);
  const std::vector<double> r = polar_radii(out.contour, centre, angles);
  if (r.empty()) {
    out.ok = false;
    out.why = "contour crosses itself";
    ++m.bad;
    return;
  }
  // The centre stays where it is as long as it is inside by far: resampling costs accuracy.
  const Point old = band.centre;
  if (cv::norm(centre - old) > 0.06 * R) {
    m.centre = centre;
    m.r = r;
  } else {
    m.centre = old;
    m.r = path.r;
  }
}

// After a new start: what was learnt of the cell without needle still holds if it is the same cell in its
// place.
void Tracker::Impl::keep_rest(const Followed& outer_before, const Followed& inner_before) {
  bool same = false;
  // Learnt over a few frames only, or not needed because nothing touches: better learnt anew.
  const bool needed = was_contact || puncture.punctured() || result.phase != rt::Phase::free;
  if (rest && outer.known && needed && outer_before.rest_frames >= kRestMature) {
    const Contour now = from_polar(outer.centre, outer.r);
    std::vector<double> weight(now.size(), 1.0);
    if (result.needle.ok) {
      for (std::size_t i = 0; i < now.size(); ++i) {
        const Point d = now[i] - outer.centre;
        weight[i] = d.dot(result.needle.axis) < 0.3 * cv::norm(d) * -1 ? 0 : 1;
      }
    }
    const auto fitted = fit_circle(now, weight);
    same = fitted && cv::norm(fitted->centre - rest->circle.centre) < 0.08 * rest->circle.r &&
           std::abs(fitted->r - rest->circle.r) < 0.06 * rest->circle.r;
  }
  if (!same) {
    rest.reset();
    rest_frames = 0;
    return;
  }
  outer.rest = outer_before.rest;
  outer.rest_centre = outer_before.rest_centre;
  outer.rest_frames = outer_before.rest_frames;
  inner.rest = inner_before.rest;
  inner.rest_centre = inner_before.rest_centre;
  inner.rest_frames = inner_before.rest_frames;
}

// While the needle is away the contours are learnt as what they are without it.
void Tracker::Impl::learn_rest(Followed& m, const Membrane& seen, bool touched) {
  if (!m.known || !seen.ok) {
    return;
  }
  if (touched) {
    if (m.rest.empty() && &m == &outer && rest) {  // never seen without: what its undeformed part tells
      m.rest = polar_radii(rest->shape, m.centre, angles);
      m.rest_centre = m.centre;
    }
    return;
  }
  if (m.rest.empty() || cv::norm(m.rest_centre - m.centre) > 0.1 * median_of(m.r)) {
    m.rest = m.r;
    m.rest_centre = m.centre;
    m.rest_frames = 1;
    return;
  }
  const std::vector<double> now = polar_radii(from_polar(m.centre, m.r), m.rest_centre, angles);
  const double g = 1.0 / std::min(++m.rest_frames, 12);
  for (std::size_t i = 0; i < now.size(); ++i) {
    m.rest[i] += g * (now[i] - m.rest[i]);
  }
}

// Blur moves the two faces of a wall apart when it is thinner than the blur: the outer one then lies too far
// out by half of what the wall looks thicker than it is. 0 where the wall is seen as thick as it is.
double Tracker::Impl::thin_wall_bias(const Followed& m, const EdgePath& path, const Point& centre) const {
  const double thickness = px(config.h_m);
  constexpr double kPsf_px = 1.2;  // of a lens in focus
  const double sigma = std::sqrt(field.sigma * field.sigma + kPsf_px * kPsf_px + 0.5);
  if (m.polarity == Polarity::any || !(thickness > 0) || thickness > 2 * sigma) {
    return 0;
  }
  const double sign = m.polarity == Polarity::brighter_out ? 1 : -1;
  std::vector<double> apart;
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!path.seen[k]) {
      continue;
    }
    const Point d = from_angle(Point(0, 0), i, 1);
    double top = 0.4 * static_cast<double>(path.strength[k]), at = 0;
    for (double s = 1; s < 3 * sigma; s += 0.25) {
      const double e = -sign * field.gradient(centre + (path.r[k] - s) * d).dot(d);
      if (e > top) {
        top = e;
        at = s;
      }
    }
    if (at > 0) {
      apart.push_back(at);
    }
  }
  if (static_cast<int>(apart.size()) < angles / 2) {
    return 0;
  }
  const double seen = median_of(apart);
  return seen < 2.6 * sigma ? std::max(0.0, 0.5 * (seen - thickness)) : 0;
}

// Away from the needle a membrane keeps its outline: an arc that has left it follows something else.
bool Tracker::Impl::strays(const Followed& m, const std::vector<double>& rested, const EdgePath& path,
                           double needle_angle) const {
  if (rested.size() != path.r.size() || !result.needle.ok || m.rest_frames < kRestMature) {
    return false;
  }
  const double limit = std::max(6.0, 0.1 * median_of(rested));
  int off = 0, n = 0;
  for (int i = 0; i < angles; ++i) {
    if (angle_between(2 * std::numbers::pi * i / angles, needle_angle) > 1.2) {
      ++n;
      off += std::abs(path.r[static_cast<std::size_t>(i)] - rested[static_cast<std::size_t>(i)]) > limit;
    }
  }
  return off > n / 12;
}

// ---- geometry, contact, puncture ----

void Tracker::Impl::measure() {
  const NeedleFix& n = result.needle;
  if (inner.known && result.inner.ok) {
    result.inner_radius_px = std::sqrt(std::abs(signed_area(result.inner.contour)) / std::numbers::pi);
  }
  if (!outer.known || !result.outer.ok) {
    return;
  }
  const Contour& c = result.outer.contour;
  const Point centre = centroid(c);
  std::vector<double> weight(c.size(), 1.0);
  Point entry_direction;
  bool near = false;
  if (n.ok) {
    if (const auto e = entry_point(rest ? rest->shape : c, n.tip, n.axis)) {
      entry_direction = *e - centre;
      near = (*e - n.tip).dot(n.axis) < 8;  // touching, about to, or inside
    }
  }
  for (std::size_t i = 0; i < c.size(); ++i) {
    const Point d = c[i] - centre;
    if (hidden(c[i])) {
      weight[i] = 0;
    }
    if (near && std::abs(std::atan2(d.cross(entry_direction), d.dot(entry_direction))) < 0.9) {
      weight[i] = 0;
    }
    if (holder_tube && result.holder.ok) {  // pressed or sucked in
      const Point h = result.holder.mouth - centre;
      if (std::abs(std::atan2(d.cross(h), d.dot(h))) < 0.6) {
        weight[i] = 0;
      }
    }
  }
  const auto now = fit_undeformed(c, weight);
  if (!now) {
    return;
  }
  // While nothing touches it the undeformed membrane is learnt; then it is remembered and goes with the
  // holder.
  const bool touched = near || was_contact || puncture.punctured();

  if (!rest || (!touched && now->round)) {
    if (rest && rest->round && now->round &&
        cv::norm(now->circle.centre - rest->circle.centre) < 0.05 * rest->circle.r) {
      const double g = 1.0 / std::min(++rest_frames, 20);
      Circle k = rest->circle;
      k.centre += g * (now->circle.centre - k.centre);
      k.r += g * (now->circle.r - k.r);
      k.rms = now->circle.rms;
      rest->circle = k;
      rest->shape = circle_contour(k, angles);
    } else {
      rest = now;
      rest_frames = 1;
    }
    rest_holder = result.holder.ok ? std::optional<Point>(result.holder.mouth) : std::nullopt;
  } else if (!touched) {
    rest = now;
    rest_holder = result.holder.ok ? std::optional<Point>(result.holder.mouth) : std::nullopt;
  } else if (rest_holder && result.holder.ok) {
    const Point d = result.holder.mouth - *rest_holder;
    if (cv::norm(d) > 1.0) {
      rest->circle.centre += d;
      outer.rest_centre += d;
      inner.rest_centre += d;
      for (Point& p : rest->shape) {
        p += d;
      }
      rest_holder = result.holder.mouth;
    }
  }
  learn_rest(outer, result.outer, touched);
  learn_rest(inner, result.inner, touched);
  result.undeformed = rest->circle;
  if (!n.ok) {
    return;
  }
  result.entry = entry_point(rest->shape, n.tip, n.axis);
  if (!result.entry) {
    return;
  }
  result.gap_px = (*result.entry - n.tip).dot(n.axis);
  const int fitted =
      static_cast<int>(std::count_if(weight.begin(), weight.end(), [](double w) { return w > 0; }));
  result.gap_noise_px = std::hypot(0.1, 3 * result.outer.residual_px / std::sqrt(std::max(fitted, 1)));
}

void Tracker::Impl::classify_contact() {
  const NeedleFix& n = result.needle;
  if (!n.ok || !result.outer.ok) {
    puncture.update({result.exposure_ns, false, false, 0, 0, 0, result.gap_px.value_or(0), n.half_width});
    result.punctured = puncture.punctured();
    was_contact = false;
    return;
  }
  // The paper's test: needle and cell are two classes until they merge.
  const cv::Rect a = field.area;
  needle_pixels.create(binary.size(), CV_8U);
  needle_pixels.setTo(0);
  Polygon needle_local = needle_polygon(n, grey.size(), 1.5, 0.5);
  for (Point& p : needle_local) {
    p -= Point(a.x, a.y);
  }
  draw_mask(needle_pixels, {needle_local});
  cell_pixels.create(binary.size(), CV_8U);
  cell_pixels.setTo(0);
  for (const Point& p : result.outer.contour) {
    if (!hidden(p)) {
      const Point q = p - Point(a.x, a.y);
      cv::circle(cell_pixels,
                 cv::Point(static_cast<int>(std::lround(q.x)), static_cast<int>(std::lround(q.y))), 1,
                 cv::Scalar(255), cv::FILLED);
    }
  }
  result.merged = merge_classes(binary, needle_pixels, cell_pixels, config.dilation_px).merged;

  // Contact points along the needle's edges, near where the contour crosses them.
  const double floor = std::max(3 * gn, 0.3 * outer.level);
  std::array<std::optional<double>, 2> near;
  for (int side = 0; side < 2; ++side) {
    const Point across(-n.axis.y, n.axis.x);
    const double u = (side == 0 ? -1 : 1) * (n.half_width + 2.5);
    if (const auto e = entry_point(result.outer.contour, n.tip + u * across, n.axis)) {
      near[static_cast<std::size_t>(side)] = -(*e - n.tip).dot(n.axis);
    }
  }
  double s_mean = 0;
  int s_count = 0;
  if (near[0] || near[1]) {
    result.points = contact_points(field, n, outer.polarity, floor, 2.5, 0.5 * outer.r.front(), near, 5);
    for (int side = 0; side < 2; ++side) {
      const std::size_t k = static_cast<std::size_t>(side);
      if (!near[k]) {
        result.points.point[k].reset();
      }
      if (result.points.point[k]) {
        s_mean += result.points.behind_tip[k];
        ++s_count;
      } else if (near[k]) {  // not seen: the contour's own crossing
        s_mean += *near[k];
        ++s_count;
      }
    }
  }
  // With the gap known to a fraction of a pixel it decides; the merging confirms, or decides alone.
  if (result.gap_px) {
    const double limit = was_contact ? 1.0 : 0.35;
    result.contact = *result.gap_px < limit && (result.merged || *result.gap_px < -1);
  } else {
    result.contact = result.merged;
  }
  PunctureInput in;
  in.t_ns = result.exposure_ns;
  in.contact = result.contact;
  in.points = s_count > 0 && result.entry.has_value();
  in.gap_px = result.gap_px.value_or(0);
  in.radius_px = n.half_width;
  if (in.points) {
    s_mean /= s_count;
    in.tip_px = -in.gap_px;
    in.membrane_px = in.tip_px - s_mean;
    in.depth_px = in.membrane_px;
  }
  result.punctured = puncture.update(in);
  result.membrane_velocity_px_s = puncture.membrane_velocity_px_s();
  was_contact = result.contact;

  if (!result.gap_px) {
    return;
  }
  if (!result.contact) {
    result.wd_px = 0;
    return;
  }
  const double R = rest ? rest->circle.r : median_of(outer.r);
  // Until the puncture the membrane lies on the tip; afterwards its own contour tells what is left of the
  // dimple.
  result.wd_px =
      result.punctured ? std::max(0.0, in.points ? in.depth_px : 0.0) : std::max(0.0, -*result.gap_px);
  if (*result.wd_px > 0.7 && rest) {
    // About the membrane's own normal: a needle off the middle is not the axis of its dimple.
    Point normal = rest->circle.centre - *result.entry;
    normal *= 1 / std::max(cv::norm(normal), 1e-9);
    std::vector<ProfilePoint> seen;
    for (const ProfilePoint& p :
         depth_profile(result.outer.contour, rest->shape, *result.entry, normal, 0.995 * R)) {
      if (std::abs(p.u) > n.half_width + 2.5) {
        seen.push_back(p);
      }
    }
    result.a_px = half_width(seen, *result.wd_px, n.half_width, R);
  }
}

void Tracker::Impl::decide_phase() {
  const double um = 1e-6 / config.pixel_m;
  if (last_tip && result.needle.ok) {
    tip_speed += 0.4 * ((result.needle.tip - *last_tip).dot(result.needle.axis) - tip_speed);
  }
  last_tip = result.needle.ok ? std::optional<Point>(result.needle.tip) : std::nullopt;
  last_axis = result.needle.axis;
  rt::Phase& p = result.phase;  // still the last frame's
  const double gap = result.gap_px.value_or(std::numeric_limits<double>::infinity());
  if (p == rt::Phase::puncture || p == rt::Phase::withdrawal) {
    if (gap > 10 * um) {
      p = rt::Phase::clear;
    } else if (tip_speed < -0.15) {
      p = rt::Phase::withdrawal;
    }
  } else if (result.punctured) {
    p = rt::Phase::puncture;
  } else if (result.contact && result.wd_px.value_or(0) > 3 * um) {
    p = rt::Phase::indentation;
  } else if (result.contact) {
    p = rt::Phase::contact;
  } else if (p != rt::Phase::clear || gap < 5 * um) {
    p = rt::Phase::free;
  }
}

void Tracker::Impl::write_verdict() {
  std::string v;
  const auto add = [&v](const std::string& s) { v += (v.empty() ? "" : "; ") + s; };
  if (config.holder && !result.holder.ok) {
    add("holder: " + (result.holder.why.empty() ? "not found" : result.holder.why));
  }
  if (config.needle && !result.needle.ok) {
    add("needle: " + (result.needle.why.empty() ? "not found" : result.needle.why));
  }
  if (!result.outer.ok) {
    add("outer: " + (result.outer.why.empty() ? "not found" : result.outer.why));
  }
  if (config.inner && !result.inner.ok) {
    add("inner: " + (result.inner.why.empty() ? "not found" : result.inner.why));
  }
  result.verdict = v.empty() ? "ok" : v;
}

const Result& Tracker::Impl::process(const hal::Frame& frame) {
  Stopwatch total, watch;
  const rt::Phase before = result.phase;
  result = {};
  result.phase = before;
  result.frame = frame.sequence;
  result.exposure_ns = frame.exposure_ns;
  const auto refuse = [&](std::string why) -> const Result& {
    result.verdict = std::move(why);
    result.us.total = total.lap_us();
    return result;
  };
  if (frame.pixels == nullptr || frame.width <= 0 || frame.height <= 0 || frame.stride < frame.width) {
    return refuse("no picture");
  }
  if (frame.width != width || frame.height != height) {
    return refuse("size " + std::to_string(frame.width) + "x" + std::to_string(frame.height) +
                  " instead of " + std::to_string(width) + "x" + std::to_string(height));
  }
  if (width < 32 || height < 32) {
    return refuse("picture too small: at least 32x32 is needed");
  }
  // A copy: the camera may take its buffer back, and OpenCV wants none of our constness.
  cv::Mat(height, width, CV_8U, const_cast<std::uint8_t*>(frame.pixels),
          static_cast<std::size_t>(frame.stride))
      .copyTo(grey);
  cv::Scalar mean, sd;
  cv::meanStdDev(grey, mean, sd);
  if (sd[0] < 0.5) {
    return refuse("no contrast: every pixel is about " + std::to_string(std::lround(mean[0])));
  }
  result.usable = true;
  result.noise = std::max(noise_level(grey), 0.3);

  // The whole picture while something must be found; else the surroundings of cell and needle.
  cv::Rect area(0, 0, width, height);
  const Followed& any = outer.known ? outer : inner;
  const bool restart = outer.bad >= 2 || (!outer.known && inner.bad >= 2) || !any.known;
  const bool needle_lost = config.needle && (!needle.started() || !last_tip);
  if (!restart && !needle_lost) {
    const double reach = 1.15 * *std::max_element(any.r.begin(), any.r.end()) + 30;
    cv::Rect2d box(any.centre.x - reach, any.centre.y - reach, 2 * reach, 2 * reach);
    if (config.needle) {
      const Point behind = *last_tip - 180 * last_axis;
      box |= cv::Rect2d(last_tip->x - 40, last_tip->y - 40, 80, 80);
      box |= cv::Rect2d(behind.x - 24, behind.y - 24, 48, 48) & cv::Rect2d(0, 0, width, height);
    }
    area &= cv::Rect(static_cast<int>(box.x), static_cast<int>(box.y), static_cast<int>(box.width),
                     static_cast<int>(box.height));
  }
  field.compute(grey, area, 1.2);
  gn = field.noise_of_gradient(result.noise);
  result.us.prepare = watch.lap_us();

  locate_pipettes(watch);
  // At the start a needle inside the cell must not split it: what shines beside its walls is covered as well.
  erase_pipettes(restart ? 2.5 + 0.7 * result.needle.half_width : kNeedleMargin_px);
  remove_impurities();
  result.us.erase = watch.lap_us();

  if (restart) {
    const Followed outer_before = std::move(outer), inner_before = std::move(inner);
    outer = {};
    inner = {};
    if (!start_membranes()) {
      result.us.start = watch.lap_us();
      if (result.outer.why.empty()) {
        result.outer.why = "no start";
      }
      puncture.update({frame.exposure_ns, false, false, 0, 0, 0, 0, 0});
      result.punctured = puncture.punctured();
      result.merged = false;
      decide_phase();
      write_verdict();
      result.us.total = total.lap_us();
      return result;
    }
    keep_rest(outer_before, inner_before);
    erase_pipettes(kNeedleMargin_px);
    remove_impurities();
    result.us.start = watch.lap_us();
  }
  follow(outer, result.outer, nullptr, &inner);
  result.us.outer = watch.lap_us();
  if (config.inner && config.refine && outer.known && result.outer.ok && (!inner.known || inner.bad >= 2)) {
    start_inner();
  }
  if (config.inner) {
    follow(inner, result.inner, outer.known && result.outer.ok ? &outer : nullptr, nullptr);
  }
  result.us.inner = watch.lap_us();
  measure();
  result.us.measure = watch.lap_us();
  classify_contact();
  result.us.contact = watch.lap_us();
  if (result.needle.ok && !result.contact && result.gap_px.value_or(99) > 12) {
    needle.learn(field, result.needle, result.noise);
  }
  decide_phase();
  write_verdict();
  ++frames;
  result.us.total = total.lap_us();
  return result;
}

rt::Observation to_observation(const Result& r, const VisionConfig& config, int width, int height) {
  rt::Observation o;
  const double k = config.pixel_m;
  const auto place = [&](const Point& p, double(&out)[3]) {
    out[0] = (p.x - (width - 1) / 2.0) * k;
    out[1] = (p.y - (height - 1) / 2.0) * k;
    out[2] = 0;
  };
  o.frame = r.frame;
  o.exposure_ns = r.exposure_ns;
  o.flags = (r.holder.ok ? rt::Observation::holder_ok : 0U) | (r.needle.ok ? rt::Observation::tip_ok : 0U) |
            (r.outer.ok ? rt::Observation::outer_ok : 0U) | (r.inner.ok ? rt::Observation::inner_ok : 0U) |
            (r.contact ? rt::Observation::contact : 0U) | (r.punctured ? rt::Observation::punctured : 0U);
  if (r.needle.ok) {
    place(r.needle.tip, o.tip_m);
    o.axis[0] = r.needle.axis.x;
    o.axis[1] = r.needle.axis.y;
    o.axis[2] = 0;
  }
  if (r.holder.ok) {
    place(r.holder.mouth, o.holder_m);
  }
  o.holder_score = r.holder.score;
  if (r.undeformed) {
    place(r.undeformed->centre, o.centre_m);
    o.R_m = r.undeformed->r * k;
  }
  o.R_inner_m = r.inner_radius_px.value_or(0) * k;
  if (r.entry) {
    place(*r.entry, o.entry_m);
  }
  o.gap_m = r.gap_px.value_or(0) * k;
  o.wd_m = r.wd_px.value_or(0) * k;
  o.a_m = r.a_px.value_or(0) * k;
  o.membrane_velocity_m_s = r.membrane_velocity_px_s * k;
  for (std::size_t i = 0; i < 2; ++i) {
    if (r.points.point[i]) {
      place(*r.points.point[i], o.contact_point_m[i]);
    }
  }
  o.noise_m = r.gap_noise_px * k;
  o.total_us = static_cast<std::uint64_t>(std::max(0.0, r.us.total));
  return o;
}

}  // namespace punctum::vision
