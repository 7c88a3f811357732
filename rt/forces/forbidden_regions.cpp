#include "rt/forces/forbidden_regions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace punctum::rt {
namespace {

// Of the shaft that is looked at: more than a dish is wide under any lens that sees a cell.
constexpr double kShaft_m = 10e-3;
// Newton's steps to the place of it that is nearest to the mouth's rim.
constexpr int kRimSteps = 8;
// On the axis of the holder every direction across it is as good as another.
constexpr double kOnAxis_m = 1e-12;
constexpr double kParallel = 1e-9;
constexpr double kLeastSine2 = 1e-30;
// A direction with more of the holder's axis in it than rounding leaves is not apart from a body without end.
constexpr double kBackwards = 1e-9;

// How far a point is behind the mouth, and how far outside the side.
struct InHolder {
  double behind_m = 0;
  double r_m = 0;  // from its axis
  double outside_m = 0;
  hal::Vec3 across = hal::Vec3::Zero();
};

InHolder in_holder(const HolderBodyParams& holder, const hal::Vec3& point_m) NONBLOCKING {
  const hal::Vec3 V = point_m - holder.mouth_m;
  const double behind_m = holder.axis.dot(V);
  const hal::Vec3 across = V - behind_m * holder.axis;
  const double r_m = across.norm();
  return {behind_m, r_m, r_m - holder.radius_m, across};
}

// The direction from the holder's surface to a point.
hal::Vec3 away_from(const HolderBodyParams& holder, const hal::Vec3& point_m) NONBLOCKING {
  const InHolder at = in_holder(holder, point_m);
  const hal::Vec3 outwards = at.r_m > kOnAxis_m ? hal::Vec3(at.across / at.r_m) : hal::Vec3(-holder.axis);
  if (at.outside_m <= 0 && at.behind_m >= 0) {
    return at.outside_m > -at.behind_m ? outwards : hal::Vec3(-holder.axis);
  }
  const double sideways_m = std::max(at.outside_m, 0.0);
  const double before_m = std::max(-at.behind_m, 0.0);
  const double off_m = std::sqrt(sideways_m * sideways_m + before_m * before_m);
  if (!(off_m > 0)) {  // on its rim
    return -holder.axis;
  }
  return (sideways_m * outwards - before_m * holder.axis) / off_m;
}

// The unit vector next to `direction` across a needle that grows thicker with this slope from its tip
// backwards.
hal::Vec3 across(const hal::Vec3& direction, const hal::Vec3& axis, double slope) NONBLOCKING {
  const hal::Vec3 aside = direction - axis.dot(direction) * axis;
  const double length = aside.norm();
  if (!(length > kParallel) || slope >= 1) {
    return direction;
  }
  return std::sqrt(1 - slope * slope) / length * aside - slope * axis;
}

// The same, and across the holder's axis; on the side of the holder on which the needle passes it.
hal::Vec3 across_both(const hal::Vec3& to_tip_m, const hal::Vec3& axis, double slope,
                      const hal::Vec3& holder_axis) NONBLOCKING {
  const hal::Vec3 normal = axis.cross(holder_axis);
  const double sine = normal.norm();
  if (!(sine > kParallel) || std::abs(slope) >= sine) {
    return -holder_axis;
  }
  const double part = slope / sine;
  const double side = to_tip_m.dot(normal) < 0 ? -1 : 1;
  const hal::Vec3 aside = axis - axis.dot(holder_axis) * holder_axis;
  return side * std::sqrt(1 - part * part) / sine * normal - part / sine * aside;
}

// Where, from here to there behind the tip, a needle of this slope is nearest to the rim of the mouth. At s
// behind the tip the axis is D = sqrt(x^2 + (r - R)^2) from it, x behind the mouth and r from the holder's
// axis, and
//
//   D (D' - slope) = s - s_c - R r' - slope D      with s_c nearest to the mouth's centre
//
// is zero there. On each side of where the axis is nearest to the holder's, r' bends one way only: without a
// slope Newton's steps from the far end of R r', +-R sin, come to the zero from one side. A step that would
// leave the bracket halves it instead, which the slope and rounding may ask for.
double nearest_to_rim_m(const HolderBodyParams& holder, const NeedlePose& needle, double slope, double from_m,
                        double to_m) NONBLOCKING {
  const InHolder tip = in_holder(holder, needle.tip_m);
  const double cosine = holder.axis.dot(needle.axis);
  const hal::Vec3 aside = needle.axis - cosine * holder.axis;
  const double sine2 = std::max(aside.squaredNorm(), kLeastSine2);
  const double centre_m = needle.axis.dot(needle.tip_m - holder.mouth_m);  // nearest to the mouth's centre
  const double axis_m = aside.dot(tip.across) / sine2;                     // nearest to the holder's axis
  const double r2_m2 = (tip.across - axis_m * aside).squaredNorm();        // there
  const double before_m = std::max(axis_m * cosine - tip.behind_m, 0.0);
  const double aside_m = std::max(std::sqrt(r2_m2) - holder.radius_m, 0.0);
  const bool behind = before_m * cosine <= slope * std::sqrt(before_m * before_m + aside_m * aside_m);
  (behind ? from_m : to_m) = std::clamp(axis_m, from_m, to_m);
  double at_m = std::clamp(centre_m + (behind ? 1 : -1) * holder.radius_m * std::sqrt(sine2), from_m, to_m);
  for (int i = 0; i < kRimSteps; ++i) {
    const double along_m = at_m - axis_m;
    const double r_m = std::sqrt(r2_m2 + sine2 * along_m * along_m);
    const double dr = sine2 * along_m / r_m;
    const double behind_m = tip.behind_m - at_m * cosine;
    const double outside_m = r_m - holder.radius_m;
    const double off_m = std::sqrt(outside_m * outside_m + behind_m * behind_m);
    const double excess_m = at_m - centre_m - holder.radius_m * dr - slope * off_m;
    (excess_m > 0 ? to_m : from_m) = at_m;
    const double rises =
        1 - holder.radius_m * (sine2 - dr * dr) / r_m - slope * (outside_m * dr - behind_m * cosine) / off_m;
    const double next_m = at_m - excess_m / rises;
    at_m = next_m >= from_m && next_m <= to_m ? next_m : 0.5 * (from_m + to_m);
  }
  return at_m;
}

}  // namespace

Gap ForbiddenRegions::widest_gap(Region region, const NeedlePose& needle) const NONBLOCKING {
  if (region == Region::holder) {
    return widest_gap_to_holder(needle);
  }
  const hal::Vec3 away{0, 0, params_.floor->z_m > 0 ? -1.0 : 1.0};
  return {away, apart_from_floor_m(away, needle)};
}

// D - r, the distance of the needle's axis from a convex body less the needle's radius, is convex along the
// taper and along the shaft, for the radius grows linearly there; and from taper to shaft, which grows no
// more. So its slope -n.a - r' at the shoulder says in which of the two the nearest place is, and at their
// ends whether it is the end. If it is neither, n.a = -r' there. Then the nearest place of the holder is on
// its side, n.b = 0 and n is known, or on its rim; on the flat mouth D is linear. A search that ends early
// gives room away and never takes any: apart_m is no more than the distance for every n.
// Long, and rarely needed: a function of its own in every loop round it.
[[gnu::noinline]] Gap ForbiddenRegions::widest_gap_to_holder(const NeedlePose& needle) const NONBLOCKING {
  const HolderBodyParams& holder = *params_.holder;
  const auto gap = [&](const hal::Vec3& away) { return Gap{away, apart_from_holder_m(away, needle)}; };
  const auto at = [&](double behind_m) { return away_from(holder, needle.tip_m - behind_m * needle.axis); };
  const double taper = (params_.shaft_radius_m - params_.tip_radius_m) / params_.taper_m;

  const hal::Vec3 of_shoulder = at(params_.taper_m);
  const double along = of_shoulder.dot(needle.axis);
  const bool in_shaft = along > 0;
  if (!in_shaft && along >= -taper) {
    return gap(of_shoulder);
  }
  const double slope = in_shaft ? 0 : taper;
  const hal::Vec3 of_end = at(in_shaft ? kShaft_m : 0);
  if ((of_end.dot(needle.axis) >= -slope) == in_shaft) {
    return gap(of_end);
  }
  const Gap of_side = gap(across_both(needle.tip_m - holder.mouth_m, needle.axis, slope, holder.axis));
  const double at_rim_m = nearest_to_rim_m(holder, needle, slope, in_shaft ? params_.taper_m : 0,
                                           in_shaft ? kShaft_m : params_.taper_m);
  const Gap of_rim = gap(across(at(at_rim_m), needle.axis, slope));
  return of_side.apart_m > of_rim.apart_m ? of_side : of_rim;
}

double ForbiddenRegions::apart_m(Region region, const hal::Vec3& direction, const NeedlePose& needle) const
    NONBLOCKING {
  return region == Region::floor ? apart_from_floor_m(direction, needle)
                                 : apart_from_holder_m(direction, needle);
}

// Of the needle the tip alone. The shaft is not kept from the floor: that of a horizontal needle is thicker
// than its tip and lies lower.
double ForbiddenRegions::apart_from_floor_m(const hal::Vec3& direction, const NeedlePose& needle) const
    NONBLOCKING {
  const double below_tip_m = direction.z() * (needle.tip_m.z() - params_.floor->z_m);
  return below_tip_m - params_.tip_radius_m - params_.clearance_m;
}

double ForbiddenRegions::apart_from_holder_m(const hal::Vec3& direction, const NeedlePose& needle) const
    NONBLOCKING {
  const HolderBodyParams& holder = *params_.holder;
  const double backwards = direction.dot(holder.axis);
  if (backwards > kBackwards) {
    return -std::numeric_limits<double>::max();
  }
  const double along = direction.dot(needle.axis);
  const double of_holder_m = holder.radius_m * std::sqrt(std::max(1 - backwards * backwards, 0.0));
  const double of_needle_m = std::max({params_.tip_radius_m, params_.taper_m * along + params_.shaft_radius_m,
                                       kShaft_m * along + params_.shaft_radius_m});
  return direction.dot(needle.tip_m - holder.mouth_m) - of_holder_m - of_needle_m - params_.clearance_m;
}

}  // namespace punctum::rt
