#include "vision/membrane/dimple_seen.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

namespace {

constexpr double kDimpleReach = 6;         // half-widths of the needle to either side
constexpr double kAbove_px = 4;            // above the outline at rest
constexpr double kPast_px = 1, kPast = 4;  // past the tip, at least; in its deviations
constexpr double kStepOfDepth_px = 1;      // the blur is wider
constexpr int kLeastReach = 8;             // rays to either side: a thin needle hides two or three
constexpr int kLeastRays = 6;              // fewer tell nothing
constexpr double kModel = 0.08;            // variance of an edge that looks unusual, in squared usual edges
constexpr double kOneSample_px = 3.5;      // along the membrane, by the smoothing
// A membrane that has let go of the tip is further from it: px, and share of its depth.
constexpr double kOnTip_px = 3, kOnTip = 0.25;
constexpr double kTip_px = 1.6;  // to which the tip is known: shapes are learnt from dimples that end there
constexpr double kSinks_px = 3;  // by which a free membrane may seem to sink in a frame
constexpr double kSinking = 4;   // log odds against each px of it
constexpr double kThrough = 12;  // log odds that a membrane is not on the tip that went through it
constexpr double kStays = 3;     // log odds that it stays on the tip, or off it, for a frame
// In relief its motion tells it, too; a shape that is none of those tried tells no more than that.
constexpr double kStaysInRelief = 5, kByShape = 10;
constexpr double kGivesWay_px = 2.5, kGivesWay = 0.25;  // by which it then goes back at least; of its depth
constexpr double kLetsGoAlone = 6;  // log odds against an outer membrane off the tip with the inner one on it
constexpr double kHand_px = 1;      // by which a hand changes the needle's speed in a frame
constexpr double kJumped = 5;       // log odds at most, by a jump of the tip, that it is off it
constexpr double kSteepest = 1.8;   // slope of a wall that ends at its width; the needle hides a steeper one
constexpr double kBandHalf_px = 7;  // half-width of the band
constexpr double kWithinHalf_px = 4;  // of an inner membrane's: granules are near

// A flat bottom with a logarithmic wall is what a stretched membrane has; bumps end at their width. Under a
// sharp point it is a cusp, which falls off exponentially.
enum class Wall : std::uint8_t { bump, logarithmic, cusp };
struct Shape {
  double width;  // half-widths of the needle; of a cusp, over which it falls to 1/e
  Wall wall;
};
constexpr std::array<Shape, kDimpleShapes> kShapes{{{2, Wall::bump},
                                                    {2.3, Wall::bump},
                                                    {2.65, Wall::bump},
                                                    {3.05, Wall::bump},
                                                    {3.5, Wall::bump},
                                                    {4, Wall::bump},
                                                    {4.6, Wall::bump},
                                                    {5.3, Wall::bump},
                                                    {18, Wall::logarithmic},
                                                    {100, Wall::logarithmic},
                                                    {1.5, Wall::cusp},
                                                    {2.2, Wall::cusp},
                                                    {3.3, Wall::cusp},
                                                    {5, Wall::cusp},
                                                    {7.5, Wall::cusp}}};

struct Shapes {
  std::size_t first, end;
};
Shapes shapes_under(const NeedlePose& needle) {
  constexpr std::size_t kBlunt = 10;
  return needle.point_aside == 0 ? Shapes{0, kBlunt} : Shapes{kBlunt, kDimpleShapes};
}

// Slope of its wall where it is steepest, for a depth of one half-width; a logarithmic wall and a cusp may
// have any: 0.
double steepness(const Shape& shape) { return shape.wall == Wall::bump ? 1.54 / shape.width : 0; }

// Share of the depth, u half-widths away from the entry.
double share_of_depth(const Shape& shape, double u) {
  if (shape.wall == Wall::cusp) {
    return math::exp(-u / shape.width);
  }
  if (u >= shape.width) {
    return 0;
  }
  if (shape.wall == Wall::logarithmic) {
    return u <= 1 ? 1 : 1 - math::log(u) / math::log(shape.width);
  }
  const double f = 1 - u * u / (shape.width * shape.width);
  return f * f;
}

enum class Tells : std::uint8_t { edge, nothing, against };

constexpr std::size_t kAtOnce = 8;  // depths
using EightFloats = float __attribute__((vector_size(kAtOnce * sizeof(float))));
using EightInts = int __attribute__((vector_size(kAtOnce * sizeof(int))));

constexpr double kPlace_px = 0.5;  // between places along a way

// What rays tell of dimples of one shape: each is looked at along its way, which is that of the needle.
struct Ways {
  std::size_t rays, room;    // of a ray: places
  const float *gx, *gy;      // grey levels per px, from the first depth on
  const Tells* tells;        // likewise
  const float* share;        // of the depth, from the ray before them to the one after
  const cv::Point2f* turn;   // of the outline at rest from the ray before to the one after, px
  float first_depth, scale;  // px; of an edge
  cv::Point2f axis;
  Polarity polarity;
  Relief relief;
};

// Of dimples of eight depths: what speaks for an edge along them, and how many rays tell.
PUNCTUM_WIDE_LOOP void look_along(const Ways& ways, const float* depths, float* sums, int* told) {
  EightFloats depth, sum{};
  EightInts count{};
  std::memcpy(&depth, depths, sizeof depth);
  const EightFloats by_x = ways.axis.x * depth, by_y = ways.axis.y * depth;
  for (std::size_t k = 0; k < ways.rays; ++k) {
    const EightFloats place = (depth * ways.share[k + 1] - ways.first_depth) / static_cast<float>(kPlace_px);
    const EightInts q = __builtin_convertvector(place, EightInts);
    const EightFloats u = place - __builtin_convertvector(q, EightFloats);
    const EightInts nearest = q - (u >= 0.5F);
    const float *row_x = ways.gx + k * ways.room, *row_y = ways.gy + k * ways.room;
    const Tells* row_tells = ways.tells + k * ways.room;
    EightFloats x0, x1, y0, y1;
    EightInts tells;
    for (int l = 0; l < static_cast<int>(kAtOnce); ++l) {
      x0[l] = row_x[q[l]];
      x1[l] = row_x[q[l] + 1];
      y0[l] = row_y[q[l]];
      y1[l] = row_y[q[l] + 1];
      tells[l] = static_cast<int>(row_tells[nearest[l]]);
    }
    // The outside is on the left of a contour of rising angle, with y down.
    const float turn = ways.share[k + 2] - ways.share[k];
    const EightFloats along_x = ways.turn[k].x + turn * by_x, along_y = ways.turn[k].y + turn * by_y;
    const EightFloats square = along_x * along_x + along_y * along_y;
    std::array<float, kAtOnce> lengths;
    std::memcpy(lengths.data(), &square, sizeof square);
    for (float& l : lengths) {
      l = std::sqrt(l);
    }
    EightFloats length;
    std::memcpy(&length, lengths.data(), sizeof length);
    EightFloats edge =
        ways.scale * ((x0 + u * (x1 - x0)) * along_y - (y0 + u * (y1 - y0)) * along_x) / length;
    EightFloats usual = 0.5F + EightFloats{};
    if (ways.polarity == Polarity::any) {
      edge = edge < 0 ? -edge : edge;
    } else if (ways.polarity == Polarity::relief) {
      EightFloats sign;
      for (int l = 0; l < static_cast<int>(kAtOnce); ++l) {
        sign[l] = static_cast<float>(ways.relief.sign_at(cv::Point2f(along_y[l], -along_x[l]) / length[l]));
      }
      edge *= sign;  // a fainter edge tells less
      usual *= sign * sign;
    }
    const EightFloats bounded = edge < -1.0F  ? -1.0F + EightFloats{}
                                : edge > 1.2F ? 1.2F + EightFloats{}
                                              : edge;
    const EightFloats nothing{};
    sum += tells == static_cast<int>(Tells::edge)      ? bounded - usual
           : tells == static_cast<int>(Tells::against) ? -usual
                                                       : nothing;
    count -= tells != static_cast<int>(Tells::nothing);
  }
  std::memcpy(sums, &sum, sizeof sum);
  std::memcpy(told, &count, sizeof count);
}

// A dimple of that shape is not deeper: the needle hides a steeper wall.
double deepest_of(const Shape& shape, double deepest, const MembraneSearch& search) {
  const double steep = steepness(shape), most = kSteepest * search.surroundings.needle.half_width;
  return steep > 0 ? std::min(deepest, most / steep) : deepest;
}

// Dimples of one membrane in one picture: its points at rest, pushed along the needle.
class Dimples {
 public:
  explicit Dimples(const MembraneSearch& search)
      : s_(search),
        outline_(from_polar(s_.band.centre, s_.rest)),
        spacing_(s_.usual_r * 2 * std::numbers::pi / s_.angles) {
    const NeedlePose& n = s_.surroundings.needle;
    if (const auto entry = entry_point(outline_, n.point(), n.axis)) {
      depth_of_tip_ = (n.point() - *entry).dot(n.axis) - s_.m.path_outside_px;
      meets_the_cell_ = true;
      entry_ = polar_index(*entry - s_.band.centre, s_.angles);
      reach_ =
          std::clamp(static_cast<int>(kDimpleReach * n.half_width / spacing_), kLeastReach, s_.angles / 8);
      for (int i = entry_ - reach_; i <= entry_ + reach_; ++i) {
        turn_.emplace_back(outline_[index(i + 1)] - outline_[index(i - 1)]);
      }
    }
  }

  [[nodiscard]] bool meets_the_cell() const { return meets_the_cell_; }
  [[nodiscard]] double depth_of_tip() const { return depth_of_tip_; }
  void look(double deepest);  // before choose()
  // A shape, with dimples up to that depth.
  void choose(const Shape& shape, double deepest);
  // Of it, `step` steps of depth below the first.
  [[nodiscard]] std::optional<double> evidence(std::size_t step) const;
  [[nodiscard]] std::size_t steps() const { return steps_; }
  [[nodiscard]] double depth(std::size_t step) const {
    return first_depth_ + static_cast<double>(step) * kStepOfDepth_px;
  }
  [[nodiscard]] Contour contour(const Shape& shape, double depth) const {
    Contour out;
    for (int i = 0; i < s_.angles; ++i) {
      out.push_back(point(share_of_depth(shape, from_entry(i)), depth, i));
    }
    return out;
  }

 private:
  [[nodiscard]] double from_entry(int i) const {  // half-widths of the needle
    const int apart = std::abs(i - entry_), rays = std::min(apart, std::abs(s_.angles - apart));
    return rays * spacing_ / s_.surroundings.needle.half_width;
  }
  [[nodiscard]] std::size_t index(int i) const {  // of an angle at most once round
    return static_cast<std::size_t>(i < 0 ? i + s_.angles : i < s_.angles ? i : i - s_.angles);
  }
  [[nodiscard]] Point point(double share, double depth, int i) const {
    return outline_[index(i)] + depth * share * s_.surroundings.needle.axis;
  }

  const MembraneSearch& s_;
  Contour outline_;
  double spacing_;  // px between two points
  double depth_of_tip_ = 0;
  bool meets_the_cell_ = false;
  int entry_ = 0;  // index of the angle
  int reach_ = 0;
  Vector<float> share_;  // of the depth, from the ray before those that tell to the one after them
  // At the places along the ways of the rays that tell, from the first depth on.
  double first_depth_ = 0;
  std::size_t places_ = 0;
  Vector<float> gx_, gy_;  // grey levels per px
  Vector<Tells> tells_;
  Vector<cv::Point2f> turn_;  // per ray, of the outline at rest from the ray before to the one after, px
  std::size_t steps_ = 0;     // of the shape that was chosen
  Vector<float> depths_, sums_;
  Vector<int> told_;
};

// The picture along each ray's way.
void Dimples::look(double deepest) {
  first_depth_ = -kAbove_px;
  places_ = static_cast<std::size_t>((deepest - first_depth_) / kPlace_px) + 3;
  const std::size_t rays = static_cast<std::size_t>(2 * reach_ + 1), room = places_ + GradientField::kAtOnce;
  gx_.resize(rays * room);
  gy_.resize(gx_.size());
  tells_.resize(gx_.size());
  const GradientField& field = s_.picture.field;
  const Point& axis = s_.surroundings.needle.axis;
  for (std::size_t k = 0; k < rays; ++k) {
    const std::size_t i = index(entry_ - reach_ + static_cast<int>(k));
    const Point from = outline_[i] + first_depth_ * axis, step = kPlace_px * axis;
    float *gx = gx_.data() + k * room, *gy = gy_.data() + k * room;
    const bool whole = field.contains(from, step, static_cast<int>(places_));
    if (whole) {
      field.gradients(from, step, static_cast<int>(places_), gx, gy);
    }
    for (std::size_t q = 0; q < places_; ++q) {
      const Point p = from + static_cast<double>(q) * step;
      if (!whole) {
        const Point g = field.gradient(p);
        gx[q] = static_cast<float>(g.x);
        gy[q] = static_cast<float>(g.y);
      }
      const bool beyond = !s_.band.upper.empty() && cv::norm(p - s_.band.centre) > s_.band.upper[i];
      tells_[k * room + q] = beyond ? Tells::against : s_.picture.hidden(p) ? Tells::nothing : Tells::edge;
    }
  }
}

void Dimples::choose(const Shape& shape, double deepest) {
  share_.clear();
  for (int i = entry_ - reach_ - 1; i <= entry_ + reach_ + 1; ++i) {
    share_.push_back(static_cast<float>(share_of_depth(shape, from_entry(i))));
  }
  steps_ = static_cast<std::size_t>(std::max(deepest - first_depth_, 0.0) / kStepOfDepth_px) + 1;
  depths_.resize((steps_ + kAtOnce - 1) / kAtOnce * kAtOnce);
  sums_.resize(depths_.size());
  told_.resize(depths_.size());
  for (std::size_t j = 0; j < depths_.size(); ++j) {
    depths_[j] = static_cast<float>(depth(std::min(j, steps_ - 1)));
  }
  const Ways ways{turn_.size(),
                  places_ + GradientField::kAtOnce,
                  gx_.data(),
                  gy_.data(),
                  tells_.data(),
                  share_.data(),
                  turn_.data(),
                  static_cast<float>(first_depth_),
                  static_cast<float>((s_.m.polarity == Polarity::darker_out ? -1 : 1) / s_.m.level),
                  cv::Point2f(s_.surroundings.needle.axis),
                  s_.m.polarity,
                  s_.m.relief};
  for (std::size_t j = 0; j < depths_.size(); j += kAtOnce) {
    look_along(ways, depths_.data() + j, sums_.data() + j, told_.data() + j);
  }
}

std::optional<double> Dimples::evidence(std::size_t step) const {
  if (told_[step] < kLeastRays) {
    return std::nullopt;
  }
  const double noise = s_.picture.gradient_noise / s_.m.level;
  return static_cast<double>(sums_[step]) * std::min(1.0, spacing_ / kOneSample_px) /
         (kModel + noise * noise);
}

// What the inner membrane tells of dimples of the outer one: it is pushed by as much less as the space
// between it and the wall gives way, about as wide, or lies on the tip still when the outer one has left it.
class WithinTells {
 public:
  WithinTells(const MembraneSearch& outer, const FollowedMembrane& inner, double deepest)
      : gives_way_(std::max(0.0, mean_radius(outer.m.contour()) - mean_radius(inner.contour()) -
                                     outer.surroundings.least_wall_px())) {
    Surroundings around = outer.surroundings;
    around.outermost = false;
    around.within = nullptr;
    const MembraneSearch search(inner, outer.picture, around);
    Dimples dimples(search);
    if (!dimples.meets_the_cell()) {
      return;
    }
    dimples.look(deepest);
    first_ = dimples.depth(0);
    const double tip = std::max(dimples.depth_of_tip(), 0.0);
    on_tip_from_ = tip - std::max(kOnTip_px, kOnTip * tip);
    for (auto [k, end] = shapes_under(around.needle); k < end; ++k) {
      dimples.choose(kShapes[k], deepest_of(kShapes[k], deepest, search));
      for (std::size_t step = 0; step < dimples.steps(); ++step) {
        of_[k].push_back(dimples.evidence(step).value_or(0));
        if (step == of_any_.size()) {
          of_any_.push_back(kNone);
        }
        of_any_[step] = std::max(of_any_[step], of_[k].back());
      }
    }
    for (std::size_t step = of_any_.size(); step-- > 1;) {
      of_any_[step - 1] = std::max(of_any_[step - 1], of_any_[step]);
    }
  }
  [[nodiscard]] double evidence(std::size_t shape, double depth, bool outer_on_tip) const {
    const auto step_of = [&](double d) {
      return static_cast<int>(std::lround((d - first_) / kStepOfDepth_px));
    };
    double best = kNone;
    const int least = std::max(step_of(depth - gives_way_), 0),
              on_tip = std::max(step_of(on_tip_from_), least);
    if (!outer_on_tip && on_tip < static_cast<int>(of_any_.size())) {
      best = of_any_[static_cast<std::size_t>(on_tip)] - kLetsGoAlone;
    }
    for (std::size_t k = shape > 0 ? shape - 1 : 0; k < std::min(shape + 2, kDimpleShapes); ++k) {
      const int to = std::min(step_of(depth) + 1, static_cast<int>(of_[k].size()));
      for (int step = least; step < to; ++step) {
        best = std::max(best, of_[k][static_cast<std::size_t>(step)]);
      }
    }
    return best > kNone ? best : 0;
  }

 private:
  static constexpr double kNone = -1e9;
  double gives_way_, first_ = 0;                  // px; the space inside the wall, and the first depth
  std::array<Vector<double>, kDimpleShapes> of_;  // evidence, step by step
  Vector<double> of_any_;                         // of any shape, that deep or deeper
  double on_tip_from_ = 0;                        // px, of its own depths
};

// Log odds that the membrane has left the tip: it draws the end of the needle back while it slides off, and
// the end then jumps ahead, further than a hand moves it.
double odds_of_jump(const Surroundings& s) {
  const NeedlePose& n = s.needle;
  const double jump = s.last_tip ? (n.tip - *s.last_tip).dot(n.axis) - s.expected_px : 0;
  return jump > 0 ? std::min(kJumped, 0.5 * jump * jump / (kHand_px * kHand_px + n.sd * n.sd)) : 0;
}

}  // namespace

std::optional<SeenDimple> likeliest_dimple(const MembraneSearch& search) {
  Dimples dimples(search);
  if (!dimples.meets_the_cell()) {
    return std::nullopt;
  }
  const FollowedMembrane &m = search.m, *around = search.surroundings.around;
  const bool within = !search.surroundings.outermost;
  const bool punctured = search.surroundings.punctured || (around && !around->held);  // the outer one
  const double tip = dimples.depth_of_tip();
  double deepest = tip, on_tip_from = tip - std::max(kOnTip_px, kOnTip * tip);
  // The outer membrane pushes an inner one before the tip does, until it gives way.
  const bool by_the_outer = within && !punctured;
  if (within) {
    deepest = std::max(tip, punctured ? m.dimple_px : around ? around->dimple_px : 0);
    on_tip_from = punctured ? std::max(on_tip_from, kTip_px) : -kAbove_px - 1;
  }
  if (deepest < 1) {
    return std::nullopt;
  }
  // A tip that is told too far back pushes the membrane all the same.
  const double tip_sd = search.surroundings.needle.sd, to = deepest + std::max(kPast_px, kPast * tip_sd);
  const auto past_tip = [tip_sd](double past) {
    return past > kPast_px ? -0.5 * past * past / (tip_sd * tip_sd) : 0;
  };
  dimples.look(to);
  std::optional<WithinTells> inner;
  if (const FollowedMembrane* w = search.surroundings.within;
      !within && m.polarity == Polarity::relief && w && w->known && !w->lost() && !w->rest.r.empty()) {
    inner.emplace(search, *w, to);
  }
  std::optional<SeenDimple> pushed, free;
  std::array<double, kDimpleShapes> best;
  best.fill(-1e9);
  for (auto [k, end] = shapes_under(search.surroundings.needle); k < end; ++k) {
    dimples.choose(kShapes[k], deepest_of(kShapes[k], to, search));
    for (std::size_t step = 0; step < dimples.steps(); ++step) {
      const double depth = dimples.depth(step);
      // What the needle does not push does not sink.
      const double sunk = m.held ? 0 : std::max(0.0, depth - m.dimple_px);
      if (sunk > kSinks_px && (punctured || depth <= on_tip_from)) {
        continue;
      }
      const auto evidence = dimples.evidence(step);
      if (!evidence) {
        continue;
      }
      const bool on_tip = depth > on_tip_from;
      if (depth <= deepest + kPast_px && (by_the_outer || depth > deepest - kTip_px)) {
        best[k] = std::max(best[k], *evidence);
      }
      std::optional<SeenDimple>& kept = on_tip ? pushed : free;
      const double with_odds = *evidence + m.dimple_odds[k] - (on_tip ? 0 : kSinking * sunk) +
                               past_tip(depth - deepest) + (inner ? inner->evidence(k, depth, on_tip) : 0);
      if (!kept || with_odds > kept->evidence) {
        kept = SeenDimple{depth, with_odds, k, on_tip, m.dimple_odds};
      }
    }
  }
  const double stays = search.free_by_motion ? kStaysInRelief : kStays;
  const bool through = punctured && !(within && m.held);
  double on_tip = through ? -kThrough : m.held && !punctured ? stays : -stays;
  if (on_tip > 0 && !within) {
    on_tip -= odds_of_jump(search.surroundings) + std::min(kJumped, search.surroundings.gone_odds);
  }
  double by_shape = pushed && free ? free->evidence - pushed->evidence : 0;
  if (search.free_by_motion) {
    // Where no edge is seen either, nothing tells that it has gone there; and one that is hardly less deep
    // than in the last frame has not gone back.
    const double last = m.held ? m.dimple_px - std::max(kGivesWay_px, kGivesWay * m.dimple_px) : tip;
    const bool gone = free && free->evidence > 0 && free->depth < last;
    // Light across the needle leaves of a dimple's bottom nothing to see, and its walls alone tell less.
    const double clear = std::abs(m.relief.sign_at(-search.surroundings.needle.axis)),
                 most = kStaysInRelief + clear * (kByShape - kStaysInRelief);
    by_shape = std::clamp(by_shape, -kByShape, gone ? most : kStaysInRelief);
    on_tip -= on_tip > 0 ? *search.free_by_motion : 0;
  }
  if (!pushed || (free && on_tip < by_shape)) {
    return free;
  }
  // A dimple keeps its shape while it grows, and while it goes back.
  constexpr double kKept = 0.7, kLearnt = 0.5, kLeast = -5;
  const double top = *std::max_element(best.begin(), best.end());
  for (std::size_t k = 0; k < kDimpleShapes; ++k) {
    pushed->odds[k] = std::max(kLeast, kKept * pushed->odds[k] + kLearnt * (best[k] - top));
  }
  return pushed;
}

EdgeBand band_along(const MembraneSearch& search, const SeenDimple& dimple) {
  EdgeBand out = search.band;
  const Vector<double> r =
      polar_radii(Dimples(search).contour(kShapes[dimple.shape], dimple.depth), out.centre, search.angles);
  for (int i = 0; i < search.angles && !r.empty(); ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double weight = std::clamp((1.1 - search.from_needle(i)) / 0.3, 0.0, 1.0);
    out.middle[k] += weight * (r[k] - out.middle[k]);
  }
  out.half_width = std::min(out.half_width, search.surroundings.outermost ? kBandHalf_px : kWithinHalf_px);
  return out;
}

}  // namespace punctum::vision
