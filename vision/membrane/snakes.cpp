#include "vision/membrane/snakes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/hough_circles.hpp"
#include "vision/image/median.hpp"
#include "vision/image/snake.hpp"
#include "vision/image/spline.hpp"
#include "vision/membrane/edge_candidates.hpp"

namespace punctum::vision {

namespace {

constexpr int kRays = 180;            // on which the first circles are measured
constexpr double kRayStep_px = 0.5;   // half of what a node can tell
constexpr double kClear = 0.5;        // of the usual edge: less is another edge, or none
constexpr double kOtherCircle = 0.4;  // of the radius: further off, it is no circle round this cell
constexpr int kHoughCircles = 6;      // that are compared
constexpr double kHoughScore = 0.35;  // share of a circumference that must have voted

double strength_at(const ClearedPicture& picture, const Point& p) {
  return picture.hidden(p) ? 0 : cv::norm(picture.field.gradient(p));
}

// The first clear edge on every ray that starts at the distance `from` and ends at the distance `to`. It is
// the outer face of the outermost membrane when the rays come from outside; the circle that has most votes
// may lie on any face of either membrane.
Vector<Point> first_edges(const ClearedPicture& picture, const Point& centre, double from, double to) {
  const int steps = static_cast<int>(std::abs(to - from) / kRayStep_px);
  const double step = (to - from) / std::max(1, steps);
  Vector<Vector<double>> rays;
  Vector<double> strongest;
  for (int i = 0; i < kRays; ++i) {
    Vector<double> g;
    for (int k = 0; k <= steps; ++k) {
      g.push_back(strength_at(picture, on_ray(centre, i, kRays, from + k * step)));
    }
    strongest.push_back(*std::max_element(g.begin(), g.end()));
    rays.push_back(std::move(g));
  }
  const double clear =
      std::max(kEdgeClear_noise * picture.gradient_noise, kClear * median_of(std::move(strongest)));
  Vector<Point> edges;
  for (int i = 0; i < kRays; ++i) {
    const Vector<double>& g = rays[static_cast<std::size_t>(i)];
    for (std::size_t k = 1; k + 1 < g.size(); ++k) {
      if (g[k] > clear && g[k] >= g[k - 1] && g[k] > g[k + 1]) {
        edges.push_back(on_ray(centre, i, kRays, from + static_cast<double>(k) * step));
        break;
      }
    }
  }
  return edges;
}

// Shares of the radius from which and to which the rays look for the first edge.
struct Look {
  double from, to;
};

// The circle through the first edges, looked for in rounds that begin with the circle of the last one. The
// same circle where there are too few edges.
Circle circle_of_first_edges(const ClearedPicture& picture, Circle circle,
                             std::initializer_list<Look> rounds) {
  for (const Look& look : rounds) {
    const Vector<Point> edges = first_edges(picture, circle.centre, look.from * circle.r, look.to * circle.r);
    if (static_cast<int>(edges.size()) > kRays / 3) {
      const auto fitted = fit_circle(edges);
      if (fitted && std::abs(fitted->r - circle.r) < kOtherCircle * circle.r) {
        circle = *fitted;
      }
    }
  }
  return circle;
}

FollowedMembrane snake_on(const Circle& c, const ClearedPicture& picture, const VisionConfig& config) {
  FollowedMembrane m;
  m.known = true;
  m.centre = c.centre;
  m.r.assign(static_cast<std::size_t>(config.contour_points), c.r);
  m.nodes = circle_contour(c, config.snake.nodes);
  Vector<double> strength;
  for (const Point& p : m.contour()) {
    strength.push_back(strength_at(picture, p));
  }
  m.level = median_of(std::move(strength));
  return m;
}

Contour moved(Contour nodes, const Point& by) {
  for (Point& p : nodes) {
    p += by;
  }
  return nodes;
}

// The contour through the nodes that are not erased and the contact points. It is eq. 3's own answer where
// there is no picture: of all curves between two nodes the cubic spline is the least bent one.
Contour visible_contour(const Contour& nodes, const FollowedMembrane& m, const ClearedPicture& picture,
                        const ContactPoints& contact) {
  Contour visible;
  for (const Point& p : nodes) {
    if (!picture.hidden(p)) {
      visible.push_back(p);
    }
  }
  if (2 * visible.size() < nodes.size()) {
    return {};
  }
  for (const auto& p : contact.point) {
    if (p) {
      visible.push_back(*p);
    }
  }
  const auto angle = [&m](const Point& p) { return math::atan2(p.y - m.centre.y, p.x - m.centre.x); };
  std::sort(visible.begin(), visible.end(),
            [&angle](const Point& a, const Point& b) { return angle(a) < angle(b); });
  return spline_through(visible, static_cast<int>(m.r.size()));
}

Point nearest(const Contour& contour, const Point& p) {
  return *std::min_element(contour.begin(), contour.end(), [&p](const Point& a, const Point& b) {
    return cv::norm(a - p) < cv::norm(b - p);
  });
}

}  // namespace

StartedMembranes start_snakes(const ClearedPicture& picture, const VisionConfig& config,
                              const std::optional<Circle>& seed) {
  StartedMembranes out;
  Circle circle = seed.value_or(Circle{});
  if (!seed) {
    const auto found = find_circles(picture.field, picture.covered, kEdgeClear_noise * picture.gradient_noise,
                                    config.px(config.R_min_m), config.px(config.R_max_m), kHoughCircles);
    if (found.empty() || found.front().score < kHoughScore) {
      out.reason = "no circle found";
      return out;
    }
    circle = found.front().circle;
  }
  // The circle that was found may be the ooplasm's, which is a fifth smaller than the outer face of the zona.
  const Circle outer = circle_of_first_edges(picture, circle, {{1.35, 0.9}, {1.12, 0.9}, {1.12, 0.9}});
  out.outer = snake_on(outer, picture, config);
  if (config.inner) {
    const Circle within{outer.centre, 0.8 * outer.r, 0};
    out.inner = snake_on(circle_of_first_edges(picture, within, {{0.85, 1.18}, {0.9, 1.1}}), picture, config);
  }
  return out;
}

namespace {

// Eq. 3: the external energy. 0 where the picture is covered.
cv::Mat squared_gradient(const ClearedPicture& picture) {
  const cv::Rect& area = picture.field.area;
  const cv::Mat length = picture.field.magnitude(cv::Range(0, area.height));
  cv::Mat out = length.mul(length);
  out.setTo(0, picture.covered(area));
  return out;
}

}  // namespace

Membrane follow_snake(FollowedMembrane& m, const ClearedPicture& picture, const VisionConfig& config,
                      const ContactPoints& contact) {
  Membrane out;
  if (!m.known) {
    out.reason = "not found";
    return out;
  }
  const cv::Rect& area = picture.field.area;
  const Point offset(area.x, area.y);
  const double floor = picture.snake_floor();
  out.nodes = moved(evolve(squared_gradient(picture), moved(m.nodes, -offset), config.snake, floor * floor,
                           picture.covered(area)),
                    offset);
  out.contour = visible_contour(out.nodes, m, picture, contact);
  const Point centre = out.contour.empty() ? Point() : centroid(out.contour);
  const Vector<double> r = polar_radii(out.contour, centre, static_cast<int>(m.r.size()));
  const double area_now = signed_area(out.contour), before = signed_area(m.contour());
  double strength = 0;
  int visible = 0;
  for (Point& p : out.nodes) {
    if (!picture.hidden(p)) {
      strength += strength_at(picture, p);
      ++visible;
    }
  }
  strength /= std::max(1, visible);
  out.visible = static_cast<double>(visible) / static_cast<double>(out.nodes.size());
  if (out.contour.empty()) {
    out.reason = "mostly hidden";
  } else if (r.empty() || area_now < 0.6 * before || area_now > 1.6 * before ||
             strength < picture.edge_floor()) {
    out.reason = "snake lost the edge";
  }
  m.known = out.ok = out.reason.empty();
  if (!out.ok) {
    return out;
  }
  m.nodes = out.nodes;
  for (Point& p : m.nodes) {
    if (picture.hidden(p)) {
      p = nearest(out.contour, p);
    }
  }
  m.level = strength;
  m.centre = centre;
  m.r = r;
  out.support = 1;
  return out;
}

}  // namespace punctum::vision
