#include "vision/membrane/parallel_edge.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr double kDepthStep_px = 0.5;
constexpr double kShiftStep_px = 2;
constexpr int kShifts = 3;          // to either side, in both directions
constexpr double kAlike_px = 3.5;   // along the edge: nearer places see the same noise
constexpr double kLeastScore = 12;  // the best of all places in noise alone has about 4
constexpr double kTexture = 2;      // times the noise: a stronger gradient inside is not noise
constexpr double kHalf_px = 4;      // of the band round the best place

// The edge at every depth below the outer one, ray by ray.
struct EdgesBelow {
  int angles, depths;
  double from;         // px below the outer edge, of the first depth
  Vector<float> edge;  // 0 where it is hidden
  Vector<std::uint8_t> seen;
  double usual = 0;  // root of their mean square

  EdgesBelow(const EdgeBand& outer, Polarity sign, const ClearedPicture& picture, double first, double last)
      : angles(static_cast<int>(outer.middle.size())),
        depths(std::max(0, static_cast<int>((last - first) / kDepthStep_px))),
        from(first),
        edge(static_cast<std::size_t>(angles * depths), 0.0F),
        seen(edge.size(), 0) {
    double square = 0;
    int places = 0;
    for (int i = 0; i < angles; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Point ray = on_ray(Point(0, 0), i, angles, sign == Polarity::brighter_out ? 1 : -1);
      for (int j = 0; j < depths && (outer.hidden.empty() || outer.hidden[k] == 0); ++j) {
        const Point p = on_ray(outer.centre, i, angles, outer.middle[k] - from - kDepthStep_px * j);
        if (!picture.hidden(p)) {
          const double e = picture.field.gradient(p).dot(ray);
          edge[at(i, j)] = static_cast<float>(e);
          seen[at(i, j)] = 1;
          square += e * e;
          ++places;
        }
      }
    }
    usual = std::sqrt(square / std::max(places, 1));
  }
  [[nodiscard]] std::size_t at(int i, int j) const { return static_cast<std::size_t>(i * depths + j); }

  // Their sum along a parallel, in standard deviations if they were chance. shift: of its middle, in depth
  // steps per angle.
  [[nodiscard]] double score(int depth, const Vector<int>& shift, double joined) const {
    double sum = 0;
    int n = 0;
    for (int i = 0; i < angles; ++i) {
      const int j = depth - shift[static_cast<std::size_t>(i)];
      if (j >= 0 && j < depths) {
        sum += static_cast<double>(edge[at(i, j)]);
        n += seen[at(i, j)];
      }
    }
    return n > angles / 2 ? sum / (usual * std::sqrt(n * joined)) : 0;
  }
};

}  // namespace

std::optional<EdgePath> parallel_edge_within(const Vector<double>& outer, const Point& centre, Polarity sign,
                                             const ClearedPicture& picture, const VisionConfig& config) {
  EdgeBand band;
  band.centre = centre;
  band.middle = outer;
  band.covered = picture.covered;
  picture.exclude_holder(band, outer);
  const double mean = median_of(outer);
  const EdgesBelow below(band, sign, picture, 1.2 * config.px(config.h_m), 0.5 * mean);
  if (sign == Polarity::any || !(below.usual < kTexture * picture.gradient_noise)) {
    return std::nullopt;
  }
  const double joined = std::max(1.0, kAlike_px * below.angles / (2 * std::numbers::pi * mean));
  double best = kLeastScore;
  Vector<double> best_below;  // px per angle
  Vector<int> shift(outer.size());
  for (int across = -kShifts; across <= kShifts; ++across) {
    for (int down = -kShifts; down <= kShifts; ++down) {
      for (int i = 0; i < below.angles; ++i) {
        const double by = kShiftStep_px * Point(across, down).dot(on_ray(Point(0, 0), i, below.angles, 1));
        shift[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(by / kDepthStep_px));
      }
      for (int j = 0; j < below.depths; ++j) {
        const double score = below.score(j, shift, joined);
        if (score > best) {
          best = score;
          best_below.assign(outer.size(), below.from);
          for (std::size_t k = 0; k < outer.size(); ++k) {
            best_below[k] += kDepthStep_px * (j - shift[k]);
          }
        }
      }
    }
  }
  if (best_below.empty()) {
    return std::nullopt;
  }
  for (std::size_t k = 0; k < outer.size(); ++k) {
    band.middle[k] -= best_below[k];
  }
  band.half_width = kHalf_px;
  band.stiffness = 0.8;
  EdgePath path = closed_path(picture.field, band, sign, picture.edge_floor(), 0);
  return path.r.empty() ? std::nullopt : std::optional(std::move(path));
}

}  // namespace punctum::vision
