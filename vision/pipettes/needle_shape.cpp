#include "vision/pipettes/needle_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/parabola.hpp"

namespace punctum::vision {

namespace {

constexpr double kStep_px = 0.5;
constexpr int kAhead = 20;       // steps that the shape begins ahead of the tip: as far as a start may err
constexpr int kBehind = 160;     // steps behind the tip; further back the shaft tells nothing of the end
constexpr int kLeastShaft = 24;  // steps of the needle that must be seen
constexpr int kMemory = 40;      // frames
// Neighbouring steps do not tell independent things: smoothing and granules join about this many.
constexpr double kJoined = 8;
constexpr double kClear = 6;  // log-likelihood by which a needle is told from none
constexpr double kDoubt = 3;  // log-likelihood below the best; a Gaussian has fallen so far at 2.4 sigma
// A needle that left the plane of focus: its walls blur into each other, most of all near the tip.
constexpr std::array kBlurs_px = {0.0, 0.8, 1.2, 1.6, 2.0, 2.5};

// Where the lanes stand across the needle: -1 .. 1.
template <std::size_t kLanes>
constexpr std::array<float, kLanes> places() {
  std::array<float, kLanes> out{};
  for (std::size_t i = 0; i < kLanes; ++i) {
    out[i] = 2.0F * static_cast<float>(i) / (kLanes - 1) - 1;
  }
  return out;
}

using EightFloats = float __attribute__((vector_size(32)));

// Of n profiles, eight side by side: each as a share of its mean, if by_usual, and without mean and slope.
template <std::size_t kLanes>
[[gnu::always_inline]] inline void normalise_each(float* rows, std::size_t n, bool by_usual) {
  constexpr std::size_t kEight = 8;
  constexpr auto kPlaces = places<kLanes>();
  constexpr auto kCount = static_cast<float>(kLanes);
  for (std::size_t first = 0; first < n; first += kEight) {
    const std::size_t many = std::min(kEight, n - first);
    float* these = rows + first * kLanes;
    std::array<EightFloats, kLanes> v{};
    for (std::size_t i = 0; i < kLanes; ++i) {
      for (std::size_t k = 0; k < many; ++k) {
        v[i][k] = these[k * kLanes + i];
      }
    }
    if (by_usual) {
      EightFloats usual{};
      for (const EightFloats& lane : v) {
        usual += lane;
      }
      usual /= kCount;
      for (EightFloats& lane : v) {
        lane /= usual < 1.0F ? 1.0F + EightFloats{} : usual;
      }
    }
    EightFloats sum{}, tilt{};
    float xx = 0;
    for (std::size_t i = 0; i < kLanes; ++i) {
      sum += v[i];
      tilt += kPlaces[i] * v[i];
      xx += kPlaces[i] * kPlaces[i];
    }
    const EightFloats mean = sum / kCount, slope = tilt / xx;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const EightFloats lane = v[i] - (mean + slope * kPlaces[i]);
      for (std::size_t k = 0; k < many; ++k) {
        these[k * kLanes + i] = lane[k];
      }
    }
  }
}

PUNCTUM_WIDE_LOOP void normalise(float* rows, std::size_t n, bool by_usual) {
  normalise_each<21>(rows, n, by_usual);
}

}  // namespace

// Empty near the border of the field.
std::optional<NeedleShape::Profile> NeedleShape::light_across(const GradientField& field,
                                                              const NeedlePose& needle, double behind) const {
  constexpr auto kPlaces = places<kLanes>();
  const cv::Rect& a = field.area;
  for (const double side : {-reach_, reach_}) {
    const Point p = needle.at(behind, side);
    if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
      return std::nullopt;
    }
  }
  Profile light{};
  const Point from = needle.at(behind, -reach_),
              step = 1.0 / (kLanes - 1) * (needle.at(behind, reach_) - from);
  if (field.contains(from, step, kLanes)) {
    std::array<float, kLanes + GradientField::kAtOnce> grey;
    field.greys(from, step, kLanes, grey.data());
    std::copy_n(grey.begin(), kLanes, light.begin());
    return light;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Point p = needle.at(behind, static_cast<double>(kPlaces[i]) * reach_);
    light[i] = Bilinear(p.x - a.x, p.y - a.y).of(field.smooth);
  }
  return light;
}

// Every half pixel from kAhead steps further ahead than `ahead` px on, `rows` of them or as far as the field
// shows them.
NeedleShape::Profiles NeedleShape::light_along(const GradientField& field, const NeedlePose& needle,
                                               double ahead, int rows) const {
  Profiles out;
  out.reserve(static_cast<std::size_t>(rows));
  for (int j = -kAhead; j < rows - kAhead; ++j) {
    const auto light = light_across(field, needle, j * kStep_px - ahead);
    if (!light) {
      break;
    }
    out.push_back(*light);
  }
  return out;
}

NeedleShape::Profiles NeedleShape::absorption(Profiles light) {
  static_assert(kLanes == 21);
  if (!light.empty()) {
    normalise(light.front().data(), light.size(), true);
  }
  return light;
}

// As light_along; where the backdrop is not known, of the usual light.
NeedleShape::Profiles NeedleShape::absorption_over(const Backdrop& backdrop, const NeedlePose& needle,
                                                   double ahead, const Profiles& light,
                                                   const Profiles& of_usual) const {
  constexpr auto kPlaces = places<kLanes>();
  Profiles out = light;
  Vector<std::uint8_t> known(light.size(), 1);
  for (std::size_t k = 0; k < light.size(); ++k) {
    const double behind = (static_cast<int>(k) - kAhead) * kStep_px - ahead;
    Profile without{};
    for (std::size_t i = 0; i < kLanes && known[k] != 0; ++i) {
      const auto g = backdrop.grey(needle.at(behind, static_cast<double>(kPlaces[i]) * reach_));
      known[k] = g && *g > 1 ? 1 : 0;
      without[i] = static_cast<float>(g.value_or(1));
    }
    for (std::size_t i = 0; i < kLanes && known[k] != 0; ++i) {
      out[k][i] /= without[i];
    }
  }
  normalise(out.front().data(), out.size(), false);
  for (std::size_t k = 0; k < light.size(); ++k) {
    if (known[k] == 0) {
      out[k] = of_usual[k];
    }
  }
  return out;
}

void NeedleShape::learn(const GradientField& field, const NeedlePose& needle) {
  if (frames_ == 0) {
    constexpr double kBeside_px = 2.5;  // the blur of the walls
    reach_ = needle.half_width_at(20) + kBeside_px;
  }
  const Profiles now = absorption(light_along(field, needle, 0, kAhead + kBehind + 1));
  if (now.size() < static_cast<std::size_t>(kAhead + kLeastShaft)) {
    return;
  }
  frames_ = std::min(frames_ + 1, kMemory);
  const std::size_t old = mean_.size();
  mean_.resize(std::max(old, now.size()));
  for (std::size_t k = 0; k < now.size(); ++k) {
    const float part = k < old ? 1.0F / static_cast<float>(frames_) : 1;
    for (std::size_t i = 0; i < kLanes; ++i) {
      mean_[k][i] += part * (now[k][i] - mean_[k][i]);
    }
  }
  smooth_along_shaft();
}

namespace {

// As median_of, of each of eight columns by itself: the lowest to the front, one by one, as far as the
// middle.
template <std::size_t kRows>
[[gnu::always_inline]] inline void median_of_eight(const float* rows, std::size_t apart, float* out) {
  std::array<EightFloats, kRows> v;
  for (std::size_t k = 0; k < kRows; ++k) {
    std::memcpy(&v[k], rows + k * apart, sizeof v[k]);
  }
#pragma GCC unroll 16
  for (std::size_t k = 0; k <= kRows / 2; ++k) {
#pragma GCC unroll 16
    for (std::size_t j = k + 1; j < kRows; ++j) {
      const EightFloats a = v[k], b = v[j];
      v[k] = b < a ? b : a;
      v[j] = b < a ? a : b;
    }
  }
  std::memcpy(out, &v[kRows / 2], sizeof v[0]);
}

// Of each of the first `many` columns, a multiple of eight.
PUNCTUM_WIDE_LOOP void median_of_thirteen(const float* rows, std::size_t apart, std::size_t many,
                                          float* out) {
  for (std::size_t i = 0; i < many; i += 8) {
    median_of_eight<13>(rows + i, apart, out + i);
  }
}

}  // namespace

// Behind its tip the needle looks the same everywhere, and ahead of it is nothing of it: what differs there
// is a speck, and one that stands still while the needle moves must not hold the shape where it was.
void NeedleShape::smooth_along_shaft() {
  // Steps: up to here the shape is the tip's own. Over few frames a speck would weigh, so it is less then.
  const std::size_t tip = kAhead + (frames_ < kMemory / 2 ? 8 : 16);
  constexpr std::size_t kReach = 24, kStride = 4;  // steps: a speck is shorter
  constexpr double kBlur_px = 4;                   // ahead of the face
  constexpr float kNoAbsorption = std::numeric_limits<float>::max();
  Profiles& shape = shape_.front().rows;
  shape = mean_;
  constexpr std::size_t kMost = 2 * kReach / kStride + 1, kPadded = (kLanes + 7) / 8 * 8;
  static_assert(kMost == 13);
  std::array<std::array<float, kPadded>, kMost> near{};
  std::array<float, kPadded> median{};
  for (std::size_t k = tip; k < mean_.size(); ++k) {
    std::size_t from = std::max(tip, k - kReach), to = std::min(mean_.size() - 1, k + kReach);
    if (frames_ >= kMemory / 2) {  // even, so that a needle that widens is not drawn to one side
      const std::size_t reach = std::min({kReach, k - kAhead, mean_.size() - 1 - k}) / kStride * kStride;
      from = k - reach;
      to = k + reach;
    }
    // Near the ends there are fewer rows; others on either side of all values leave the median as it is.
    const std::size_t n = (to - from) / kStride + 1, below = kMost / 2 - n / 2;
    for (std::size_t j = 0; j < kMost; ++j) {
      if (j < below || j >= below + n) {
        near[j].fill(j < below ? -kNoAbsorption : kNoAbsorption);
      } else {
        std::copy_n(mean_[from + (j - below) * kStride].begin(), kLanes, near[j].begin());
      }
    }
    median_of_thirteen(near[0].data(), kPadded, kPadded, median.data());
    std::copy_n(median.begin(), kLanes, shape[k].begin());
  }
  const double front = kAhead - (face().value_or(0) + kBlur_px) / kStep_px;
  for (std::size_t k = 0; k < kAhead && static_cast<double>(k) < front; ++k) {
    shape[k].fill(0);
  }
  for (Look& look : shape_) {
    if (&look != &shape_.front()) {
      look.rows.clear();
    }
  }
  shape_.front().arrange();
}

double NeedleShape::blur_px(View view) { return kBlurs_px[view.blur]; }

bool NeedleShape::beyond_blurs(View view) { return view.blur + 1 == kBlurs_px.size(); }

// Blurred when it is first asked for: most needles stay in focus.
const NeedleShape::Look& NeedleShape::look(std::size_t blurred) {
  Look& out = shape_[blurred];
  if (out.rows.empty()) {
    blur(kBlurs_px[blurred], out.rows);
    out.arrange();
  }
  return out;
}

// In three sums that do not wait for each other.
float NeedleShape::product(const Profile& a, const Profile& b) {
  static_assert(kLanes % 3 == 0);
  std::array<float, 3> sum{};
  for (std::size_t i = 0; i < kLanes; i += 3) {
    sum[0] += a[i] * b[i];
    sum[1] += a[i + 1] * b[i + 1];
    sum[2] += a[i + 2] * b[i + 2];
  }
  return sum[0] + sum[1] + sum[2];
}

// Blur does not move the middle of a step: there the walls have half of their strength. From the walls to
// the front, so that a speck ahead of the tip does not count.
std::optional<double> NeedleShape::face() const {
  const Profiles& shape = shape_.front().rows;
  constexpr std::size_t kFrom = 6, kTo = 16;    // steps behind the face: the walls in full strength
  constexpr std::size_t kSurely = kAhead + 30;  // steps: there the shape shows walls however wrong the start
  if (shape.size() < kSurely + kTo) {
    return std::nullopt;
  }
  const auto strength = [&shape](std::size_t k, const Profile& walls) {
    return static_cast<double>(product(shape[k], walls) / std::max(product(walls, walls), 1e-12F));
  };
  for (std::size_t k = kSurely; k > 0; --k) {
    Profile walls{};
    for (std::size_t j = k + kFrom; j < k + kTo; ++j) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        walls[i] += shape[j][i] / (kTo - kFrom);
      }
    }
    const double here = strength(k, walls), before = strength(k - 1, walls);
    if (before < 0.5) {
      const double part = here > before ? std::clamp((0.5 - before) / (here - before), 0.0, 1.0) : 0.5;
      return (kAhead - (static_cast<double>(k) - 1 + part)) * kStep_px;
    }
  }
  return kAhead * kStep_px;  // the needle goes on at least so far
}

namespace {

// To each of n sums, the weighted values from there on that lie so far apart.
PUNCTUM_WIDE_LOOP void add_weighted(const float* values, const Vector<float>& weights, std::size_t apart,
                                    std::size_t n, float* sums) {
  for (std::size_t d = 0; d < weights.size(); ++d) {
    const float weight = weights[d], *these = values + d * apart;
    for (std::size_t i = 0; i < n; ++i) {
      sums[i] += weight * these[i];
    }
  }
}

}  // namespace

// The shape out of focus.
void NeedleShape::blur(double sigma_px, Profiles& out) const {
  out = shape_.front().rows;
  const auto kernel = [](double sigma) {
    Vector<float> k;
    float sum = 0;
    for (int i = -static_cast<int>(std::ceil(3 * sigma)); i <= std::ceil(3 * sigma); ++i) {
      k.push_back(static_cast<float>(math::exp(-0.5 * i * i / (sigma * sigma))));
      sum += k.back();
    }
    for (float& x : k) {
      x /= sum;
    }
    return k;
  };
  const auto across = kernel(sigma_px * (kLanes - 1) / (2 * reach_)), along = kernel(sigma_px / kStep_px);
  const std::size_t rows = out.size(), beyond = across.size() / 2, room = kLanes + 2 * beyond,
                    ends = along.size() / 2;
  Vector<float> wide(rows * room + 2 * beyond, 0.0F),
      blurred(rows * room, 0.0F);  // with nothing on either side
  for (std::size_t k = 0; k < rows; ++k) {
    const float beside = 0.5F * (out[k].front() + out[k].back());  // there is no needle
    std::transform(out[k].begin(), out[k].end(), wide.data() + k * room + beyond,
                   [beside](float v) { return v - beside; });
  }
  add_weighted(wide.data(), across, 1, blurred.size(), blurred.data());
  for (std::size_t k = 0; k < rows; ++k) {
    std::copy_n(blurred.data() + k * room, kLanes, out[k].begin());
  }
  normalise(out.front().data(), rows, false);
  Profiles sharp(ends, out.front());  // going on at either end as it ends
  sharp.insert(sharp.end(), out.begin(), out.end());
  sharp.insert(sharp.end(), ends, out.back());
  std::fill(out.begin(), out.end(), Profile{});
  add_weighted(sharp.front().data(), along, kLanes, rows * kLanes, out.front().data());
}

namespace {

// What a row of power `power` in the shape tells for the needle. A speck or another edge may tell for or
// against it no more than the needle itself.
float gain_of_row(float product, float power) {
  return std::min(std::max(product, -0.5F * power), 1.5F * power) - 0.5F * power;
}

}  // namespace

namespace {

// Of n ends, a multiple of eight: the products of a row of the picture with rows of the shape, whose lanes
// lie `size` apart, in three sums that do not wait for each other; and what each tells for the needle.
template <std::size_t kLanes>
[[gnu::always_inline]] inline void add_gains_of_row(const float* row, const float* lane, std::size_t size,
                                                    const float* power, std::size_t n, float* gain) {
  constexpr std::size_t kEight = 8;
  for (std::size_t q = 0; q < n; q += kEight) {
    std::array<EightFloats, 3> sum{};
    EightFloats of_lane, of_power, here;
#pragma GCC unroll 21
    for (std::size_t i = 0; i < kLanes; ++i) {
      std::memcpy(&of_lane, lane + i * size + q, sizeof of_lane);
      sum[i % 3] += row[i] * of_lane;
    }
    std::memcpy(&of_power, power + q, sizeof of_power);
    std::memcpy(&here, gain + q, sizeof here);
    const EightFloats product = sum[0] + sum[1] + sum[2], least = -0.5F * of_power, most = 1.5F * of_power,
                      bounded = product < least ? least : product;
    here += (bounded > most ? most : bounded) + least;
    std::memcpy(gain + q, &here, sizeof here);
  }
}

PUNCTUM_WIDE_LOOP void add_gains(const float* row, const float* lane, std::size_t size, const float* power,
                                 std::size_t n, float* gain) {
  add_gains_of_row<21>(row, lane, size, power, n, gain);
}

constexpr std::size_t kEndsAtOnce = 8;

}  // namespace

void NeedleShape::Look::arrange() {
  const std::size_t n = rows.size();
  power.assign(n + kEndsAtOnce, 0.0F);
  lanes.assign(kLanes * (n + kEndsAtOnce), 0.0F);
  for (std::size_t k = 0; k < n; ++k) {
    const Profile& row = rows[n - 1 - k];
    power[k] = product(row, row);
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i * (n + kEndsAtOnce) + k] = row[i];
    }
  }
}

// Of the ends from..to - 1; the shape of the e-th end begins at the e-th row. This is where the needle's time
// goes: row by row of the picture, all ends at once.
Vector<float> NeedleShape::gains(const Profiles& seen, const Look& look, int from, int to) {
  const int n = static_cast<int>(seen.size()), last = static_cast<int>(look.rows.size()) - 1;
  static_assert(kLanes == 21);
  Vector<float> gain(static_cast<std::size_t>(to - from) + kEndsAtOnce, 0.0F);
  for (int j = from; j < n; ++j) {
    const Profile& row = seen[static_cast<std::size_t>(j)];
    // Of the ends so far ahead that the row lies behind their shape, the shaft goes on as the shape ends.
    const int first = std::clamp(j - last, from, to), ends = std::min(to, j + 1) - first;
    if (first > from) {
      const float shaft = gain_of_row(product(row, look.rows.back()), look.power.front());
      std::for_each(gain.begin(), gain.begin() + (first - from), [shaft](float& g) { g += shaft; });
    }
    if (ends > 0) {
      // What the last eight have too many of belongs to ends whose shape this row lies ahead of: with rows
      // beyond the first one of the shape, which are 0.
      const std::size_t k = static_cast<std::size_t>(last - j + first), many = static_cast<std::size_t>(ends),
                        room = look.rows.size() + kEndsAtOnce;
      add_gains(row.data(), look.lanes.data() + k, room, look.power.data() + k,
                (many + kEndsAtOnce - 1) / kEndsAtOnce * kEndsAtOnce, gain.data() + (first - from));
    }
  }
  gain.resize(static_cast<std::size_t>(to - from));
  return gain;
}

NeedleShape::Fit NeedleShape::fit(const Profiles& seen, View view, int ends) {
  const Look& shape = look(view.blur);
  Fit out;
  out.view = view;
  out.gain = gains(seen, shape, 0, ends);
  out.best = static_cast<int>(std::max_element(out.gain.begin(), out.gain.end()) - out.gain.begin());
  // What the surroundings of the needle show is noise to it. Variance of a lane: by the profiles ahead of
  // this end, and of what is left behind it.
  double sum = 0;
  int count = 0;
  for (int j = 0; j < static_cast<int>(seen.size()) && j - out.best < kLeastShaft; ++j) {
    const int k = j - out.best;
    const Profile of_shape =
        k < 0 ? Profile{} : shape.rows[std::min(static_cast<std::size_t>(k), shape.rows.size() - 1)];
    for (std::size_t i = 0; i < kLanes; ++i, ++count) {
      const float d = seen[static_cast<std::size_t>(j)][i] - of_shape[i];
      sum += static_cast<double>(d * d);
    }
  }
  out.variance = sum / std::max(count, 1);
  return out;
}

// first: of the first end.
double NeedleShape::Fit::ahead_of(double first) const {
  const auto at = [&](int e) { return static_cast<double>(gain[static_cast<std::size_t>(e)]); };
  return first - (best + vertex_offset(at(best - 1), at(best), at(best + 1))) * kStep_px;
}

std::optional<NeedleShape::End> NeedleShape::end(const GradientField& field, const Backdrop& backdrop,
                                                 const NeedlePose& needle, double back, double ahead,
                                                 View near) {
  const int ends = static_cast<int>((back + ahead) / kStep_px) + 1;
  // A backdrop takes granules off, unless they have moved since; then it doubles them.
  const Profiles light = light_along(field, needle, ahead, ends + kBehind);
  if (!known() || static_cast<int>(light.size()) < ends + kAhead + kLeastShaft) {
    return std::nullopt;
  }
  const Profiles plain = absorption(light), over = absorption_over(backdrop, needle, ahead, light, plain);
  Fit best = fit(plain, {false, near.blur}, ends);
  if (Fit f = fit(over, {true, near.blur}, ends); f.variance < best.variance) {
    best = std::move(f);
  }
  const Profiles& seen = best.view.over_backdrop ? over : plain;
  constexpr int kNear = 6;  // steps: another blur does not move the end further
  const auto better = [&](std::size_t blur) {
    const auto near_best =
        gains(seen, look(blur), std::max(best.best - kNear, 0), std::min(best.best + kNear + 1, ends));
    const bool is = *std::max_element(near_best.begin(), near_best.end()) > best.top();
    if (is) {
      best = fit(seen, {best.view.over_backdrop, blur}, ends);
    }
    return is;
  };
  while (best.view.blur > 0 && better(best.view.blur - 1)) {
  }
  if (best.view.blur == near.blur) {
    while (best.view.blur + 1 < shape_.size() && better(best.view.blur + 1)) {
    }
  }
  return end_of(best, ahead);
}

std::optional<double> NeedleShape::end_near(View view, const GradientField& field, const Backdrop& backdrop,
                                            const NeedlePose& needle, double reach) {
  const int ends = static_cast<int>(2 * reach / kStep_px) + 1;
  const Profiles light = light_along(field, needle, reach, ends + kBehind);
  if (!known() || static_cast<int>(light.size()) < ends + kAhead + kLeastShaft) {
    return std::nullopt;
  }
  const Profiles plain = absorption(light);
  const Fit f =
      fit(view.over_backdrop ? absorption_over(backdrop, needle, reach, light, plain) : plain, view, ends);
  return f.inside() ? std::optional(f.ahead_of(reach)) : std::nullopt;
}

std::optional<NeedleShape::End> NeedleShape::end_of(const Fit& f, double ahead) {
  if (!f.inside()) {
    return std::nullopt;
  }
  const int ends = static_cast<int>(f.gain.size());
  const double unit = kJoined * std::max(f.variance, 1e-8);
  const auto below_best = [&](int e) {
    return static_cast<double>(f.top() - f.gain[static_cast<std::size_t>(e)]) / unit;
  };
  if (below_best(0) < kClear || below_best(ends - 1) < kClear) {
    return std::nullopt;
  }
  End out;
  out.view = f.view;
  for (int e = 0; e < ends; ++e) {
    if (below_best(e) < kDoubt) {
      out.doubt = std::max(out.doubt, std::abs(e - f.best) * kStep_px);
    }
  }
  out.ahead = f.ahead_of(ahead);
  return out;
}

}  // namespace punctum::vision
