#include "vision/pipettes/needle_walls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>

#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"
#include "vision/image/straight_line.hpp"

namespace punctum::vision {

namespace {

constexpr double kPlain_px = 4;     // of a wall that stands out by itself
constexpr double kMostTaper = 0.2;  // unless the pose is steeper already

// The outermost strong edge within `reach` px of the distance u0 across the axis; a wall has two faces.
// Averaged over `length` px of it. Empty when no edge exceeds the floor.
std::optional<double> outer_edge(const GradientField& field, const NeedlePose& needle, double s, double u0,
                                 double reach, double length, double floor) {
  constexpr double kStep_px = 0.5;
  // A wall is thin and its inner face may be twice as strong; an average over noise makes it three times.
  const float outer_face = length > kPlain_px ? 0.35F : 0.5F;
  constexpr double kAlong_px = 1.5;
  const int half = static_cast<int>(std::min(reach, kWallReachAtStart_px) / kStep_px);
  const std::size_t count = static_cast<std::size_t>(2 * half + 1);
  const int samples = 2 * static_cast<int>(length / (2 * kAlong_px)) + 1;
  const Point across(-needle.axis.y, needle.axis.x);
  std::array<float, 2 * static_cast<std::size_t>(kWallReachAtStart_px / kStep_px) + 1> g{};
  std::array<float, g.size() + GradientField::kAtOnce> gx{}, gy{};
  for (int i = 0; i < samples; ++i) {
    const double t = s + (i - samples / 2) * kAlong_px;
    const double u = u0 + std::copysign(needle.taper * (t - s), u0) - half * kStep_px;
    const Point from = needle.at(t, u), step = kStep_px * across;
    const int n = 2 * half + 1;
    if (field.contains(from, step, n)) {
      field.gradients(from, step, n, gx.data(), gy.data());
    } else {
      for (int k = 0; k < n; ++k) {
        const Point here = field.gradient(from + k * step);
        gx[static_cast<std::size_t>(k)] = static_cast<float>(here.x);
        gy[static_cast<std::size_t>(k)] = static_cast<float>(here.y);
      }
    }
    const auto ax = static_cast<float>(across.x / samples), ay = static_cast<float>(across.y / samples);
    for (std::size_t k = 0; k < count; ++k) {
      g[k] += gx[k] * ax + gy[k] * ay;
    }
  }
  std::transform(g.begin(), g.end(), g.begin(), [](float e) { return std::abs(e); });
  const auto is_peak = [&g](std::size_t k) { return g[k] >= g[k - 1] && g[k] >= g[k + 1]; };
  float strongest = 0;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    if (is_peak(k)) {
      strongest = std::max(strongest, g[k]);
    }
  }
  for (std::size_t q = 1; q + 1 < count; ++q) {
    const std::size_t k = u0 > 0 ? count - 1 - q : q;  // from outside
    if (is_peak(k) && g[k] >= outer_face * strongest) {
      if (static_cast<double>(strongest) < floor) {
        return std::nullopt;
      }
      const double at = static_cast<int>(k) - half +
                        vertex_offset(static_cast<double>(g[k - 1]), static_cast<double>(g[k]),
                                      static_cast<double>(g[k + 1]));
      return u0 + at * kStep_px;
    }
  }
  return std::nullopt;
}

struct ShaftStations {
  Vector<double> along, middle, half;
  int tried = 0;
};

ShaftStations stations_along(const GradientField& field, const NeedlePose& needle, double reach,
                             double length, double floor) {
  const cv::Rect& a = field.area;
  constexpr std::size_t kMost = 33;
  ShaftStations out;
  for (Vector<double>* v : {&out.along, &out.middle, &out.half}) {
    v->reserve(kMost);
  }
  for (double s = 8; s < 170; s += 5) {
    const Point p = needle.at(s, 0);
    if (p.x < a.x + 3 || p.x > a.x + a.width - 4 || p.y < a.y + 3 || p.y > a.y + a.height - 4) {
      break;
    }
    ++out.tried;
    const double w = needle.half_width_at(s);
    const auto low = outer_edge(field, needle, s, -w, reach, length, floor);
    const auto high = low ? outer_edge(field, needle, s, w, reach, length, floor) : std::nullopt;
    if (high && *high - *low > 0.5 * w) {
      out.along.push_back(s);
      out.middle.push_back(0.5 * (*low + *high));
      out.half.push_back(0.5 * (*high - *low));
    }
  }
  return out;
}

// ---- the cross profile of walls and lumen ----

constexpr int kLanes = 21;
constexpr double kProfileReach = 1.5;  // half-widths to either side
using Profile = std::array<double, kLanes>;

// Across the needle, in units of its half-width, without mean and slope: a membrane that the needle meets
// head-on is even across it and drops out. Empty near the border of the field.
std::optional<Profile> cross_profile(const GradientField& field, const NeedlePose& needle, double s) {
  const cv::Rect& a = field.area;
  const double w = needle.half_width_at(s);
  Profile v{};
  double mean = 0, tilt = 0, xx = 0;
  const auto place = [](std::size_t i) { return 2.0 * static_cast<double>(i) / (kLanes - 1) - 1; };
  const Point from = needle.at(s, -kProfileReach * w),
              step = 1.0 / (kLanes - 1) * (needle.at(s, kProfileReach * w) - from);
  std::array<float, kLanes + GradientField::kAtOnce> grey{};
  const bool whole = field.contains(from, step, kLanes);
  if (whole) {
    field.greys(from, step, kLanes, grey.data());
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (!whole) {
      const Point p = from + static_cast<double>(i) * step;
      if (p.x < a.x + 1 || p.y < a.y + 1 || p.x > a.x + a.width - 2 || p.y > a.y + a.height - 2) {
        return std::nullopt;
      }
      grey[i] = static_cast<float>(field.grey(p));
    }
    v[i] = static_cast<double>(grey[i]);
    mean += v[i] / kLanes;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    tilt += place(i) * v[i];
    xx += place(i) * place(i);
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    v[i] -= mean + tilt / xx * place(i);
  }
  return v;
}

struct ShaftProfile {
  Profile sum{};
  double norm2 = 0;
  int stations = 0;
};

// The sum of the profiles of 58 px of the shaft. Empty when walls and lumen do not stand out of what the
// smoothing leaves of the noise.
std::optional<ShaftProfile> shaft_profile(const GradientField& field, const NeedlePose& needle, double back,
                                          double noise) {
  ShaftProfile out;
  for (double s = back + 2; s < back + 60; s += 1) {
    if (const auto v = cross_profile(field, needle, s)) {
      ++out.stations;
      for (std::size_t i = 0; i < kLanes; ++i) {
        out.sum[i] += (*v)[i];
      }
    }
  }
  for (double x : out.sum) {
    out.norm2 += x * x;
  }
  const double contrast = std::sqrt(out.norm2 / kLanes) / std::max(out.stations, 1);
  const double smooth_noise = noise / (2 * field.sigma * std::sqrt(std::numbers::pi));
  if (out.stations < 5 || contrast < std::max(0.7, 4 * smooth_noise / std::sqrt(out.stations))) {
    return std::nullopt;
  }
  return out;
}

// An edge that stands out of the noise, averaged over `length` px, has at least this change of grey.
double least_edge(const GradientField& field, double noise, double length) {
  // Along a wall the smoothing joins about so much.
  const double joined = 2 * std::sqrt(std::numbers::pi) * field.sigma;
  return 4 * field.noise_of_gradient(noise) *
         (length > kPlain_px ? std::sqrt(joined / (joined + length)) : 1);
}

// As fit_walls, with edges averaged over `length` px.
double fit_walls_averaged(const GradientField& field, double noise, double radius, double reach,
                          double length, NeedlePose& needle) {
  const double floor = least_edge(field, noise, length);
  const ShaftStations stations = stations_along(field, needle, reach, length, floor);
  const std::size_t n = stations.along.size();
  constexpr double kStations_px = 5;
  if (static_cast<double>(n) < std::max(4.0, 2.5 * length / kStations_px)) {  // fewer are not independent
    return 0;
  }
  Vector<double> weight(n, 1.0);
  StraightLine middle, half;
  for (int round = 0; round < 5; ++round) {
    const auto new_middle = fit_line(stations.along, stations.middle, weight);
    const auto new_half = fit_line(stations.along, stations.half, weight);
    if (!new_middle || !new_half) {
      return 0;
    }
    middle = *new_middle;
    half = *new_half;
    for (std::size_t i = 0; i < n; ++i) {
      const double e = middle.residual(stations.along[i], stations.middle[i]) / 0.6;
      const double f = half.residual(stations.along[i], stations.half[i]) / 0.8;
      weight[i] = 1 / std::pow(1 + e * e + f * f, 2);
    }
  }
  // A short shaft tells its tilt poorly, so the tilt is corrected in part only.
  const double trust = std::clamp(stations.along.back() / 60, 0.0, 1.0);
  const Point across(-needle.axis.y, needle.axis.x);
  needle.tip += middle.offset * across;
  needle.axis -= trust * middle.slope * across;
  needle.axis *= 1 / cv::norm(needle.axis);
  if (half.offset > 0.3 * needle.half_width && half.offset < 2 * std::max(needle.half_width, radius)) {
    needle.half_width = half.offset;
    needle.taper = std::clamp(half.slope, 0.0, std::max(kMostTaper, needle.taper));
  }
  // An edge of four standard deviations lies up to a quarter of its squared width off.
  const double tolerance = length > 20 ? 1.6 : 1;
  int straight = 0;
  for (std::size_t i = 0; i < n; ++i) {
    straight += std::abs(middle.residual(stations.along[i], stations.middle[i])) < tolerance &&
                std::abs(half.residual(stations.along[i], stations.half[i])) < tolerance;
  }
  return static_cast<double>(straight) / stations.tried;
}

}  // namespace

// The shortest average that shows the walls: a long one takes bends for straight.
double fit_walls(const GradientField& field, double noise, double radius, NeedlePose& needle, double longest,
                 double reach) {
  constexpr double kMostly = 0.8;
  const NeedlePose before = needle;
  double best = 0;
  for (const double length : {3.0, 12.0, 24.0, 40.0}) {
    if (length > longest) {
      break;
    }
    NeedlePose fitted = before;
    const double straight = fit_walls_averaged(field, noise, radius, reach, length, fitted);
    if (straight > best) {
      best = straight;
      needle = fitted;
    }
    if (best >= kMostly) {
      break;
    }
  }
  return best;
}

bool walls_go_on(const GradientField& field, double noise, const NeedlePose& needle, double from,
                 double ahead, double shortest) {
  constexpr double kMostly = 0.75;
  constexpr double kOnLine_px = 1.5, kThinnest_px = 1;
  if (needle.half_width - needle.taper * ahead < kThinnest_px) {  // they would have met before
    return false;
  }
  for (const double length : {shortest, 2 * shortest}) {
    const double floor = least_edge(field, noise, length);
    int tried = 0, on_lines = 0;
    for (double s = from; s <= ahead; s += shortest / 3) {
      const double w = needle.half_width - needle.taper * s;
      if (!field.area.contains(needle.at(-s, 0))) {
        break;
      }
      ++tried;
      const auto low = outer_edge(field, needle, -s, -w, kWallReach_px, length, floor);
      const auto high = low ? outer_edge(field, needle, -s, w, kWallReach_px, length, floor) : std::nullopt;
      on_lines += high && std::abs(*low + w) < kOnLine_px && std::abs(*high - w) < kOnLine_px ? 1 : 0;
    }
    if (on_lines > kMostly * tried) {
      return true;
    }
  }
  return false;
}

std::optional<double> end_of_profile(const GradientField& field, const NeedlePose& needle, double back,
                                     double ahead, double noise) {
  constexpr double kStep_px = 0.5;
  constexpr double kPresent = 0.22;  // share of the shaft's profile above which it counts as present
  const auto shaft = shaft_profile(field, needle, back, noise);
  if (!shaft) {
    return std::nullopt;
  }
  // How much of the shaft's profile each station holds, and its distance ahead of the tip.
  Vector<double> share, place;
  for (Vector<double>* v : {&share, &place}) {
    v->reserve(static_cast<std::size_t>((back + ahead) / kStep_px) + 1);
  }
  for (double s = back; s >= -ahead; s -= kStep_px) {
    const auto v = cross_profile(field, needle, s);
    if (!v) {
      break;
    }
    double dot = 0;
    for (std::size_t i = 0; i < kLanes; ++i) {
      dot += (*v)[i] * shaft->sum[i];
    }
    share.push_back(dot * shaft->stations / shaft->norm2);
    place.push_back(-s);
  }
  // Change point of (share - kPresent).
  double sum = 0, top = -1;
  std::size_t last = 0;
  for (std::size_t i = 0; i < share.size(); ++i) {
    sum += std::clamp(share[i], -0.3, 0.6) - kPresent;
    if (sum > top) {
      top = sum;
      last = i;
    }
  }
  if (last < 8 || last + 4 >= share.size()) {
    return std::nullopt;
  }
  // Sub-pixel: half of the share just before the end. Blur does not move the middle of a step.
  const Vector<double> before(share.begin() + static_cast<std::ptrdiff_t>(last >= 24 ? last - 24 : 0),
                              share.begin() + static_cast<std::ptrdiff_t>(last - 6));
  const double half = 0.5 * median_of(before);
  for (std::size_t i = last - 6; i + 1 < std::min(share.size(), last + 8); ++i) {
    if (share[i] >= half && share[i + 1] < half) {
      return place[i] + kStep_px * (share[i] - half) / (share[i] - share[i + 1]);
    }
  }
  return place[last];
}

std::optional<double> steepest_wall_step(const GradientField& field, const NeedlePose& needle, double reach,
                                         double floor, double sign) {
  constexpr double kStep_px = 0.25;
  const int n = 2 * static_cast<int>(reach / kStep_px) + 1;
  Vector<double> g(static_cast<std::size_t>(n), 0.0);
  for (int i = 0; i < n; ++i) {
    const double ahead = (i - n / 2) * kStep_px;
    double e = 0;
    for (const double u : {-0.95, -0.8, -0.65, 0.65, 0.8, 0.95}) {
      e += field.gradient(needle.at(-ahead, u * needle.half_width)).dot(needle.axis) / 6;
    }
    g[static_cast<std::size_t>(i)] = sign == 0 ? std::abs(e) : sign * e;
  }
  std::optional<std::size_t> best;
  for (std::size_t k = 1; k + 1 < g.size(); ++k) {
    if (g[k] > floor && g[k] >= g[k - 1] && g[k] >= g[k + 1] && (!best || g[k] > g[*best])) {
      best = k;
    }
  }
  if (!best) {
    return std::nullopt;
  }
  const std::size_t k = *best;
  return (static_cast<int>(k) - n / 2 + vertex_offset(g[k - 1], g[k], g[k + 1])) * kStep_px;
}

void put_at_end_of_walls(const GradientField& field, double noise, double back, double ahead,
                         NeedlePose& needle) {
  if (const auto s = end_of_profile(field, needle, back, ahead, noise)) {
    needle.tip += *s * needle.axis;
  }
}

}  // namespace punctum::vision
