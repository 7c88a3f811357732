#include "vision/pipettes/needle_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"

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

std::optional<Lanes> row_at(const GradientField& field, const NeedlePose& needle, double s) {
  const cv::Rect& a = field.area;
  const double w = needle.half_width + needle.taper * s;
  Lanes row{};
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Point p = needle.at(s, place(i, w));
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
  std::vector<Lanes> seen;
  double first_s = 0;  // of the first row behind the tip, px
  [[nodiscard]] double at(std::size_t j) const { return first_s + kStep_px * static_cast<double>(j); }
};

Rows rows_along(const GradientField& field, const NeedlePose& needle, double from, double to) {
  Rows out;
  for (double s = from; s <= to; s += kStep_px) {
    if (const auto row = row_at(field, needle, s)) {
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
  std::vector<double> values;
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

// How an end at t looks: walls behind it, and a line across the lumen.
class EndModel {
 public:
  EndModel(const Rows& rows, const Lanes& walls, double half_width, double blur, double noise2) {
    noise2_ = noise2;
    // The steepest outer face of a thin wall is its middle and the blur.
    const double middle = std::max(half_width - blur, 0.6 * half_width);
    line_behind_ = kHalfWall * middle;
    const double lumen = middle - line_behind_;
    const double spread = std::numbers::sqrt2 * blur;
    Lanes line{};
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double u = place(i, half_width);
      line[i] = 0.5 * (blurred_step((lumen - u) / spread) - blurred_step((-lumen - u) / spread));
    }
    take_off_mean_and_slope(line, half_width);
    ww_ = std::max(product(walls, walls, half_width), 1e-9);
    wl_ = product(walls, line, half_width);
    ll_ = std::max(product(line, line, half_width), 1e-9);
    for (const Lanes& row : rows.seen) {
      // A speck may tell for or against the needle no more than the needle itself.
      on_walls_.push_back(ww_ * std::clamp(product(row, walls, half_width) / ww_, -0.5, 1.6));
      on_line_.push_back(product(row, line, half_width));
    }
    zero_ = static_cast<int>(kTails * blur / kFine_px);
    for (int k = -zero_; k * kFine_px < kTo_px; ++k) {
      const double s = k * kFine_px;
      step_.push_back(0.5 * blurred_step(s / spread));
      const double z = (s - line_behind_) / blur;
      bump_.push_back(math::exp(-0.5 * z * z));
    }
  }

  struct Fit {
    double gain = 0;     // grey levels squared, over no needle
    bool plain = false;  // the walls near the end look as further back
  };
  // t: behind the tip of the pose, in steps of kFine_px from the first row. The walls may be weaker at the
  // tip, where they are thin, and weaker or stronger than elsewhere in front of a yolk.
  [[nodiscard]] Fit fit(int t) const {
    constexpr double kFrom_px = 4;
    constexpr int kRowsPerStep = static_cast<int>(kStep_px / kFine_px);
    double n = 0, s1 = 0, s2 = 0, w1 = 0, w2 = 0;      // strength of the walls over the place
    double a0 = 0, a1 = 0, aa0 = 0, aa1 = 0, aa2 = 0;  // walls, walls times place, ...
    double b0 = 0, bb = 0, ab0 = 0, ab1 = 0;           // line
    double shaft = 0;
    for (std::size_t j = 0; j < on_walls_.size(); ++j) {
      const int k = static_cast<int>(j) * kRowsPerStep - t;
      if (k < -zero_) {
        continue;
      }
      const double s = k * kFine_px, w = on_walls_[j];
      if (s >= kTo_px) {  // of any strength
        shaft += w * w / ww_;
        continue;
      }
      const double a = step_[static_cast<std::size_t>(zero_ + k)],
                   b = bump_[static_cast<std::size_t>(zero_ + k)];
      a0 += a * w;
      a1 += a * s * w;
      aa0 += a * a;
      aa1 += a * a * s;
      aa2 += a * a * s * s;
      b0 += b * on_line_[j];
      bb += b * b;
      ab0 += a * b;
      ab1 += a * b * s;
      if (s > kFrom_px) {
        n += 1;
        s1 += s;
        s2 += s * s;
        w1 += w / ww_;
        w2 += s * w / ww_;
      }
    }
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

  static constexpr double kFine_px = 0.25;

 private:
  // Half the thickness of the glass over the radius of its middle: pulled glass keeps the ratio of inner to
  // outer diameter of its capillary, usually 0.7.
  static constexpr double kHalfWall = 0.17;
  double noise2_ = 0;  // grey levels squared times px squared, of a product with one row
  double line_behind_ = 0, ww_ = 0, wl_ = 0, ll_ = 0;
  static constexpr double kTails = 5;  // blurs ahead of the end, where nothing of it is left
  static constexpr double kTo_px =
      24;  // behind the end; further back the strength of the walls tells nothing
  static constexpr double kSlope = 0.01;  // usual slope of the walls' strength, per px
  static constexpr double kSteepest = 0.02, kWeakest = 0.6,
                          kStrongest = 1.6;  // of the usual strength, per px
  std::vector<double> on_walls_, on_line_;
  std::vector<double> step_, bump_;  // every kFine_px
  int zero_ = 0;
};

// The likelihood of every end of the range, in grey levels squared.
struct Ends {
  double first = 0;  // behind the tip of the pose, px
  std::vector<double> at;
  std::size_t best = 0;
  bool plain = false;
  double blur = 0;  // px
  [[nodiscard]] double top() const { return at[best]; }
  [[nodiscard]] double behind() const {
    return first + (static_cast<double>(best) + 2 * vertex_offset(at[best - 2], top(), at[best + 2])) *
                       EndModel::kFine_px;
  }
  [[nodiscard]] double curvature() const {
    constexpr double kApart = 2 * EndModel::kFine_px;
    return (2 * top() - at[best - 2] - at[best + 2]) / (kApart * kApart);
  }
};

// The most likely end from `from` to `to` px behind the tip, by the walls of the shaft from `shaft_from` to
// `shaft_to`. Empty when it lies outside of the range.
std::optional<Ends> best_end(const Rows& rows, double half_width, double from, double to, double shaft_from,
                             double shaft_to, double noise2) {
  constexpr std::array kBlurs_px = {1.4, 1.7, 2.1, 2.6, 3.2, 4.0};
  const auto walls = usual_row(rows, shaft_from, shaft_to);
  if (!walls || product(*walls, *walls, half_width) < 1e-6) {
    return std::nullopt;
  }
  const int first = static_cast<int>(std::lround((from - rows.first_s) / EndModel::kFine_px));
  const int ends = static_cast<int>((to - from) / EndModel::kFine_px) + 1;
  Ends found;
  for (const double blur : kBlurs_px) {
    const EndModel model(rows, *walls, half_width, blur, noise2);
    Ends g;
    for (int e = 0; e < ends; ++e) {
      g.at.push_back(model.fit(first + e).gain);
    }
    g.best = static_cast<std::size_t>(std::max_element(g.at.begin(), g.at.end()) - g.at.begin());
    if (found.at.empty() || g.top() > found.top()) {
      g.plain = model.fit(first + static_cast<int>(g.best)).plain && blur < kBlurs_px.back();
      g.first = rows.first_s + first * EndModel::kFine_px;
      g.blur = blur;
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
                                     double back, double ahead) {
  constexpr double kMargin_px = 6;  // the blur of the end reaches so far
  constexpr double kNear_px = 24;   // of the shaft look as its end, however it widens
  constexpr double kAgain_px = 3;   // round the first result
  const Rows rows = rows_along(field, needle, -ahead - kMargin_px, back + kTail_px + kShaft_px);
  if (rows.seen.empty()) {
    return std::nullopt;
  }
  // First with the shaft behind the range, then with the shaft just behind the end.
  auto found = best_end(rows, needle.half_width, -ahead, back, back + kMargin_px,
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
    found = best_end(rows, needle.half_width, end - kAgain_px, end + kAgain_px, end + kMargin_px,
                     end + kMargin_px + kNear_px, noise * noise);
  }
  if (!found || !found->plain) {
    return std::nullopt;
  }
  return GlassEnd{-found->behind(), std::sqrt(2 * unit / std::max(found->curvature(), 1e-9)), found->blur};
}

}  // namespace punctum::vision
