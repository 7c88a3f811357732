// What the needle and the hand may do. Checked on every set-point and on every force, after everything else.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/control/master_to_stage.hpp"
#include "rt/control/moving_average.hpp"
#include "rt/forces/fixture.hpp"
#include "rt/forces/forbidden_regions.hpp"

namespace punctum::rt {

struct LimitParams {
  double hand_force_N = 3.0;
  double stage_velocity_m_s = 400e-6;
  double stage_velocity_near_m_s = 200e-6;    // nearer to the undeformed membrane than near_m
  double stage_velocity_inside_m_s = 100e-6;  // past it
  double near_m = 20e-6;
  double stage_acceleration_m_s2 = 20e-3;
  double stage_jerk_m_s3 = 4;
  double penetration_depth_m = 90e-6;  // past the undeformed outer membrane
  double far_wall_m = 20e-6;           // smallest distance to the far wall
  double lateral_m = 5e-6;             // inside, from the line that the needle went in by
  double tip_force_soft_N = 30e-6;     // the needle is not pushed further
  double tip_force_hard_N = 60e-6;     // latched fault
  double following_error_m = 10e-6;
};
constexpr auto keys_of(const LimitParams*) {
  return hal::keys(hal::real("hand_force_N", &LimitParams::hand_force_N, 0, 40),
                   hal::micro("stage_velocity_um_s", &LimitParams::stage_velocity_m_s, 1, 1e5),
                   hal::micro("stage_velocity_near_um_s", &LimitParams::stage_velocity_near_m_s, 1, 1e5),
                   hal::micro("stage_velocity_inside_um_s", &LimitParams::stage_velocity_inside_m_s, 1, 1e5),
                   hal::micro("near_um", &LimitParams::near_m, 0, 5000),
                   hal::milli("stage_acceleration_mm_s2", &LimitParams::stage_acceleration_m_s2, 0.1, 1e5),
                   hal::real("stage_jerk_m_s3", &LimitParams::stage_jerk_m_s3, 0.01, 1e5),
                   hal::micro("penetration_depth_um", &LimitParams::penetration_depth_m, 1, 5000),
                   hal::micro("far_wall_um", &LimitParams::far_wall_m, 0, 5000),
                   hal::micro("lateral_um", &LimitParams::lateral_m, 0.1, 5000),
                   hal::micro("tip_force_soft_uN", &LimitParams::tip_force_soft_N, 0.1, 1e5),
                   hal::micro("tip_force_hard_uN", &LimitParams::tip_force_hard_N, 0.1, 1e5),
                   hal::micro("following_error_um", &LimitParams::following_error_m, 0.1, 1000));
}

// Where the needle is in the cell, for the depth limits.
struct Membrane3D {
  bool known = false;
  hal::Vec3 entry_m = hal::Vec3::Zero();  // of the undeformed membrane, on the axis through the cell's centre
  hal::Vec3 axis = -hal::Vec3::UnitX();
  double R_m = 0;

  // Depth of a point past the undeformed membrane along the axis; < 0 outside.
  [[nodiscard]] double depth_m(const hal::Vec3& p) const NONBLOCKING {
    const hal::Vec3 V = p - entry_m;
    const double along = axis.dot(V);
    const double r2 = std::min((V - along * axis).squaredNorm(), R_m * R_m);
    // The sphere falls back from the entry plane with the distance from the axis.
    return along - r2 / (R_m + std::sqrt(R_m * R_m - r2));
  }
  // Its distance from the axis.
  [[nodiscard]] double beside_m(const hal::Vec3& p) const NONBLOCKING {
    const hal::Vec3 V = p - entry_m;
    return (V - axis.dot(V) * axis).norm();
  }
  // Depth of the far wall on the same line.
  [[nodiscard]] double chord_m(const hal::Vec3& p) const NONBLOCKING {
    const hal::Vec3 V = p - entry_m;
    const double r2 = (V - axis.dot(V) * axis).squaredNorm();
    return 2 * std::sqrt(std::max(R_m * R_m - r2, 0.0));
  }
};

struct StageConstraint {
  Membrane3D membrane;
  bool withdrawal_only = false;  // vision is stale: only outward along the axis
  bool no_deeper = false;        // soft tip-force limit
  bool frozen = false;           // no motion at all
  // The needle goes no further along the axis than this, whatever vision says of the membrane.
  double inward_limit_m = std::numeric_limits<double>::infinity();
  double depth_limit_m = std::numeric_limits<double>::infinity();  // past the membrane, below the scene's
  std::optional<FixtureFrame> insertion;  // the needle is in the cell, along this line: not sideways
};

// Set-points for the stage, one per tick: never faster, never outside, never deeper than the limits, never
// NaN. A limit that the needle is already beyond holds the needle; it does not push it back.
//
// A point goes to the target with bounds on its velocity and acceleration, and always so that braking along
// its way would end where it may be; the set-point is the mean of that point over a window 2 a/j long, which
// bounds the jerk. So velocity, acceleration and jerk are bounded whatever the targets are, and where the
// region that is allowed is convex and stands still, no set-point leaves it. Where it is not (a depth limit
// that vision's correction moves under the needle, a way that closes when vision is lost), the position wins:
// the set-point stops there at once and may break the bounds of acceleration and jerk, never that of
// velocity; it goes on from rest. Steps count nominal ticks: a late tick moves the set-point no further than
// another.
class StageLimits {
 public:
  // reach: of a stage that cannot make every motion, the projector onto those that it can.
  StageLimits(const LimitParams& limits, const MappingParams& mapping, double rate_Hz,
              const std::optional<ForbiddenParams>& forbidden = std::nullopt,
              const std::optional<hal::Mat3>& reach = std::nullopt) NONBLOCKING;

  void restart(const hal::Vec3& tip_m, const hal::Vec3& axis) NONBLOCKING;  // at rest there

  // Where the hand's own point may be: the same position limits without dynamics. The alarms name the limits
  // that hold it.
  struct Checked {
    hal::Vec3 point_m;
    std::uint32_t alarms;
  };
  [[nodiscard]] Checked check(const hal::Vec3& wanted_m, const StageConstraint& c) const NONBLOCKING;

  // Nearer to the set-point than this, check() leaves every point as it is, without an alarm: step() checks
  // several, and mostly this says it of all of them.
  [[nodiscard]] double clearance_m(const StageConstraint& c) const NONBLOCKING;

  // The next set-point. A target that is not finite leaves it where it is.
  const hal::StageCommand& step(const hal::StageCommand& target, const StageConstraint& c) NONBLOCKING;

  // Where the set-point comes to rest from here on.
  [[nodiscard]] hal::Vec3 stops_at_m() const NONBLOCKING { return stop_of(ahead_m_, ahead_m_s_); }
  // What the needle may do on its way through this constraint now.
  [[nodiscard]] double allowed_speed_m_s(const StageConstraint& c) const NONBLOCKING;
  // What it may do in every constraint.
  [[nodiscard]] double slowest_m_s() const NONBLOCKING { return slowest_m_s_; }
  // How long the set-point is behind a target that moves steadily.
  [[nodiscard]] double lag_s() const NONBLOCKING { return lag_s_; }

  [[nodiscard]] const hal::StageCommand& set_point() const NONBLOCKING { return set_point_; }
  [[nodiscard]] std::uint32_t alarms() const NONBLOCKING { return alarms_; }  // of the last step
  [[nodiscard]] bool finite() const NONBLOCKING { return finite_; }           // the last target was

 private:
  // The set-point's tip is here from now on.
  void place(const hal::Vec3& tip_m) NONBLOCKING;
  [[nodiscard]] bool is_in_workspace(const hal::Vec3& point_m) const NONBLOCKING;
  // Workspace, cell and line of insertion.
  [[nodiscard]] Checked check_cell(const hal::Vec3& wanted_m, const StageConstraint& c) const NONBLOCKING;
  [[nodiscard]] double room_in_cell_m(const StageConstraint& c, const hal::Vec3& p) const NONBLOCKING;
  // The part of a motion that the stage can make.
  [[nodiscard]] hal::Vec3 made(const hal::Vec3& motion_m) const NONBLOCKING;
  // The way to a point, up to where it leaves the workspace.
  [[nodiscard]] hal::Vec3 within_workspace(const hal::Vec3& point_m) const NONBLOCKING;
  // So near to where regions were looked for from that none is between them.
  [[nodiscard]] bool is_far_from_regions(const hal::Vec3& point_m) const NONBLOCKING;
  void keep_out(Checked& out, const StageConstraint& c) const NONBLOCKING;
  // A way of the tip that begins at the set-point: how much of it keeps out of the region, and what lies
  // beyond the plane before which the region ends it.
  struct FreeWay {
    double part = 1;
    double beyond_m = 0;  // of the whole way
    hal::Vec3 away = hal::Vec3::UnitX();
  };
  template <Region region>
  [[nodiscard]] FreeWay free_way(const hal::Vec3& to_m) const NONBLOCKING;
  // Whether a region ends the way to the point, which is moved before it then; stops: not aside.
  template <Region region>
  [[nodiscard]] bool hold_before(hal::Vec3& point_m, bool stops) const NONBLOCKING;
  [[nodiscard]] bool is_clear(const hal::Vec3& point_m) const NONBLOCKING;  // of every limit, within a step
  [[nodiscard]] Checked check_unless_clear(const hal::Vec3& wanted_m, const StageConstraint& c) const
      NONBLOCKING;
  // From the set-point, after it was moved.
  void look_for_regions() NONBLOCKING;
  [[nodiscard]] bool may_point(const hal::Vec3& axis) const NONBLOCKING;
  void turn(const hal::Vec3& target) NONBLOCKING;
  // What the limits leave of the next set-point.
  [[nodiscard]] hal::Vec3 held(const hal::Vec3& wanted_m, double longest_m, const StageConstraint& c)
      NONBLOCKING;
  // The set-point was held at held_m instead: its way across that limit begins from rest.
  void settle(const hal::Vec3& wanted_m, const hal::Vec3& held_m) NONBLOCKING;
  void advance(const hal::Vec3& goal_m, const StageConstraint& c) NONBLOCKING;
  // Where braking from there ends.
  [[nodiscard]] hal::Vec3 stop_of(const hal::Vec3& point_m, const hal::Vec3& velocity_m_s) const NONBLOCKING;
  [[nodiscard]] bool may_be_at(const hal::Vec3& point_m, const StageConstraint& c) const NONBLOCKING;
  [[nodiscard]] hal::Vec3 beside(const FixtureFrame& line, const hal::Vec3& point_m) const NONBLOCKING;
  [[nodiscard]] std::uint32_t keep_to_line(hal::Vec3& point_m, const FixtureFrame& line) const NONBLOCKING;

  LimitParams limits_;
  hal::Vec3 low_m_;
  hal::Vec3 high_m_;
  hal::Vec3 low_here_m_;  // the workspace and the set-point: outside already, it may stay or come back
  hal::Vec3 high_here_m_;
  hal::Vec3 clear_low_m_;  // of these; a point between them is held by neither
  hal::Vec3 clear_high_m_;
  std::optional<hal::Mat3> reach_;
  std::optional<ForbiddenRegions> regions_;
  // Directions in which needle and regions lie apart: as long as they do, nothing more is computed.
  std::array<hal::Vec3, std::size(kRegions)> away_{hal::Vec3::UnitX(), hal::Vec3::UnitX()};
  SeenRoom seen_;  // of the set-point, before the regions
  double room_left_m_ = 0;
  double clear_m_ = 0;  // clearance_m() of this step
  double dt_s_;
  double hardest_m_s2_;  // of which the window bounds the jerk
  double slowest_m_s_;
  double reach_m_;  // on its way to a new speed the needle gets no further
  double lag_s_;
  hal::Vec3 ahead_m_ = hal::Vec3::Zero();  // goes to the target, its jerk not bounded
  hal::Vec3 ahead_m_s_ = hal::Vec3::Zero();
  MovingAverage bounds_jerk_;
  hal::StageCommand set_point_;
  hal::Vec3 turned_to_ = hal::Vec3::Zero();  // the last target of its axis
  bool axis_stands_ = false;                 // that target no longer turned it
  std::uint32_t alarms_ = 0;
  bool finite_ = true;
};

// The force to the hand, last of all: at most max_N long, and zero if it is not finite.
struct LimitedForce {
  hal::Vec3 force_N = hal::Vec3::Zero();
  bool limited = false;
  bool finite = true;
};
[[nodiscard]] LimitedForce limit_hand_force(const hal::Vec3& wanted_N, double max_N) NONBLOCKING;

}  // namespace punctum::rt
