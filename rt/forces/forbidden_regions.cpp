#include "rt/forces/forbidden_regions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace punctum::rt {
namespace {

// Of the shaft that is looked at: more than a dish is wide under any lens that sees a cell.
constexpr double kShaft_m = 10e-3;
// Golden sections of it: 10 mm become 5 nm.
constexpr int kSections = 30;
constexpr double kFinest_m = 5e-9;
constexpr double kGolden = 0.6180339887498949;
// On the axis of the holder every direction across it is as good as another.
constexpr double kOnAxis_m = 1e-12;
constexpr double kParallel = 1e-9;
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

double distance_m(const HolderBodyParams& holder, const hal::Vec3& point_m) NONBLOCKING {
  const InHolder at = in_holder(holder, point_m);
  if (at.outside_m <= 0 && at.behind_m >= 0) {
    return std::max(at.outside_m, -at.behind_m);
  }
  const double sideways_m = std::max(at.outside_m, 0.0);
  const double before_m = std::max(-at.behind_m, 0.0);
  return std::sqrt(sideways_m * sideways_m + before_m * before_m);
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

// The same, and across the holder's axis.
hal::Vec3 across_both(const hal::Vec3& direction, const hal::Vec3& axis, double slope,
                      const hal::Vec3& holder_axis) NONBLOCKING {
  const hal::Vec3 normal = axis.cross(holder_axis);
  const double sine = normal.norm();
  if (!(sine > kParallel) || slope >= sine) {
    return direction;
  }
  const double part = slope / sine;
  const double side = direction.dot(normal) < 0 ? -1 : 1;
  const hal::Vec3 aside = axis - axis.dot(holder_axis) * holder_axis;
  return side * std::sqrt(1 - part * part) / sine * normal - part / sine * aside;
}

}  // namespace

double ForbiddenRegions::radius_m(double behind_m) const NONBLOCKING {
  const double part = std::min(behind_m / params_.taper_m, 1.0);
  return params_.tip_radius_m + part * (params_.shaft_radius_m - params_.tip_radius_m);
}

hal::Vec3 ForbiddenRegions::away(Region region, const NeedlePose& needle) const NONBLOCKING {
  if (region == Region::floor) {
    return {0, 0, params_.floor->z_m > 0 ? -1.0 : 1.0};
  }
  return away_from_holder(needle);
}

// The distance from a convex body to a ball that grows no faster than linearly is convex along the needle.
hal::Vec3 ForbiddenRegions::away_from_holder(const NeedlePose& needle) const NONBLOCKING {
  const HolderBodyParams& holder = *params_.holder;
  const auto gap_m = [&](double behind_m) {
    return distance_m(holder, needle.tip_m - behind_m * needle.axis) - radius_m(behind_m);
  };
  double from_m = 0;
  double to_m = kShaft_m;
  if (gap_m(0) <= gap_m(kFinest_m)) {  // the tip is nearest, as for a needle that points to the holder
    to_m = kFinest_m;
  } else {
    double near_m = to_m - kGolden * (to_m - from_m);
    double far_m = from_m + kGolden * (to_m - from_m);
    double near_gap_m = gap_m(near_m);
    double far_gap_m = gap_m(far_m);
    for (int i = 0; i < kSections; ++i) {
      if (near_gap_m <= far_gap_m) {
        to_m = far_m;
        far_m = near_m;
        far_gap_m = near_gap_m;
        near_m = to_m - kGolden * (to_m - from_m);
        near_gap_m = gap_m(near_m);
      } else {
        from_m = near_m;
        near_m = far_m;
        near_gap_m = far_gap_m;
        far_m = from_m + kGolden * (to_m - from_m);
        far_gap_m = gap_m(far_m);
      }
    }
  }
  // Where a straight part of the needle is nearest, its slope and not the search fixes the direction; where
  // its side meets the holder's, both do. Of directions that may be it, the best is it.
  const auto at = [&](double behind_m) { return away_from(holder, needle.tip_m - behind_m * needle.axis); };
  hal::Vec3 best = at(0);
  double best_m = apart_m(Region::holder, best, needle);
  const auto consider = [&](const hal::Vec3& direction) {
    const double found_m = apart_m(Region::holder, direction, needle);
    if (found_m > best_m) {
      best_m = found_m;
      best = direction;
    }
  };
  const hal::Vec3 found = at(0.5 * (from_m + to_m));
  consider(found);
  consider(at(params_.taper_m));
  for (const double slope : {(params_.shaft_radius_m - params_.tip_radius_m) / params_.taper_m, 0.0}) {
    consider(across(found, needle.axis, slope));
    consider(across_both(found, needle.axis, slope, holder.axis));
  }
  return best;
}

double ForbiddenRegions::apart_m(Region region, const hal::Vec3& direction, const NeedlePose& needle) const
    NONBLOCKING {
  if (region == Region::floor) {
    // Of the needle the tip alone. The shaft is not kept from the floor: that of a horizontal needle is
    // thicker than its tip and lies lower.
    const double below_tip_m = direction.z() * (needle.tip_m.z() - params_.floor->z_m);
    return below_tip_m - params_.tip_radius_m - params_.clearance_m;
  }
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
