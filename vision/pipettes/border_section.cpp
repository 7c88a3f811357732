#include "vision/pipettes/border_section.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

constexpr double kInset_px = 4;  // borders of recorded pictures are often black
constexpr double kColumnStep_px = 2;
constexpr double kLeastEdge = 0.25;  // grey levels per px

struct EdgeGroup {
  double lo = 0, hi = 0;  // outermost edges
  double energy = 0;      // sum of the squared edges
};

// Mean grey along lines of one tilt; at the tube's own tilt its edges are sharpest.
struct TiltedProfile {
  std::vector<float> edge;  // per row, |change of grey| per px
  double strongest = 0;
  int samples = 0;  // along each line
};

// The columns of the strip, one after the other from the border inwards.
std::vector<std::vector<float>> columns_of(const GradientField& field, double border_x, double into_x,
                                           double strip) {
  std::vector<std::vector<float>> out;
  for (double s = 0; s < strip; s += kColumnStep_px) {
    std::vector<float>& column = out.emplace_back();
    for (int y = 0; y < field.area.height; ++y) {
      column.push_back(static_cast<float>(
          field.grey(Point(border_x + s * into_x,
                           std::min(field.area.y + y + 0.0, field.area.y + field.area.height - 1.001)))));
    }
  }
  return out;
}

// Short loops over the rows, which the compiler vectorises.
TiltedProfile profile_at(const std::vector<std::vector<float>>& columns, double slope) {
  const int h = static_cast<int>(columns.front().size());
  std::vector<float> sum(static_cast<std::size_t>(h));
  TiltedProfile out;
  out.samples = static_cast<int>(columns.size());
  for (int c = 0; c < out.samples; ++c) {
    const double shift = c * kColumnStep_px * slope;
    const int down = static_cast<int>(std::floor(shift));
    const float after = static_cast<float>(shift - down), here = 1 - after;
    const float* const column = columns[static_cast<std::size_t>(c)].data();
    const int from = std::clamp(-down, 0, h), to = std::clamp(h - 1 - down, from, h);
    for (int y = 0; y < from; ++y) {
      sum[static_cast<std::size_t>(y)] += column[0];
    }
    for (int y = from; y < to; ++y) {
      sum[static_cast<std::size_t>(y)] += here * column[y + down] + after * column[y + down + 1];
    }
    for (int y = to; y < h; ++y) {
      sum[static_cast<std::size_t>(y)] += column[h - 1];
    }
  }
  out.edge.assign(static_cast<std::size_t>(h), 0.0F);
  const float per_px = 1 / (2.0F * static_cast<float>(out.samples));
  for (int y = 4; y + 4 < h; ++y) {
    const std::size_t k = static_cast<std::size_t>(y);
    out.edge[k] = std::abs(sum[k + 1] - sum[k - 1]) * per_px;
  }
  out.strongest = static_cast<double>(*std::max_element(out.edge.begin(), out.edge.end()));
  return out;
}

// Edges above the floor that are nearer to the first of their group than `width_max`. total: energy of all.
std::vector<EdgeGroup> groups_of(const std::vector<float>& edge, double floor, double width_max,
                                 double& total) {
  std::vector<EdgeGroup> groups;
  total = 0;
  for (std::size_t y = 4; y + 4 < edge.size(); ++y) {
    const double e = static_cast<double>(edge[y]);
    if (e <= floor || edge[y] < edge[y - 1] || edge[y] < edge[y + 1]) {
      continue;
    }
    total += e * e;
    const double at = static_cast<double>(y);
    if (groups.empty() || at - groups.back().lo > width_max) {
      groups.push_back({at, at, e * e});
    } else {
      groups.back().hi = at;
      groups.back().energy += e * e;
    }
  }
  return groups;
}

}  // namespace

std::optional<TubeTrace> border_section(const GradientField& field, Side side, double width_min,
                                        double width_max, double noise, double strip, double relative,
                                        int tilt_max_deg) {
  const cv::Rect a = field.area;
  const double into_x = side == Side::right ? -1 : 1;
  const double border_x = side == Side::right ? a.x + a.width - 1 - kInset_px : a.x + kInset_px;
  const auto columns = columns_of(field, border_x, into_x, strip);
  std::optional<TubeTrace> best;
  double best_energy = 0;
  int best_degree = 0;
  const auto look_along = [&](int degree) {
    const double slope = math::tan(degree * CV_PI / 180);
    const TiltedProfile profile = profile_at(columns, slope);
    // Four standard deviations of what the noise leaves.
    const double floor = std::max({4 * field.noise_of_gradient(noise) / std::sqrt(0.6 * profile.samples),
                                   kLeastEdge, relative * profile.strongest});
    double total = 0;
    for (const EdgeGroup& group : groups_of(profile.edge, floor, width_max, total)) {
      const double width = (group.hi - group.lo) * math::cos(degree * CV_PI / 180);
      if (width < width_min || width > width_max || group.energy <= best_energy) {
        continue;
      }
      best_energy = group.energy;
      best_degree = degree;
      TubeTrace t;
      t.side = side;
      t.axis = Point(into_x, slope) / math::hypot(1.0, slope);
      t.root = Point(border_x, a.y + 0.5 * (group.lo + group.hi));
      t.half_width = 0.5 * width;
      t.edge_share = group.energy / total;
      best = t;
    }
  };
  // Half of the step blurs an edge by less than a pixel at the ends of the widest strip.
  constexpr int kStep_deg = 3;
  for (int degree = -tilt_max_deg; degree <= tilt_max_deg; degree += kStep_deg) {
    look_along(degree);
  }
  const int roughly = best_degree;
  for (int degree = roughly - kStep_deg + 1; degree < roughly + kStep_deg; ++degree) {
    if (best && degree != roughly && std::abs(degree) <= tilt_max_deg) {
      look_along(degree);
    }
  }
  return best;
}

Point across_tube(const Point& axis) {
  const Point across(-axis.y, axis.x);
  return across.y < 0 ? -across : across;
}

}  // namespace punctum::vision
