#include "vision/image/edge_band.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr int kLeastAngles = 16, kLeastSamples = 8;
constexpr double kCentre_px = 2;  // nearer to the centre of the band nothing is visible

}  // namespace

bool is_clear_about(const cv::Mat& picture, std::span<const Point> places) {
  constexpr double kRounded_px = 1;
  constexpr int kEight = 8;
  double left = picture.cols, right = 0, top = picture.rows, bottom = 0;
  for (const Point& p : places) {
    left = std::min(left, p.x);
    right = std::max(right, p.x);
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
  }
  // The last eight pixels of a row may be looked at twice.
  const int from = static_cast<int>(std::max(left - kRounded_px, 0.0)),
            to = static_cast<int>(std::min(right + kRounded_px + 1, static_cast<double>(picture.cols))),
            first = static_cast<int>(std::max(top - kRounded_px, 0.0)),
            last = static_cast<int>(std::min(bottom + kRounded_px + 1, static_cast<double>(picture.rows)));
  if (to - from < kEight) {
    return false;
  }
  std::uint64_t any = 0, eight = 0;
  for (int y = first; y < last; ++y) {
    const std::uint8_t* row = picture.ptr(y);
    for (int x = from; x < to; x += kEight) {
      std::memcpy(&eight, row + std::min(x, to - kEight), kEight);
      any |= eight;
    }
  }
  return any == 0;
}

struct EdgeSamples::Ray {
  Point direction, normal;  // of the ray; of the middle of the band, with the sign of the edge
  double first;             // px from the centre
};

EdgeSamples::EdgeSamples(const GradientField& field, const EdgeBand& band, Polarity polarity)
    : angles(static_cast<int>(band.middle.size())),
      samples(2 * static_cast<int>(band.half_width / band.step) + 1),
      half(samples / 2) {
  if (angles < kLeastAngles || samples < kLeastSamples || field.area.empty()) {
    return;
  }
  const std::size_t n = band.middle.size();
  const std::span<const Point> ray = unit_rays(angles);
  double r_mean = 0;
  for (const double r : band.middle) {
    r_mean += r / angles;
  }
  arc = std::max(0.5, r_mean * 2 * std::numbers::pi / angles);
  edge.assign(n * static_cast<std::size_t>(samples), 0.0F);
  cost.assign(edge.size(), 1.0F);
  shown.assign(n, 0);
  constexpr std::size_t kTogether = 8;  // rays
  bool may_be_covered = false;
  for (std::size_t a = 0; a < n; ++a) {
    if (a % kTogether == 0 && !band.covered.empty()) {
      std::array<Point, 2 * kTogether> ends;
      for (std::size_t k = 0; k < kTogether; ++k) {
        const std::size_t b = std::min(a + k, n - 1);
        const double reach = (half + 1) * band.step;
        ends[2 * k] = band.centre + (band.middle[b] - reach) * ray[b];
        ends[2 * k + 1] = band.centre + (band.middle[b] + reach) * ray[b];
      }
      may_be_covered = !is_clear_about(band.covered, ends);
    }
    // The edge is measured along the normal of the band's middle line: on the wall of a dimple that is far
    // from radial. Neighbours two angles away smooth it a little.
    const std::size_t before = a >= 2 ? a - 2 : a + n - 2, after = a + 2 < n ? a + 2 : a + 2 - n;
    const Point t = band.middle[after] * ray[after] - band.middle[before] * ray[before];
    const double l = std::sqrt(t.dot(t));
    const Point normal = l > 0 ? 1 / l * Point(t.y, -t.x) : ray[a];
    const double sign = polarity == Polarity::relief       ? band.relief.sign_at(normal)
                        : polarity == Polarity::darker_out ? -1
                                                           : 1;
    sample(field, band, {ray[a], sign * normal, band.middle[a] - half * band.step}, may_be_covered, a);
  }
  if (polarity == Polarity::any) {
    std::transform(edge.begin(), edge.end(), edge.begin(), [](float e) { return std::abs(e); });
  }
}

// Whether the samples of a ray are visible, and the edge there. Nothing is visible within one pixel of the
// border of the field, where the gradient is not known.
void EdgeSamples::sample(const GradientField& field, const EdgeBand& band, const Ray& ray,
                         bool may_be_covered, std::size_t a) {
  constexpr int kMostSamples = 512;
  const std::size_t m = static_cast<std::size_t>(samples);
  float *edges = edge.data() + a * m, *costs = cost.data() + a * m;
  const auto sample_at = [&](double r) {  // the first one at or beyond that radius
    return static_cast<std::size_t>(
        std::clamp(std::ceil((r - ray.first) / band.step), 0.0, static_cast<double>(samples)));
  };
  if (band.hidden.empty() || band.hidden[a] == 0) {
    const Point from = band.centre + ray.first * ray.direction, step = band.step * ray.direction;
    const auto along = static_cast<float>(ray.normal.x), down = static_cast<float>(ray.normal.y);
    if (ray.first > kCentre_px && samples <= kMostSamples && field.contains(from, step, samples)) {
      std::array<float, kMostSamples + GradientField::kAtOnce> gx, gy;
      field.gradients(from, step, samples, gx.data(), gy.data());
      for (std::size_t j = 0; j < m; ++j) {
        edges[j] = along * gx[j] + down * gy[j];
        costs[j] = 0;
      }
    } else {
      const double right = field.area.x + field.area.width - 2, bottom = field.area.y + field.area.height - 2;
      for (int j = 0; j < samples; ++j) {
        const Point p = from + j * step;
        if (p.x >= field.area.x + 1 && p.y >= field.area.y + 1 && p.x <= right && p.y <= bottom &&
            ray.first + j * band.step > kCentre_px) {
          const Point g = field.gradient(p);
          edges[j] = along * static_cast<float>(g.x) + down * static_cast<float>(g.y);
          costs[j] = 0;
        }
      }
    }
    if (may_be_covered) {
      constexpr double kOne = 1 << 16;
      const std::uint8_t* hides = band.covered.ptr();
      const auto stride = static_cast<std::ptrdiff_t>(band.covered.step[0]);
      int x = static_cast<int>((from.x + 0.5) * kOne), y = static_cast<int>((from.y + 0.5) * kOne);
      const int dx = static_cast<int>(step.x * kOne), dy = static_cast<int>(step.y * kOne);
      for (std::size_t j = 0; j < m; ++j, x += dx, y += dy) {
        if (costs[j] == 0.0F && hides[(y >> 16) * stride + (x >> 16)] != 0) {
          edges[j] = 0;
          costs[j] = 1;
        }
      }
    }
    if (!band.seen_to.empty()) {
      const std::size_t beyond = sample_at(band.seen_to[a]);
      std::fill(edges + beyond, edges + m, 0.0F);
      std::fill(costs + beyond, costs + m, 1.0F);
    }
    const float* near = costs + (half - half / 2);
    shown[a] = std::find(near, near + 2 * (half / 2) + 1, 0.0F) != near + 2 * (half / 2) + 1 ? 1 : 0;
  }
  if (!band.lower.empty()) {
    std::fill_n(costs, sample_at(band.lower[a]), kForbidden);
  }
  if (!band.upper.empty()) {
    std::size_t beyond = sample_at(band.upper[a]);
    if (beyond < m && ray.first + static_cast<double>(beyond) * band.step <= band.upper[a]) {
      ++beyond;
    }
    std::fill(costs + beyond, costs + m, kForbidden);
  }
}

}  // namespace punctum::vision
