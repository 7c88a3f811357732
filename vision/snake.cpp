#include "vision/snake.hpp"

#include <algorithm>
#include <cmath>

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

SnakeResult evolve(const cv::Mat& edge, Contour nodes, const SnakeParams& params, double floor) {
  SnakeResult out;
  const std::size_t n = nodes.size();
  if (n < 3 || edge.empty()) {
    out.nodes = std::move(nodes);
    return out;
  }
  for (Point& p : nodes) {  // the search is over whole pixels
    p.x = std::clamp(std::round(p.x), 0.0, edge.cols - 1.0);
    p.y = std::clamp(std::round(p.y), 0.0, edge.rows - 1.0);
  }
  const int r = std::max(1, params.radius_px);
  const std::size_t side = static_cast<std::size_t>(2 * r + 1), cells = side * side;
  std::vector<double> el(cells), be(cells), g(cells);
  std::vector<Point> at(cells);
  for (out.iterations = 0; out.iterations < params.iterations;) {
    ++out.iterations;
    double spacing = 0;
    for (std::size_t i = 0; i < n; ++i) {
      spacing += cv::norm(nodes[(i + 1) % n] - nodes[i]);
    }
    spacing /= static_cast<double>(n);
    int moved = 0;
    double energy = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Point &prev = nodes[(i + n - 1) % n], &next = nodes[(i + 1) % n];
      double el_max = 1e-9, be_max = 1e-9, lo = 1e30, hi = -1e30;
      std::size_t m = 0, here = 0;
      for (int dy = -r; dy <= r; ++dy) {
        for (int dx = -r; dx <= r; ++dx) {
          const Point p = nodes[i] + Point(dx, dy);
          if (p.x < 0 || p.y < 0 || p.x > edge.cols - 1 || p.y > edge.rows - 1) {
            continue;
          }
          if (dx == 0 && dy == 0) {
            here = m;
          }
          at[m] = p;
          el[m] = elastic_energy(prev, p, spacing);
          be[m] = bending_energy(prev, p, next);
          g[m] = static_cast<double>(edge.at<float>(static_cast<int>(p.y), static_cast<int>(p.x)));
          el_max = std::max(el_max, el[m]);
          be_max = std::max(be_max, be[m]);
          lo = std::min(lo, g[m]);
          hi = std::max(hi, g[m]);
          ++m;
        }
      }
      const auto total = [&](std::size_t k) {
        return params.alpha * el[k] / el_max + params.beta * be[k] / be_max +
               params.gamma * external_energy(g[k], lo, hi, floor);
      };
      std::size_t best = here;
      double e_best = total(here);  // staying wins a tie
      for (std::size_t k = 0; k < m; ++k) {
        const double e = total(k);
        if (e < e_best - 1e-12) {
          e_best = e;
          best = k;
        }
      }
      energy += e_best;
      if (best != here) {
        nodes[i] = at[best];
        ++moved;
      }
    }
    out.moved_last = moved;
    out.energy = energy / static_cast<double>(n);
    if (moved * 12 <= static_cast<int>(n)) {
      break;
    }
  }
  out.nodes = std::move(nodes);
  return out;
}

}  // namespace punctum::vision
