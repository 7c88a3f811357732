// A contour as one radius for each of a number of equally spaced polar angles about a centre. Angle 0 points
// along +x.
#pragma once

#include <span>

#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

inline constexpr double kJoinedAngles = 10;  // that tell the same: the contour of a frame is smooth

// The radii of a contour seen from `centre`. Where a wall overhangs, the outermost crossing counts. Empty if
// fewer than half of the rays cross the contour.
[[nodiscard]] Vector<double> polar_radii(std::span<const Point> contour, const Point& centre, int angles);
[[nodiscard]] Contour from_polar(const Point& centre, std::span<const double> radii);

// Along each of the rays; valid until the next call for another number of them in this thread.
[[nodiscard]] std::span<const Point> unit_rays(int angles);
[[nodiscard]] double polar_angle(int i, int angles);                // of the i-th ray, rad
[[nodiscard]] int polar_index(const Point& direction, int angles);  // of the nearest ray
[[nodiscard]] Point on_ray(const Point& centre, int i, int angles, double r);
[[nodiscard]] double angle_between(double a, double b);  // 0 .. pi

// By how much each radius grows for a px of drift to the right, of drift down, and of turn at that place
// towards larger angles.
[[nodiscard]] Vector<cv::Vec3d> effects_of_motion(std::span<const double> radii);

}  // namespace punctum::vision
