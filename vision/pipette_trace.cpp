#include "vision/pipette_trace.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace punctum::vision {

namespace {

struct Edges {
  double lo = 0, hi = 0;  // outermost significant edges
  double energy = 0;
};

// Mean-free and of unit length; false when it is flat.
bool normalise(std::vector<double>& v) {
  double mean = 0, ss = 0;
  for (double x : v) {
    mean += x;
  }
  mean /= static_cast<double>(v.size());
  for (double& x : v) {
    x -= mean;
    ss += x * x;
  }
  if (ss < 1e-6 * static_cast<double>(v.size())) {
    return false;
  }
  for (double& x : v) {
    x /= std::sqrt(ss);
  }
  return true;
}

}  // namespace

std::optional<TubeTrace> trace_tube(const GradientField& field, Side side, double width_min, double width_max,
                                    double noise) {
  const cv::Rect a = field.area;
  const int h = a.height;
  if (a.width < 48 || h < 48) {
    return std::nullopt;
  }
  const double strip = std::clamp(0.09 * a.width, 16.0, 70.0);
  const double inset = 4;  // borders of recorded pictures are often black
  const Point into(side == Side::right ? -1 : 1, 0);
  const double border_x = side == Side::right ? a.x + a.width - 1 - inset : a.x + inset;

  // Mean grey along lines of several tilts: at the tube's own tilt its edges are sharpest.
  std::optional<TubeTrace> best;
  double best_energy = 0;
  for (int degree = -20; degree <= 20; ++degree) {
    const double slope = std::tan(degree * CV_PI / 180);
    std::vector<double> p(static_cast<std::size_t>(h));
    int samples = 0;
    for (double s = 0; s < strip; s += 2) {
      ++samples;
      for (int y = 0; y < h; ++y) {
        const double yy = std::clamp(a.y + y + s * slope, a.y + 0.0, a.y + h - 1.001);
        p[static_cast<std::size_t>(y)] += field.grey(Point(border_x + s * into.x, yy));
      }
    }
    std::vector<double> d(static_cast<std::size_t>(h), 0.0);
    for (int y = 1; y + 1 < h; ++y) {
      d[static_cast<std::size_t>(y)] =
          std::abs(p[static_cast<std::size_t>(y + 1)] - p[static_cast<std::size_t>(y - 1)]) / (2.0 * samples);
    }
    // 4 sd of what noise leaves, never less than a quarter grey level per pixel.
    double top = 0;
    for (int y = 4; y + 4 < h; ++y) {
      top = std::max(top, d[static_cast<std::size_t>(y)]);
    }
    const double floor =
        std::max({4 * field.noise_of_gradient(noise) / std::sqrt(0.6 * samples), 0.25, 0.12 * top});
    std::vector<Edges> clusters;
    double total = 0;
    for (int y = 4; y + 4 < h; ++y) {
      const double e = d[static_cast<std::size_t>(y)];
      if (e <= floor || e < d[static_cast<std::size_t>(y - 1)] || e < d[static_cast<std::size_t>(y + 1)]) {
        continue;
      }
      total += e * e;
      if (clusters.empty() || y - clusters.back().lo > width_max) {
        clusters.push_back({static_cast<double>(y), static_cast<double>(y), e * e});
      } else {
        clusters.back().hi = y;
        clusters.back().energy += e * e;
      }
    }
    for (const Edges& c : clusters) {
      const double width = c.hi - c.lo;
      if (width < width_min || width > width_max || c.energy <= best_energy) {
        continue;
      }
      best_energy = c.energy;
      TubeTrace t;
      t.side = side;
      t.axis = Point(into.x, slope) / std::hypot(1.0, slope);
      t.root = Point(border_x, a.y + 0.5 * (c.lo + c.hi));
      t.half_width = 0.5 * width;
      t.clarity = c.energy / total;
      best = t;
    }
  }
  if (!best) {
    return std::nullopt;
  }
  TubeTrace& t = *best;

  // Follow it: the cross profile is compared with the one learnt so far, shifted by up to 2 px.
  const double w = t.half_width + 5;
  const int n = 2 * static_cast<int>(w) + 1;
  const auto profile = [&](const Point& at, const Point& across, double length) {
    std::vector<double> v(static_cast<std::size_t>(n), 0.0);
    for (double k = 0; k < length; k += 1.5) {
      for (int i = 0; i < n; ++i) {
        Point q = at + k * t.axis + (i - n / 2) * across;
        q.y = std::clamp(q.y, a.y + 0.0, a.y + h - 1.001);
        q.x = std::clamp(q.x, a.x + 0.0, a.x + a.width - 1.001);
        v[static_cast<std::size_t>(i)] += field.grey(q);
      }
    }
    return v;
  };
  Point across(-t.axis.y, t.axis.x);
  if (across.y < 0) {
    across = -across;
  }
  std::vector<double> learnt = profile(t.root, across, strip * 0.8);
  if (!normalise(learnt)) {
    return std::nullopt;
  }
  const double stride = 2, window = 5;
  const double longest = 0.85 * a.width / std::abs(t.axis.x);
  std::vector<double> along, shift, like;
  double lateral = 0;
  for (double s = 0; s < longest; s += stride) {
    double top = -2, at = lateral;
    std::vector<double> top_profile;
    for (double dl = -2; dl <= 2; dl += 0.5) {
      std::vector<double> v = profile(t.root + s * t.axis + (lateral + dl) * across, across, window);
      if (!normalise(v)) {
        continue;
      }
      const double c = std::inner_product(v.begin(), v.end(), learnt.begin(), 0.0) - 0.004 * std::abs(dl);
      if (c > top) {
        top = c;
        at = lateral + dl;
        top_profile = v;
      }
    }
    along.push_back(s);
    like.push_back(top);
    shift.push_back(at);
    if (top > 0.6) {
      lateral += 0.5 * (at - lateral);
      for (std::size_t i = 0; i < learnt.size(); ++i) {
        learnt[i] += 0.12 * (top_profile[i] - learnt[i]);
      }
      (void)normalise(learnt);
    }
  }
  // The end is where the sum of (likeness - 0.5) is largest: a short foreign thing across it does not end it.
  double sum = 0, sum_best = 0, like_sum = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < like.size(); ++i) {
    sum += std::clamp(like[i], -0.5, 1.0) - 0.5;
    if (sum > sum_best) {
      sum_best = sum;
      last = i;
    }
    if (sum < sum_best - 8) {
      break;
    }
  }
  if (last < 3) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i <= last; ++i) {
    like_sum += like[i];
  }
  t.likeness = like_sum / static_cast<double>(last + 1);
  // Straight line through the shifts, outliers down-weighted.
  double off = 0, tilt = 0;
  std::vector<double> wt(last + 1, 1.0);
  for (int round = 0; round < 4; ++round) {
    double s0 = 0, s1 = 0, s2 = 0, y0 = 0, y1 = 0;
    for (std::size_t i = 0; i <= last; ++i) {
      const double ww = wt[i] * std::max(0.0, like[i]);
      s0 += ww;
      s1 += ww * along[i];
      s2 += ww * along[i] * along[i];
      y0 += ww * shift[i];
      y1 += ww * shift[i] * along[i];
    }
    const double det = s0 * s2 - s1 * s1;
    if (std::abs(det) < 1e-9) {
      break;
    }
    off = (y0 * s2 - y1 * s1) / det;
    tilt = (s0 * y1 - s1 * y0) / det;
    for (std::size_t i = 0; i <= last; ++i) {
      const double e = (shift[i] - off - tilt * along[i]) / 2.0;
      wt[i] = 1 / (1 + e * e);
    }
  }
  t.root += off * across;
  t.axis = t.axis + tilt * across;
  t.axis *= 1 / cv::norm(t.axis);
  t.length = along[last] + window;
  // Width near the end: outermost edges of the mean cross profile there.
  across = Point(-t.axis.y, t.axis.x);
  const double back = std::min(t.length * 0.6, 26.0);
  std::vector<double> tail(static_cast<std::size_t>(n), 0.0);
  const Point near_end = t.root + (t.length - back) * t.axis;
  for (double k = 0; k < 0.6 * back; k += 1.5) {
    for (int i = 0; i < n; ++i) {
      tail[static_cast<std::size_t>(i)] += field.grey(near_end + k * t.axis + (i - n / 2) * across);
    }
  }
  double steepest = 0;
  for (int i = 1; i + 1 < n; ++i) {
    steepest = std::max(
        steepest, std::abs(tail[static_cast<std::size_t>(i + 1)] - tail[static_cast<std::size_t>(i - 1)]));
  }
  double lo = 0, hi = 0;
  bool any = false;
  for (int i = 1; i + 1 < n; ++i) {
    const double e = std::abs(tail[static_cast<std::size_t>(i + 1)] - tail[static_cast<std::size_t>(i - 1)]);
    if (e > 0.4 * steepest && std::abs(i - n / 2) <= t.half_width + 2) {
      lo = any ? lo : i - n / 2;
      hi = i - n / 2;
      any = true;
    }
  }
  t.end_half_width = any ? std::clamp(0.5 * (hi - lo), 1.0, t.half_width + 2) : t.half_width;
  return t;
}

std::optional<double> end_face(const GradientField& field, const Point& guess, const Point& axis,
                               double half_width, double reach, double noise) {
  const Point across(-axis.y, axis.x);
  const double step = 0.25;
  const int n = 2 * static_cast<int>(reach / step) + 1;
  std::vector<double> g(static_cast<std::size_t>(n));
  const double half = std::max(1.0, half_width);
  const int lanes = 2 * static_cast<int>(half) + 1;
  for (int i = 0; i < n; ++i) {
    const double s = (i - n / 2) * step;
    double sum = 0;
    for (int k = 0; k < lanes; ++k) {
      const double u = lanes > 1 ? (2.0 * k / (lanes - 1) - 1) * half : 0;
      // Magnitudes add up: wall and lumen may change in opposite senses.
      sum += std::abs(field.gradient(guess + s * axis + u * across).dot(axis));
    }
    g[static_cast<std::size_t>(i)] = sum / lanes;
  }
  const auto top = std::max_element(g.begin() + 1, g.end() - 1);
  if (top == g.end() - 1 || *top < 3 * field.noise_of_gradient(noise)) {
    return std::nullopt;
  }
  const int i = static_cast<int>(top - g.begin());
  const double l = g[static_cast<std::size_t>(i - 1)], u = g[static_cast<std::size_t>(i + 1)];
  const double den = l - 2 * *top + u;
  const double offset = den < -1e-12 ? std::clamp(0.5 * (l - u) / den, -0.5, 0.5) : 0;
  return (i - n / 2 + offset) * step;
}

}  // namespace punctum::vision
