#include "vision/image/closed_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

#include "vision/image/median.hpp"
#include "vision/image/periodic_smoothing.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr float kForbidden = 1e6F;  // cost of a sample outside the limits
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr float kNoWay = std::numeric_limits<float>::max();
constexpr int kAnywhere = -1;
constexpr double kAnchorWeight = 4;  // in the smoothing; an edge weighs at most 1
constexpr double kAnchorStiffness = 0.3;
constexpr double kBridgeWeight = 0.01;  // of the straight bridge over an arc without edges
constexpr double kTukey = 4.7;          // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale_px = 0.15;

// The band as a grid of samples: the angle i runs round, the offset j outwards.
class BandSearch {
 public:
  BandSearch(const GradientField& field, const EdgeBand& band, Polarity polarity)
      : field_(field),
        band_(band),
        polarity_(polarity),
        n_(static_cast<int>(band.middle.size())),
        m_(2 * static_cast<int>(band.half_width / band.step) + 1),
        half_(m_ / 2) {}

  [[nodiscard]] bool empty() const { return n_ < 16 || m_ < 5 || field_.area.empty(); }

  EdgePath search(double floor, double saturation) {
    set_rays();
    sample_edges();
    set_costs(floor, saturation);
    find_shortest_closed_path();
    measure_edges(floor);
    bridge_gaps();
    smooth();
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::size_t id(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(m_) + static_cast<std::size_t>(j);
  }
  [[nodiscard]] std::size_t angle(int i) const {
    return static_cast<std::size_t>(i >= 0 && i < n_ ? i : (i % n_ + n_) % n_);
  }
  [[nodiscard]] double radius(int i, int j) const {
    return band_.middle[static_cast<std::size_t>(i)] + (j - half_) * band_.step;
  }

  void set_rays();
  void sample_edges();
  [[nodiscard]] double usual_top() const;
  void set_costs(double floor, double saturation);
  void find_shortest_closed_path();
  void cheapest_steps(const float* before, const std::vector<float>& bend);
  void find_shortest_path(int from, int count, int fixed, const std::vector<float>& bend);
  [[nodiscard]] int top_of_edge(int i) const;
  [[nodiscard]] double vertex_beside(int i, int j) const;
  void measure_edges(double floor);
  [[nodiscard]] double radius_beside_gap(int from, int step) const;
  void bridge_gaps();
  [[nodiscard]] std::vector<double> stiffness_per_angle() const;
  void smooth();

  const GradientField& field_;
  const EdgeBand& band_;
  Polarity polarity_;
  int n_, m_, half_;
  std::vector<Point> ray_, normal_;  // per angle, unit
  double arc_ = 0;                   // between two angles, px
  std::vector<float> edge_, cost_;   // per sample; edge: grey levels per px
  std::vector<std::uint8_t> shown_;  // 1: this angle is visible near the middle of the band
  std::vector<int> path_;            // offset per angle
  std::vector<float> best_, total_;  // of the shortest path: one angle's samples, and all
  std::vector<double> weight_;       // per angle, in the smoothing
  EdgePath out_;
};

void BandSearch::set_rays() {
  const double turn = 2 * std::numbers::pi / n_;
  ray_.resize(band_.middle.size());
  normal_.resize(band_.middle.size());
  double r_mean = 0;
  for (int i = 0; i < n_; ++i) {
    ray_[angle(i)] = on_ray(Point(0, 0), i, n_, 1);
    r_mean += band_.middle[angle(i)] / n_;
  }
  arc_ = std::max(0.5, r_mean * turn);
  // The edge is measured along the normal of the band's middle line: on the wall of a dimple that is far from
  // radial. Neighbours two angles away smooth it a little.
  for (int i = 0; i < n_; ++i) {
    const std::size_t before = angle(i - 2), after = angle(i + 2);
    const Point t = band_.middle[after] * ray_[after] - band_.middle[before] * ray_[before];
    const double l = cv::norm(t);
    normal_[angle(i)] = l > 0 ? Point(t.y / l, -t.x / l) : ray_[angle(i)];
  }
}

// Whether the rays are visible, and the edge there. Nothing is visible within one pixel of the border of the
// field, where the gradient is not known, and near the centre. What does not change is in variables of its
// own: this is where a frame's time goes.
void BandSearch::sample_edges() {
  const std::size_t m = static_cast<std::size_t>(m_), samples = band_.middle.size() * m;
  edge_.assign(samples, 0.0F);
  cost_.assign(samples, 1.0F);
  shown_.assign(band_.middle.size(), 0);
  const cv::Mat &gx = field_.gx, &gy = field_.gy, &covered = band_.covered;
  const float *gx_data = gx.ptr<float>(), *gy_data = gy.ptr<float>();
  const std::uint8_t* hides = covered.empty() ? nullptr : covered.ptr(field_.area.y) + field_.area.x;
  const auto stride = static_cast<std::ptrdiff_t>(gx.step1());
  const auto hides_stride = static_cast<std::ptrdiff_t>(covered.empty() ? 0 : covered.step1());
  const auto right = static_cast<float>(gx.cols - 2), bottom = static_cast<float>(gx.rows - 2);
  const double sign = polarity_ == Polarity::darker_out ? -1 : 1;
  const Point centre = band_.centre - Point(field_.area.x, field_.area.y);
  const int first_near = half_ - half_ / 2, last_near = half_ + half_ / 2;
  for (std::size_t a = 0; a < band_.middle.size(); ++a) {
    const double first = band_.middle[a] - half_ * band_.step;
    const double lower = band_.lower.empty() ? -kNoLimit : band_.lower[a];
    const double upper = band_.upper.empty() ? kNoLimit : band_.upper[a];
    const bool hidden_ray = !band_.hidden.empty() && band_.hidden[a] != 0;
    const auto along = static_cast<float>(sign * normal_[a].x),
               down = static_cast<float>(sign * normal_[a].y);
    const auto x0 = static_cast<float>(centre.x + first * ray_[a].x),
               y0 = static_cast<float>(centre.y + first * ray_[a].y);
    const auto dx = static_cast<float>(band_.step * ray_[a].x),
               dy = static_cast<float>(band_.step * ray_[a].y);
    float *edge = edge_.data() + a * m, *cost = cost_.data() + a * m;
    bool shown_near = false;
    for (int j = 0; j < m_; ++j) {
      const double r = first + j * band_.step;
      const float x = x0 + static_cast<float>(j) * dx, y = y0 + static_cast<float>(j) * dy;
      const bool known = x >= 1 && y >= 1 && x <= right && y <= bottom && r > 2 && !hidden_ray;
      if (known && (hides == nullptr ||
                    hides[static_cast<int>(y + 0.5F) * hides_stride + static_cast<int>(x + 0.5F)] == 0)) {
        const int left = static_cast<int>(x), top = static_cast<int>(y);
        const std::ptrdiff_t at = top * stride + left;
        const float u = x - static_cast<float>(left), v = y - static_cast<float>(top);
        const float both = u * v, only_u = u - both, only_v = v - both, none = 1 - u - only_v;
        const auto sample = [&](const float* g) {
          return none * g[at] + only_u * g[at + 1] + only_v * g[at + stride] + both * g[at + stride + 1];
        };
        const float e = along * sample(gx_data) + down * sample(gy_data);
        edge[j] = polarity_ == Polarity::any ? std::abs(e) : e;
        cost[j] = 0;
        shown_near = shown_near || (j >= first_near && j <= last_near);
      }
      if (!(r >= lower && r <= upper)) {
        cost[j] = kForbidden;
      }
    }
    shown_[a] = shown_near ? 1 : 0;
  }
}

// Median over the visible angles of each ray's strongest edge.
double BandSearch::usual_top() const {
  std::vector<float> strongest;
  for (int i = 0; i < n_; ++i) {
    float top = 0;
    for (int j = 0; j < m_; ++j) {
      if (cost_[id(i, j)] == 0.0F) {
        top = std::max(top, edge_[id(i, j)]);
      }
    }
    if (shown_[angle(i)] != 0) {
      strongest.push_back(top);
    }
  }
  return median_of(std::move(strongest));
}

void BandSearch::set_costs(double floor, double saturation) {
  if (!(saturation > 0)) {
    saturation = std::max({0.7 * usual_top(), 2 * floor, 1e-6});
  }
  out_.saturation = saturation;
  if (band_.measures_background) {
    std::vector<float> all;
    for (std::size_t k = 0; k < cost_.size(); ++k) {
      if (cost_[k] == 0.0F) {
        all.push_back(std::abs(edge_[k]));
      }
    }
    out_.background = median_of(std::move(all));
  }
  for (std::size_t k = 0; k < cost_.size(); ++k) {
    if (cost_[k] == 0.0F) {
      cost_[k] = static_cast<float>(1 - std::clamp(static_cast<double>(edge_[k]) / saturation, -0.3, 1.0));
    }
  }
  for (const auto& [i, r] : band_.anchors) {
    for (int j = 0; j < m_; ++j) {
      const double d = radius(i, j) - r;
      cost_[id(i, j)] = static_cast<float>(std::min(40.0, 4 * d * d));
    }
  }
}

void BandSearch::find_shortest_closed_path() {
  const int reach = std::clamp(static_cast<int>(std::lround(band_.slope * arc_ / band_.step)), 1, 8);
  std::vector<float> bend(static_cast<std::size_t>(reach) + 1);
  for (int k = 0; k <= reach; ++k) {
    bend[static_cast<std::size_t>(k)] =
        static_cast<float>(band_.stiffness * std::pow(k * band_.step / arc_, 2));
  }
  path_.resize(band_.middle.size());
  // An open path tells where the path crosses an angle; the closed one begins and ends there. It needs so
  // many times the angles in which a path crosses the band, or noise would choose; round the whole cell at
  // most.
  constexpr int kSettled = 12;
  const int middle = n_ / 2, count = std::min(n_, kSettled * m_ / reach);
  find_shortest_path(middle - count / 2, count, kAnywhere, bend);
  find_shortest_path(middle, n_, path_[angle(middle)], bend);
}

// The cheapest way to each sample of an angle from the one before, `reach` samples inwards to `reach`
// outwards. `before` has `reach` samples more on either side, which no path may use. Each loop runs over the
// samples, so that a compiler makes several of them at once.
void BandSearch::cheapest_steps(const float* before, const std::vector<float>& bend) {
  const std::size_t m = best_.size(), reach = bend.size() - 1;
  float* best = best_.data();
  for (std::size_t j = 0; j < m; ++j) {
    best[j] = before[j] + bend[reach];
  }
  for (std::size_t k = 1; k <= 2 * reach; ++k) {
    const float bent = bend[k > reach ? k - reach : reach - k];
    const float* from = before + k;
    for (std::size_t j = 0; j < m; ++j) {
      const float c = from[j] + bent;
      best[j] = c < best[j] ? c : best[j];
    }
  }
}

// Dynamic programming over `count` angles. The path begins and ends at the sample `fixed`, or anywhere.
void BandSearch::find_shortest_path(int from, int count, int fixed, const std::vector<float>& bend) {
  const std::size_t m = static_cast<std::size_t>(m_), reach = bend.size() - 1, row = m + 2 * reach;
  total_.assign(static_cast<std::size_t>(count) * row, kNoWay);
  best_.resize(m);
  float* total = total_.data() + reach;
  for (int j = 0; j < m_; ++j) {
    total[j] = fixed == kAnywhere || j == fixed ? cost_[id(from, j)] : kForbidden * 100;
  }
  for (int i = 1; i < count; ++i) {
    cheapest_steps(total - reach, bend);
    total += row;
    const float* cost = cost_.data() + angle(from + i) * m;
    for (std::size_t j = 0; j < m; ++j) {
      total[j] = best_[j] + cost[j];
    }
  }
  // Backwards: the cheapest sample of the last angle, and of each angle before the one that led on.
  const auto cheapest = [&](int towards, bool free) {
    int at = 0;
    float least = kNoWay;
    for (int j = 0; j < m_; ++j) {
      const auto k = static_cast<std::size_t>(free ? 0 : std::abs(j - towards));
      if (k <= reach && total[j] + bend[k] < least) {
        least = total[j] + bend[k];
        at = j;
      }
    }
    return at;
  };
  int here = cheapest(fixed, fixed == kAnywhere);
  for (int i = count - 1; i >= 0; --i) {
    path_[angle(from + i)] = here;
    if (i > 0) {
      total -= row;
      here = cheapest(here, false);
    }
  }
}

// The cost saturates, so the path may lie beside the top of the edge: at most 2 px away.
int BandSearch::top_of_edge(int i) const {
  int j = path_[angle(i)];
  for (int climbed = 0; climbed * band_.step < 2.0; ++climbed) {
    const int up = j + 1 < m_ && edge_[id(i, j + 1)] > edge_[id(i, j)] ? 1 : 0;
    const int down = j > 0 && edge_[id(i, j - 1)] > edge_[id(i, std::min(j + up, m_ - 1))] ? 1 : 0;
    if (up + down == 0) {
      break;
    }
    j += down ? -1 : 1;
  }
  return j;
}

// Vertex of a parabola fitted by least squares over about +-1.5 px, in steps from j. A narrower parabola is
// drawn towards the pixel grid.
double BandSearch::vertex_beside(int i, int j) const {
  const int wide = std::clamp(static_cast<int>(std::lround(1.5 / band_.step)), 1, 4);
  const int reach = std::min({wide, j, m_ - 1 - j});
  if (reach < 1) {
    return 0;
  }
  double s2 = 0, s4 = 0, y0 = 0, y1 = 0, y2 = 0;
  const double count = 2.0 * reach + 1;
  for (int q = -reach; q <= reach; ++q) {
    const double y = static_cast<double>(edge_[id(i, j + q)]);
    s2 += q * q;
    s4 += static_cast<double>(q) * q * q * q;
    y0 += y;
    y1 += q * y;
    y2 += q * q * y;
  }
  const double curvature = (count * y2 - s2 * y0) / (count * s4 - s2 * s2);
  return curvature < -1e-9 ? std::clamp(-y1 / s2 / (2 * curvature), -2.0, 2.0) : 0.0;
}

void BandSearch::measure_edges(double floor) {
  const std::size_t n = band_.middle.size();
  out_.raw.resize(n);
  out_.strength.resize(n);
  out_.seen.assign(n, 0);
  weight_.resize(n);
  int visible = 0, seen = 0;
  std::vector<float> levels;
  for (int i = 0; i < n_; ++i) {
    const std::size_t a = angle(i);
    const int j = top_of_edge(i);
    const double e = static_cast<double>(edge_[id(i, j)]);
    out_.raw[a] = band_.middle[a] + (j - half_ + vertex_beside(i, j)) * band_.step;
    out_.strength[a] = static_cast<float>(e);
    if (shown_[a] != 0) {
      ++visible;
      levels.push_back(static_cast<float>(e));
      if (e > floor) {
        ++seen;
        out_.seen[a] = 1;
      }
      out_.mean_strength += std::clamp(e / out_.saturation, 0.0, 1.0);
    }
    weight_[a] = e > 0 ? std::pow(std::min(e / out_.saturation, 1.0), 2) : 0;
  }
  out_.level = median_of(std::move(levels));
  out_.visible = static_cast<double>(visible) / n_;
  out_.support = visible > 0 ? static_cast<double>(seen) / visible : 0;
  out_.mean_strength = visible > 0 ? out_.mean_strength / visible : 0;
  for (const auto& [i, r] : band_.anchors) {
    out_.raw[angle(i)] = r;
    weight_[angle(i)] = kAnchorWeight;
  }
}

// Median of the seen radii nearest to a gap, without the outermost, which may be half hidden; -1: too few.
double BandSearch::radius_beside_gap(int from, int step) const {
  std::vector<float> near;
  for (int k = 0; k < n_ / 8 && near.size() < 8; ++k) {
    const std::size_t a = angle(from + k * step);
    if (out_.seen[a] && k > 0) {
      near.push_back(static_cast<float>(out_.raw[a]));
    }
  }
  return near.size() < 4 ? -1.0 : median_of(std::move(near));
}

// Over long arcs without edges the contour is drawn weakly to a straight bridge between the seen radii on
// either side; otherwise noise at the ends of the arc would bend it far out.
void BandSearch::bridge_gaps() {
  std::vector<std::uint8_t> anchored(band_.middle.size(), 0);
  for (const auto& anchor : band_.anchors) {
    anchored[angle(anchor.first)] = 1;
  }
  for (int i = 0; i < n_; ++i) {
    if (!out_.seen[angle(i)] || out_.seen[angle(i + 1)]) {
      continue;
    }
    int run = 1;
    while (run < n_ && !out_.seen[angle(i + 1 + run)]) {
      ++run;
    }
    const double left = radius_beside_gap(i, -1), right = radius_beside_gap(i + 1 + run, 1);
    if (left < 0 || right < 0) {
      continue;
    }
    for (int k = 0; k < run; ++k) {
      const std::size_t a = angle(i + 1 + k);
      if (!anchored[a]) {
        const double t = (k + 1.0) / (run + 1.0);
        out_.raw[a] = (1 - t) * left + t * right;
        weight_[a] = std::max(weight_[a], kBridgeWeight);
      }
    }
  }
}

// About 25 modes of the contour are left free; more where the middle line itself is bent (a dimple), and at
// the anchors.
std::vector<double> BandSearch::stiffness_per_angle() const {
  std::vector<double> stiffness(band_.middle.size());
  const double finer = n_ / 256.0;
  for (int i = 0; i < n_; ++i) {
    const double bend = band_.middle[angle(i - 3)] - 2 * band_.middle[angle(i)] + band_.middle[angle(i + 3)];
    const double curvature = std::abs(bend) / (9 * arc_ * arc_);
    stiffness[angle(i)] = 30 * (finer * finer * (finer * finer)) / (1 + std::pow(curvature * 100, 2));
  }
  for (const auto& anchor : band_.anchors) {
    for (int d = -n_ / 16; d <= n_ / 16; ++d) {
      double& s = stiffness[angle(anchor.first + d)];
      s = std::min(s, kAnchorStiffness);
    }
  }
  return stiffness;
}

void BandSearch::smooth() {
  const std::vector<double> stiffness = stiffness_per_angle();
  std::vector<double> w = weight_;
  for (int round = 0; round < 3; ++round) {
    out_.r = smooth_periodic(out_.raw, w, stiffness);
    std::vector<double> distances;
    for (std::size_t a = 0; a < out_.r.size(); ++a) {
      if (out_.seen[a]) {
        distances.push_back(std::abs(out_.raw[a] - out_.r[a]));
      }
    }
    if (distances.size() < 8) {
      break;
    }
    out_.residual = kSdOfMedian * median_of(std::move(distances));
    const double limit = kTukey * std::max(out_.residual, kLeastScale_px);
    for (std::size_t a = 0; a < out_.r.size(); ++a) {
      const double t = (out_.raw[a] - out_.r[a]) / limit;
      w[a] = std::abs(t) < 1 ? weight_[a] * std::pow(1 - t * t, 2) : 0;
    }
    for (const auto& anchor : band_.anchors) {
      w[angle(anchor.first)] = kAnchorWeight;
    }
  }
  if (!band_.upper.empty()) {
    for (std::size_t a = 0; a < out_.r.size(); ++a) {
      out_.r[a] = std::min(out_.r[a], std::max(band_.upper[a], 2.0));
    }
  }
}

}  // namespace

EdgePath closed_path(const GradientField& field, const EdgeBand& band, Polarity polarity, double floor,
                     double saturation) {
  BandSearch search(field, band, polarity);
  return search.empty() ? EdgePath{} : search.search(floor, saturation);
}

}  // namespace punctum::vision
