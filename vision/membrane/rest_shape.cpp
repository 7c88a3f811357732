#include "vision/membrane/rest_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

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
constexpr double kTurnless =
    0.1;  // sum of squared effects of a turn below which the outline is hardly less than round

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

// Drift and turn, px, from one to the other, by least squares. A turn shows as far as the outline is not
// round; of a round one none is told.
cv::Vec3d motion_between(std::span<const double> r, std::span<const double> now,
                         std::span<const double> weight) {
  cv::Matx33d a = cv::Matx33d::diag({kTurnless, kTurnless, kTurnless});
  cv::Vec3d b = cv::Vec3d::all(0);
  const Vector<cv::Vec3d> effect = effects_of_motion(r);
  for (std::size_t i = 0; i < r.size(); ++i) {
    a += weight[i] * effect[i] * effect[i].t();
    b += weight[i] * (now[i] - r[i]) * effect[i];
  }
  return a.solve(b, cv::DECOMP_CHOLESKY);
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
  if (r.empty() || cv::norm(centre - now_centre) > 0.1 * median_of(now_r)) {
    *this = {.centre = now_centre, .r = now_r, .frames = 1};
    return;
  }
  // The cell drifts and turns: its motion is what explains most of how the frame differs, followed by least
  // squares over the last frames. Its form is their mean.
  turn(spin);
  const int angles = static_cast<int>(r.size());
  const auto rays = unit_rays(angles);
  const Vector<double> now = polar_radii(from_polar(now_centre, now_r), centre, angles);
  const Gain gain = gain_of(++frames);
  const cv::Vec3d beyond =
      motion_between(r, now, Vector<double>(now.size(), 1.0)) - cv::Vec3d(drift.x, drift.y, 0);
  const Point off(beyond[0], beyond[1]), shift = drift + gain.of_place * off;
  centre += shift;
  drift += gain.of_drift * off;
  const double mean_r = mean_of(r);
  turn(gain.of_place * beyond[2] / mean_r);
  spin += gain.of_drift * beyond[2] / mean_r;
  for (std::size_t i = 0; i < now.size(); ++i) {
    r[i] += (now[i] - shift.dot(rays[i]) - r[i]) / std::min(frames, kOutlineMemory);
  }
}

void RestOutline::turn(double rad) {
  if (rad == 0 || r.empty()) {
    return;
  }
  const Vector<cv::Vec3d> effect = effects_of_motion(r);
  for (std::size_t i = 0; i < r.size(); ++i) {
    r[i] += rad * r[i] * effect[i][2];
  }
}

double RestOutline::turn_with(const Contour& contour, std::span<const double> weight) {
  turn(spin);
  const int angles = static_cast<int>(r.size());
  const Vector<double> now =
      contour.size() == r.size() ? polar_radii(contour, centre, angles) : Vector<double>();
  if (now.empty()) {
    return spin;
  }
  Vector<double> of_angle(r.size(), 0.0);
  for (std::size_t i = 0; i < contour.size(); ++i) {
    of_angle[static_cast<std::size_t>(polar_index(contour[i] - centre, angles))] = weight[i];
  }
  const Gain gain = gain_of(frames);
  const double off = motion_between(r, now, of_angle)[2] / mean_of(r), turned = spin + gain.of_place * off;
  turn(gain.of_place * off);
  spin += gain.of_drift * off;
  return turned;
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
