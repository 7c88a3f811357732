#include "vision/image/closed_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "vision/image/cheapest_path.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/median.hpp"
#include "vision/image/periodic_smoothing.hpp"

namespace punctum::vision {

namespace {

constexpr double kAnchorWeight = 4;  // in the smoothing; an edge weighs at most 1
constexpr double kAnchorStiffness = 0.3;
constexpr double kBridgeWeight = 0.01;  // of the straight bridge over an arc without edges
constexpr double kTukey = 4.7;          // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale_px = 0.15;

class BandSearch {
 public:
  BandSearch(const GradientField& field, const EdgeBand& band, Polarity polarity)
      : samples_(field, band, polarity),
        band_(band),
        edge_(samples_.edge),
        cost_(samples_.cost),
        shown_(samples_.shown),
        n_(samples_.angles),
        m_(samples_.samples),
        half_(samples_.half),
        arc_(samples_.arc) {}

  [[nodiscard]] bool empty() const { return samples_.empty(); }

  EdgePath search(double floor, double saturation) {
    set_costs(floor, saturation);
    find_path();
    measure_edges(floor);
    bridge_gaps();
    smooth();
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::size_t id(int i, int j) const { return samples_.id(i, j); }
  [[nodiscard]] std::size_t angle(int i) const {
    return static_cast<std::size_t>(i >= 0 && i < n_ ? i : (i % n_ + n_) % n_);
  }
  [[nodiscard]] double radius(int i, int j) const {
    return band_.middle[static_cast<std::size_t>(i)] + (j - half_) * band_.step;
  }

  [[nodiscard]] double usual_top() const;
  void set_costs(double floor, double saturation);
  void find_path();
  [[nodiscard]] int top_of_edge(int i) const;
  [[nodiscard]] double vertex_beside(int i, int j) const;
  void measure_edges(double floor);
  [[nodiscard]] double radius_beside_gap(int from, int step) const;
  void bridge_gaps();
  [[nodiscard]] Vector<double> stiffness_per_angle() const;
  void smooth();

  EdgeSamples samples_;
  const EdgeBand& band_;
  const Vector<float>& edge_;
  Vector<float>& cost_;
  const Vector<std::uint8_t>& shown_;
  int n_, m_, half_;
  double arc_;
  Vector<int> path_;       // sample per angle
  Vector<double> weight_;  // per angle, in the smoothing
  EdgePath out_;
};

// Median over the visible angles of each ray's strongest edge.
double BandSearch::usual_top() const {
  Vector<float> strongest;
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

// Of the samples that are visible; those cost nothing yet.
PUNCTUM_WIDE_LOOP void cost_of_edges(const float* edge, std::size_t n, float per_edge, float* cost) {
  for (std::size_t k = 0; k < n; ++k) {
    const float e = edge[k] * per_edge, low = e < -0.3F ? -0.3F : e, here = cost[k];
    const float seen = 1 - (low > 1.0F ? 1.0F : low);
    cost[k] = here == 0.0F ? seen : here;
  }
}

void BandSearch::set_costs(double floor, double saturation) {
  if (!(saturation > 0)) {
    saturation = std::max({0.7 * usual_top(), 2 * floor, 1e-6});
  }
  out_.saturation = saturation;
  if (band_.measures_background) {
    Vector<float> all;
    for (std::size_t k = 0; k < cost_.size(); ++k) {
      if (cost_[k] == 0.0F) {
        all.push_back(std::abs(edge_[k]));
      }
    }
    out_.background = median_of(std::move(all));
  }
  cost_of_edges(edge_.data(), cost_.size(), static_cast<float>(1 / saturation), cost_.data());
  for (const auto& [i, r] : band_.anchors) {
    for (int j = 0; j < m_; ++j) {
      const double d = radius(i, j) - r;
      cost_[id(i, j)] = static_cast<float>(std::min(40.0, 4 * d * d));
    }
  }
}

void BandSearch::find_path() {
  const int reach = std::clamp(static_cast<int>(std::lround(band_.slope * arc_ / band_.step)), 1, kMostReach);
  std::array<float, kMostReach + 1> bend{};
  for (int k = 0; k <= reach; ++k) {
    const double turn = k * band_.step / arc_;
    bend[static_cast<std::size_t>(k)] = static_cast<float>(band_.stiffness * turn * turn);
  }
  path_ = cheapest_closed_path(cost_, n_, m_, std::span(bend).first(static_cast<std::size_t>(reach) + 1));
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
  Vector<float> levels;
  levels.reserve(n);
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
  Vector<float> near;
  near.reserve(8);
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
  Vector<std::uint8_t> anchored(band_.middle.size(), 0);
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
Vector<double> BandSearch::stiffness_per_angle() const {
  Vector<double> stiffness(band_.middle.size());
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
  const Vector<double> stiffness = stiffness_per_angle();
  Vector<double> w = weight_;
  Vector<double> distances;
  distances.reserve(w.size());
  for (int round = 0; round < 3; ++round) {
    out_.r = smooth_periodic(out_.raw, w, stiffness);
    distances.clear();
    for (std::size_t a = 0; a < out_.r.size(); ++a) {
      if (out_.seen[a]) {
        distances.push_back(std::abs(out_.raw[a] - out_.r[a]));
      }
    }
    if (distances.size() < 8) {
      break;
    }
    out_.residual = kSdOfMedian * median_in_place(distances);
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
