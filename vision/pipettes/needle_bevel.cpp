#include "vision/pipettes/needle_bevel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

constexpr double kRow_px = 1;                        // along the needle
constexpr std::size_t kWithin = 5, kClearLanes = 3;  // lanes on one side: of the glass, beside it
constexpr double kClearApart = 0.9;                  // of those beside it, over the blur
constexpr std::size_t kBeside = 2;                   // of those, the outer ones: hardly blurred walls
constexpr std::size_t kLumenLanes = 2;               // of those of the glass, in the lumen
constexpr std::size_t kOneSide = kWithin + kClearLanes, kAllLanes = 2 * kOneSide;
constexpr double kShaftFrom_px = 6, kShaftTo_px = 51;  // behind the range: tell how the walls look
constexpr double kBehind_px = 14;                      // behind the range, compared with every end
// Half the thickness of the glass over the radius of its middle, in a usual capillary.
constexpr double kHalfOfWall = 0.17;
// px along per px across; what is cut more steeply is no needle's end.
constexpr double kSteepestCut = 0.95;
// A needle that is ground sharp may be cut so, where that explains the picture better by so much of what the
// walls do.
constexpr double kSharpestCut = 2.8, kClearlySharp = 0.02, kClearlyCut = 0.025;
constexpr double kSteepestFrom = 0.1;  // of the steepest: it may be steeper still
// In relief a line along the shaft is the slope of the light's path through a face of the glass. That slope
// is steepest at the face and goes on inwards: in the mean it lies so far from the axis, of the outer radius,
// by integrating over a tube with a bore of 0.61 of it. With one of 0.65, 0.89 and 0.55,
// the tips are as right. So far out the wall of an oblique cut ends.
constexpr double kOuterFace = 0.88, kInnerFace = 0.51;
constexpr double kLens_px = 1.2;  // blur of a lens in focus
constexpr double kLit = 0.02;  // the picture is explained better by so much where light comes from one side
constexpr double kUnequalWalls = 2;  // the strength of one over the other, from where on it is relief
constexpr double kCutOverWalls = 2;  // a cut that faces the light is up to so much brighter or darker
constexpr double kOblique = 0.5;     // cut: of a blunter end in relief the walls tell the radius
using GlassRow = std::array<double, kAllLanes>;

// A table of a function of the distance in blurs.
class OfBlurs {
 public:
  template <typename Function>
  explicit OfBlurs(Function of) {
    for (int k = 0; k < kCount; ++k) {
      values_[static_cast<std::size_t>(k)] = of((k - kZero) / kPerBlur);
    }
  }
  [[nodiscard]] double operator()(double blurs) const {
    const int k = static_cast<int>(blurs * kPerBlur + kZero + 0.5);
    return values_[static_cast<std::size_t>(std::clamp(k, 0, kCount - 1))];
  }
  static constexpr double kFar = 5;  // beyond so many blurs it does not change

 private:
  static constexpr double kPerBlur = 32;
  static constexpr int kZero = static_cast<int>(kFar * kPerBlur), kCount = 2 * kZero + 1;
  std::array<double, kCount> values_{};
};

const OfBlurs kStep([](double z) { return 0.5 * blurred_step(z / std::numbers::sqrt2); });
const OfBlurs kBump([](double z) { return math::exp(-0.5 * z * z); });

// Grey levels across the shaft from `from` to `to` px behind the tip, from its axis outwards, less their
// mean: the mean of both sides, or, with sign -1, half of what one side has more than the other.
Vector<double> half_profile(const GradientField& field, const NeedlePose& needle, double from, double to,
                            double apart_px, double sign) {
  constexpr double kOutside_px = 6;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  Vector<double> profile, along;
  for (double u = 0; u < half_width + kOutside_px; u += apart_px) {
    along.clear();
    for (double s = from; s < to; s += kRow_px) {
      const double v = u + needle.half_width_at(s) - half_width;
      along.push_back(0.5 * (field.grey(needle.at(s, v)) + sign * field.grey(needle.at(s, -v))));
    }
    profile.push_back(median_of(along));
  }
  double mean = 0;
  for (const double grey : profile) {
    mean += grey / static_cast<double>(profile.size());
  }
  for (double& grey : profile) {
    grey -= mean;
  }
  return profile;
}

// What is left of the profile, grey levels squared, when two walls so far from the axis, a lumen between them
// and a level are taken off, each as strong as it fits best.
double unexplained(const Vector<double>& profile, double apart_px, double middle_px, double blur_px) {
  // Out of focus a lumen looks like a wider blur. In focus it covers several lanes.
  constexpr double kNoLumen = 1;  // as surely as one place of the profile tells it
  cv::Matx33d a = cv::Matx33d::diag({1e-6, kNoLumen, 1e-6});
  cv::Vec3d g;
  double square = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const double u = apart_px * static_cast<double>(k), low = (u - middle_px) / blur_px,
                 high = (u + middle_px) / blur_px;
    const cv::Vec3d shown(kBump(low) + kBump(high), kStep(high) - kStep(low), 1);
    a += shown * shown.t();
    g += profile[k] * shown;
    square += profile[k] * profile[k];
  }
  return square - g.dot(a.inv() * g);
}

// A granule is about as wide as a wall, and not drawn anew in every pixel as noise is: over an end its sum
// varies so many times as much as that of noise that leaves as much.
double with_granules(double misfit) {
  constexpr double kOfGranules = 4;
  return 1 + kOfGranules * (misfit - 1);
}

struct CutEnd {
  double at = 0, tangent = 0;  // behind the tip of the pose, px; of the cut
};

// Weighted, of a quantity.
struct Moments {
  double weight = 0, sum = 0, squares = 0;

  void add(double w, double x) {
    weight += w;
    sum += w * x;
    squares += w * x * x;
  }
  [[nodiscard]] double mean() const { return sum / weight; }
  [[nodiscard]] double variance() const { return std::max(squares / weight - mean() * mean(), 0.0); }
};

// Of what N things show in the lanes of a row, and of what is seen there: the sums of products, those of the
// things without their mean and slope across.
template <std::size_t N>
class RowProducts {
 public:
  void add(double weight, double tilt, double grey, const std::array<double, N>& shown) {
    for (std::size_t a = 0; a < N; ++a) {
      mean_[a] += weight * shown[a];
      slope_[a] += weight * tilt * shown[a];
      seen_[a] += shown[a] * grey;
      for (std::size_t b = a; b < N; ++b) {
        of_both_[a][b] += weight * shown[a] * shown[b];
      }
    }
  }
  // a <= b. weights, tilts: of the row, see CutModel.
  [[nodiscard]] double of(std::size_t a, std::size_t b, double weights, double tilts) const {
    return of_both_[a][b] - (mean_[a] * mean_[b] / weights + slope_[a] * slope_[b] / tilts);
  }
  [[nodiscard]] double with_seen(std::size_t a) const { return seen_[a]; }

 private:
  std::array<double, N> mean_{}, slope_{}, seen_{};
  std::array<std::array<double, N>, N> of_both_{};
};

// Two walls that stop along an oblique line, each as its own line is blurred, and a line of glass along it,
// or none. What is neither walls nor clear is a speck and tells nothing. The medium is as even as it is
// beside the needle: were it not known out of focus, where the walls merge, the end would be half as certain.
class CutModel {
 public:
  // The shaft that tells how the walls look: all of it, or where light comes from one side only what the
  // noise asks for, since that light shows what the lumen holds, which changes along a needle.
  enum class Shaft { all, near };
  // radius: outer, of a glass in relief, px; 0: not in relief.
  CutModel(const GradientField& field, const NeedlePose& needle, double noise, double blur_px, double back,
           double ahead, Shaft shaft = Shaft::all, double radius = 0);
  [[nodiscard]] bool stands_out() const noexcept { return clear_; }
  // As light that comes from one side makes them.
  [[nodiscard]] bool walls_differ() const noexcept { return walls_differ_; }
  // Log likelihood over no needle, twice.
  [[nodiscard]] double gain(const CutEnd& end) const { return likelier(sums(end)); }
  // The most that a needle and a speck before it explain, in line with the wall at that side.
  [[nodiscard]] double gain_with_speck(const CutEnd& end, double side) const;
  // What specks and granules leave of the picture, over what the noise alone would, at least 1.
  [[nodiscard]] double misfit(double gain) const {
    return std::max(1.0, (square_ - gain * unit_) / (area_px2_ * smooth_noise_ * smooth_noise_));
  }

 private:
  struct Seen {
    double s, half_width;
    GlassRow grey;      // later times the weight, without what the medium may add
    GlassRow weight{};  // width of the lane, px; nearly none where there is a speck
    // Of the weights: mean place, sum, sum over the squares of the distance from that place.
    double middle = 0, weights = 0, tilts = 0;
    // px, px cubed: what tells that the medium is even here, in the mean and across.
    double even = 0, level = 0;
    // Of both walls where the needle goes on: squared, and times the grey levels.
    double walls_squared = 0, walls_seen = 0;
  };
  // Of the squares of what is shown, and of that times what is seen: walls; the same times the distance from
  // the end; line; what else is shown.
  template <int N>
  struct Sums {
    cv::Matx<double, N, N> a;
    cv::Vec<double, N> g;
  };
  // Of a lane of a row, where the needle ends so.
  struct Shown {
    double walls, line;
  };
  struct Ends {
    CutEnd end;
    double cut_px, of_line_px, reach_px;  // reach: where the needle goes on to, and from where it shows
  };
  [[nodiscard]] Ends ends_at(const CutEnd& end) const;
  // Calls for each lane with what is shown in it.
  template <class Each>
  void for_lanes(const Seen& row, const Ends& ends, Each each) const;
  [[nodiscard]] Sums<3> sums(const CutEnd& end) const;
  struct Speck {
    double at, aside, radius_px;  // behind the tip of the pose and beside its axis, px
  };
  [[nodiscard]] Sums<4> with_speck(const Sums<3>& of_needle, const Ends& ends, const Speck& speck) const;
  template <int N>
  [[nodiscard]] double likelier(Sums<N> sums) const;
  [[nodiscard]] double lane_at(std::size_t lane, double half_width) const;
  [[nodiscard]] double lane_width(std::size_t lane, double half_width) const;
  [[nodiscard]] static bool is_beside(std::size_t lane) { return lane % kOneSide + kBeside >= kOneSide; }
  void weigh_without_specks(Seen& row, double most) const;
  void take_off_plane();
  void tell_how_even_it_is();
  void take_off_mean_and_slope(Seen& row) const;
  void expect_walls(Seen& row) const;
  void show_in_relief(double radius, double strength);
  double half_width_, blur_, smooth_noise_, unit_;
  double square_ = 0, area_px2_ = 0;  // of what is seen, grey levels squared
  bool clear_ = false;
  Vector<Seen> rows_;
  GlassRow walls_{}, near_{}, line_{};  // of the shaft; the share of the nearer one; of a line across
  double middle_, line_behind_;         // of a wall, from the axis; of the line, behind the end
  bool walls_differ_ = false, in_relief_ = false;
  double radius_ = 0;  // in relief: outer, of the glass, px; and the place of the line that is seen in a lane
  GlassRow face_{};
};

double CutModel::lane_at(std::size_t lane, double half_width) const {
  const std::size_t i = lane % kOneSide;
  const double u = i < kWithin ? half_width * (static_cast<double>(i) + 0.5) / kWithin
                               : half_width + kClearApart * blur_ * (static_cast<double>(i - kWithin) + 0.5);
  return lane < kOneSide ? -u : u;
}

double CutModel::lane_width(std::size_t lane, double half_width) const {
  return lane % kOneSide < kWithin ? half_width / kWithin : kClearApart * blur_;
}

CutModel::CutModel(const GradientField& field, const NeedlePose& needle, double noise, double blur_px,
                   double back, double ahead, Shaft along, double radius)
    : half_width_(needle.half_width),
      blur_(blur_px),
      smooth_noise_(std::max(noise, 0.3) / (2 * field.sigma * std::sqrt(std::numbers::pi))),
      middle_(std::max(half_width_ - blur_, 0.6 * half_width_)),
      line_behind_(kHalfOfWall * middle_) {
  constexpr double kMargin_px = 6;  // the blur of the end reaches so far
  constexpr double kLeast_grey = 1.5, kMost_noises = 0.25;
  constexpr double kLeastShaft_px = 14, kPerNoise = 4;  // px per grey level
  const double shaft_px = kShaftTo_px - kShaftFrom_px,
               told_by_px =
                   along == Shaft::all ? shaft_px : std::clamp(kPerNoise * noise, kLeastShaft_px, shaft_px);
  // What the smoothing leaves of the noise in an end of that blur: it is a peak across, a slope along.
  const double blur2 = blur_ * blur_, of_noise = blur2 / (blur2 + field.sigma * field.sigma);
  unit_ = std::max(noise * noise, 0.1) * of_noise * of_noise / kRow_px;
  std::array<Vector<double>, kAllLanes> shaft;
  for (double s = -ahead - kMargin_px; s <= back + kShaftFrom_px + told_by_px; s += kRow_px) {
    GlassRow grey{};
    const double w = needle.half_width + needle.taper * s;
    bool whole = true;
    for (std::size_t i = 0; i < kAllLanes && whole; ++i) {
      const Point p = needle.at(s, lane_at(i, w));
      whole = p.x > field.area.x + 1 && p.y > field.area.y + 1 && p.x < field.area.x + field.area.width - 2 &&
              p.y < field.area.y + field.area.height - 2;
      grey[i] = field.grey(p);
    }
    if (!whole) {
      break;
    }
    if (s >= back + kShaftFrom_px) {
      // Against what is clear on either side.
      const double low = 0.5 * (grey[kOneSide - 1] + grey[kOneSide - 2]),
                   high = 0.5 * (grey[kAllLanes - 1] + grey[kAllLanes - 2]);
      const double far = 0.5 * (lane_at(kAllLanes - 1, w) + lane_at(kAllLanes - 2, w));
      for (std::size_t i = 0; i < kAllLanes; ++i) {
        shaft[i].push_back(grey[i] - 0.5 * (low + high) - 0.5 * (high - low) / far * lane_at(i, w));
      }
    }
    if (s <= back + kBehind_px) {
      rows_.push_back({.s = s, .half_width = w, .grey = grey});
    }
  }
  constexpr std::size_t kFewest = 12;
  if (shaft[0].size() < kFewest) {
    return;
  }
  double square = 0, most = 0, of_wall = 0, of_low = 0, squares = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    walls_[i] = median_of(shaft[i]);
    square += walls_[i] * walls_[i] / kAllLanes;
    most = std::max(most, std::abs(walls_[i]));
    const double u = lane_at(i, half_width_), lumen = middle_ - line_behind_;
    const double near = kBump((std::abs(u) - middle_) / blur_), far = kBump((std::abs(u) + middle_) / blur_);
    near_[i] = near / std::max(near + far, 1e-9);
    line_[i] = kStep((lumen - u) / blur_) - kStep((-lumen - u) / blur_);
    of_wall += walls_[i] * (near + far);
    of_low = i < kOneSide ? of_wall : of_low;
    squares += (near + far) * (near + far);
  }
  for (double& l : line_) {
    l *= of_wall / squares;
  }
  const double of_high = of_wall - of_low, weaker = std::min(std::abs(of_low), std::abs(of_high)),
               stronger = std::max(std::abs(of_low), std::abs(of_high));
  walls_differ_ = of_low * of_high < 0 || stronger > kUnequalWalls * weaker;
  if (radius > 0) {
    show_in_relief(radius,
                   std::copysign(std::sqrt(2 * (of_low * of_low + of_high * of_high)) / squares, of_wall));
  }
  clear_ = square > kLeast_grey * kLeast_grey && square > kMost_noises * kMost_noises * noise * noise;
  for (Seen& row : rows_) {
    weigh_without_specks(row, most);
  }
  take_off_plane();
  tell_how_even_it_is();
  for (Seen& row : rows_) {
    take_off_mean_and_slope(row);
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      square_ += row.weight[i] * row.grey[i] * row.grey[i];
      area_px2_ += row.weight[i];
      row.grey[i] *= row.weight[i];
    }
    expect_walls(row);
  }
}

// All of the cut is a line then: as bright or dark as the light's path rises there, from none to the glass.
// strength: of the walls, grey levels.
void CutModel::show_in_relief(double radius, double strength) {
  in_relief_ = true;
  radius_ = radius;
  line_behind_ = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double u = lane_at(i, half_width_);
    face_[i] = std::copysign(std::clamp(std::abs(u), kInnerFace * radius, kOuterFace * radius), u);
    line_[i] = strength * (kStep((radius - u) / blur_) - kStep((-radius - u) / blur_));
  }
}

void CutModel::expect_walls(Seen& row) const {
  double x0 = 0, x1 = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double x = walls_[i], weighted = row.weight[i] * x;
    x0 += weighted;
    x1 += weighted * (lane_at(i, row.half_width) - row.middle);
    row.walls_squared += weighted * x;
    row.walls_seen += row.grey[i] * x;
  }
  row.walls_squared -= x0 * x0 / row.weights + x1 * x1 / row.tilts;
}

// What is neither the walls nor clear is a speck, wherever the needle ends. most: of the walls, grey levels.
void CutModel::weigh_without_specks(Seen& row, double most) const {
  constexpr double kNoises = 4, kOfWalls = 0.3, kOfSpeck = 1e-3;
  const double tolerance = kNoises * smooth_noise_ + kOfWalls * most,
               of_cut = in_relief_ ? kCutOverWalls * most : 0;
  Vector<double> clear;  // beside the walls and between them
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    if (i % kOneSide >= kWithin || i % kOneSide < kLumenLanes) {
      clear.push_back(row.grey[i]);
    }
  }
  const double level = median_of(clear);
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double grey = row.grey[i] - level;
    const bool speck =
        grey < std::min(walls_[i], -of_cut) - tolerance || grey > std::max(walls_[i], of_cut) + tolerance;
    row.weight[i] = (speck ? kOfSpeck : 1) * lane_width(i, row.half_width);
  }
}

// Of the medium beside the needle.
void CutModel::take_off_plane() {
  cv::Matx33d a = 1e-6 * cv::Matx33d::eye();
  cv::Vec3d g;
  for (const Seen& row : rows_) {
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      if (is_beside(i)) {
        const cv::Vec3d plane(1, row.s, lane_at(i, row.half_width));
        a += row.weight[i] * plane * plane.t();
        g += row.weight[i] * row.grey[i] * plane;
      }
    }
  }
  const cv::Vec3d plane = a.inv() * g;
  for (Seen& row : rows_) {
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      row.grey[i] -= plane[0] + plane[1] * row.s + plane[2] * lane_at(i, row.half_width);
    }
  }
}

// By what is beside the needle in the rows about it: a membrane across it, say.
void CutModel::tell_how_even_it_is() {
  constexpr std::size_t kAbout = 4;
  struct Uneven {
    double level, slope, of_level, of_slope;  // squared; what the noise makes of both
  };
  Vector<Uneven> uneven;
  for (const Seen& row : rows_) {
    double m0 = 0, m2 = 0, r0 = 0, r1 = 0;
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      if (is_beside(i)) {
        const double u = lane_at(i, row.half_width), w = row.weight[i];
        m0 += w;
        m2 += w * u * u;
        r0 += w * row.grey[i];
        r1 += w * u * row.grey[i];
      }
    }
    uneven.push_back({r0 * r0 / (m0 * m0), r1 * r1 / (m2 * m2), unit_ / m0, unit_ / m2});
  }
  for (std::size_t j = 0; j < rows_.size(); ++j) {
    const std::size_t from = j > kAbout ? j - kAbout : 0, to = std::min(j + kAbout + 1, rows_.size());
    Uneven sum{};
    for (std::size_t k = from; k < to; ++k) {
      sum.level += uneven[k].level;
      sum.slope += uneven[k].slope;
      sum.of_level += uneven[k].of_level;
      sum.of_slope += uneven[k].of_slope;
    }
    const double n = static_cast<double>(to - from), doubt = std::sqrt(2 / n);
    rows_[j].even = unit_ * n / (std::max(sum.level - sum.of_level, 0.0) + doubt * sum.of_level);
    rows_[j].level = unit_ * n / (std::max(sum.slope - sum.of_slope, 0.0) + doubt * sum.of_slope);
  }
}

void CutModel::take_off_mean_and_slope(Seen& row) const {
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.weights += row.weight[i];
    row.middle += row.weight[i] * lane_at(i, row.half_width);
  }
  row.middle /= row.weights;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double tilt = lane_at(i, row.half_width) - row.middle;
    row.tilts += row.weight[i] * tilt * tilt;
    mean += row.weight[i] * row.grey[i];
    slope += row.weight[i] * tilt * row.grey[i];
  }
  row.weights += row.even;
  row.tilts += row.level;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.grey[i] -= mean / row.weights + slope / row.tilts * (lane_at(i, row.half_width) - row.middle);
  }
}

CutModel::Ends CutModel::ends_at(const CutEnd& end) const {
  const double cut_px = end.tangent * (in_relief_ ? radius_ : middle_),
               of_line_px = blur_ * std::sqrt(1 + end.tangent * end.tangent);
  return {end, cut_px, of_line_px, std::abs(cut_px) + OfBlurs::kFar * of_line_px};
}

template <class Each>
void CutModel::for_lanes(const Seen& row, const Ends& ends, Each each) const {
  const double along = row.s - ends.end.at, low = kStep((along + ends.cut_px) / blur_),
               high = kStep((along - ends.cut_px) / blur_);
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double u = lane_at(i, row.half_width);
    const double near = i < kOneSide ? low : high, far = i < kOneSide ? high : low;
    const double begun =
        in_relief_ ? kStep((along - ends.end.tangent * face_[i]) / blur_) : far + near_[i] * (near - far);
    each(i, u,
         Shown{walls_[i] * begun,
               line_[i] * kBump((along - ends.end.tangent * u - line_behind_) / ends.of_line_px)});
  }
}

CutModel::Sums<3> CutModel::sums(const CutEnd& end) const {
  Sums<3> of{cv::Matx33d::zeros(), {}};
  const Ends ends = ends_at(end);
  for (const Seen& row : rows_) {
    if (row.s < end.at - ends.reach_px) {
      continue;
    }
    if (row.s > end.at + line_behind_ + ends.reach_px) {
      const double from_end = row.s - end.at;
      of.a(0, 0) += row.walls_squared;
      of.a(0, 1) += from_end * row.walls_squared;
      of.a(1, 1) += from_end * from_end * row.walls_squared;
      of.g[0] += row.walls_seen;
      of.g[1] += from_end * row.walls_seen;
      continue;
    }
    RowProducts<2> row_of;
    for_lanes(row, ends, [&](std::size_t i, double u, const Shown& shown) {
      row_of.add(row.weight[i], u - row.middle, row.grey[i], {shown.walls, shown.line});
    });
    const auto product = [&](std::size_t k, std::size_t l) {
      return row_of.of(k, l, row.weights, row.tilts);
    };
    const double xx = product(0, 0), xl = product(0, 1), ll = product(1, 1), xy = row_of.with_seen(0),
                 ly = row_of.with_seen(1);
    const double from_end = std::max(0.0, row.s - end.at);
    of.a += cv::Matx33d(xx, from_end * xx, xl, from_end * xx, from_end * from_end * xx, from_end * xl, xl,
                        from_end * xl, ll);
    of.g += cv::Vec3d(xy, from_end * xy, ly);
  }
  of.a(1, 0) = of.a(0, 1);
  return of;
}

// With what is usual of walls and line.
template <int N>
double CutModel::likelier(Sums<N> of) const {
  constexpr double kStrength = 0.25,
                   kPerPx = 0.01;  // usual deviations of the walls' strength from the shaft's
  // Usual deviation of the line's strength from none, or from that of the walls. In focus it shows, and is
  // not just where a usual capillary has it; out of focus the walls merge into one.
  constexpr double kFocused = 3, kClosed = 0.15, kUnsharp_px = 2.2;
  const double sure = unit_ / (kStrength * kStrength);
  of.a(0, 0) += sure;
  of.g[0] += sure;
  of.a(1, 1) += unit_ / (kPerPx * kPerPx);
  // An open end or one that is closed by glass as strong as the walls.
  const double usual = blur_ > kUnsharp_px ? kClosed : kFocused, of_line = unit_ / (usual * usual);
  of.a(2, 2) += of_line;
  const cv::Matx<double, N, N> inverse = of.a.inv();
  const double open = (of.g.dot(inverse * of.g) - sure) / unit_;
  of.g[2] += of_line;
  const double closed = (of.g.dot(inverse * of.g) - sure - of_line) / unit_, more = std::max(open, closed);
  return more + 2 * math::log(0.5 * (1 + math::exp(-0.5 * std::abs(open - closed))));
}

// As dark or bright as it fits best.
CutModel::Sums<4> CutModel::with_speck(const Sums<3>& of_needle, const Ends& ends, const Speck& speck) const {
  Sums<4> of{cv::Matx44d::eye(), {}};
  for (int i = 0; i < 3; ++i) {
    of.g[i] = of_needle.g[i];
    for (int j = 0; j < 3; ++j) {
      of.a(i, j) = of_needle.a(i, j);
    }
  }
  for (const Seen& row : rows_) {
    if (std::abs(row.s - speck.at) > 3 * speck.radius_px) {
      continue;
    }
    RowProducts<3> row_of;
    const double along = kBump((row.s - speck.at) / speck.radius_px);
    for_lanes(row, ends, [&](std::size_t i, double u, const Shown& shown) {
      row_of.add(row.weight[i], u - row.middle, row.grey[i],
                 {shown.walls, shown.line, along * kBump((u - speck.aside) / speck.radius_px)});
    });
    const auto with_speck = [&](std::size_t k) { return row_of.of(k, 2, row.weights, row.tilts); };
    of.a(0, 3) += with_speck(0);
    of.a(1, 3) += std::max(0.0, row.s - ends.end.at) * with_speck(0);
    of.a(2, 3) += with_speck(1);
    of.a(3, 3) += with_speck(2);
    of.g[3] += row_of.with_seen(2);
  }
  for (int i = 0; i < 3; ++i) {
    of.a(3, i) = of.a(i, 3);
  }
  return of;
}

double CutModel::gain_with_speck(const CutEnd& end, double side) const {
  constexpr double kReach_px = 14, kOffLine_px = 1;
  const Ends ends = ends_at(end);
  const Sums<3> of_needle = sums(end);
  double most = likelier(of_needle);
  for (const double radius_px : {blur_, 1.5 * blur_}) {
    for (double off = -kOffLine_px; off <= kOffLine_px; off += 1) {
      for (double ahead = 0; ahead <= kReach_px; ahead += 1) {
        const Speck speck{end.at - ahead, std::copysign(middle_ + off, side), radius_px};
        most = std::max(most, likelier(with_speck(of_needle, ends, speck)));
      }
    }
  }
  return most;
}

// Ends from..to px behind the tip of the pose, and cuts, with what is between two of them.
struct EndsAndCuts {
  double from, to, apart, cut_from, cut_to, cut_apart;
};

// Coarsely, of cuts like these.
template <std::size_t kCuts>
CutEnd likeliest_end(const CutModel& model, double back, double ahead,
                     const std::array<double, kCuts>& tangents) {
  CutEnd best;
  double most = -1e18;
  for (double at = -ahead; at <= back; at += 1) {
    for (const double tangent : tangents) {
      if (const double gain = model.gain({at, tangent}); gain > most) {
        most = gain;
        best = {at, tangent};
      }
    }
  }
  return best;
}

// Uphill from a likely one, by the steps that are tried.
CutEnd likeliest_near(const CutModel& model, const CutEnd& from, const EndsAndCuts& tried) {
  constexpr int kSteps = 16;
  CutEnd best = from;
  double most = model.gain(from);
  for (int step = 0; step < kSteps; ++step) {
    const CutEnd middle = best;
    for (const double along : {-tried.apart, 0.0, tried.apart}) {
      for (const double cut : {-tried.cut_apart, 0.0, tried.cut_apart}) {
        const CutEnd end{std::clamp(middle.at + along, tried.from, tried.to),
                         std::clamp(middle.tangent + cut, tried.cut_from, tried.cut_to)};
        if (const double gain = model.gain(end); gain > most) {
          most = gain;
          best = end;
        }
      }
    }
    if (best.at == middle.at && best.tangent == middle.tangent) {
      break;
    }
  }
  return best;
}

// With a cut that is a little steeper.
bool gets_likelier_beyond(const CutModel& model, const CutEnd& end) {
  const double gain = model.gain(end);
  for (double off = -0.5; off <= 0.5; off += 0.5) {
    if (model.gain({end.at + off, 1.1 * end.tangent}) > gain) {
      return true;
    }
  }
  return false;
}

// Rather than at right angles with a speck in line with one wall, which looks alike but for the light between
// the two.
bool is_clearly_cut(const CutModel& model, const CutEnd& cut, const CutEnd& right) {
  constexpr double kThanSpeck = 1.2;
  constexpr int kReach_px = 3;
  const double without = model.gain(right);
  double speck = 0;
  for (int off = -kReach_px; off <= kReach_px; ++off) {
    speck = std::max(speck, model.gain_with_speck({right.at + off, 0}, -cut.tangent) - without);
  }
  return model.gain(cut) - without > std::max(kThanSpeck * speck, kClearlyCut * without);
}

// Each as likely as it explains the picture; and the likeliest. radius: of the glass, px.
CutGlass mean_of(const CutModel& model, const EndsAndCuts& tried, double blur_px, double radius,
                 CutEnd& best) {
  struct Likely {
    CutEnd end;
    double gain;
  };
  Vector<Likely> ends;
  double most = -1e18;
  for (int k = static_cast<int>(std::ceil(tried.cut_from / tried.cut_apart));
       k * tried.cut_apart <= tried.cut_to; ++k) {
    for (double at = tried.from; at <= tried.to; at += tried.apart) {
      const CutEnd end{at, k * tried.cut_apart};
      ends.push_back({end, model.gain(end)});
      if (ends.back().gain > most) {
        most = ends.back().gain;
        best = end;
      }
    }
  }
  const double misfit = with_granules(model.misfit(most));
  // Of the end, of the cut, and of the end where the cut is known.
  Moments outermost, tangents, of_cut;
  double where_cut_is_known = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto& [end, gain] = ends[i];
    // Before anything is seen, a needle is as likely cut at right angles as anyhow up to the steepest.
    const double before = tried.cut_apart / (2 * kSteepestCut) + (end.tangent == 0 ? 1 : 0);
    const double weight = before * math::exp(0.5 * (gain - most) / misfit);
    const double place = std::abs(end.tangent) * radius - end.at;
    outermost.add(weight, place);
    tangents.add(weight, end.tangent);
    of_cut.add(weight, place);
    if (i + 1 == ends.size() || ends[i + 1].end.tangent != end.tangent) {
      where_cut_is_known += of_cut.weight > 0 ? of_cut.weight * of_cut.variance() : 0;
      of_cut = {};
    }
  }
  const double with_cut = outermost.variance() - tangents.variance() * radius * radius;
  return {{outermost.mean(), std::sqrt(std::max(with_cut, where_cut_is_known / outermost.weight)), blur_px},
          {tangents.mean(), std::sqrt(tangents.variance())}};
}

// The likeliest end `ahead` px ahead of the tip of the pose to `back` px behind it, of usual cuts and of
// sharp ones.
struct CoarseEnds {
  CoarseEnds(const CutModel& model, double back_px, double ahead_px)
      : back(back_px),
        ahead(ahead_px),
        usual(likeliest_end(model, back, ahead, std::array{-0.6, -0.3, 0.0, 0.3, 0.6})),
        sharp(likeliest_end(model, back, ahead, std::array{-2.4, -2.0, -1.6, -1.2, 1.2, 1.6, 2.0, 2.4})),
        gain(std::max(model.gain(usual), model.gain(sharp))),
        is_sharp(gain > (1 + kClearlySharp) * model.gain(usual)) {}
  double back, ahead;
  CutEnd usual, sharp;
  double gain;
  bool is_sharp;
};

// radius: outer, of the glass, px.
std::optional<CutGlass> cut_by(const CutModel& model, const CoarseEnds& coarse, double blur_px,
                               double radius) {
  CutEnd best = coarse.usual;
  // Ends far from the best one may be as likely: in noise the likelihood falls off in straight lines, not as
  // a parabola. Where they are not, it is sharp.
  constexpr double kBeyond_px = 2, kSharp_px2 = 0.1,
                   kReach_px = 1;  // of the range; variance; round the best end
  constexpr double kReachOfCut = 0.16;
  const EndsAndCuts usual{
      -coarse.ahead - kBeyond_px, coarse.back + kBeyond_px, 0.5, -kSteepestCut, kSteepestCut, 0.1};
  EndsAndCuts tried = usual;
  const auto try_sharp = [&](const CutEnd& likely) {
    const bool up = likely.tangent > 0;  // a needle that is cut the other way explains it far worse
    tried = {usual.from, usual.to, 0.5, up ? 0 : -kSharpestCut, up ? kSharpestCut : 0, 0.2};
    best = likely;
  };
  if (coarse.is_sharp) {
    best = likeliest_near(model, best, usual);
    if (coarse.gain > (1 + kClearlySharp) * model.gain(best)) {
      try_sharp(coarse.sharp);
    }
  }
  constexpr double kEdge_px = 1.5;  // of the range
  if (best.at < -coarse.ahead + kEdge_px || best.at > coarse.back - kEdge_px) {
    return CutGlass{{std::abs(best.tangent) * radius - best.at, coarse.back + coarse.ahead, blur_px},
                    {best.tangent, 0}};
  }
  CutGlass found = mean_of(model, tried, blur_px, radius, best);
  const auto is_steeper = [&] {
    return std::abs(best.tangent) > std::max(tried.cut_to, -tried.cut_from) - kSteepestFrom &&
           gets_likelier_beyond(model, best);
  };
  // A cut that is hardly steeper than usual explains the picture hardly better than a usual one, but better
  // than a right angle, with a speck before it or without.
  if (tried.cut_from == usual.cut_from && is_steeper()) {
    try_sharp(best);
    best = likeliest_near(model, best, tried);
    if (!is_clearly_cut(model, best, likeliest_end(model, coarse.back, coarse.ahead, std::array{0.0}))) {
      return std::nullopt;
    }
    found = mean_of(model, tried, blur_px, radius, best);
  }
  if (is_steeper()) {
    return std::nullopt;
  }
  if (const double of_cut = found.bevel.sd * radius;
      found.end.sd * found.end.sd + of_cut * of_cut < kSharp_px2) {
    const EndsAndCuts near{best.at - kReach_px,        best.at + kReach_px,        0.1,
                           best.tangent - kReachOfCut, best.tangent + kReachOfCut, 0.02};
    found = mean_of(model, near, blur_px, radius, best);
  }
  return found;
}

}  // namespace

double outer_radius_of_glass(double half_width, double blur) {
  return (1 + kHalfOfWall) * std::max(half_width - blur, 0.6 * half_width);
}

std::optional<double> blur_of_shaft(const GradientField& field, const NeedlePose& needle, double back) {
  constexpr double kApart_px = 0.5, kUnexplained = 0.2;
  constexpr double kUnequal = 0.5;  // the difference of both sides over what they have in common, squared
  // What it is tried with, and the least that a needle in focus has.
  constexpr double kLeast_px = 1.2, kMost_px = 4.8, kBlurStep_px = 0.1, kMiddleStep_px = 0.25,
                   kSharpest_px = 1.4;
  const double from = back + kShaftFrom_px, to = back + kShaftTo_px;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  const Vector<double> profile = half_profile(field, needle, from, to, kApart_px, 1),
                       difference = half_profile(field, needle, from, to, kApart_px, -1);
  double least = 0, in_common = 0, apart = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    least += kUnexplained * profile[k] * profile[k];
    in_common += profile[k] * profile[k];
    apart += difference[k] * difference[k];
  }
  if (apart > kUnequal * in_common) {
    return std::nullopt;
  }
  std::optional<double> best;
  for (double blur = kLeast_px; blur < kMost_px; blur += kBlurStep_px) {
    for (double middle = 0.5 * half_width; middle < half_width; middle += kMiddleStep_px) {
      if (const double rest = unexplained(profile, kApart_px, middle, blur); rest < least) {
        least = rest;
        const double wall = 2 * kHalfOfWall * middle;  // its thickness spreads it, too, but only across
        best = std::sqrt(std::max(blur * blur - wall * wall / 12, 0.0));
      }
    }
  }
  return best && *best > kSharpest_px ? best : std::nullopt;
}

std::optional<CutGlass> cut_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                     double blur_px, double back, double ahead) {
  const auto as_in_bright_field = [&](const CutModel& model, const CoarseEnds& coarse) {
    return cut_by(model, coarse, blur_px, outer_radius_of_glass(needle.half_width, blur_px));
  };
  if (const CutModel even(field, needle, noise, blur_px, back, ahead); !even.stands_out()) {
    return std::nullopt;
  } else if (!even.walls_differ()) {
    return as_in_bright_field(even, {even, back, ahead});
  }
  // The outer flank of a face's line is steepest one blur outside of it: 0.8 to 1.1 for tubes of all usual
  // walls.
  const double radius = needle.half_width - math::hypot(kLens_px, field.sigma);
  const CutModel lit(field, needle, noise, blur_px, back, ahead, CutModel::Shaft::near, radius);
  const CoarseEnds coarse(lit, back, ahead);
  if (!coarse.is_sharp) {
    const CutModel plain(field, needle, noise, blur_px, back, ahead, CutModel::Shaft::near);
    if (const CoarseEnds of_plain(plain, back, ahead); coarse.gain <= (1 + kLit) * of_plain.gain) {
      return as_in_bright_field(plain, of_plain);
    }
  }
  auto cut = cut_by(lit, coarse, blur_px, radius);
  if (cut && std::abs(cut->bevel.tangent) > kOblique) {
    cut->bevel.radius = radius;
  }
  return cut;
}

std::optional<LikelyEnds> likely_ends(const GradientField& field, double noise, const NeedlePose& needle,
                                      double blur_px) {
  constexpr int kReach = LikelyEnds::kReach_px;
  const CutModel model(field, needle, noise, blur_px, kReach, kReach);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  LikelyEnds out;
  double most = -1e18;
  for (std::size_t cut = 0; cut < LikelyEnds::kCuts; ++cut) {
    auto& of_cut = out.gain[cut];
    for (std::size_t k = 0; k < of_cut.size(); ++k) {
      of_cut[k] = model.gain({static_cast<double>(k) - kReach, LikelyEnds::tangent(cut)});
      most = std::max(most, of_cut[k]);
    }
  }
  const double misfit = with_granules(model.misfit(most));
  for (auto& of_cut : out.gain) {
    for (double& g : of_cut) {
      g /= misfit;
    }
  }
  return out;
}

std::optional<GlassEnd> end_of_known_cut(const GradientField& field, double noise, const NeedlePose& needle,
                                         const Bevel& bevel, double blur_px, double reach) {
  constexpr double kApart_px = 0.5;
  const CutModel model(field, needle, noise, blur_px, reach, reach,
                       bevel.radius > 0 ? CutModel::Shaft::near : CutModel::Shaft::all, bevel.radius);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  Vector<double> gains;
  for (double at = -reach; at <= reach; at += kApart_px) {
    gains.push_back(model.gain({at, bevel.tangent}));
  }
  const double most = *std::max_element(gains.begin(), gains.end()),
               misfit = with_granules(model.misfit(most));
  Moments ends;
  for (std::size_t k = 0; k < gains.size(); ++k) {
    ends.add(math::exp(0.5 * (gains[k] - most) / misfit), reach - kApart_px * static_cast<double>(k));
  }
  return GlassEnd{ends.mean(), std::sqrt(ends.variance()), blur_px};
}

}  // namespace punctum::vision
