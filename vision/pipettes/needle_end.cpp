#include "vision/pipettes/needle_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <span>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"
#include "vision/pipettes/glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kStep_px = 0.5;
constexpr std::size_t kInside = 6, kBeside = 2,
                      kSide = kInside + kBeside;  // lanes: within the wall, beside it
constexpr std::size_t kLanes = 2 * kSide;
constexpr double kShaft_px = 45;  // of the needle behind the range tell how its walls look
constexpr double kTail_px = 20;   // behind the range, compared with every end
using Lanes = std::array<double, kLanes>;

// Distance of a lane from the axis, px.
double place(std::size_t lane, double half_width) {
  const std::size_t i = lane % kSide;
  const double u = i < kInside ? half_width * (static_cast<double>(i) + 0.5) / kInside
                               : half_width + static_cast<double>(i - kInside) + 0.5;
  return lane < kSide ? -u : u;
}

// What it counts for, px.
double width(std::size_t lane, double half_width) {
  return lane % kSide < kInside ? half_width / kInside : 1;
}

double product(const Lanes& a, const Lanes& b, double half_width) {
  double sum = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    sum += width(i, half_width) * a[i] * b[i];
  }
  return sum;
}

// The same, of b with its widths.
double product(const Lanes& a, const Lanes& weighted) {
  double sum = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    sum += a[i] * weighted[i];
  }
  return sum;
}
Lanes weights_of(const Lanes& v, double half_width) {
  Lanes out;
  for (std::size_t i = 0; i < kLanes; ++i) {
    out[i] = width(i, half_width) * v[i];
  }
  return out;
}

// A membrane across the needle and a slope of the light are not of it: without mean and slope.
void take_off_mean_and_slope(Lanes& row, double half_width) {
  double m0 = 0, m2 = 0, r0 = 0, r1 = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const double u = place(i, half_width), w = width(i, half_width);
    m0 += w;
    m2 += w * u * u;
    r0 += w * row[i];
    r1 += w * u * row[i];
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    row[i] -= r0 / m0 + r1 / m2 * place(i, half_width);
  }
}

// bevel: by how much further back than the axis it is sampled, per px across.
std::optional<Lanes> row_at(const GradientField& field, const NeedlePose& needle, double bevel, double s) {
  const cv::Rect& a = field.area;
  const double w = needle.half_width + needle.taper * s;
  Lanes row{};
  for (std::size_t i = 0; i < kLanes; ++i) {
    const double u = place(i, w);
    const Point p = needle.at(s + bevel * u, u);
    if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
      return std::nullopt;
    }
    row[i] = field.grey(p);
  }
  take_off_mean_and_slope(row, w);
  return row;
}

// What the rows show, from the most forward one backward.
struct Rows {
  Vector<Lanes> seen;
  double first_s = 0;  // of the first row behind the tip, px
  [[nodiscard]] double at(std::size_t j) const { return first_s + kStep_px * static_cast<double>(j); }
};

Rows rows_along(const GradientField& field, const NeedlePose& needle, double bevel, double from, double to) {
  Rows out;
  out.seen.reserve(static_cast<std::size_t>((to - from) / kStep_px) + 1);
  for (double s = from; s <= to; s += kStep_px) {
    if (const auto row = row_at(field, needle, bevel, s)) {
      if (out.seen.empty()) {
        out.first_s = s;
      }
      out.seen.push_back(*row);
    } else if (!out.seen.empty()) {
      break;
    }
  }
  return out;
}

// The usual row of the shaft from `from` to `to` px behind the tip. Empty when too little of it is in the
// picture.
std::optional<Lanes> usual_row(const Rows& rows, double from, double to) {
  constexpr std::size_t kLeast = 24;
  Lanes out{};
  Vector<double> values;
  for (std::size_t i = 0; i < kLanes; ++i) {
    values.clear();
    for (std::size_t j = 0; j < rows.seen.size(); ++j) {
      if (rows.at(j) >= from && rows.at(j) <= to) {
        values.push_back(rows.seen[j][i]);
      }
    }
    if (values.size() < kLeast) {
      return std::nullopt;
    }
    out[i] = median_of(values);
  }
  return out;
}

constexpr std::size_t kFour = 4;
using FourDoubles = double __attribute__((vector_size(kFour * sizeof(double))));

struct ThreeSums {
  double a, b, c;
};
// a . x, b . x and c . y, four at once in a fixed order; what is left is added one by one.
PUNCTUM_WIDE_LOOP ThreeSums products_with(const double* a, const double* b, const double* c, const double* x,
                                          const double* y, std::size_t n) {
  FourDoubles sum_a{}, sum_b{}, sum_c{}, p, q, r, u, v;
  std::size_t i = 0;
  for (; i + kFour <= n; i += kFour) {
    std::memcpy(&p, a + i, sizeof p);
    std::memcpy(&q, b + i, sizeof q);
    std::memcpy(&r, c + i, sizeof r);
    std::memcpy(&u, x + i, sizeof u);
    std::memcpy(&v, y + i, sizeof v);
    sum_a += p * u;
    sum_b += q * u;
    sum_c += r * v;
  }
  ThreeSums out{(sum_a[0] + sum_a[1]) + (sum_a[2] + sum_a[3]), (sum_b[0] + sum_b[1]) + (sum_b[2] + sum_b[3]),
                (sum_c[0] + sum_c[1]) + (sum_c[2] + sum_c[3])};
  for (; i < n; ++i) {
    out.a += a[i] * x[i];
    out.b += b[i] * x[i];
    out.c += c[i] * y[i];
  }
  return out;
}

// Sums over the first n values, for every n.
class SumsUpTo {
 public:
  void reserve(std::size_t n) { sums_.reserve(n + 1); }
  void add(double value) { sums_.push_back(sums_.back() + value); }
  [[nodiscard]] double from_to(std::size_t from, std::size_t to) const { return sums_[to] - sums_[from]; }

 private:
  Vector<double> sums_{0.0};
};

constexpr double kFine_px = 0.25;  // between the ends that are compared
constexpr int kFinePerRow = static_cast<int>(kStep_px / kFine_px);
constexpr double kEndTo_px = 24;   // behind the end; further back the strength of the walls tells nothing
constexpr double kEndFrom_px = 4;  // nearer, the walls may be weaker

// What an end of that blur shows at the rows about it: walls behind it, a line across the lumen. Ends lie
// finer than rows, so there are several phases of rows.
class EndRows {
 public:
  EndRows(double half_width, double blur_px, bool in_relief) : blur(blur_px) {
    constexpr double kTails = 5;  // blurs ahead of the end, where nothing of it is left
    // The steepest outer face of a thin wall is its middle and the blur.
    const double middle = middle_radius_of_glass(half_width, blur);
    const double wall = kHalfOfWall * middle, lumen = middle - wall, spread = std::numbers::sqrt2 * blur;
    const double behind = in_relief ? 0 : wall;  // a line of glass; in relief one where the glass begins
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double u = place(i, half_width);
      line[i] = 0.5 * (blurred_step((lumen - u) / spread) - blurred_step((-lumen - u) / spread));
    }
    take_off_mean_and_slope(line, half_width);
    zero_ = static_cast<int>(kTails * blur / kFine_px);
    constexpr int kTo = static_cast<int>(kEndTo_px / kFine_px);
    for (Phase& p : phase_) {
      const auto rows = static_cast<std::size_t>(zero_ + kTo) / kFinePerRow + 1;
      for (Vector<double>* v : {&p.step, &p.step_place, &p.line}) {
        v->reserve(rows);
      }
      for (SumsUpTo* sums : {&p.aa, &p.aas, &p.aass, &p.bb, &p.ab, &p.abs, &p.n, &p.s, &p.ss}) {
        sums->reserve(rows);
      }
      p.first = kTo;
    }
    for (int k = -zero_; k < kTo; ++k) {
      Phase& p = phase_[phase_of(k)];
      p.first = std::min(p.first, k);
      const double s = k * kFine_px, a = 0.5 * blurred_step(s / spread), z = (s - behind) / blur,
                   b = math::exp(-0.5 * z * z);
      p.step.push_back(a);
      p.step_place.push_back(a * s);
      p.line.push_back(b);
      p.aa.add(a * a);
      p.aas.add(a * a * s);
      p.aass.add(a * a * s * s);
      p.bb.add(b * b);
      p.ab.add(a * b);
      p.abs.add(a * b * s);
      const bool strong = s > kEndFrom_px;
      p.n.add(strong ? 1 : 0);
      p.s.add(strong ? s : 0);
      p.ss.add(strong ? s * s : 0);
    }
  }

  struct Phase {
    int first = 0;                          // fine steps behind the end
    Vector<double> step, step_place, line;  // per row: walls, walls times place, line
    SumsUpTo aa, aas, aass, bb, ab, abs;    // of their products, and of these times place
    SumsUpTo n, s, ss;                      // of the rows behind kEndFrom_px: their number, places
  };
  // Of rows that lie t fine steps ahead of the end, and every kFinePerRow behind.
  [[nodiscard]] const Phase& phase(int t) const { return phase_[phase_of(-t)]; }

  double blur;
  Lanes line{};  // across the needle

 private:
  static std::size_t phase_of(int k) {
    return static_cast<std::size_t>((k % kFinePerRow + kFinePerRow) % kFinePerRow);
  }
  int zero_ = 0;
  std::array<Phase, kFinePerRow> phase_;
};

// What the rows show of walls that look like these; a speck may tell for or against the needle no more than
// the needle itself.
struct OnWalls {
  double power;                      // of the walls
  Vector<double> strength;           // of a row, times the power
  SumsUpTo sum, times_row, squares;  // of the strengths; times the number of the row; squared

  OnWalls(const Rows& rows, const Lanes& walls, double half_width)
      : power(std::max(product(walls, walls, half_width), 1e-9)) {
    const Lanes weighted = weights_of(walls, half_width);
    strength.reserve(rows.seen.size());
    for (SumsUpTo* sums : {&sum, &times_row, &squares}) {
      sums->reserve(rows.seen.size());
    }
    for (const Lanes& row : rows.seen) {
      const double w = power * std::clamp(product(row, weighted) / power, -0.5, 1.6);
      times_row.add(w * static_cast<double>(strength.size()));
      strength.push_back(w);
      sum.add(w);
      squares.add(w * w);
    }
  }
};

// How an end at t looks: walls behind it, and a line across the lumen.
class EndModel {
 public:
  EndModel(const Rows& rows, const OnWalls& on_walls, const Lanes& walls, const EndRows& end,
           double half_width, double noise2)
      : noise2_(noise2),
        ww_(on_walls.power),
        wl_(product(walls, end.line, half_width)),
        ll_(std::max(product(end.line, end.line, half_width), 1e-9)),
        end_(end),
        on_walls_(on_walls) {
    const Lanes line = weights_of(end.line, half_width);
    on_line_.reserve(rows.seen.size());
    for (const Lanes& row : rows.seen) {
      on_line_.push_back(product(row, line));
    }
  }

  struct Fit {
    double gain = 0;     // grey levels squared, over no needle
    bool plain = false;  // the walls near the end look as further back
  };
  // t: behind the tip of the pose, in fine steps from the first row. The walls may be weaker at the tip,
  // where they are thin, and weaker or stronger than elsewhere in front of a yolk.
  [[nodiscard]] Fit fit(int t) const {
    const EndRows::Phase& at = end_.phase(t);
    // Rows of the picture and of the end that lie on each other; behind them the walls have any strength.
    const int rows = static_cast<int>(on_walls_.strength.size()), shown = static_cast<int>(at.step.size());
    const int shift = (at.first + t) / kFinePerRow;  // row of the picture on the first one of the end
    const int from = std::clamp(shift, 0, rows), to = std::clamp(shift + shown, from, rows);
    const auto first = static_cast<std::size_t>(from), last = static_cast<std::size_t>(to),
               p = static_cast<std::size_t>(std::clamp(from - shift, 0, shown)), q = p + (last - first);
    const auto [a0, a1, b0] =
        products_with(at.step.data() + p, at.step_place.data() + p, at.line.data() + p,
                      on_walls_.strength.data() + first, on_line_.data() + first, last - first);
    const double aa0 = at.aa.from_to(p, q), aa1 = at.aas.from_to(p, q), aa2 = at.aass.from_to(p, q),
                 bb = at.bb.from_to(p, q), ab0 = at.ab.from_to(p, q), ab1 = at.abs.from_to(p, q);
    // Strength of the walls over the place.
    const double n = at.n.from_to(p, q), s1 = at.s.from_to(p, q), s2 = at.ss.from_to(p, q);
    const std::size_t strong = last - static_cast<std::size_t>(std::lround(n));
    const double w1 = on_walls_.sum.from_to(strong, last) / ww_,
                 w2 = kStep_px * on_walls_.times_row.from_to(strong, last) / ww_ - t * kFine_px * w1;
    const double shaft = on_walls_.squares.from_to(last, on_walls_.strength.size()) / ww_;
    // What the noise leaves of the slope: nothing where it tells less than is known before.
    const double spread = s2 - s1 * s1 / std::max(n, 1.0);
    const double raw = spread > 1 ? (w2 - s1 * w1 / n) / spread : 0;
    const double variance = noise2_ / (ww_ * kStep_px * std::max(spread, 1.0));
    const double steep = std::clamp(raw / (1 + variance / (kSlope * kSlope)), 0.0, kSteepest);
    const double level = n > 0 ? (w1 - steep * s1) / n : 1;  // at the tip
    const double strength = std::clamp(level, kWeakest, kStrongest);
    Fit out;
    out.plain = level > kWeakest && level < kStrongest && raw - 2 * std::sqrt(variance) < 1.3 * kSlope;
    const double rest = b0 - wl_ * (strength * ab0 + steep * ab1);
    out.gain = shaft + 2 * (strength * a0 + steep * a1) -
               ww_ * (strength * strength * aa0 + 2 * strength * steep * aa1 + steep * steep * aa2) +
               rest * rest / (ll_ * std::max(bb, 1e-9));  // the line has the strength that fits best
    return out;
  }

 private:
  static constexpr double kSlope = 0.01;  // usual slope of the walls' strength, per px
  static constexpr double kSteepest = 0.02, kWeakest = 0.6,
                          kStrongest = 1.6;  // of the usual strength, per px
  double noise2_;  // grey levels squared times px squared, of a product with one row
  double ww_, wl_, ll_;
  const EndRows& end_;
  const OnWalls& on_walls_;
  Vector<double> on_line_;
};

// The likelihood of every end of the range, in grey levels squared.
struct Ends {
  double first = 0;  // behind the tip of the pose, px
  Vector<double> at;
  std::size_t best = 0;
  bool plain = false;
  double blur = 0;  // px
  [[nodiscard]] double top() const { return at[best]; }
  [[nodiscard]] double behind() const {
    return first +
           (static_cast<double>(best) + 2 * vertex_offset(at[best - 2], top(), at[best + 2])) * kFine_px;
  }
  [[nodiscard]] double curvature() const {
    constexpr double kApart = 2 * kFine_px;
    return (2 * top() - at[best - 2] - at[best + 2]) / (kApart * kApart);
  }
};

// The most likely end from `from` to `to` px behind the tip, by the walls of the shaft from `shaft_from` to
// `shaft_to`. Empty when it lies outside of the range.
std::optional<Ends> best_end(const Rows& rows, std::span<const EndRows> blurred, double half_width,
                             double from, double to, double shaft_from, double shaft_to, double noise2) {
  const auto walls = usual_row(rows, shaft_from, shaft_to);
  if (!walls || product(*walls, *walls, half_width) < 1e-6) {
    return std::nullopt;
  }
  const int first = static_cast<int>(std::lround((from - rows.first_s) / kFine_px));
  const int ends = static_cast<int>((to - from) / kFine_px) + 1;
  Ends found;
  const OnWalls on_walls(rows, *walls, half_width);
  for (const EndRows& end : blurred) {
    const EndModel model(rows, on_walls, *walls, end, half_width, noise2);
    Ends g;
    g.at.reserve(static_cast<std::size_t>(ends));
    for (int e = 0; e < ends; ++e) {
      g.at.push_back(model.fit(first + e).gain);
    }
    g.best = static_cast<std::size_t>(std::max_element(g.at.begin(), g.at.end()) - g.at.begin());
    if (found.at.empty() || g.top() > found.top()) {
      g.plain = model.fit(first + static_cast<int>(g.best)).plain && &end != &blurred.back();
      g.first = rows.first_s + first * kFine_px;
      g.blur = end.blur;
      found = std::move(g);
    }
  }
  if (found.at.empty() || found.best < 2 || found.best + 3 > found.at.size()) {
    return std::nullopt;
  }
  return found;
}

}  // namespace

std::optional<GlassEnd> end_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                     double bevel, double back, double ahead, bool in_relief) {
  constexpr double kMargin_px = 6;  // the blur of the end reaches so far
  constexpr double kNear_px = 24;   // of the shaft look as its end, however it widens
  constexpr double kAgain_px = 3;   // round the first result
  const Rows rows = rows_along(field, needle, bevel, -ahead - kMargin_px, back + kTail_px + kShaft_px);
  if (rows.seen.empty()) {
    return std::nullopt;
  }
  const auto end_of = [&](double blur) { return EndRows{needle.half_width, blur, in_relief}; };
  const std::array<EndRows, 6> blurred{end_of(1.4), end_of(1.7), end_of(2.1),
                                       end_of(2.6), end_of(3.2), end_of(4.0)};
  // First with the shaft behind the range, then with the shaft just behind the end.
  auto found = best_end(rows, blurred, needle.half_width, -ahead, back, back + kMargin_px,
                        back + kMargin_px + kShaft_px, noise * noise);
  // Gain over variance: the smoothed noise weighs less on what is about as wide as the smoothing.
  constexpr double kSmoothed = 0.6;
  const double unit = noise * noise * kSmoothed / kStep_px;
  constexpr double kClear = 9;
  if (found && found->top() - std::max(found->at.front(), found->at.back()) < kClear * unit) {
    return std::nullopt;
  }
  if (found) {
    const double end = found->behind();
    found = best_end(rows, blurred, needle.half_width, end - kAgain_px, end + kAgain_px, end + kMargin_px,
                     end + kMargin_px + kNear_px, noise * noise);
  }
  if (!found || !found->plain) {
    return std::nullopt;
  }
  return GlassEnd{-found->behind() + std::abs(bevel) * outer_radius_of_glass(needle.half_width, found->blur),
                  std::sqrt(2 * unit / std::max(found->curvature(), 1e-9)), found->blur};
}

}  // namespace punctum::vision
