#include "vision/image/snake.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

double elastic_energy(const Point& previous, const Point& v, double mean_spacing) {
  return std::abs(mean_spacing - cv::norm(v - previous));
}

double bending_energy(const Point& previous, const Point& v, const Point& next) {
  const Point d = previous - 2.0 * v + next;
  return d.dot(d);
}

double external_energy(double g, double lo, double hi, double floor) {
  if (hi - lo < floor) {
    lo = hi - floor;
  }
  return hi > lo ? (lo - g) / (hi - lo) : 0;
}

namespace {

// The square of whole pixels round a node that is searched in one step.
struct Neighbourhood {
  Vector<Point> at;
  Vector<double> elastic, bending, gradient;
  double elastic_max = 0, bending_max = 0, gradient_min = 0, gradient_max = 0;
  std::size_t here = 0;  // where the node is now

  void fill(const cv::Mat& edge, const Point& previous, const Point& node, const Point& next, double spacing,
            int radius) {
    for (auto* v : {&elastic, &bending, &gradient}) {
      v->clear();
    }
    at.clear();
    elastic_max = bending_max = 1e-9;
    gradient_min = 1e30;
    gradient_max = -1e30;
    here = 0;
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        const Point p = node + Point(dx, dy);
        if (p.x < 0 || p.y < 0 || p.x > edge.cols - 1 || p.y > edge.rows - 1) {
          continue;
        }
        if (dx == 0 && dy == 0) {
          here = at.size();
        }
        at.push_back(p);
        elastic.push_back(elastic_energy(previous, p, spacing));
        bending.push_back(bending_energy(previous, p, next));
        gradient.push_back(static_cast<double>(edge.at<float>(static_cast<int>(p.y), static_cast<int>(p.x))));
        elastic_max = std::max(elastic_max, elastic.back());
        bending_max = std::max(bending_max, bending.back());
        gradient_min = std::min(gradient_min, gradient.back());
        gradient_max = std::max(gradient_max, gradient.back());
      }
    }
  }
  // Where the weighted sum of the terms is least. A node that gains nothing stays.
  [[nodiscard]] std::size_t best(const SnakeParams& params, double floor) const {
    const auto total = [&](std::size_t k) {
      return params.alpha * elastic[k] / elastic_max + params.beta * bending[k] / bending_max +
             params.gamma * external_energy(gradient[k], gradient_min, gradient_max, floor);
    };
    std::size_t best = here;
    double least = total(here);
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double e = total(k);
      if (e < least - 1e-12) {
        least = e;
        best = k;
      }
    }
    return best;
  }
};

}  // namespace

Contour evolve(const cv::Mat& edge, Contour nodes, const SnakeParams& params, double floor,
               const cv::Mat& erased) {
  const std::size_t n = nodes.size();
  if (n < 3 || edge.empty()) {
    return nodes;
  }
  for (Point& p : nodes) {
    p.x = std::clamp(std::round(p.x), 0.0, edge.cols - 1.0);
    p.y = std::clamp(std::round(p.y), 0.0, edge.rows - 1.0);
  }
  const int radius = std::max(1, params.radius_px);
  Neighbourhood around;
  for (int iteration = 0; iteration < params.iterations; ++iteration) {
    double spacing = 0;
    for (std::size_t i = 0; i < n; ++i) {
      spacing += cv::norm(nodes[(i + 1) % n] - nodes[i]);
    }
    spacing /= static_cast<double>(n);
    int moved = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const cv::Point at(static_cast<int>(nodes[i].x), static_cast<int>(nodes[i].y));
      if (!erased.empty() && erased.at<std::uint8_t>(at) > 0) {
        continue;
      }
      around.fill(edge, nodes[(i + n - 1) % n], nodes[i], nodes[(i + 1) % n], spacing, radius);
      const std::size_t best = around.best(params, floor);
      if (best != around.here) {
        nodes[i] = around.at[best];
        ++moved;
      }
    }
    if (moved * 12 <= static_cast<int>(n)) {
      break;
    }
  }
  return nodes;
}

}  // namespace punctum::vision
