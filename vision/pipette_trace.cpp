#include "vision/pipette_trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace punctum::vision {

namespace {

struct Edges {
  double lo = 0, hi = 0;  // outermost significant edges
  double energy = 0;
};

// Without mean and slope, and of unit length; its length before that. 0 when it is flat.
double normalise(std::vector<double>& v) {
  const double n = static_cast<double>(v.size());
  double mean = 0, tilt = 0, ss = 0;
  for (double x : v) {
    mean += x / n;
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double u = static_cast<double>(i) - (n - 1) / 2;
    tilt += u * v[i] * 12 / (n * (n * n - 1));
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    v[i] -= mean + tilt * (static_cast<double>(i) - (n - 1) / 2);
    ss += v[i] * v[i];
  }
  if (ss < 1e-6 * n) {
    return 0;
  }
  for (double& x : v) {
    x /= std::sqrt(ss);
  }
  return std::sqrt(ss);
}

// What crosses the strip along the border: mean grey along lines of several tilts, since at the tube's own
// tilt its edges are sharpest. Edges weaker than `relative` of the strongest one do not count.
std::optional<TubeTrace> cross_section(const GradientField& field, Side side, double width_min,
                                       double width_max, double noise, double strip, double relative) {
  const cv::Rect a = field.area;
  const int h = a.height;
  const double inset = 4;  // borders of recorded pictures are often black
  const Point into(side == Side::right ? -1 : 1, 0);
  const double border_x = side == Side::right ? a.x + a.width - 1 - inset : a.x + inset;
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
    double top = 0;
    for (int y = 4; y + 4 < h; ++y) {
      d[static_cast<std::size_t>(y)] =
          std::abs(p[static_cast<std::size_t>(y + 1)] - p[static_cast<std::size_t>(y - 1)]) / (2.0 * samples);
      top = std::max(top, d[static_cast<std::size_t>(y)]);
    }
    // 4 sd of what noise leaves, never less than a quarter grey level per pixel.
    const double floor =
        std::max({4 * field.noise_of_gradient(noise) / std::sqrt(0.6 * samples), 0.25, relative * top});
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
  return best;
}

// Weighted straight line y = offset + tilt x with outliers further than `scale` down-weighted; rms of the
// rest.
struct Line {
  double offset = 0, tilt = 0, rms = 0;
};
Line fit_line(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& weight,
              double scale) {
  Line line;
  std::vector<double> w = weight;
  for (int round = 0; round < 5; ++round) {
    double s0 = 0, s1 = 0, s2 = 0, y0 = 0, y1 = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      s0 += w[i];
      s1 += w[i] * x[i];
      s2 += w[i] * x[i] * x[i];
      y0 += w[i] * y[i];
      y1 += w[i] * y[i] * x[i];
    }
    const double det = s0 * s2 - s1 * s1;
    if (!(s0 > 0) || std::abs(det) < 1e-9) {
      return line;
    }
    line.offset = (y0 * s2 - y1 * s1) / det;
    line.tilt = (s0 * y1 - s1 * y0) / det;
    double ss = 0, sw = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double e = y[i] - line.offset - line.tilt * x[i];
      ss += weight[i] * e * e;
      sw += weight[i];
      w[i] = weight[i] / (1 + e * e / (scale * scale));
    }
    line.rms = std::sqrt(ss / sw);
  }
  return line;
}

}  // namespace

std::optional<TubeTrace> trace_narrow_tube(const GradientField& field, Side side, double width_min,
                                           double width_max, double noise) {
  const cv::Rect a = field.area;
  if (a.width < 48 || a.height < 48) {
    return std::nullopt;
  }
  const double strip = std::clamp(0.09 * a.width, 16.0, 70.0);
  auto found = cross_section(field, side, width_min, width_max, noise, strip, 0.12);
  if (!found) {
    return std::nullopt;
  }
  TubeTrace& t = *found;
  // The cross profile is compared with the one learnt so far, shifted by up to 2 px.
  const int n = 2 * static_cast<int>(t.half_width + 5) + 1;
  Point across(-t.axis.y, t.axis.x);
  if (across.y < 0) {
    across = -across;
  }
  const auto profile = [&](const Point& at, double length) {
    std::vector<double> v(static_cast<std::size_t>(n), 0.0);
    int stations = 0;
    for (double k = 0; k < length; k += 1.5) {
      ++stations;
      for (int i = 0; i < n; ++i) {
        Point q = at + k * t.axis + (i - n / 2) * across;
        q.y = std::clamp(q.y, a.y + 0.0, a.y + a.height - 1.001);
        q.x = std::clamp(q.x, a.x + 0.0, a.x + a.width - 1.001);
        v[static_cast<std::size_t>(i)] += field.grey(q);
      }
    }
    for (double& x : v) {
      x /= stations;
    }
    return v;
  };
  std::vector<double> learnt = profile(t.root, strip * 0.8);
  double contrast = normalise(learnt);
  if (!(contrast > 0)) {
    return std::nullopt;
  }
  const double stride = 2, window = 5;
  const double longest = 0.85 * a.width / std::abs(t.axis.x);
  std::vector<double> along, shift, like;
  double lateral = 0;
  for (double s = 0; s < longest; s += stride) {
    double top = -2, at = lateral, top_contrast = 0;
    std::vector<double> top_profile;
    for (double dl = -2; dl <= 2; dl += 0.5) {
      std::vector<double> v = profile(t.root + s * t.axis + (lateral + dl) * across, window);
      const double strength = normalise(v);
      if (!(strength > 0)) {
        continue;
      }
      // A faint look-alike is not it; what is in front of or behind glass may change its contrast by half.
      const double ratio = std::min(1.0, 1.6 * strength / contrast);
      const double c =
          ratio * std::inner_product(v.begin(), v.end(), learnt.begin(), 0.0) - 0.004 * std::abs(dl);
      if (c > top) {
        top = c;
        at = lateral + dl;
        top_profile = v;
        top_contrast = strength;
      }
    }
    along.push_back(s);
    like.push_back(top);
    shift.push_back(at);
    if (top > 0.6) {
      lateral += 0.5 * (at - lateral);
      contrast += 0.12 * (top_contrast - contrast);
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
  if (last < 3 || last + 1 >= like.size()) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i <= last; ++i) {
    like_sum += like[i];
  }
  t.likeness = like_sum / static_cast<double>(last + 1);
  along.resize(last + 1);
  shift.resize(last + 1);
  like.resize(last + 1);
  for (double& l : like) {
    l = std::max(0.0, l);
  }
  const Line line = fit_line(along, shift, like, 2.0);
  if (line.rms > 0.15 * t.half_width + 1.0) {
    return std::nullopt;  // not straight
  }
  t.root += line.offset * across;
  t.axis = t.axis + line.tilt * across;
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
  const auto edge = [&](int i) {
    return std::abs(tail[static_cast<std::size_t>(i + 1)] - tail[static_cast<std::size_t>(i - 1)]);
  };
  double steepest = 0;
  for (int i = 1; i + 1 < n; ++i) {
    steepest = std::max(steepest, edge(i));
  }
  double lo = 0, hi = 0;
  bool any = false;
  for (int i = 1; i + 1 < n; ++i) {
    if (edge(i) > 0.4 * steepest && std::abs(i - n / 2) <= t.half_width + 2) {
      lo = any ? lo : i - n / 2;
      hi = i - n / 2;
      any = true;
    }
  }
  t.end_half_width = any ? std::clamp(0.5 * (hi - lo), 1.0, t.half_width + 2) : t.half_width;
  return found;
}

std::optional<TubeTrace> trace_wide_tube(const GradientField& field, Side side, double width_min,
                                         double width_max, double noise) {
  const cv::Rect a = field.area;
  if (a.width < 48 || a.height < 48) {
    return std::nullopt;
  }
  auto found =
      cross_section(field, side, width_min, width_max, noise, std::clamp(0.03 * a.width, 8.0, 24.0), 0.3);
  if (!found) {
    return std::nullopt;
  }
  TubeTrace& t = *found;
  Point across(-t.axis.y, t.axis.x);
  if (across.y < 0) {
    across = -across;
  }
  // Both outer edges, each within 3 px of where it was.
  std::array<double, 2> at{-t.half_width, t.half_width}, usual{};
  std::vector<double> along, middle, half, kept;
  const double longest = 0.85 * a.width / std::abs(t.axis.x);
  double sum = 0, sum_best = 0;
  std::size_t last = 0;
  for (double s = 0; s < longest; s += 1.5) {
    std::array<double, 2> place = at, strength{};
    for (std::size_t k = 0; k < 2; ++k) {
      for (double du = -3; du <= 3; du += 0.5) {
        const Point p = t.root + s * t.axis + (at[k] + du) * across;
        const double e = std::abs(field.gradient(p).dot(across));
        if (e > strength[k]) {
          strength[k] = e;
          place[k] = at[k] + du;
        }
      }
    }
    if (along.size() < 6) {
      for (std::size_t k = 0; k < 2; ++k) {
        usual[k] += strength[k] / 6;
      }
    }
    const std::size_t count = along.size();
    double like = 1;
    if (count >= 6) {
      like = std::min(strength[0] / usual[0], strength[1] / usual[1]);
    }
    along.push_back(s);
    middle.push_back(0.5 * (place[0] + place[1]));
    half.push_back(0.5 * (place[1] - place[0]));
    kept.push_back(std::clamp(like, 0.0, 1.0));
    sum += std::clamp(like, 0.0, 1.0) - 0.4;
    if (sum > sum_best) {
      sum_best = sum;
      last = count;
    }
    if (sum < sum_best - 3) {
      break;
    }
    if (like > 0.4) {
      at[0] += 0.4 * (place[0] - at[0]);
      at[1] += 0.4 * (place[1] - at[1]);
    }
  }
  if (last < 4 || last + 1 >= along.size()) {
    return std::nullopt;
  }
  along.resize(last + 1);
  middle.resize(last + 1);
  half.resize(last + 1);
  kept.resize(last + 1);
  t.likeness = std::accumulate(kept.begin(), kept.end(), 0.0) / static_cast<double>(kept.size());
  const Line line = fit_line(along, middle, kept, 1.0), width = fit_line(along, half, kept, 1.0);
  if (line.rms > 2.5 || width.rms > 0.08 * t.half_width + 1.0) {
    return std::nullopt;
  }
  t.root += line.offset * across;
  t.axis = t.axis + line.tilt * across;
  t.axis *= 1 / cv::norm(t.axis);
  t.length = along[last];
  t.half_width = width.offset;
  t.end_half_width = std::clamp(width.offset + width.tilt * t.length, 0.5 * t.half_width, 1.5 * t.half_width);
  return found;
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
