// Where the needle's glass must not be: its tip in the dish floor, tip and shaft in the holding pipette. The
// shaft, thicker than the tip and so the lower one in a horizontal needle, is not kept from the floor. To the
// holder the needle is a row of balls along its axis, from the tip back, as thick as its taper and its shaft;
// the floor is a plane, the holder a cylinder with a flat mouth, without an end. So what the tip must keep
// out of is convex for each of the two, and every direction in which needle and region lie apart gives a
// plane that the region is wholly behind, exactly:
//
//   n . (p - m) > R sqrt(1 - (n.b)^2) + max_s (s n.a + r(s))      for n.b <= 0
//
// p tip, a axis of the needle (out of its tip), r(s) its radius s behind the tip; m mouth, b axis of the
// holder (backwards from its mouth), R its radius. The left side less the right one is never more than needle
// and holder are apart, whatever n is: it is the gap between two parallel planes, with the one wholly on this
// side and the other wholly beyond. So a search for the best n may end anywhere: how good the direction is
// decides only how much room is given away. Everything stands in the stage's frame, as the workspace does,
// and includes the clearance. Real-time safe.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

// The bottom of the dish: a plane across the optical axis. The picture's plane, z = 0, is above it.
struct DishFloorParams {
  double z_m = 70e-6;
};
constexpr auto keys_of(const DishFloorParams*) {
  return hal::keys(hal::micro("z_um", &DishFloorParams::z_m, -1e5, 1e5));
}

// The holding pipette.
struct HolderBodyParams {
  hal::Vec3 mouth_m{-100e-6, 0, 0};  // centre of its mouth
  hal::Vec3 axis{-1, 0, 0};          // unit, from the mouth backwards
  double radius_m = 45e-6;           // outer
};
constexpr auto keys_of(const HolderBodyParams*) {
  return hal::keys(hal::micro_vector("mouth_um", &HolderBodyParams::mouth_m, -1e5, 1e5),
                   hal::direction("axis", &HolderBodyParams::axis),
                   hal::micro("radius_um", &HolderBodyParams::radius_m, 1, 5000));
}

struct ForbiddenParams {
  double clearance_m = 5e-6;  // between glass and glass that the set-point keeps
  double felt_m = 8e-6;       // the wall is felt from this much before it
  double K_N_m = 100;         // of the wall, at the hand
  // The needle.
  double tip_radius_m = 3.8e-6;
  double shaft_radius_m = 9e-6;
  double taper_m = 160e-6;  // from the tip to where the shaft is that thick
  std::optional<DishFloorParams> floor;
  std::optional<HolderBodyParams> holder;
};
constexpr auto keys_of(const ForbiddenParams*) {
  return hal::keys(hal::micro("clearance_um", &ForbiddenParams::clearance_m, 0, 1000),
                   hal::micro("felt_um", &ForbiddenParams::felt_m, 0.5, 1000),
                   hal::real("K_N_m", &ForbiddenParams::K_N_m, 0, 3000),
                   hal::micro("tip_radius_um", &ForbiddenParams::tip_radius_m, 0.2, 50),
                   hal::micro("shaft_radius_um", &ForbiddenParams::shaft_radius_m, 0.2, 500),
                   hal::micro("taper_um", &ForbiddenParams::taper_m, 1, 5000));
}

enum class Region : std::uint8_t { floor, holder };
inline constexpr Region kRegions[] = {Region::floor, Region::holder};

struct NeedlePose {
  hal::Vec3 tip_m = hal::Vec3::Zero();
  hal::Vec3 axis = -hal::Vec3::UnitX();  // unit, out of the tip
};

// Between needle and region: a direction that leads away from the region, unit, and apart_m() in it.
struct Gap {
  hal::Vec3 away;
  double apart_m;
};

// Room that a needle was once seen to have. A plane that it is apart from comes no nearer than the tip goes,
// as long as the needle does not turn: until the room is used up there is nothing to look for anew.
struct SeenRoom {
  NeedlePose needle;
  double room_m = 0;

  [[nodiscard]] double left_m(const hal::Vec3& tip_m) const NONBLOCKING {
    return room_m - (tip_m - needle.tip_m).norm();
  }
  [[nodiscard]] double left_m(const NeedlePose& now) const NONBLOCKING {
    return now.axis == needle.axis ? left_m(now.tip_m) : 0;
  }
};

class ForbiddenRegions {
 public:
  explicit ForbiddenRegions(const ForbiddenParams& params) NONBLOCKING : params_(params) {}

  [[nodiscard]] bool has(Region region) const NONBLOCKING {
    return region == Region::floor ? params_.floor.has_value() : params_.holder.has_value();
  }
  // In the direction from the region to the needle where the two are nearest. Bounded work.
  [[nodiscard]] Gap widest_gap(Region region, const NeedlePose& needle) const NONBLOCKING;
  // How far needle and region are apart in this direction; never more than they are apart. < 0: too near, or
  // not apart in this direction.
  [[nodiscard]] double apart_m(Region region, const hal::Vec3& direction, const NeedlePose& needle) const
      NONBLOCKING;

 private:
  [[nodiscard]] Gap widest_gap_to_holder(const NeedlePose& needle) const NONBLOCKING;
  [[nodiscard]] double apart_from_floor_m(const hal::Vec3& direction, const NeedlePose& needle) const
      NONBLOCKING;
  [[nodiscard]] double apart_from_holder_m(const hal::Vec3& direction, const NeedlePose& needle) const
      NONBLOCKING;

  ForbiddenParams params_;
};

}  // namespace punctum::rt
