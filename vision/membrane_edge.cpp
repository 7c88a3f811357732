#include "vision/membrane_edge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace punctum::vision {

std::vector<double> smooth_closed(const std::vector<double>& r, const std::vector<double>& weight,
                                  const std::vector<double>& stiffness) {
  // Cyclic and pentadiagonal, symmetric positive definite: the last two unknowns are a border; the rest is a
  // band of width 2, factorised as L D L^T for three right-hand sides.
  const std::size_t n = r.size();
  if (n < 8) {
    return r;
  }
  double total = 0;
  for (double w : weight) {
    total += w;
  }
  if (!(total > 0)) {
    return r;
  }
  const double tiny = 1e-9 * total / static_cast<double>(n);
  std::vector<double> d0(n), d1(n), d2(n);  // A(i,i), A(i,i+1), A(i,i+2), cyclic
  for (std::size_t i = 0; i < n; ++i) {
    const double k0 = stiffness[(i + n - 1) % n], k1 = stiffness[i], k2 = stiffness[(i + 1) % n];
    d0[i] = weight[i] + tiny + k0 + 4 * k1 + k2;
    d1[i] = -2 * (k1 + k2);
    d2[i] = k2;
  }
  const std::size_t m = n - 2;
  // Columns of the border: unknowns m and m + 1 against 0 .. m - 1.
  std::array<std::vector<double>, 3> rhs;  // data, border column 0, border column 1
  for (auto& v : rhs) {
    v.assign(m, 0.0);
  }
  for (std::size_t i = 0; i < m; ++i) {
    rhs[0][i] = weight[i] * r[i];
  }
  rhs[1][m - 2] += d2[m - 2];
  rhs[1][m - 1] += d1[m - 1];
  rhs[1][0] += d2[m];
  rhs[2][m - 1] += d2[m - 1];
  rhs[2][0] += d1[m + 1];
  rhs[2][1] += d2[m + 1];
  const std::vector<double> c0 = rhs[1], c1 = rhs[2];
  std::vector<double> d(m), l1(m), l2(m);  // L(i,i-1), L(i,i-2)
  for (std::size_t i = 0; i < m; ++i) {
    const double a2 = i >= 2 ? d2[i - 2] : 0, a1 = i >= 1 ? d1[i - 1] : 0;
    l2[i] = i >= 2 ? a2 / d[i - 2] : 0;
    l1[i] = i >= 1 ? (a1 - (i >= 2 ? l2[i] * d[i - 2] * l1[i - 1] : 0)) / d[i - 1] : 0;
    d[i] = d0[i] - (i >= 1 ? l1[i] * l1[i] * d[i - 1] : 0) - (i >= 2 ? l2[i] * l2[i] * d[i - 2] : 0);
  }
  for (auto& v : rhs) {
    for (std::size_t i = 0; i < m; ++i) {
      v[i] -= (i >= 1 ? l1[i] * v[i - 1] : 0) + (i >= 2 ? l2[i] * v[i - 2] : 0);
    }
    for (std::size_t i = 0; i < m; ++i) {
      v[i] /= d[i];
    }
    for (std::size_t i = m; i-- > 0;) {
      v[i] -= (i + 1 < m ? l1[i + 1] * v[i + 1] : 0) + (i + 2 < m ? l2[i + 2] * v[i + 2] : 0);
    }
  }
  double s00 = d0[m], s01 = d1[m], s11 = d0[m + 1];
  double b0 = weight[m] * r[m], b1 = weight[m + 1] * r[m + 1];
  for (std::size_t i = 0; i < m; ++i) {
    s00 -= c0[i] * rhs[1][i];
    s01 -= c0[i] * rhs[2][i];
    s11 -= c1[i] * rhs[2][i];
    b0 -= c0[i] * rhs[0][i];
    b1 -= c1[i] * rhs[0][i];
  }
  const double det = s00 * s11 - s01 * s01;
  if (!(std::abs(det) > 0)) {
    return r;
  }
  std::vector<double> x(n);
  x[m] = (b0 * s11 - b1 * s01) / det;
  x[m + 1] = (s00 * b1 - s01 * b0) / det;
  for (std::size_t i = 0; i < m; ++i) {
    x[i] = rhs[0][i] - rhs[1][i] * x[m] - rhs[2][i] * x[m + 1];
  }
  return x;
}

EdgePath closed_path(const GradientField& field, const EdgeBand& band, Polarity polarity, double floor,
                     double saturation) {
  EdgePath out;
  const int n = static_cast<int>(band.middle.size());
  const int m = 2 * static_cast<int>(band.half_width / band.step) + 1;
  if (n < 16 || m < 5 || field.area.empty()) {
    return out;
  }
  const int half = m / 2;
  const std::size_t cells = static_cast<std::size_t>(n) * static_cast<std::size_t>(m);
  std::vector<float> s(cells), cost(cells);
  std::vector<double> shown(static_cast<std::size_t>(n), 0.0);
  const auto id = [m](int i, int j) {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(m) + static_cast<std::size_t>(j);
  };
  const double turn = 2 * std::numbers::pi / n;
  std::vector<Point> ray(static_cast<std::size_t>(n));
  double r_mean = 0;
  for (int i = 0; i < n; ++i) {
    ray[static_cast<std::size_t>(i)] = Point(std::cos(i * turn), std::sin(i * turn));
    r_mean += band.middle[static_cast<std::size_t>(i)] / n;
  }
  // Outward normal of the band's middle line, a little smoothed: on the wall of a dimple it is far from
  // radial.
  std::vector<Point> normal(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const std::size_t b = static_cast<std::size_t>((i + n - 2) % n),
                      f = static_cast<std::size_t>((i + 2) % n);
    const Point t = band.middle[f] * ray[f] - band.middle[b] * ray[b];
    const double l = cv::norm(t);
    normal[static_cast<std::size_t>(i)] = l > 0 ? Point(t.y / l, -t.x / l) : ray[static_cast<std::size_t>(i)];
  }
  constexpr float kForbidden = 1e6F;
  for (int i = 0; i < n; ++i) {
    const std::size_t a = static_cast<std::size_t>(i);
    for (int j = 0; j < m; ++j) {
      const double r = band.middle[a] + (j - half) * band.step;
      const Point p = band.centre + r * ray[a];
      double v = r > 2 && (band.hidden.empty() || !band.hidden[a]) ? 1 : 0;
      // One pixel from the border of the field nothing can be told.
      if (p.x < field.area.x + 1 || p.y < field.area.y + 1 || p.x > field.area.x + field.area.width - 2 ||
          p.y > field.area.y + field.area.height - 2) {
        v = 0;
      } else if (v > 0 && band.visible) {
        v = band.visible(p);
      }
      double e = 0;
      if (v > 0) {
        const Point g = field.gradient(p);
        e = g.dot(normal[a]);
        e = polarity == Polarity::any ? std::abs(e) : polarity == Polarity::darker_out ? -e : e;
        e *= v;
      }
      shown[a] = std::max(shown[a], v * (std::abs(j - half) < half / 2 + 1 ? 1.0 : 0.0));
      s[id(i, j)] = static_cast<float>(e);
      const bool allowed =
          (band.lower.empty() || r >= band.lower[a]) && (band.upper.empty() || r <= band.upper[a]);
      cost[id(i, j)] = !allowed ? kForbidden : v > 0 ? 0.0F : 1.0F;
    }
  }
  std::vector<float> tops, all;
  for (int i = 0; i < n; ++i) {
    float top = 0;
    for (int j = 0; j < m; ++j) {
      if (cost[id(i, j)] == 0.0F) {
        top = std::max(top, s[id(i, j)]);
        all.push_back(std::abs(s[id(i, j)]));
      }
    }
    if (shown[static_cast<std::size_t>(i)] > 0) {
      tops.push_back(top);
    }
  }
  const auto median = [](std::vector<float>& v) {
    if (v.empty()) {
      return 0.0;
    }
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return static_cast<double>(v[v.size() / 2]);
  };
  if (!(saturation > 0)) {
    saturation = std::max({0.7 * median(tops), 2 * floor, 1e-6});
  }
  out.saturation = saturation;
  out.background = median(all);
  for (std::size_t k = 0; k < cells; ++k) {
    if (cost[k] == 0.0F) {
      cost[k] = static_cast<float>(1 - std::clamp(static_cast<double>(s[k]) / saturation, -0.3, 1.0));
    }
  }
  for (const auto& [i, r] : band.anchors) {
    for (int j = 0; j < m; ++j) {
      const double d = band.middle[static_cast<std::size_t>(i)] + (j - half) * band.step - r;
      cost[id(i, j)] = static_cast<float>(std::min(40.0, 4 * d * d));
    }
  }
  const double arc = std::max(0.5, r_mean * turn);
  const int reach = std::clamp(static_cast<int>(std::lround(band.slope * arc / band.step)), 1, 8);
  std::vector<float> bend(static_cast<std::size_t>(reach) + 1);
  for (int k = 0; k <= reach; ++k) {
    bend[static_cast<std::size_t>(k)] = static_cast<float>(band.stiffness * std::pow(k * band.step / arc, 2));
  }
  // Shortest path from angle `from` once round; with `fixed` >= 0 it starts and ends at that sample.
  std::vector<float> reached(cells);
  std::vector<std::int8_t> back(cells);
  std::vector<int> path(static_cast<std::size_t>(n));
  const auto search = [&](int from, int fixed) {
    for (int j = 0; j < m; ++j) {
      reached[id(0, j)] = fixed < 0 || j == fixed ? cost[id(from, j)] : kForbidden * 100;
    }
    for (int i = 1; i < n; ++i) {
      const int at = (from + i) % n;
      for (int j = 0; j < m; ++j) {
        float best = std::numeric_limits<float>::max();
        int from_k = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int q = j + k;
          if (q < 0 || q >= m) {
            continue;
          }
          const float c = reached[id(i - 1, q)] + bend[static_cast<std::size_t>(std::abs(k))];
          if (c < best) {
            best = c;
            from_k = k;
          }
        }
        reached[id(i, j)] = best + cost[id(at, j)];
        back[id(i, j)] = static_cast<std::int8_t>(from_k);
      }
    }
    int end = 0;
    float best = std::numeric_limits<float>::max();
    for (int j = 0; j < m; ++j) {
      const int k = fixed < 0 ? 0 : std::abs(j - fixed);
      if (k > reach) {
        continue;
      }
      const float c = reached[id(n - 1, j)] + bend[static_cast<std::size_t>(k)];
      if (c < best) {
        best = c;
        end = j;
      }
    }
    for (int i = n - 1; i >= 0; --i) {
      path[static_cast<std::size_t>((from + i) % n)] = end;
      end += i > 0 ? back[id(i, end)] : 0;
    }
  };
  search(0, -1);
  // The path is open at angle 0: go round again from the angle half a turn away, where it was not.
  const int opposite = n / 2;
  search(opposite, path[static_cast<std::size_t>(opposite)]);

  out.raw.resize(static_cast<std::size_t>(n));
  out.strength.resize(static_cast<std::size_t>(n));
  out.seen.assign(static_cast<std::size_t>(n), 0);
  std::vector<double> weight(static_cast<std::size_t>(n));
  int visible = 0, seen = 0;
  std::vector<float> levels;
  for (int i = 0; i < n; ++i) {
    const std::size_t a = static_cast<std::size_t>(i);
    // The cost saturates: from the path to the top of the edge beside it, at most 2 px.
    int j = path[a];
    for (int climbed = 0; climbed * band.step < 2.0; ++climbed) {
      const int up = j + 1 < m && s[id(i, j + 1)] > s[id(i, j)] ? 1 : 0;
      const int down = j > 0 && s[id(i, j - 1)] > s[id(i, std::min(j + up, m - 1))] ? 1 : 0;
      if (up + down == 0) {
        break;
      }
      j += down ? -1 : 1;
    }
    const double e = static_cast<double>(s[id(i, j)]);
    // Parabola by least squares over about +-1.5 px: a narrow one is drawn to the pixel grid.
    double offset = 0;
    const int wide = std::clamp(static_cast<int>(std::lround(1.5 / band.step)), 1, 4);
    const int from = std::min({wide, j, m - 1 - j});
    if (from >= 1) {
      double s2 = 0, s4 = 0, y0 = 0, y1 = 0, y2 = 0;
      const double count = 2.0 * from + 1;
      for (int q = -from; q <= from; ++q) {
        const double y = static_cast<double>(s[id(i, j + q)]);
        s2 += q * q;
        s4 += static_cast<double>(q) * q * q * q;
        y0 += y;
        y1 += q * y;
        y2 += q * q * y;
      }
      const double curve = (count * y2 - s2 * y0) / (count * s4 - s2 * s2);
      if (curve < -1e-9) {
        offset = std::clamp(-y1 / s2 / (2 * curve), -2.0, 2.0);
      }
    }
    out.raw[a] = band.middle[a] + (j - half + offset) * band.step;
    out.strength[a] = static_cast<float>(e);
    if (shown[a] > 0) {
      ++visible;
      levels.push_back(static_cast<float>(e));
      if (e > floor) {
        ++seen;
        out.seen[a] = 1;
      }
      out.mean_strength += std::clamp(e / saturation, 0.0, 1.0);
    }
    weight[a] = e > 0 ? std::pow(std::min(e / saturation, 1.0), 2) : 0;
  }
  out.level = median(levels);
  out.visible = static_cast<double>(visible) / n;
  out.support = visible > 0 ? static_cast<double>(seen) / visible : 0;
  out.mean_strength = visible > 0 ? out.mean_strength / visible : 0;
  constexpr double kAnchored = 4;  // weight
  std::vector<std::uint8_t> anchored(static_cast<std::size_t>(n), 0);
  for (const auto& [i, r] : band.anchors) {
    const std::size_t a = static_cast<std::size_t>(i);
    anchored[a] = 1;
    out.raw[a] = r;
    weight[a] = kAnchored;
  }
  // Long arcs that nothing is seen of: drawn a little to the line between what is seen on either side, or
  // noise at their ends would bend them far out.
  for (int i = 0; i < n; ++i) {
    if (!out.seen[static_cast<std::size_t>(i)] || out.seen[static_cast<std::size_t>((i + 1) % n)]) {
      continue;
    }
    int run = 1;
    while (run < n && !out.seen[static_cast<std::size_t>((i + 1 + run) % n)]) {
      ++run;
    }
    const auto side = [&](int from, int step) {
      std::vector<float> near;
      for (int k = 0; k < n / 8 && near.size() < 8; ++k) {
        const std::size_t a = static_cast<std::size_t>(((from + k * step) % n + n) % n);
        if (out.seen[a] && k > 0) {  // the outermost one may be half hidden
          near.push_back(static_cast<float>(out.raw[a]));
        }
      }
      return near.size() < 4 ? -1.0 : median(near);
    };
    const double left = side(i, -1), right = side(i + 1 + run, 1);
    if (left < 0 || right < 0) {
      continue;
    }
    for (int k = 0; k < run; ++k) {
      const std::size_t a = static_cast<std::size_t>((i + 1 + k) % n);
      if (!anchored[a]) {
        const double t = (k + 1.0) / (run + 1.0);
        out.raw[a] = (1 - t) * left + t * right;
        weight[a] = std::max(weight[a], 0.01);
      }
    }
  }
  out.r = out.raw;
  // (weights of the smoother are set by the caller's stiffness; the default holds about 25 modes)
  std::vector<double> stiff(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    // Where the middle line itself is bent (a dimple), give way.
    const std::size_t a = static_cast<std::size_t>(i);
    const std::size_t b = static_cast<std::size_t>((i + n - 3) % n),
                      f = static_cast<std::size_t>((i + 3) % n);
    const double curvature = std::abs(band.middle[b] - 2 * band.middle[a] + band.middle[f]) / (9 * arc * arc);
    stiff[a] = 30 * std::pow(n / 256.0, 4) / (1 + std::pow(curvature * 100, 2));
  }
  for (const auto& anchor : band.anchors) {
    for (int d = -n / 16; d <= n / 16; ++d) {
      const std::size_t a = static_cast<std::size_t>((anchor.first + d + n) % n);
      stiff[a] = std::min(stiff[a], 0.3);
    }
  }
  std::vector<double> w = weight;
  for (int round = 0; round < 3; ++round) {
    out.r = smooth_closed(out.raw, w, stiff);
    std::vector<double> d;
    for (int i = 0; i < n; ++i) {
      const std::size_t a = static_cast<std::size_t>(i);
      if (out.seen[a]) {
        d.push_back(std::abs(out.raw[a] - out.r[a]));
      }
    }
    if (d.size() < 8) {
      break;
    }
    std::nth_element(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2), d.end());
    out.residual = 1.4826 * d[d.size() / 2];
    const double limit = 4.7 * std::max(out.residual, 0.15);
    for (int i = 0; i < n; ++i) {
      const std::size_t a = static_cast<std::size_t>(i);
      const double t = (out.raw[a] - out.r[a]) / limit;
      w[a] = std::abs(t) < 1 ? weight[a] * std::pow(1 - t * t, 2) : 0;
    }
    for (const auto& anchor : band.anchors) {
      w[static_cast<std::size_t>(anchor.first)] = kAnchored;
    }
  }
  for (int i = 0; i < n && !band.upper.empty(); ++i) {
    const std::size_t a = static_cast<std::size_t>(i);
    out.r[a] = std::min(out.r[a], std::max(band.upper[a], 2.0));
  }
  return out;
}

}  // namespace punctum::vision
