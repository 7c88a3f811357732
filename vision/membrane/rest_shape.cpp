#include "vision/membrane/rest_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/median.hpp"
#include "vision/image/polar_contour.hpp"

namespace punctum::vision {

namespace {

constexpr int kReliable = 6;             // frames without contact; then the outline is relied on
constexpr int kOutlineMemory = 12;       // frames averaged
constexpr int kDriftMemory = 20;         // frames that tell it
constexpr int kCircleMemory = 20;        // frames averaged
constexpr double kDentHalf = 0.9;        // rad to either side of the entry
constexpr double kHolderHalf = 0.6;      // rad to either side of the holding pipette's mouth
constexpr double kMotion_sd = 2.5;       // less is no motion of the holding pipette
constexpr double kLeastMotion_px = 0.1;  // likewise, however certain its place is
constexpr double kLeastDrift_px = 0.02;  // per frame: less may be noise
constexpr double kSpin_px = 0.15;        // of the outline per frame, at its rim: sd, at first
constexpr double kUnevenSpin_px = 0.01;  // by which that changes in a frame

// Of a straight line through the last frames: by how much its end and its slope follow the newest.
struct Gain {
  double of_place = 0, of_drift = 0;
};
Gain gain_of(int frames) {
  const double n = std::clamp(frames, kReliable, kDriftMemory);
  return {2 * (2 * n - 1) / (n * (n + 1)), 6 / (n * (n + 1))};
}

double mean_of(std::span<const double> r) {
  return std::accumulate(r.begin(), r.end(), 0.0) / static_cast<double>(r.size());
}

// Drift and turn from one to the other, px at the rim, by least squares. A turn shows as far as the outline
// is not round.
struct Motion {
  Point drift;
  double turn = 0, turn_variance = 0;
};
Motion motion_between(std::span<const double> r, std::span<const double> now,
                      std::span<const double> weight) {
  constexpr double kLeast = 0.01;  // sum of squared effects: solvable for a circle, too
  cv::Matx33d a = cv::Matx33d::diag({kLeast, kLeast, kLeast});
  cv::Vec3d b = cv::Vec3d::all(0);
  const Vector<cv::Vec3d> effect = effects_of_motion(r);
  double square = 0, weights = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double off = now[i] - r[i];
    a += weight[i] * effect[i] * effect[i].t();
    b += weight[i] * off * effect[i];
    square += weight[i] * off * off;
    weights += weight[i];
  }
  const cv::Matx33d covariance = a.inv(cv::DECOMP_CHOLESKY);
  const cv::Vec3d motion = covariance * b;
  const double unexplained = std::max(0.0, square - motion.dot(b)) / std::max(weights, 1.0);
  return {{motion[0], motion[1]}, motion[2], kJoinedAngles * unexplained * covariance(2, 2)};
}

// The angle between them has a larger cosine.
bool within(const Point& d, const Point& e, double cosine) {
  return d.dot(e) > cosine * std::sqrt(d.dot(d) * e.dot(e));
}

}  // namespace

bool RestOutline::reliable() const noexcept { return frames >= kReliable; }

Vector<double> RestOutline::seen_from(const Point& other_centre) const {
  return r.empty() || other_centre == centre
             ? r
             : polar_radii(from_polar(centre, r), other_centre, static_cast<int>(r.size()));
}

void RestOutline::learn(const Point& now_centre, const Vector<double>& now_r) {
  const int angles = static_cast<int>(now_r.size());
  const bool anew = r.size() != now_r.size() || cv::norm(centre - now_centre) > 0.1 * median_of(now_r);
  const Vector<double> now =
      anew ? Vector<double>() : polar_radii(from_polar(now_centre, now_r), centre, angles);
  if (now.empty()) {
    const double sd = kSpin_px / mean_of(now_r);
    *this = {.centre = now_centre, .r = now_r, .frames = 1, .turned = {.drift = sd * sd}};
    return;
  }
  // The cell drifts and turns: its motion is what explains most of how the frame differs, followed by least
  // squares over the last frames. Its form is their mean.
  turn_on();
  const auto rays = unit_rays(angles);
  const Gain gain = gain_of(++frames);
  const Motion motion = motion_between(r, now, Vector<double>(now.size(), 1.0));
  const Point off = motion.drift - drift, shift = drift + gain.of_place * off;
  centre += shift;
  drift += gain.of_drift * off;
  (void)turn_as_seen(motion.turn, motion.turn_variance);
  for (std::size_t i = 0; i < now.size(); ++i) {
    r[i] += (now[i] - shift.dot(rays[i]) - r[i]) / std::min(frames, kOutlineMemory);
  }
}

// Cubic between the angles: however often it is turned, it neither grows nor loses its form.
void RestOutline::turn(double rad) {
  const std::size_t n = r.size();
  if (rad == 0 || n == 0) {
    return;
  }
  const double back = -rad * static_cast<double>(n) / (2 * std::numbers::pi), whole = std::floor(back),
               f = back - whole;
  const double w[4] = {f * (f - 1) * (2 - f) / 6, (f + 1) * (f - 1) * (f - 2) / 2, (f + 1) * f * (2 - f) / 2,
                       (f + 1) * f * (f - 1) / 6};
  const auto size = static_cast<std::int64_t>(n);
  const auto first = static_cast<std::size_t>(((static_cast<std::int64_t>(whole) - 1) % size + size) % size);
  Vector<double> turned_r(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      turned_r[i] += w[k] * r[(first + i + k) % n];
    }
  }
  r = std::move(turned_r);
}

void RestOutline::turn_on() {
  turn(spin);
  turned.go_on(kUnevenSpin_px / mean_of(r));
}

double RestOutline::turn_as_seen(double rim_px, double variance) {
  const double mean_r = mean_of(r);
  const DriftCovariance::Gain gain = turned.see(variance / (mean_r * mean_r));
  const double by = gain.of_place * rim_px / mean_r;
  turn(by);
  spin += gain.of_drift * rim_px / mean_r;
  return by;
}

double RestOutline::turn_with(const Contour& contour, std::span<const double> weight) {
  const double expected = spin;
  turn_on();
  const int angles = static_cast<int>(r.size());
  const Vector<double> now =
      contour.size() == r.size() ? polar_radii(contour, centre, angles) : Vector<double>();
  if (now.empty()) {
    return expected;
  }
  Vector<double> of_angle(r.size(), 0.0);
  for (std::size_t i = 0; i < contour.size(); ++i) {
    of_angle[static_cast<std::size_t>(polar_index(contour[i] - centre, angles))] = weight[i];
  }
  const Motion motion = motion_between(r, now, of_angle);
  return expected + turn_as_seen(motion.turn, motion.turn_variance);
}

RestOutline outline_within(const RestOutline& around, const Point& centre, const Vector<double>& r,
                           const Point& entry) {
  constexpr double kBlend = 0.3;  // rad
  const Vector<double> outer = around.seen_from(centre);
  const int angles = static_cast<int>(r.size());
  if (outer.size() != r.size()) {
    return {};
  }
  const Point towards = entry - centre;
  RestOutline out{centre, r, 0};
  Vector<double> near(r.size()), gap;
  for (std::size_t k = 0; k < r.size(); ++k) {
    const double from_needle =
        angle_between(polar_angle(static_cast<int>(k), angles), math::atan2(towards.y, towards.x));
    near[k] = std::clamp((kDentHalf + kBlend - from_needle) / kBlend, 0.0, 1.0);
    if (near[k] <= 0) {
      gap.push_back(outer[k] - r[k]);
    }
  }
  const double usual = median_of(std::move(gap));
  for (std::size_t k = 0; k < r.size(); ++k) {
    out.r[k] += near[k] * (outer[k] - usual - r[k]);
  }
  return out;
}

LearntUndeformed::Moved LearntUndeformed::update(const Undeformed& now, bool touched, bool learns,
                                                 const std::optional<Mouth>& mouth, const Contour& contour,
                                                 std::span<const double> weight) {
  if (!shape_ || (!touched && now.round)) {
    if (shape_ && shape_->round && now.round &&
        cv::norm(now.circle.centre - shape_->circle.centre) < 0.05 * shape_->circle.r) {
      const double gain = 1.0 / std::min(++frames_, kCircleMemory);
      Circle& c = shape_->circle;
      c.centre += gain * (now.circle.centre - c.centre);
      c.r += gain * (now.circle.r - c.r);
      c.rms = now.circle.rms;
      c.r_sd = now.circle.r_sd;
      shape_->shape = circle_contour(c, static_cast<int>(now.shape.size()));
    } else {
      shape_ = now;
      frames_ = 1;
    }
  } else if (!touched) {
    shape_ = now;
  } else {
    const Point shift = moved(mouth);
    shape_->circle.centre += shift;
    for (Point& p : shape_->shape) {
      p += shift;
    }
    if (learns) {
      return {};
    }
    face_.centre += shift;
    return {shift, face_.reliable() ? face_.turn_with(contour, weight) : 0.0};
  }
  mouth_ = mouth ? std::optional(mouth->at) : std::nullopt;
  return {};
}

void LearntUndeformed::jump_with_picture(const Point& by) {
  face_.centre += by;
  if (shape_) {
    shape_->circle.centre += by;
    for (Point& p : shape_->shape) {
      p += by;
    }
  }
  if (mouth_) {
    *mouth_ += by;
  }
}

Point LearntUndeformed::moved(const std::optional<Mouth>& mouth) {
  if (!mouth_) {
    return face_.reliable() && cv::norm(face_.drift) > kLeastDrift_px ? face_.drift : Point();
  }
  if (!mouth || cv::norm(mouth->at - *mouth_) < std::max(kMotion_sd * mouth->sd, kLeastMotion_px)) {
    return {};
  }
  const Point shift = mouth->at - *mouth_;
  mouth_ = mouth->at;
  return shift;
}

void LearntUndeformed::learn_outline(const Contour& contour, const Point& centre) {
  const Vector<double> r = polar_radii(contour, centre, static_cast<int>(contour.size()));
  if (!r.empty()) {
    face_.learn(centre, r);
  }
}

Undeformed LearntUndeformed::at_rest() const {
  Undeformed out = *shape_;
  if (face_.frames > 0) {
    out.shape = from_polar(face_.centre, face_.r);
  }
  return out;
}

void LearntUndeformed::forget() {
  shape_.reset();
  face_ = {};
  frames_ = 0;
}

bool LearntUndeformed::same_cell(const Contour& outer, const Point& centre, const NeedlePose& needle) const {
  if (!shape_) {
    return false;
  }
  Vector<double> weight(outer.size(), 1.0);
  if (needle.ok) {
    for (std::size_t i = 0; i < outer.size(); ++i) {
      const Point d = outer[i] - centre;
      weight[i] = d.dot(needle.axis) < -0.3 * cv::norm(d) ? 0 : 1;
    }
  }
  const auto fitted = fit_circle(outer, weight);
  const Circle& known = shape_->circle;
  return fitted && cv::norm(fitted->centre - known.centre) < 0.08 * known.r &&
         std::abs(fitted->r - known.r) < 0.06 * known.r;
}

Vector<double> undeformed_weights(const Contour& contour, const ClearedPicture& picture,
                                  const std::optional<Point>& entry, const std::optional<Point>& mouth) {
  const Point centre = centroid(contour);
  const double dent = math::cos(kDentHalf), holder = math::cos(kHolderHalf);
  Vector<double> weight(contour.size(), 1.0);
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const Point d = contour[i] - centre;
    if (picture.hidden(contour[i]) || (entry && within(d, *entry - centre, dent)) ||
        (mouth && within(d, *mouth - centre, holder))) {
      weight[i] = 0;
    }
  }
  return weight;
}

}  // namespace punctum::vision
