#include "vision/pipettes/wide_tube.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/parabola.hpp"
#include "vision/pipettes/border_section.hpp"
#include "vision/pipettes/robust_line.hpp"

namespace punctum::vision {

namespace {

constexpr double kWideStride_px = 1.5;
constexpr std::size_t kUsualStations = 10;  // at the border they tell what the walls look like; more in noise
constexpr double kWallContinued = 0.5;      // of that: the tube goes on
constexpr double kSurely = 0.8;             // and its other wall tells so
constexpr int kNoWallMost = 5;              // stations in a row without either wall: what follows is the cell
constexpr int kCrossedMost = 16;            // stations in a row with a speck on one wall
constexpr double kLong_px = 60;             // a tube that is traced so far is none of a speck
constexpr double kAlike = 0.75;             // correlation of one look of a wall with another
constexpr double kWallGiveUp = 3;           // so far below its best value the sum does not recover

// How many times as long a strip is averaged in noise, to tell what a wall is and what it looks like.
double times_as_long(double noise) {
  constexpr double kUsualNoise = 10, kMost = 2;
  return std::clamp(noise * noise / (kUsualNoise * kUsualNoise), 1.0, kMost);
}

struct Stations {
  Vector<double> along, middle, half, similarity;
  void resize(std::size_t n) {
    for (auto* v : {&along, &middle, &half, &similarity}) {
      v->resize(n);
    }
  }
};

// What a wall looks like across the tube, without its mean: grey levels at equal steps.
constexpr double kWallStep_px = 0.5;
constexpr std::size_t kWallSamples = 17;
constexpr double kWallReach_px = kWallStep_px * (kWallSamples / 2);  // to either side
using WallProfile = std::array<double, kWallSamples>;
constexpr std::size_t kBeside = 6;  // steps to either side, in which a wall is looked for at the next station
constexpr std::size_t kWideSamples = kWallSamples + 2 * kBeside;
using WideProfile = std::array<double, kWideSamples>;

// Averaged over 2 `lines` of them, along the tube.
template <std::size_t samples>
std::array<double, samples> greys_across(const GradientField& field, const Point& p, const Point& along,
                                         const Point& across, int lines) {
  constexpr double kApart_px = 0.8;
  std::array<double, samples> out{};
  for (std::size_t i = 0; i < samples; ++i) {
    const double u = (static_cast<double>(i) - static_cast<double>(samples / 2)) * kWallStep_px;
    for (int k = 0; k < lines; ++k) {
      const double s = (k + 0.5) * kApart_px;
      out[i] +=
          (field.grey(p + u * across - s * along) + field.grey(p + u * across + s * along)) / (2 * lines);
    }
  }
  return out;
}

WallProfile without_mean(const double* grey) {
  WallProfile out{};
  std::copy_n(grey, out.size(), out.begin());
  const double mean = std::accumulate(out.begin(), out.end(), 0.0) / static_cast<double>(out.size());
  for (double& g : out) {
    g -= mean;
  }
  return out;
}

double dot(const WallProfile& a, const WallProfile& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// The side of a shadow, a straight slope over all 14 px: it has no place. Of the variance of a wall and what
// is beside it, a slope explains less, even of a plain step with a blur of 3 px.
bool is_slope(const WideProfile& greys) {
  constexpr double kSlope = 0.985;  // walls that are 4 px out of focus: up to 0.93
  const double n = static_cast<double>(greys.size()),
               mean = std::accumulate(greys.begin(), greys.end(), 0.0) / n;
  double uu = 0, ug = 0, gg = 0;
  for (std::size_t i = 0; i < greys.size(); ++i) {
    const double u = static_cast<double>(i) - (n - 1) / 2, g = greys[i] - mean;
    uu += u * u;
    ug += u * g;
    gg += g * g;
  }
  return ug * ug > kSlope * uu * gg;
}

// Follows both outer edges, each near where it was, by what they look like at the border. The tube
// ends where the sum of (similarity - kWallContinued) is largest. Empty when it does not end in the picture.
std::optional<Stations> follow_edges(const GradientField& field, const TubeTrace& t, const Point& across,
                                     double noise) {
  std::array<double, 2> at{-t.half_width, t.half_width};
  std::array<WallProfile, 2> usual{};
  const double longer = times_as_long(noise);
  const std::size_t usual_stations = static_cast<std::size_t>(longer * kUsualStations);
  for (std::size_t k = 0; k < 2; ++k) {
    WideProfile wide{};
    for (std::size_t i = 0; i < usual_stations; ++i) {
      const Point p = t.root + static_cast<double>(i) * kWideStride_px * t.axis + at[k] * across;
      if (!field.shows(p - kWallReach_px * across) || !field.shows(p + kWallReach_px * across)) {
        return std::nullopt;  // the end of the picture looks like a wall
      }
      const auto greys = greys_across<kWideSamples>(field, p, t.axis, across, 1);
      for (std::size_t j = 0; j < greys.size(); ++j) {
        wide[j] += greys[j] / static_cast<double>(usual_stations);
      }
    }
    usual[k] = without_mean(wide.data() + kBeside);
    if (!(dot(usual[k], usual[k]) > 0) || is_slope(wide)) {
      return std::nullopt;
    }
  }
  // Noise makes a wall unlike itself: it is averaged along the tube until a tenth of the wall's square is
  // left of it.
  constexpr double kNoiseLeft = 0.1;
  constexpr int kLinesMost = 6;
  const double smooth_noise = noise / (2 * field.sigma * std::sqrt(std::numbers::pi));
  const double square = std::min(dot(usual[0], usual[0]), dot(usual[1], usual[1])) / kWallSamples;
  constexpr double kClearWall = 4, kSureWall = 50;  // times the noise
  if (square * longer < kClearWall * smooth_noise * smooth_noise) {
    return std::nullopt;
  }
  const int lines =
      std::clamp(static_cast<int>(smooth_noise * smooth_noise / (kNoiseLeft * square)), 1, kLinesMost);
  Stations out;
  const double longest = 0.85 * field.area.width / std::abs(t.axis.x);
  double sum = 0, sum_best = 0;
  std::size_t last = 0;
  int one_wall = 0, no_wall = 0;  // stations in a row
  for (double s = 0; s < longest; s += kWideStride_px) {
    std::array<double, 2> place = at, like{-1, -1};
    for (std::size_t k = 0; k < 2; ++k) {
      WallProfile most{};
      const auto greys =
          greys_across<kWideSamples>(field, t.root + s * t.axis + at[k] * across, t.axis, across, lines);
      for (std::size_t i = 0; i <= 2 * kBeside; ++i) {
        const WallProfile wall = without_mean(greys.data() + i);
        const double as_usual = dot(wall, usual[k]) / dot(usual[k], usual[k]);
        if (as_usual > like[k]) {
          like[k] = as_usual;
          place[k] = at[k] + (static_cast<double>(i) - static_cast<double>(kBeside)) * kWallStep_px;
          most = wall;
        }
      }
      // A membrane may look a little alike, and stronger.
      const double alike =
          dot(most, usual[k]) / std::sqrt(std::max(dot(most, most), 1e-9) * dot(usual[k], usual[k]));
      like[k] = alike < kAlike ? std::min(like[k], 0.0) : std::min({like[k], 1.0, 2.5 - like[k]});
    }
    // A speck on one wall tells nothing. Where the tube ends, both walls do.
    const bool crossed = std::max(like[0], like[1]) > kSurely &&
                         std::min(like[0], like[1]) < kWallContinued && ++one_wall <= kCrossedMost;
    one_wall = std::min(like[0], like[1]) < kWallContinued ? one_wall : 0;
    const double similarity = crossed ? kWallContinued : std::clamp(std::min(like[0], like[1]), 0.0, 1.0);
    const std::size_t count = out.along.size();
    out.along.push_back(s);
    out.middle.push_back(0.5 * (place[0] + place[1]));
    out.half.push_back(0.5 * (place[1] - place[0]));
    out.similarity.push_back(crossed ? 0 : similarity);
    sum += similarity - kWallContinued;
    if (sum > sum_best) {
      sum_best = sum;
      last = count;
    }
    no_wall = std::max(like[0], like[1]) < kWallContinued ? no_wall + 1 : 0;
    if (sum < sum_best - kWallGiveUp || no_wall == kNoWallMost) {
      break;
    }
    if (similarity > kWallContinued) {
      // Its walls are straight and bend only into its mouth.
      constexpr double kSteepest_px = 0.25;  // per station
      for (std::size_t k = 0; k < 2; ++k) {
        at[k] += std::clamp(0.4 * (place[k] - at[k]), -kSteepest_px, kSteepest_px);
      }
    }
  }
  // Noise looks like what was learnt of it, as far as that was learnt and averaged.
  const bool sure = square > kSureWall * smooth_noise * smooth_noise;
  const std::size_t least = sure ? 4 : usual_stations + 2 * static_cast<std::size_t>(lines);
  if (last < least || last + 1 >= out.along.size()) {
    return std::nullopt;
  }
  out.resize(last + 1);
  return out;
}

// From its section at the border to its end.
std::optional<TubeTrace> trace_section(const GradientField& field, TubeTrace t, double noise) {
  const Point across = across_tube(t.axis);
  const auto stations = follow_edges(field, t, across, noise);
  if (!stations) {
    return std::nullopt;
  }
  t.similarity = std::accumulate(stations->similarity.begin(), stations->similarity.end(), 0.0) /
                 static_cast<double>(stations->similarity.size());
  const RobustLine middle = fit_robust_line(stations->along, stations->middle, stations->similarity, 1.0);
  const RobustLine width = fit_robust_line(stations->along, stations->half, stations->similarity, 1.0);
  if (middle.rms > 2.5 || width.rms > 0.08 * t.half_width + 1.0) {
    return std::nullopt;  // not straight
  }
  t.root += middle.line.offset * across;
  t.axis = t.axis + middle.line.slope * across;
  t.axis *= 1 / cv::norm(t.axis);
  t.length = stations->along.back();
  t.half_width = width.line.offset;
  t.end_half_width =
      std::clamp(width.line.offset + width.line.slope * t.length, 0.5 * t.half_width, 1.5 * t.half_width);
  return t;
}

}  // namespace

std::optional<TubeTrace> trace_wide_tube(const GradientField& field, Border border, double width_min,
                                         double width_max, double noise) {
  if (field.area.width < 48 || field.area.height < 48) {
    return std::nullopt;
  }
  const WantedTube wanted{.width_min = width_min,
                          .width_max = width_max,
                          .strip = times_as_long(noise) * std::clamp(0.03 * field.area.width, 8.0, 24.0),
                          .relative = 0.3,
                          .tilt_max_deg = 20};
  std::optional<TubeTrace> best;
  const auto sure = [](const TubeTrace& t) { return t.similarity * std::min(t.length, kLong_px); };
  for (const TubeTrace& section : border_sections(field, border, wanted, noise)) {
    const auto tube = trace_section(field, section, noise);
    if (tube && (!best || sure(*tube) > sure(*best))) {
      best = tube;
    }
    if (best && best->length >= kLong_px && best->similarity > kWallContinued) {
      break;
    }
  }
  return best;
}

std::optional<double> end_face(const GradientField& field, const Point& guess, const Point& axis,
                               double half_width, double reach, double noise) {
  constexpr double kFine_px = 0.25;
  const Point across(-axis.y, axis.x);
  const int n = 2 * static_cast<int>(reach / kFine_px) + 1;
  Vector<double> g(static_cast<std::size_t>(n));
  const double half = std::max(1.0, half_width);
  // The magnitudes of strips are added, since wall and lumen may change in opposite senses; within a strip
  // noise averages out. A face that shows in strips of one line needs no wider ones.
  const auto strongest = [&](int strip, double clear) -> std::optional<double> {
    const int strips = std::max(1, (2 * static_cast<int>(half) + 1) / strip), lanes = strips * strip;
    for (int i = 0; i < n; ++i) {
      const double s = (i - n / 2) * kFine_px;
      double sum = 0, of_strip = 0;
      for (int k = 0; k < lanes; ++k) {
        const double u = lanes > 1 ? (2.0 * k / (lanes - 1) - 1) * half : 0;
        of_strip += field.gradient(guess + s * axis + u * across).dot(axis);
        if ((k + 1) % strip == 0) {
          sum += std::abs(std::exchange(of_strip, 0.0));
        }
      }
      g[static_cast<std::size_t>(i)] = sum / lanes;
    }
    // The walls bend into the face, so the guess is a little short of it; the edge of the cell's ooplasm,
    // which lies further off, may be stronger.
    constexpr double kShort_px = 4, kUncertain_px = 8;
    double most = 0;
    std::size_t top = 0;
    for (std::size_t i = 1; i + 1 < g.size(); ++i) {
      const double off = ((static_cast<double>(i) - n / 2) * kFine_px - kShort_px) / kUncertain_px;
      const double likely = g[i] * math::exp(-0.5 * off * off);
      if (g[i] >= g[i - 1] && g[i] >= g[i + 1] && likely > most) {
        most = likely;
        top = i;
      }
    }
    if (top == 0 || g[top] < clear * field.noise_of_gradient(noise)) {
      return std::nullopt;
    }
    return (static_cast<int>(top) - n / 2 + vertex_offset(g[top - 1], g[top], g[top + 1])) * kFine_px;
  };
  constexpr int kStrip = 6;
  constexpr double kClear = 3, kClearStrip = 1.2;  // noise alone leaves 0.8, and 0.5 +- 0.13 in strips
  const auto plain = strongest(1, kClear);
  return plain ? plain : strongest(kStrip, kClearStrip);
}

}  // namespace punctum::vision
