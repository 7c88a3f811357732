#include "vision/pipettes/border_section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

constexpr double kLineStep_px = 2;
constexpr double kLeastEdge = 0.25;  // grey levels per px

struct BorderEdge {
  double at, energy;  // along the border, squared edge
};

struct EdgeGroup {
  Vector<BorderEdge> edges;  // from the first
  double energy = 0;         // of all
};

// Mean grey along lines of one tilt; at the tube's own tilt its edges are sharpest.
struct TiltedProfile {
  Vector<float> edge;  // per px along the border, |change of grey| per px
  double strongest = 0;
  int samples = 0;  // along each line
};

// A border of the picture, as its left one: along it, and from it inwards.
struct BorderAxes {
  Point origin, along, into;
  int length;
};

BorderAxes axes_of(const cv::Rect& a, Border border, double inset) {
  switch (border) {
    case Border::right:
      return {Point(a.x + a.width - 1 - inset, a.y), {0, 1}, {-1, 0}, a.height};
    case Border::upper:
      return {Point(a.x, a.y + inset), {1, 0}, {0, 1}, a.width};
    case Border::lower:
      return {Point(a.x, a.y + a.height - 1 - inset), {1, 0}, {0, -1}, a.width};
    case Border::left:
      break;
  }
  return {Point(a.x + inset, a.y), {0, 1}, {1, 0}, a.height};
}

// The lines of the strip along the border, one after the other inwards.
Vector<Vector<float>> lines_of(const GradientField& field, const BorderAxes& axes, double strip) {
  Vector<Vector<float>> out;
  for (double s = 0; s < strip; s += kLineStep_px) {
    Vector<float>& line = out.emplace_back();
    line.reserve(static_cast<std::size_t>(axes.length));
    for (int k = 0; k < axes.length; ++k) {
      line.push_back(static_cast<float>(
          field.grey(axes.origin + s * axes.into + std::min(k + 0.0, axes.length - 1.001) * axes.along)));
    }
  }
  return out;
}

PUNCTUM_WIDE_LOOP void add_between(const float* line, int n, float here, float after, float* sum) {
  for (int y = 0; y < n; ++y) {
    sum[y] += here * line[y] + after * line[y + 1];
  }
}

TiltedProfile profile_at(const Vector<Vector<float>>& lines, int begin, int end, double slope) {
  const int h = static_cast<int>(lines.front().size());
  Vector<float> sum(static_cast<std::size_t>(h));
  TiltedProfile out;
  out.samples = end - begin;
  for (int c = begin; c < end; ++c) {
    const double shift = c * kLineStep_px * slope;
    const int down = static_cast<int>(std::floor(shift));
    const float after = static_cast<float>(shift - down), here = 1 - after;
    const float* const line = lines[static_cast<std::size_t>(c)].data();
    const int from = std::clamp(-down, 0, h), to = std::clamp(h - 1 - down, from, h);
    for (int y = 0; y < from; ++y) {
      sum[static_cast<std::size_t>(y)] += line[0];
    }
    add_between(line + from + down, to - from, here, after, sum.data() + from);
    for (int y = to; y < h; ++y) {
      sum[static_cast<std::size_t>(y)] += line[h - 1];
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

Vector<BorderEdge> edges_above(const Vector<float>& edge, double floor) {
  Vector<BorderEdge> edges;
  for (std::size_t y = 4; y + 4 < edge.size(); ++y) {
    const double e = static_cast<double>(edge[y]);
    if (e > floor && edge[y] >= edge[y - 1] && edge[y] >= edge[y + 1]) {
      edges.push_back({static_cast<double>(y), e * e});
    }
  }
  return edges;
}

// The strongest edges that lie within `width_max`, at least `width_min` apart. Every edge is tried as the
// first: a speck beside a tube must not end the group amid the tube.
EdgeGroup strongest_group(const Vector<BorderEdge>& edges, double width_min, double width_max) {
  EdgeGroup best;
  double energy = 0;
  auto end = edges.begin();
  for (auto first = edges.begin(); first != edges.end(); ++first) {
    for (; end != edges.end() && end->at - first->at <= width_max; ++end) {
      energy += end->energy;
    }
    if (std::prev(end)->at - first->at >= width_min && energy > best.energy) {
      best = {.edges = Vector<BorderEdge>(first, end), .energy = energy};
    }
    energy -= first->energy;
  }
  return best;
}

// Those outside of the others that are faint, or in one half of the strip: specks beside the tube. halves:
// the profiles of both.
void leave_out_specks(EdgeGroup& group, const std::array<TiltedProfile, 2>& halves) {
  constexpr double kFaint = 0.35;  // of the strongest one
  constexpr std::size_t kAside_px =
      2;  // by which a wall lies elsewhere in one half: it is not quite parallel
  double strongest = 0;
  for (const BorderEdge& edge : group.edges) {
    strongest = std::max(strongest, edge.energy);
  }
  const double least = kFaint * std::sqrt(strongest);
  const auto shows = [&](const TiltedProfile& half, double at) {
    const auto k = static_cast<std::size_t>(at);
    return std::any_of(half.edge.begin() + static_cast<std::ptrdiff_t>(k - kAside_px),
                       half.edge.begin() + static_cast<std::ptrdiff_t>(k + kAside_px + 1),
                       [&](float e) { return static_cast<double>(e) >= least; });
  };
  const auto clear = [&](const BorderEdge& edge) {
    return edge.energy >= least * least && shows(halves[0], edge.at) && shows(halves[1], edge.at);
  };
  const auto first = std::find_if(group.edges.begin(), group.edges.end(), clear);
  const auto last = std::find_if(group.edges.rbegin(), group.edges.rend(), clear).base();
  group.edges = Vector<BorderEdge>(first, std::max(first, last));
}

}  // namespace

Vector<TubeTrace> border_sections(const GradientField& field, Border border, const WantedTube& wanted,
                                  double noise) {
  const BorderAxes axes = axes_of(field.area, border, wanted.inset);
  const auto lines = lines_of(field, axes, wanted.strip);
  const int all = static_cast<int>(lines.size());
  constexpr std::size_t kLeftOut = 3;
  EdgeGroup best;
  double best_total = 0;
  int best_degree = 0;
  const auto width_of = [](const BorderEdge& low, const BorderEdge& high, int degree) {
    return (high.at - low.at) * math::cos(degree * CV_PI / 180);
  };
  const auto look_along = [&](int degree) {
    const double slope = math::tan(degree * CV_PI / 180);
    const TiltedProfile profile = profile_at(lines, 0, all, slope);
    // Four standard deviations of what the noise leaves.
    const double floor = std::max({4 * field.noise_of_gradient(noise) / std::sqrt(0.6 * profile.samples),
                                   kLeastEdge, wanted.relative * profile.strongest});
    const Vector<BorderEdge> edges = edges_above(profile.edge, floor);
    const double shorter = math::cos(degree * CV_PI / 180);
    EdgeGroup group = strongest_group(edges, wanted.width_min / shorter, wanted.width_max / shorter);
    if (group.energy > best.energy) {
      best = std::move(group);
      best_degree = degree;
      best_total = std::accumulate(edges.begin(), edges.end(), 0.0,
                                   [](double sum, const BorderEdge& e) { return sum + e.energy; });
    }
  };
  // Half of the step blurs an edge by less than a pixel at the ends of the widest strip.
  constexpr int kStep_deg = 3;
  for (int degree = -wanted.tilt_max_deg; degree <= wanted.tilt_max_deg; degree += kStep_deg) {
    if (std::abs(degree) >= wanted.tilt_min_deg) {
      look_along(degree);
    }
  }
  const int roughly = best_degree;
  for (int degree = roughly - kStep_deg + 1; degree < roughly + kStep_deg; ++degree) {
    if (!best.edges.empty() && degree != roughly && std::abs(degree) <= wanted.tilt_max_deg) {
      look_along(degree);
    }
  }
  Vector<TubeTrace> out;
  const double slope = math::tan(best_degree * CV_PI / 180);
  if (wanted.without_specks && !best.edges.empty()) {
    leave_out_specks(best, {profile_at(lines, 0, all / 2, slope), profile_at(lines, all / 2, all, slope)});
  }
  const std::size_t edges = best.edges.size();
  for (std::size_t above = 0; above <= kLeftOut; ++above) {
    for (std::size_t below = 0; below <= kLeftOut && above + below + 2 <= edges; ++below) {
      const BorderEdge &low = best.edges[above], &high = best.edges[edges - 1 - below];
      const double width = width_of(low, high, best_degree);
      if (width < wanted.width_min) {
        break;
      }
      double energy = 0;
      for (std::size_t k = above; k < edges - below; ++k) {
        energy += best.edges[k].energy;
      }
      TubeTrace& t = out.emplace_back();
      t.axis = (axes.into + slope * axes.along) / math::hypot(1.0, slope);
      t.root = axes.origin + 0.5 * (low.at + high.at) * axes.along;
      t.half_width = 0.5 * width;
      t.edge_share = energy / best_total;
    }
  }
  return out;
}

Point across_tube(const Point& axis) {
  const Point across(-axis.y, axis.x);
  return across.y < 0 ? -across : across;
}

}  // namespace punctum::vision
