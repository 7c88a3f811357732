#include "vision/membrane_following.hpp"

#include <algorithm>
#include <cmath>

#include "vision/median.hpp"
#include "vision/snake.hpp"

namespace punctum::vision {

namespace {

constexpr double kSnakeFloor_noise = 4;  // times the gradient's noise: what a flat neighbourhood spreads
constexpr double kSaturation = 0.7;      // times the usual edge: more is no better
constexpr double kStep_px = 2.0;         // motion of the whole that is believed, per frame and direction
constexpr double kStill_px = 1.2;        // the snake stands on whole pixels: less is no motion
constexpr double kNeedleHalf = 1.2;      // rad to either side of the entry: what a needle may dent
constexpr double kBesideHalf = 0.24;     // rad to either side of the entry: the dimple's steep part

SnakeResult snake_from(const Contour& nodes, const ClearedPicture& picture, const SnakeParams& params) {
  const Point offset(picture.field.area.x, picture.field.area.y);
  Contour local = nodes;
  for (Point& p : local) {
    p -= offset;
  }
  SnakeResult snake = evolve(picture.edge, local, params, kSnakeFloor_noise * picture.gradient_noise);
  for (Point& p : snake.nodes) {
    p += offset;
  }
  return snake;
}

// The paper's contour: the spline through the snake's nodes.
void take_snake(FollowedMembrane& m, const ClearedPicture& picture, Membrane& out) {
  const int angles = static_cast<int>(m.r.size());
  out.contour = spline_through(m.nodes, angles);
  const Point centre = centroid(out.contour);
  const std::vector<double> r = polar_radii(out.contour, centre, angles);
  const double area = signed_area(out.contour), before = signed_area(m.contour());
  double strength = 0;
  for (const Point& p : m.nodes) {
    strength += cv::norm(picture.field.gradient(p)) / static_cast<double>(m.nodes.size());
  }
  if (r.empty() || area < 0.6 * before || area > 1.6 * before || strength < picture.edge_floor()) {
    out.why = "snake lost the edge";
    m.known = false;
    return;
  }
  m.centre = centre;
  m.r = r;
  out.support = 1;
  out.visible = 1;
  out.ok = true;
}

Point motion_of_whole(const Contour& from, const Contour& to) {
  std::vector<double> dx, dy;
  for (std::size_t i = 0; i < from.size() && i < to.size(); ++i) {
    dx.push_back(to[i].x - from[i].x);
    dy.push_back(to[i].y - from[i].y);
  }
  const Point shift(std::clamp(median_of(dx), -kStep_px, kStep_px),
                    std::clamp(median_of(dy), -kStep_px, kStep_px));
  return cv::norm(shift) < kStill_px ? Point() : shift;
}

// Where the needle meets a membrane seen from the band's centre.
struct NeedleHere {
  double entry_angle = 0;  // of the entry, not of the axis: a needle off the middle enters at another angle
  int tip_index = 0;       // nearest angle
  double tip_r = 0;        // px
};

struct Search {
  const FollowedMembrane& m;
  const ClearedPicture& picture;
  const Surroundings& surroundings;
  int angles;
  double usual_r;              // px
  double saturation;           // grey levels per px
  EdgeBand band;               // round the last contour
  std::vector<double> rested;  // rest outline seen from the band's centre; empty = not known
  std::optional<NeedleHere> needle;

  Search(const FollowedMembrane& followed, const ClearedPicture& cleared, const Surroundings& s,
         const Point& shift);

  [[nodiscard]] double from_needle(int i) const {  // rad
    return angle_between(polar_angle(i, angles), needle ? needle->entry_angle : 0);
  }
  [[nodiscard]] EdgePath path_in(const EdgeBand& b) const {
    return closed_path(picture.field, b, m.polarity, picture.edge_floor(), saturation);
  }
  [[nodiscard]] EdgePath path_free() const;
  [[nodiscard]] EdgePath path_pushed() const;
  [[nodiscard]] std::vector<std::pair<int, double>> end_face() const;
  [[nodiscard]] double mean_beside_needle(const std::vector<double>& per_angle) const;

 private:
  void keep_order_of_membranes();
  void limit_depth_to_tip();
};

Search::Search(const FollowedMembrane& followed, const ClearedPicture& cleared, const Surroundings& s,
               const Point& shift)
    : m(followed),
      picture(cleared),
      surroundings(s),
      angles(static_cast<int>(m.r.size())),
      usual_r(median_of(m.r)),
      saturation(kSaturation * m.level) {
  band.centre = m.centre + shift;
  band.middle = m.r;
  band.half_width = std::clamp(0.11 * usual_r, 6.0, 14.0);
  band.slope = 1.0;
  band.visible = picture.visibility();
  rested = m.rest.seen_from(band.centre);
  keep_order_of_membranes();

  std::vector<double> expected = m.r;
  if (s.outermost && s.undeformed && s.undeformed->round) {
    // What once slipped inwards along the holder comes back.
    const std::vector<double> free = polar_radii(s.undeformed->shape, band.centre, angles);
    for (std::size_t i = 0; i < free.size(); ++i) {
      expected[i] = std::max(expected[i], free[i]);
    }
  }
  picture.keep_off_holder(band, expected);

  if (s.needle.ok) {
    const Point tip = s.needle.tip - band.centre;
    const auto entry = entry_point(m.contour(), s.needle.tip, s.needle.axis);
    const Point towards = entry ? *entry - band.centre : -s.needle.axis;
    needle = {std::atan2(towards.y, towards.x), polar_index(tip, angles), cv::norm(tip)};
    if (!rested.empty()) {
      limit_depth_to_tip();
    }
  }
}

void Search::keep_order_of_membranes() {
  const FollowedMembrane *around = surroundings.around, *within = surroundings.within;
  if (around && around->known) {
    const double usual_gap = std::max(0.0, mean_radius(around->contour()) - mean_radius(m.contour()));
    band.upper = polar_radii(around->contour(), band.centre, angles);
    for (double& r : band.upper) {
      r -= std::max(2.0, 0.5 * usual_gap);
    }
  }
  if (within && within->known) {
    const double usual_gap = std::max(0.0, mean_radius(m.contour()) - mean_radius(within->contour()));
    band.lower = polar_radii(within->contour(), band.centre, angles);
    double tip_angle = 0;
    if (surroundings.last_tip) {
      const Point tip = *surroundings.last_tip - band.centre;
      tip_angle = std::atan2(tip.y, tip.x);
    }
    for (std::size_t k = 0; k < band.lower.size(); ++k) {
      // It was there one frame ago; near the needle it may have moved on.
      const bool near =
          surroundings.last_tip && angle_between(polar_angle(static_cast<int>(k), angles), tip_angle) < 0.5;
      band.lower[k] += near ? -4.0 : std::max(2.5, 0.35 * usual_gap);
    }
  }
}

// Nothing presses the membrane in further than the tip has come.
void Search::limit_depth_to_tip() {
  constexpr double kMargin_px = 6;
  const Point tip = surroundings.needle.tip - band.centre;
  const double depth =
      tip.dot(surroundings.needle.axis) < 0
          ? std::max(0.0, rested[static_cast<std::size_t>(needle->tip_index)] - needle->tip_r)
          : 0;
  if (band.lower.empty()) {
    band.lower.assign(m.r.size(), 0.0);
  }
  for (std::size_t k = 0; k < band.lower.size(); ++k) {
    band.lower[k] = std::max(band.lower[k], rested[k] - depth - kMargin_px);
  }
}

// The membrane is back where it was without needle.
EdgePath Search::path_free() const {
  EdgeBand free = band;
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double weight = std::clamp((1.1 - from_needle(i)) / 0.3, 0.0, 1.0);
    free.middle[k] += weight * (rested[k] - free.middle[k]);
  }
  free.half_width = std::min(band.half_width, 7.0);
  return path_in(free);
}

// Where the needle is met: the membrane lies flat against its end face, or once pierced at the tip at most.
std::vector<std::pair<int, double>> Search::end_face() const {
  const NeedleFix& n = surroundings.needle;
  const double ahead = (n.tip - band.centre).dot(n.axis);
  std::vector<std::pair<int, double>> face;
  for (int i = 0; i < angles && ahead < 0 && !surroundings.punctured; ++i) {
    const Point ray = on_ray(Point(0, 0), i, angles, 1);
    const double towards = ray.dot(n.axis);
    if (towards < -0.5 &&
        std::abs((ahead / towards * ray + band.centre - n.tip).cross(n.axis)) < n.half_width) {
      face.emplace_back(i, ahead / towards);
    }
  }
  return face.empty() ? std::vector{std::make_pair(needle->tip_index, needle->tip_r)} : face;
}

// It lies on the tip, and the dimple goes on with the needle.
EdgePath Search::path_pushed() const {
  EdgeBand pushed = band;
  const int tip = needle->tip_index;
  const double move = needle->tip_r - pushed.middle[static_cast<std::size_t>(tip)];
  const double dimple_px = std::max(4.0, 2.0 * surroundings.needle.half_width);
  for (int i = 0; i < angles; ++i) {
    const double u = angle_between(polar_angle(i, angles), polar_angle(tip, angles)) * usual_r / dimple_px;
    pushed.middle[static_cast<std::size_t>(i)] += move / (1 + u * u);
  }
  pushed.anchors = end_face();
  pushed.slope = 3;
  pushed.stiffness = 0.1;
  return path_in(pushed);
}

// Over the visible angles; 0 where there is none.
double Search::mean_beside_needle(const std::vector<double>& per_angle) const {
  double sum = 0;
  int n = 0;
  for (int i = 0; i < angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (from_needle(i) < kBesideHalf && !picture.hidden(on_ray(band.centre, i, angles, rested[k]))) {
      sum += per_angle[k];
      ++n;
    }
  }
  return n > 0 ? sum / n : 0.0;
}

struct EdgeFound {
  EdgePath path;
  bool is_free = false;  // of the needle that is inside it
};

EdgeFound pushed_or_free(const Search& s) {
  const auto tip_inside = [&] {
    return s.needle->tip_r < s.rested[static_cast<std::size_t>(s.needle->tip_index)] - 1.0;
  };
  if (!s.needle || s.rested.empty() || !tip_inside()) {
    return {s.path_in(s.band)};
  }
  EdgePath free = s.path_free();
  EdgePath pushed = s.surroundings.outermost ? s.path_pushed() : s.path_in(s.band);
  if (free.r.empty() || pushed.r.empty()) {
    return {std::move(pushed)};
  }
  std::vector<double> seen, apart, off_rest;
  for (std::size_t k = 0; k < free.r.size(); ++k) {
    seen.push_back(std::clamp(static_cast<double>(free.strength[k]) / s.saturation, 0.0, 1.0));
    apart.push_back(std::max(0.0, free.r[k] - pushed.r[k]));
    off_rest.push_back(std::abs(free.r[k] - s.rested[k]));
  }
  const double free_seen = s.mean_beside_needle(seen), between = s.mean_beside_needle(apart);
  // Where an edge lies further out than the dimple and is as well seen, the dimple is another membrane's; but
  // what lies nearer to the dimple than to the rest outline is the dimple's own wall.
  const bool is_free = s.surroundings.punctured && s.surroundings.outermost
                           ? free_seen > 0.4
                           : between > 1.5 && between > s.mean_beside_needle(off_rest) && free_seen > 0.7;
  return {is_free ? std::move(free) : std::move(pushed), is_free};
}

// Blur moves the two faces of a wall apart when it is thinner than the blur: the outer one then lies too far
// out by half of what the wall looks thicker than it is. 0 where the wall is seen as thick as it is.
double thin_wall_bias(const Search& search, const EdgePath& path, double thickness) {
  constexpr double kPsf_px = 1.2;     // of a lens in focus
  constexpr double kPixelling = 0.5;  // px^2, of pixels and gradient mask
  constexpr double kStep = 0.25;      // px
  const GradientField& field = search.picture.field;
  const double sigma = std::sqrt(field.sigma * field.sigma + kPsf_px * kPsf_px + kPixelling);
  if (search.m.polarity == Polarity::any || !(thickness > 0) || thickness > 2 * sigma) {
    return 0;
  }
  const double sign = search.m.polarity == Polarity::brighter_out ? 1 : -1;
  std::vector<double> apart;
  for (int i = 0; i < search.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!path.seen[k]) {
      continue;
    }
    const Point d = on_ray(Point(0, 0), i, search.angles, 1);
    double top = 0.4 * static_cast<double>(path.strength[k]), at = 0;
    for (double s = 1; s < 3 * sigma; s += kStep) {
      const double e = -sign * field.gradient(search.band.centre + (path.r[k] - s) * d).dot(d);
      if (e > top) {
        top = e;
        at = s;
      }
    }
    if (at > 0) {
      apart.push_back(at);
    }
  }
  if (static_cast<int>(apart.size()) < search.angles / 2) {
    return 0;
  }
  const double seen = median_of(apart);
  return seen < 2.6 * sigma ? std::max(0.0, 0.5 * (seen - thickness)) : 0;
}

// Away from the needle a membrane keeps its outline: an arc that has left it follows something else.
bool strays(const Search& s, const EdgePath& path) {
  if (s.rested.size() != path.r.size() || !s.needle || !s.m.rest.mature()) {
    return false;
  }
  const double limit = std::max(6.0, 0.1 * median_of(s.rested));
  int off = 0, n = 0;
  for (int i = 0; i < s.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (s.from_needle(i) > kNeedleHalf) {
      ++n;
      off += std::abs(path.r[k] - s.rested[k]) > limit;
    }
  }
  return off > n / 12;
}

// Empty: it is still the same edge.
std::string why_another_edge(const Search& s, const EdgeFound& found, double shift) {
  const EdgePath& path = found.path;
  std::vector<double> jump;
  for (int i = 0; i < s.angles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!found.is_free || s.from_needle(i) >= kNeedleHalf) {
      jump.push_back(std::abs(path.r[k] - s.m.r[k]));
    }
  }
  if (path.visible < 0.35) {
    return "mostly hidden";
  }
  if (path.support < 0.55) {
    return "edge seen over " + std::to_string(std::lround(100 * path.support)) + " % only";
  }
  if (path.level < 0.35 * s.m.level) {
    return "edge has faded";
  }
  if (median_of(jump) + shift > 0.6 * s.band.half_width) {
    return "contour jumped";
  }
  if (strays(s, path)) {
    return "contour left the cell's outline";
  }
  return {};
}

}  // namespace

Membrane follow(FollowedMembrane& m, const ClearedPicture& picture, const VisionConfig& config,
                const Surroundings& surroundings) {
  Membrane out;
  if (!m.known) {
    out.why = "not found";
    return out;
  }
  const Contour nodes =
      config.refine || m.nodes.size() < 3 ? spline_through(m.contour(), config.snake.nodes) : m.nodes;
  const SnakeResult snake = snake_from(nodes, picture, config.snake);
  out.nodes = snake.nodes;
  out.snake_iterations = snake.iterations;
  m.nodes = snake.nodes;
  if (!config.refine) {
    take_snake(m, picture, out);
    return out;
  }

  const Point shift = motion_of_whole(nodes, snake.nodes);
  const Search search(m, picture, surroundings, shift);
  const EdgeFound found = pushed_or_free(search);
  const EdgePath& path = found.path;
  if (path.r.empty()) {
    out.why = "no band to search";
    ++m.lost_frames;
    return out;
  }
  std::vector<double> face = path.r;
  if (surroundings.outermost) {
    const double bias = thin_wall_bias(search, path, config.px(config.h_m));
    for (double& r : face) {
      r -= bias;
    }
  }
  out.contour = from_polar(search.band.centre, face);
  out.support = path.support;
  out.visible = path.visible;
  out.residual_px = path.residual;
  out.why = why_another_edge(search, found, cv::norm(shift));
  if (!out.why.empty()) {
    ++m.lost_frames;
    return out;
  }
  m.level += 0.1 * (path.level - m.level);
  const Point centre = centroid(out.contour);
  const std::vector<double> r = polar_radii(out.contour, centre, search.angles);
  if (r.empty()) {
    out.why = "contour crosses itself";
    ++m.lost_frames;
    return out;
  }
  out.ok = true;
  m.lost_frames = 0;
  // The centre stays where it is as long as it is inside by far: resampling costs accuracy.
  if (cv::norm(centre - search.band.centre) > 0.06 * search.usual_r) {
    m.centre = centre;
    m.r = r;
  } else {
    m.centre = search.band.centre;
    m.r = path.r;
  }
  return out;
}

}  // namespace punctum::vision
