#include "vision/membrane/common_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/median.hpp"
#include "vision/image/periodic_smoothing.hpp"

namespace punctum::vision {

namespace {

// Shape and places in turn; a third round makes no contour measurably better, nor a second one that begins
// with the shape of the last frame.
constexpr int kRounds = 2, kRoundsFromLast = 1;
constexpr double kFurthestPlace_px = 2.5;  // a place further from the contour is another edge's
constexpr int kLeastSamples = 12;          // of a profile
constexpr std::ptrdiff_t kPadding = 8;     // samples beyond either end of the shape that a place may reach
constexpr double kLeastSeen = 0.35;        // of the points
constexpr double kLeastLikeness = 0.48;    // median share of a profile's variance that the shape explains
constexpr double kTukey = 4.7;             // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale_px = 0.05;
constexpr double kGainReach = 0.04;  // of the circumference to either side, over which contrast is averaged
// A place follows the samples that tell it, so that little is left of what they err by.
constexpr double kMostTrust = 2;
constexpr double kGrain = 0.6;  // per point, for granules of about 2 px
// Of the variance of the noise: samples between pixels and the weights of the places leave so much.
constexpr double kSampledNoise = 0.5;
constexpr double kClip = 1.3;        // times the spread: Huber's limit
constexpr double kBesideLine = 0.1;  // weight of a place beside a line that is not its own
constexpr double kCommon_px = 0.03;  // sd of what is wrong alike all round: the steps are no perfect model
constexpr double kMostLasting_px = 0.45;  // sd per point that granules have where noise does not hide them
constexpr double kSoft = 0.02;            // of the stiffness, where the membrane may have any shape

// Mean of the middle half: as robust as is needed against impurities, and less noisy than the median.
double middle_mean(Vector<double>& v) {
  if (v.size() < 8) {
    return 0;
  }
  const auto quarter = static_cast<std::ptrdiff_t>(v.size() / 4);
  std::nth_element(v.begin(), v.begin() + quarter, v.end());
  std::nth_element(v.begin() + quarter, v.end() - quarter, v.end());
  double sum = 0;
  for (auto it = v.begin() + quarter; it != v.end() - quarter; ++it) {
    sum += *it;
  }
  return sum / static_cast<double>(v.end() - v.begin() - 2 * quarter);
}

// y = even + turning x, weighted.
struct FittedLine {
  double w = 0, x = 0, xx = 0, y = 0, xy = 0;

  void add(double weight, double at, double value) {
    w += weight;
    x += weight * at;
    xx += weight * at * at;
    y += weight * value;
    xy += weight * at * value;
  }
  void solve(double& even, double& turning) const {
    const double det = w * xx - x * x;
    turning = det > 1e-6 * w * w ? (w * xy - x * y) / det : 0;
    even = w > 0 ? (y - turning * x) / w : 0;
  }
};

bool is_set(const Vector<std::uint8_t>& mask, std::size_t i) { return !mask.empty() && mask[i] != 0; }

float sum_of(const Lanes& v) {
  static_assert(kSideBySide == 8);
  return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}

PUNCTUM_WIDE_LOOP void add_products(const Lanes* grey, const Lanes* seen, const float* trust,
                                    const float* shape, const float* slope, std::size_t samples,
                                    ProfileProducts& out) {
  ProfileProducts p{};
  for (std::size_t j = 0; j < samples; ++j) {
    const float w = trust[j], t = shape[j], s = slope[j], wt = w * t, ws = w * s;
    p.one += w * seen[j];
    p.shape += wt * seen[j];
    p.slope += ws * seen[j];
    p.shape_shape += wt * t * seen[j];
    p.shape_slope += wt * s * seen[j];
    p.slope_slope += ws * s * seen[j];
    p.untrusted += s * s * seen[j];
    p.grey += w * grey[j];
    p.grey_shape += wt * grey[j];
    p.grey_slope += ws * grey[j];
    p.grey_grey += w * grey[j] * grey[j];
  }
  out = p;
}

// Of one group, lane by lane: the profiles are level + gain shape - gain_step slope, and what is left.
struct PlacedLanes {
  Lanes used{}, level{}, gain{}, gain_step{}, mean_slope{};
};
PUNCTUM_WIDE_LOOP void add_what_is_left(const PlacedLanes& of, const Lanes* grey, const Lanes* seen,
                                        const float* trust, const float* shape, const float* slope,
                                        std::size_t samples, Lanes* square, Lanes* count, Lanes& pulled) {
  const PlacedLanes p = of;
  Lanes sum{};
  for (std::size_t j = 0; j < samples; ++j) {
    const Lanes here = p.used * seen[j];
    const Lanes rest = grey[j] - p.level - p.gain * shape[j] + p.gain_step * slope[j];
    square[j] += here * rest * rest;
    count[j] += here;
    const Lanes pull = here * trust[j] * (slope[j] - p.mean_slope);
    sum += pull * pull;
  }
  pulled = sum;
}

// A group, moved by whole + u samples, scaled and cut off at low and high, to the sums over all groups.
struct MovedLanes {
  int whole;
  float u;
  double by;
  Lanes scale, use;
};
PUNCTUM_WIDE_LOOP void add_moved(const MovedLanes& of, const Lanes* row, int samples, const Lanes* low,
                                 const Lanes* high, Lanes* sum) {
  const MovedLanes m = of;
  const double last = samples - 1.001;
  for (int j = 0; j < samples; ++j) {
    const int at = std::clamp(j + m.whole, 0, samples - 2);
    const float part = j + m.by <= 0 ? 0 : j + m.by >= last ? 1 : m.u;
    const Lanes x = m.scale * (row[at] + part * (row[at + 1] - row[at]));
    sum[j] += m.use * (x < low[j] ? low[j] : x > high[j] ? high[j] : x);
  }
}

// The same in relief: of what goes beyond `turning` times how far each lane is turned to the light.
PUNCTUM_WIDE_LOOP void add_moved_in_relief(const MovedLanes& of, const Lanes& lit, const double* turning,
                                           const Lanes* row, int samples, const Lanes* low, const Lanes* high,
                                           Lanes* sum, Lanes* by_lit) {
  const MovedLanes m = of;
  const Lanes turned = lit;
  const double last = samples - 1.001;
  for (int j = 0; j < samples; ++j) {
    const int at = std::clamp(j + m.whole, 0, samples - 2);
    const float part = j + m.by <= 0 ? 0 : j + m.by >= last ? 1 : m.u;
    const Lanes x = m.scale * (row[at] + part * (row[at + 1] - row[at]));
    const Lanes more = turned * static_cast<float>(turning[j]), rest = x - more;
    const Lanes kept = m.use * (more + (rest < low[j] ? low[j] : rest > high[j] ? high[j] : rest));
    sum[j] += kept;
    by_lit[j] += turned * kept;
  }
}

}  // namespace

Vector<double> stiffness_of(double modes, const Vector<double>& soft) {
  const double wave = static_cast<double>(soft.size()) / (2 * std::numbers::pi * modes);
  const double usual = wave * wave * (wave * wave);  // of most points
  Vector<double> out(soft.size());
  std::transform(soft.begin(), soft.end(), out.begin(),
                 [usual](double s) { return s == 0 ? usual : usual * math::pow(kSoft, s); });
  return out;
}

CommonShape::CommonShape(const EdgeProfiles& profiles, const Vector<double>& soft,
                         const Vector<double>& stiffness, const EdgeShape& edge)
    : profiles_(profiles),
      soft_(soft),
      stiffness_(stiffness),
      beside_line_(edge.beside_line),
      in_shadow_(edge.in_shadow),
      modes_(edge.modes),
      least_lasting_(edge.lasting),
      trust_(profiles.samples, 1.0F),
      place_(profiles.points),
      raw_(profiles.points),
      weight_(profiles.points),
      gain_(profiles.points, 1.0),
      gain_raw_(profiles.points, 1.0),
      noise_(profiles.points),
      misfit_(profiles.points),
      likeness_(profiles.points),
      padded_(profiles.samples + 2 * kPadding),
      padded_slope_(padded_.size()),
      moved_shape_(profiles.samples),
      moved_slope_(profiles.samples) {
  if (edge.relief != Point(0, 0)) {
    for (const Point& n : profiles.normal) {
      lit_.push_back(n.dot(edge.relief));
    }
    turning_.resize(profiles.samples);
    padded_turning_.resize(padded_.size());
    padded_turning_slope_.resize(padded_.size());
  }
}

bool CommonShape::find(EdgeLearnt& learnt) {
  bool found = false;
  if (!lit_.empty()) {
    average_first_in_relief();
    found = find_from(kRounds);
  } else if (learnt.shape.size() == profiles_.samples && learnt.turning.empty()) {
    shape_ = learnt.shape;
    spread_ = learnt.spread;
    trust_samples();
    found = find_from(kRoundsFromLast);
  }
  if (!found && lit_.empty()) {
    std::fill(place_.begin(), place_.end(), 0.0);
    std::fill(gain_.begin(), gain_.end(), 1.0);
    std::fill(trust_.begin(), trust_.end(), 1.0F);
    average_first();
    found = find_from(kRounds);
  }
  learnt.shape.clear();
  if (found) {
    learn(learnt);
  }
  return found;
}

// Put where it lies about the contour on average, as the first shape of a picture does: what a place errs by
// would add up over the frames.
void CommonShape::learn(EdgeLearnt& learnt) {
  double at = 0, weight = 0;
  for (std::size_t i = 0; i < profiles_.points; ++i) {
    const double w = soft_[i] < 0.5 ? robust_[i] : 0;
    at += w * place_[i];
    weight += w;
  }
  pad(shape_, padded_, padded_slope_);
  learnt.face = weight > 0 ? at / weight : 0;
  move_shape(learnt.face, 0);
  learnt.shape.assign(moved_shape_.begin(), moved_shape_.end());
  learnt.spread = spread_;
  learnt.turning.clear();
  if (!lit_.empty()) {
    pad(turning_, padded_turning_, padded_turning_slope_);
    move_shape(learnt.face, 1);
    for (std::size_t j = 0; j < profiles_.samples; ++j) {
      learnt.turning.push_back(static_cast<double>(moved_shape_[j]) - learnt.shape[j]);
    }
  }
}

bool CommonShape::find_from(int rounds) {
  for (int round = 0; round < rounds; ++round) {
    if (!place_all()) {
      return false;
    }
    smooth_places();
    if (rounds == kRoundsFromLast && place_again()) {
      smooth_places();
    }
    average();
  }
  values_.clear();
  for (std::size_t i = 0; i < profiles_.points; ++i) {
    if (weight_[i] > 0) {
      values_.push_back(likeness_[i]);
    }
  }
  return median_in_place(values_) > kLeastLikeness;
}

bool CommonShape::tells_shape(std::size_t i) const {
  return profiles_.whole(i) && soft_[i] < 0.5 && !is_set(in_shadow_, i);
}

Vector<std::size_t> CommonShape::every_second() const {
  Vector<std::size_t> points;
  for (std::size_t i = 0; i < profiles_.points; i += 2) {
    if (tells_shape(i)) {
      points.push_back(i);
    }
  }
  return points;
}

// Of the profiles as they are.
void CommonShape::average_first() {
  const Vector<std::size_t> points = every_second();
  shape_.resize(profiles_.samples);
  for (std::size_t j = 0; j < profiles_.samples; ++j) {
    values_.clear();
    for (const std::size_t i : points) {
      values_.push_back(profiles_.grey_at(i, j));
    }
    shape_[j] = middle_mean(values_);
  }
}

// Least squares per sample, twice: what is far off the first line counts as if it lay nearer.
void CommonShape::average_first_in_relief() {
  constexpr int kAgain = 2;
  const Vector<std::size_t> points = every_second();
  shape_.assign(profiles_.samples, 0.0);
  Vector<double> lit, grey(points.size()), off(points.size());
  for (const std::size_t i : points) {
    lit.push_back(lit_[i]);
  }
  for (std::size_t j = 0; j < profiles_.samples; ++j) {
    FittedLine line;
    for (std::size_t k = 0; k < points.size(); ++k) {
      grey[k] = profiles_.grey_at(points[k], j);
      line.add(1, lit[k], grey[k]);
    }
    line.solve(shape_[j], turning_[j]);
    for (int again = 0; again < kAgain; ++again) {
      for (std::size_t k = 0; k < points.size(); ++k) {
        off[k] = std::abs(grey[k] - shape_[j] - lit[k] * turning_[j]);
      }
      values_ = off;
      const double most = kClip * std::max(kSdOfMedian * median_in_place(values_), 1e-3);
      line = {};
      for (std::size_t k = 0; k < points.size(); ++k) {
        line.add(off[k] > most ? most / off[k] : 1, lit[k], grey[k]);
      }
      line.solve(shape_[j], turning_[j]);
    }
  }
}

// Of the profiles put where the shape is, level and gain taken off, and of what is within the usual spread;
// what lies further out counts as if it lay there.
void CommonShape::average() {
  const auto m = static_cast<int>(profiles_.samples);
  Vector<Lanes> sum(profiles_.samples, Lanes{}), low(sum), high(sum), by_lit;
  FittedLine line;
  by_lit.resize(turning_.size(), Lanes{});
  for (std::size_t j = 0; j < profiles_.samples; ++j) {
    const double most = kClip * spread_[j];
    low[j] = static_cast<float>(shape_[j] - most) + Lanes{};
    high[j] = static_cast<float>(shape_[j] + most) + Lanes{};
  }
  float used = 0;
  for (std::size_t g = 0; g < profiles_.groups; ++g) {
    Lanes scale{}, use{};
    for (std::size_t l = 0, i = g * kSideBySide; l < kSideBySide && i < profiles_.points; ++l, ++i) {
      if (tells_shape(i)) {
        scale[static_cast<int>(l)] = static_cast<float>(1 / gain_[i]);
        use[static_cast<int>(l)] = 1;
      }
    }
    used += sum_of(use);
    Lanes turned{};
    for (std::size_t l = 0, i = g * kSideBySide; l < kSideBySide && i < lit_.size(); ++l, ++i) {
      const auto lane = static_cast<int>(l);
      turned[lane] = static_cast<float>(lit_[i]);
      line.add(static_cast<double>(use[lane]), lit_[i], 0);
    }
    const double by = place_of_group(g) / EdgeProfiles::kStep_px;
    const int whole = static_cast<int>(std::floor(by));
    const MovedLanes moved{whole, static_cast<float>(by - whole), by, scale, use};
    if (by_lit.empty()) {
      add_moved(moved, profiles_.grey_of(g), m, low.data(), high.data(), sum.data());
    } else {
      add_moved_in_relief(moved, turned, turning_.data(), profiles_.grey_of(g), m, low.data(), high.data(),
                          sum.data(), by_lit.data());
    }
  }
  for (std::size_t j = 0; j < profiles_.samples; ++j) {
    shape_[j] = used > 0 ? static_cast<double>(sum_of(sum[j]) / used) : 0;
    if (!by_lit.empty()) {
      line.y = static_cast<double>(sum_of(sum[j]));
      line.xy = static_cast<double>(sum_of(by_lit[j]));
      line.solve(shape_[j], turning_[j]);
    }
  }
}

void CommonShape::trust_samples() {
  double usual = 0;
  for (const double s : spread_) {
    usual += s * s / static_cast<double>(spread_.size());
  }
  for (std::size_t j = 0; j < trust_.size(); ++j) {
    const double square = spread_[j] * spread_[j];
    trust_[j] = static_cast<float>(usual / std::max(square, usual / kMostTrust + 1e-9));
  }
}

// Neighbouring places differ little: one step of Gauss and Newton from their mean leads to each of them.
double CommonShape::place_of_group(std::size_t group) const {
  const auto from = place_.begin() + static_cast<std::ptrdiff_t>(group * kSideBySide);
  const auto to = std::min(from + kSideBySide, place_.end());
  return std::accumulate(from, to, 0.0) / static_cast<double>(to - from);
}

double CommonShape::lit(std::size_t group) const {
  const std::size_t middle = std::min(group * kSideBySide + kSideBySide / 2, profiles_.points - 1);
  return lit_.empty() ? 0 : lit_[middle];
}

void CommonShape::pad(const Vector<double>& shape, Vector<float>& padded, Vector<float>& slope) const {
  const auto end = padded.begin() + kPadding + static_cast<std::ptrdiff_t>(shape.size());
  std::fill_n(padded.begin(), kPadding, static_cast<float>(shape.front()));
  std::transform(shape.begin(), shape.end(), padded.begin() + kPadding,
                 [](double v) { return static_cast<float>(v); });
  std::fill(end, padded.end(), static_cast<float>(shape.back()));
  constexpr float kPerTwoSamples = 0.5F / static_cast<float>(EdgeProfiles::kStep_px);
  for (std::size_t k = 1; k + 1 < padded.size(); ++k) {
    slope[k] = kPerTwoSamples * (padded[k + 1] - padded[k - 1]);
  }
}

// The shape and its slope (per px) at the samples of a profile whose place that is.
void CommonShape::move_shape(double place_px, double lit) {
  const double shift = place_px / EdgeProfiles::kStep_px, whole = std::ceil(shift);
  const auto u = static_cast<float>(whole - shift);
  const std::ptrdiff_t from = kPadding - static_cast<std::ptrdiff_t>(whole);
  const float *shape = padded_.data() + from, *slope = padded_slope_.data() + from;
  for (std::size_t j = 0; j < profiles_.samples; ++j) {
    moved_shape_[j] = shape[j] + u * (shape[j + 1] - shape[j]);
    moved_slope_[j] = slope[j] + u * (slope[j + 1] - slope[j]);
  }
  if (!lit_.empty()) {
    const float *turn = padded_turning_.data() + from, *turn_slope = padded_turning_slope_.data() + from;
    const auto by = static_cast<float>(lit);
    for (std::size_t j = 0; j < profiles_.samples; ++j) {
      moved_shape_[j] += by * (turn[j] + u * (turn[j + 1] - turn[j]));
      moved_slope_[j] += by * (turn_slope[j] + u * (turn_slope[j + 1] - turn_slope[j]));
    }
  }
}

void CommonShape::multiply(std::size_t group, ProfileProducts& out) const {
  add_products(profiles_.grey_of(group), profiles_.seen_in(group), trust_.data(), moved_shape_.data(),
               moved_slope_.data(), profiles_.samples, out);
}

// Places all profiles, each with its neighbourhood's contrast: of one profile alone contrast and place are
// hard to tell apart. False: too little of the edge is seen, or it is another one.
bool CommonShape::place_all() {
  const std::size_t n = profiles_.samples;
  pad(shape_, padded_, padded_slope_);
  if (!lit_.empty()) {
    pad(turning_, padded_turning_, padded_turning_slope_);
  }
  double even_energy = 0, both_energy = 0, turning_energy = 0;
  for (std::size_t k = 0; k < padded_slope_.size(); ++k) {
    const float even = padded_slope_[k], turn = lit_.empty() ? 0 : padded_turning_slope_[k];
    even_energy += static_cast<double>(even * even);
    both_energy += static_cast<double>(even * turn);
    turning_energy += static_cast<double>(turn * turn);
  }
  const double full_energy = even_energy + turning_energy;
  if (!(full_energy > 0)) {
    return false;
  }
  std::size_t used = 0;
  Vector<ProfileProducts> sums(profiles_.groups);
  for (std::size_t g = 0; g < profiles_.groups; ++g) {
    const double c = lit(g), energy = even_energy + c * (2 * both_energy + c * turning_energy);
    move_shape(place_of_group(g), c);
    multiply(g, sums[g]);
    for (std::size_t i = g * kSideBySide; i < std::min((g + 1) * kSideBySide, profiles_.points); ++i) {
      const bool seen = compare(i, sums[g], energy);
      weight_[i] = seen ? std::min(1.0, energy / full_energy) : 0;
      used += seen ? 1 : 0;
    }
  }
  average_gains();
  Vector<Lanes> square(n, Lanes{}), count(square);  // of what the shape leaves, per sample
  for (std::size_t g = 0; g < profiles_.groups; ++g) {
    place(g, sums[g], square, count);
  }
  spread_.resize(n);
  for (std::size_t j = 0; j < n; ++j) {
    const float seen = sum_of(count[j]);
    spread_[j] = seen > 0 ? std::sqrt(static_cast<double>(sum_of(square[j]) / seen)) : 0;
  }
  trust_samples();
  return static_cast<double>(used) >= kLeastSeen * static_cast<double>(profiles_.points);
}

// Those that came to lie far from where they were compared: there a second step leads on. False: none did.
bool CommonShape::place_again() {
  constexpr double kOnIt_px = 0.5;
  bool any = false;
  Vector<Lanes> square(profiles_.samples, Lanes{}), count(square);
  for (std::size_t g = 0; g < profiles_.groups; ++g) {
    if (std::abs(place_of_group(g)) > kOnIt_px) {
      const double c = lit(g);
      move_shape(place_of_group(g), c);
      ProfileProducts sums;
      multiply(g, sums);
      place(g, sums, square, count);
      any = true;
    }
  }
  return any;
}

// Level, gain and place of one profile that fit best, all at once. False: too little of the edge is seen.
bool CommonShape::compare(std::size_t i, const ProfileProducts& sums, double shape_energy) {
  const auto of = [l = static_cast<int>(i % kSideBySide)](const Lanes& v) {
    return static_cast<double>(v[l]);
  };
  if (profiles_.seen_of[i] < kLeastSamples || of(sums.untrusted) < 0.5 * shape_energy) {
    return false;
  }
  // Without level.
  const double n = of(sums.one), t = of(sums.shape) / n, s = of(sums.slope) / n, v = of(sums.grey);
  const double tt = of(sums.shape_shape) - n * t * t, ts = of(sums.shape_slope) - n * t * s;
  const double ss = of(sums.slope_slope) - n * s * s, spread = of(sums.grey_grey) - v * v / n;
  const double vt = of(sums.grey_shape) - v * t, vs = of(sums.grey_slope) - v * s;
  const double det = tt * ss - ts * ts;
  if (!(det > 0)) {
    return false;
  }
  const double gain = (vt * ss - vs * ts) / det, of_slope = (vs * tt - vt * ts) / det;
  if (!(gain > 0)) {
    return false;
  }
  gain_raw_[i] = std::clamp(gain, 0.2, 5.0);
  const double left = std::max(0.0, spread - gain * vt - of_slope * vs);
  likeness_[i] = spread > 0 ? std::max(0.0, 1 - left / spread) : 0;
  misfit_[i] = std::sqrt(left / n);
  return true;
}

// With the gain that is given: one step, and what the shape then leaves.
void CommonShape::place(std::size_t group, const ProfileProducts& sums, Vector<Lanes>& square,
                        Vector<Lanes>& count) {
  const double at = place_of_group(group);
  PlacedLanes placed;
  const std::size_t first = group * kSideBySide;
  for (std::size_t i = first; i < std::min(first + kSideBySide, profiles_.points); ++i) {
    const int l = static_cast<int>(i - first);
    raw_[i] = place_[i];
    if (weight_[i] > 0) {
      const auto of = [l](const Lanes& v) { return static_cast<double>(v[l]); };
      const double n = of(sums.one), g = gain_[i], s = of(sums.slope) / n,
                   ss = of(sums.slope_slope) - n * s * s;
      const double rest =
          of(sums.grey_slope) - of(sums.grey) * s - g * (of(sums.shape_slope) - of(sums.shape) * s);
      const double step = -rest / (g * ss);
      raw_[i] = std::clamp(at + step, -kFurthestPlace_px, kFurthestPlace_px);
      placed.used[l] = 1;
      placed.gain[l] = static_cast<float>(g);
      placed.gain_step[l] = static_cast<float>(g * step);
      placed.level[l] = static_cast<float>((of(sums.grey) - g * of(sums.shape)) / n + g * step * s);
      placed.mean_slope[l] = static_cast<float>(s);
      noise_[i] = kSampledNoise / (EdgeProfiles::kStep_px * g * g * ss * ss);
    }
  }
  move_shape(at, lit(group));
  Lanes pulled{};
  add_what_is_left(placed, profiles_.grey_of(group), profiles_.seen_in(group), trust_.data(),
                   moved_shape_.data(), moved_slope_.data(), profiles_.samples, square.data(), count.data(),
                   pulled);
  for (std::size_t i = first; i < std::min(first + kSideBySide, profiles_.points); ++i) {
    noise_[i] *= static_cast<double>(pulled[static_cast<int>(i - first)]);
  }
}

// Over so many points that those of a group have one in common.
void CommonShape::average_gains() {
  const std::size_t n = profiles_.points;
  const auto reach = static_cast<std::size_t>(kGainReach * static_cast<double>(n));
  for (std::size_t first = 0; first < n; first += kSideBySide) {
    values_.clear();
    for (std::size_t k = n + kSideBySide / 2 - reach; k <= n + kSideBySide / 2 + reach; k += 2) {
      const std::size_t q = (first + k) % n;
      if (weight_[q] > 0) {
        values_.push_back(gain_raw_[q]);
      }
    }
    if (values_.size() >= 4) {
      const std::size_t end = std::min(first + kSideBySide, n);
      std::fill(gain_.begin() + first, gain_.begin() + end, median_in_place(values_));
    }
  }
}

void CommonShape::smooth_places() {
  const std::size_t n = profiles_.points;
  values_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (weight_[i] > 0) {
      values_.push_back(misfit_[i]);
    }
  }
  const double usual = std::max(median_in_place(values_), 1e-3);
  for (std::size_t i = 0; i < n; ++i) {
    // An impurity on the edge makes the profile fit badly, and pulls.
    const double bad = 2 * std::max(0.0, misfit_[i] / usual - 1);
    weight_[i] *= std::min(1.0, gain_[i] * gain_[i]) / (1 + bad * bad);
    if (is_set(beside_line_, i) || is_set(in_shadow_, i)) {
      weight_[i] *= kBesideLine;
    }
  }
  robust_ = weight_;
  for (int round = 0; round < 2; ++round) {
    place_ = smooth_periodic(raw_, robust_, stiffness_);
    values_.clear();
    for (std::size_t i = 0; i < n; ++i) {
      if (weight_[i] > 0) {
        values_.push_back(std::abs(raw_[i] - place_[i]));
      }
    }
    const double limit = kTukey * std::max(kSdOfMedian * median_in_place(values_), kLeastScale_px);
    for (std::size_t i = 0; i < n; ++i) {
      const double t = (raw_[i] - place_[i]) / limit;
      robust_[i] = std::abs(t) < 1 ? weight_[i] * std::pow(1 - t * t, 2) : 0;
    }
  }
  place_ = smooth_periodic(raw_, robust_, stiffness_);
  for (double& p : place_) {
    p = std::clamp(p, -kFurthestPlace_px, kFurthestPlace_px);
  }
}

// The raw places scatter by the picture's noise, which differs from point to point and from frame to frame,
// and by what is beside the edge, of which neighbours see the same and the next frames, too.
CommonShape::Variance CommonShape::variance(double noise, EdgeLearnt& mean) const {
  const std::size_t n = profiles_.points;
  double points = 0, weight = 0, square = 0, weights = 0, difference = 0, by_noise = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t next = (i + 1) % n;
    const double w = robust_[i], off = raw_[i] - place_[i];
    if (w > 0) {
      points += 1;
      weight += w;
      square += w * off * off;
      by_noise += w * noise * noise * noise_[i];
      const double both = std::sqrt(w * robust_[next]);
      weights += both;
      difference += 0.5 * both * std::pow(off - raw_[next] + place_[next], 2);
    }
  }
  constexpr int kMemory = 40;  // frames
  const double part = 1.0 / (mean.frames = std::min(mean.frames + 1, kMemory));
  mean.square += part * (square / weight - mean.square);  // some are seen, or there would be no shape
  mean.difference += part * (difference / std::max(weights, 1e-9) - mean.difference);
  by_noise /= weight;
  // What neighbours have in common falls off by kGrain from point to point. Of waves that are long against
  // its kernel K the smoothing takes all: of the scatter 2 K(0) - K * K(0), times what is in common.
  const double wave = static_cast<double>(n) / (2 * std::numbers::pi * modes_);
  double scatter = mean.square, together = 1;
  for (int round = 0; round < 4; ++round) {
    scatter = mean.square / (1 - std::min(0.6, 0.44 * together / wave));
    together = 1 + 2 / (1 - kGrain) * std::max(0.0, 1 - mean.difference / std::max(scatter, 1e-9));
  }
  scatter *= together;
  by_noise = std::min(scatter, by_noise);
  const double lasting =
      std::max(scatter - by_noise, std::min(least_lasting_ * scatter, kMostLasting_px * kMostLasting_px));
  Variance out{variance_of_smoothing(robust_, stiffness_), Vector<double>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    out.all[i] += 1 / points;  // of the steps in the mean profile
    out.lasting[i] = lasting * out.all[i] + kCommon_px * kCommon_px;
    out.all[i] = by_noise * out.all[i] + out.lasting[i];
  }
  return out;
}

}  // namespace punctum::vision
