#include "vision/membrane/rest_shape.hpp"

#include <algorithm>
#include <cmath>

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
  const int angles = static_cast<int>(r.size());
  const auto rays = unit_rays(angles);
  const Vector<double> now = polar_radii(from_polar(now_centre, now_r), centre, angles);
  // The cell drifts: what differs as the cosine of the angle is its motion, followed by least squares over
  // the last frames. Its form is their mean.
  const double n = std::clamp(++frames, kReliable, kDriftMemory), of_place = 2 * (2 * n - 1) / (n * (n + 1)),
               of_drift = 6 / (n * (n + 1));
  Point beyond = -drift;  // of what was expected
  for (std::size_t i = 0; i < now.size(); ++i) {
    beyond += 2.0 / angles * (now[i] - r[i]) * rays[i];
  }
  const Point shift = drift + of_place * beyond;
  centre += shift;
  drift += of_drift * beyond;
  for (std::size_t i = 0; i < now.size(); ++i) {
    r[i] += (now[i] - shift.dot(rays[i]) - r[i]) / std::min(frames, kOutlineMemory);
  }
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

Point LearntUndeformed::update(const Undeformed& now, bool touched, bool learns,
                               const std::optional<Mouth>& mouth) {
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
    return shift;
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
