#include "rt/control/limits.hpp"

#include <algorithm>
#include <cmath>

#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

// Of the approach axis: the glass 0.2 mm behind the tip then goes 0.1 mm/s, no faster than it is led.
constexpr double kTiltSpeed_rad_s = 0.5;
// Nearer to a limit than this, the needle is said to be held by it: an encoder step of a fine stage.
constexpr double kAtLimit_m = 0.05e-6;
constexpr double kRounding_m = 1e-15;
// Part of the acceleration that the approach to a target plans with; the rest is for what it did not foresee.
constexpr double kPlanned = 0.8;
constexpr double kFinestPart = 1e-3;  // of a way: a thousandth of 1 um is beyond every stage
constexpr double kSurface_m = 1e-9;   // of a region: the needle is at it when nearer
// Newton's steps double the digits; more are needed only where a way grazes an edge, and it may end early
// there.
constexpr int kSurfaceSteps = 6;
// Of a place where a region meets another one or another limit.
constexpr int kCornerRounds = 3;
// Nearer to a region than this, the direction away from it is found anew on every tick.
constexpr double kNear_m = 20e-6;

[[nodiscard]] hal::Vec3 shortened(const hal::Vec3& v, double longest) NONBLOCKING {
  const double length = v.norm();
  return length > longest ? hal::Vec3(v * (longest / length)) : v;
}

// Samples of a window that takes this long.
[[nodiscard]] std::size_t samples(double seconds, double dt_s) NONBLOCKING {
  const double n = std::ceil(seconds / dt_s - 1e-9);
  return static_cast<std::size_t>(std::clamp(n, 1.0, static_cast<double>(MovingAverage::kMost)));
}

}  // namespace

StageLimits::StageLimits(const LimitParams& limits, const MappingParams& mapping, double rate_Hz,
                         const std::optional<ForbiddenParams>& forbidden,
                         const std::optional<hal::Mat3>& reach) NONBLOCKING
    : limits_(limits),
      low_m_(mapping.workspace_min_m),
      high_m_(mapping.workspace_max_m),
      reach_(reach),
      dt_s_(1 / rate_Hz),
      // A window as long as can be still has to bound the jerk: a stage this slow gets less acceleration.
      hardest_m_s2_(std::min(limits.stage_acceleration_m_s2,
                             limits.stage_jerk_m_s3* static_cast<double>(MovingAverage::kMost) * dt_s_ / 2)),
      slowest_m_s_(std::min({limits.stage_velocity_m_s, limits.stage_velocity_near_m_s,
                             limits.stage_velocity_inside_m_s})),
      bounds_jerk_(samples(2 * hardest_m_s2_ / limits.stage_jerk_m_s3, dt_s_)) {
  const double window_s = static_cast<double>(bounds_jerk_.samples()) * dt_s_;
  // A speed turns into any other within 2 v/a.
  reach_m_ = limits.stage_velocity_m_s * (2 * limits.stage_velocity_m_s / hardest_m_s2_ + window_s);
  lag_s_ = window_s / 2;
  if (forbidden) {
    regions_.emplace(*forbidden);
  }
  place(set_point_.tip_m);
}

void StageLimits::place(const hal::Vec3& tip_m) NONBLOCKING {
  set_point_.tip_m = tip_m;
  for (Eigen::Index i = 0; i < 3; ++i) {
    low_here_m_[i] = std::min(low_m_[i], tip_m[i]);
    high_here_m_[i] = std::max(high_m_[i], tip_m[i]);
  }
  clear_low_m_ = low_here_m_.array() + kAtLimit_m;
  clear_high_m_ = high_here_m_.array() - kAtLimit_m;
}

bool StageLimits::is_in_workspace(const hal::Vec3& p) const NONBLOCKING {
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (p[i] < low_here_m_[i] || p[i] > high_here_m_[i]) {
      return false;
    }
  }
  return true;
}

void StageLimits::restart(const hal::Vec3& tip_m, const hal::Vec3& axis) NONBLOCKING {
  place(tip_m);
  set_point_.axis = axis;
  axis_stands_ = false;
  ahead_m_ = tip_m;
  ahead_m_s_.setZero();
  bounds_jerk_.restart(tip_m);
  look_for_regions();
}

void StageLimits::look_for_regions() NONBLOCKING {
  if (!regions_) {
    return;
  }
  const NeedlePose needle{set_point_.tip_m, set_point_.axis};
  room_left_m_ = seen_.left_m(needle);
  if (room_left_m_ > kNear_m + kSurface_m) {
    return;
  }
  seen_ = {needle, std::numeric_limits<double>::infinity()};
  for (const Region region : kRegions) {
    if (!regions_->has(region)) {
      continue;
    }
    hal::Vec3& away = away_[static_cast<std::size_t>(region)];
    Gap gap{away, regions_->apart_m(region, away, needle)};
    if (gap.apart_m < kNear_m) {
      gap = regions_->widest_gap(region, needle);
      away = gap.away;
    }
    seen_.room_m = std::min(seen_.room_m, gap.apart_m);
  }
  room_left_m_ = seen_.room_m;
}

StageLimits::Checked StageLimits::check(const hal::Vec3& wanted_m, const StageConstraint& c) const
    NONBLOCKING {
  if (c.frozen || !hal::is_finite(wanted_m)) {
    return {set_point_.tip_m, 0};
  }
  Checked out = check_cell(wanted_m, c);
  if (!is_far_from_regions(out.point_m)) {
    keep_out(out, c);
  }
  return out;
}

hal::Vec3 StageLimits::made(const hal::Vec3& motion_m) const NONBLOCKING {
  return reach_ ? hal::Vec3(reach_->lazyProduct(motion_m)) : motion_m;
}

hal::Vec3 StageLimits::within_workspace(const hal::Vec3& point_m) const NONBLOCKING {
  const hal::Vec3& here = set_point_.tip_m;
  const hal::Vec3 way = point_m - here;
  double part = 1;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double end = way[i] > 0 ? high_here_m_[i] : low_here_m_[i];
    if (std::abs(way[i]) > std::abs(end - here[i]) + kRounding_m) {
      part = std::min(part, (end - here[i]) / way[i]);
    }
  }
  return part < 1 ? hal::Vec3(here + part * way) : point_m;
}

// The largest depth at a point.
double StageLimits::room_in_cell_m(const StageConstraint& c, const hal::Vec3& p) const NONBLOCKING {
  const double at_most_m = std::min(limits_.penetration_depth_m, c.depth_limit_m);
  return std::max(std::min(at_most_m, c.membrane.chord_m(p) - limits_.far_wall_m), 0.0);
}

StageLimits::Checked StageLimits::check_cell(const hal::Vec3& wanted_m, const StageConstraint& c) const
    NONBLOCKING {
  const hal::Vec3& here = set_point_.tip_m;
  Checked out{wanted_m, 0};

  // What the stage cannot reach is not asked for: the hand slips there.
  if (reach_) {
    out.point_m = here + made(wanted_m - here);
  }

  // Workspace.
  for (Eigen::Index i = 0; i < 3; ++i) {
    double& x_m = out.point_m[i];
    if (x_m < clear_low_m_[i] || x_m > clear_high_m_[i]) {
      out.alarms |= alarm_travel_limited;
      x_m = std::clamp(x_m, low_here_m_[i], high_here_m_[i]);
    }
  }
  if (reach_) {
    out.point_m = within_workspace(here + made(out.point_m - here));
  }

  const Membrane3D& m = c.membrane;
  if (c.withdrawal_only) {
    // Outward along the axis, nothing else, and not out of the workspace.
    const double wanted = std::max(-m.axis.dot(wanted_m - here), 0.0);
    double outward = wanted;
    out.alarms = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double direction = -m.axis[i];
      if (direction == 0) {
        continue;
      }
      const double room = (direction > 0 ? high_here_m_[i] : low_here_m_[i]) - here[i];
      outward = std::min(outward, room / direction);
    }
    if (outward < wanted) {
      out.alarms |= alarm_travel_limited;
    }
    out.point_m = here - std::max(outward, 0.0) * made(m.axis);
    return out;
  }
  if (c.insertion) {
    if (const std::uint32_t held = keep_to_line(out.point_m, *c.insertion); held != 0) {
      out.alarms |= held;
      out.point_m = within_workspace(out.point_m);  // an oblique line leads out of it
    }
  }
  const double inward_m = m.axis.dot(out.point_m);
  if (inward_m - c.inward_limit_m > -kAtLimit_m) {
    const double beyond = inward_m - std::max(c.inward_limit_m, m.axis.dot(here));
    if (beyond > -kAtLimit_m) {
      out.alarms |= alarm_depth_limited;
    }
    if (beyond > 0) {
      out.point_m -= beyond * made(m.axis);
      if (!is_in_workspace(out.point_m)) {
        out.point_m = here;
      }
    }
  }
  if (!m.known) {
    return out;
  }

  // Depth along the axis: of the penetration limit, of the far wall, of the tip force. Points outside the
  // cell pass; a needle that is beyond a limit already is held there, not driven back.
  const double depth = m.depth_m(out.point_m);
  if (depth <= 0) {
    return out;
  }
  const double room_there = room_in_cell_m(c, out.point_m);
  if (!c.no_deeper && depth <= room_there - kAtLimit_m) {
    return out;  // whatever room a needle that is too deep is left besides
  }
  const double depth_here = std::max(m.depth_m(here), 0.0);
  const double excess = std::max(depth_here - room_in_cell_m(c, here), 0.0);
  double deepest = room_there + excess;
  if (depth > deepest - kAtLimit_m) {
    out.alarms |= alarm_depth_limited;
  }
  if (c.no_deeper && depth > depth_here) {
    deepest = std::min(deepest, depth_here);
    out.alarms |= alarm_tip_force;
  }
  if (depth > deepest) {
    out.point_m -= (depth - deepest) * made(m.axis);
    if (!is_in_workspace(out.point_m)) {
      out.point_m = here;  // out of the cell but out of the workspace too: stay
    }
  }
  return out;
}

bool StageLimits::is_far_from_regions(const hal::Vec3& point_m) const NONBLOCKING {
  return !regions_ || seen_.left_m(point_m) > 0;
}

// Every limit that check_cell() knows moves no faster than the point, but for the one across the cell. Within
// half of its radius from the axis the sphere falls back by at most 1/sqrt(3) of the way across, the far wall
// by twice that the other way, and the depth along the axis by all of the way: the room left of it by at most
// twice the way.
double StageLimits::clearance_m(const StageConstraint& c) const NONBLOCKING {
  if (reach_ || c.withdrawal_only || c.no_deeper) {
    return 0;
  }
  const hal::Vec3& here = set_point_.tip_m;
  const Membrane3D& m = c.membrane;
  double clear_m = c.inward_limit_m - kAtLimit_m - m.axis.dot(here);
  for (Eigen::Index i = 0; i < 3; ++i) {
    clear_m = std::min({clear_m, here[i] - clear_low_m_[i], clear_high_m_[i] - here[i]});
  }
  if (regions_) {
    clear_m = std::min(clear_m, room_left_m_);
  }
  if (c.insertion) {
    clear_m = std::min(clear_m, limits_.lateral_m - beside(*c.insertion, here).norm());
  }
  if (m.known) {
    const double room_m = room_in_cell_m(c, here) - m.depth_m(here) - kAtLimit_m;
    clear_m = std::min({clear_m, room_m / 2, m.R_m / 2 - m.beside_m(here)});
  }
  return clear_m - kSurface_m;  // rounding takes less
}

bool StageLimits::is_clear(const hal::Vec3& point_m) const NONBLOCKING {
  return (point_m - set_point_.tip_m).norm() < clear_m_;
}

StageLimits::Checked StageLimits::check_unless_clear(const hal::Vec3& wanted_m,
                                                     const StageConstraint& c) const NONBLOCKING {
  return is_clear(wanted_m) ? Checked{wanted_m, 0} : check(wanted_m, c);
}

// A convex body lies wholly behind a plane across any direction in which the needle is apart from it.
// Newton's steps along the way come to its surface from outside and never pass it: no plane that they use
// lets the needle through, and none takes away more than the last.
template <Region region>
[[gnu::noinline]] StageLimits::FreeWay StageLimits::free_way(const hal::Vec3& to_m) const NONBLOCKING {
  FreeWay free;
  if (!regions_->has(region)) {
    return free;
  }
  const hal::Vec3& from_m = set_point_.tip_m;
  const hal::Vec3 way = to_m - from_m;
  const auto apart_m = [&](const hal::Vec3& direction, const hal::Vec3& tip_m) {
    return regions_->apart_m(region, direction, {tip_m, set_point_.axis});
  };
  free.away = away_[static_cast<std::size_t>(region)];
  if (apart_m(free.away, from_m) >= 0 && apart_m(free.away, to_m) >= 0) {
    return free;
  }
  double at = 0;
  double level_m = 0;
#pragma GCC unroll 1  // one copy of what is long and rare
  for (int i = 0; i < kSurfaceSteps; ++i) {
    const hal::Vec3 tip_m = from_m + at * way;
    const auto [away, here_m] = regions_->widest_gap(region, {tip_m, set_point_.axis});
    const double along_m = away.dot(way);
    free.away = away;
    if (i == 0 && here_m < -2 * kSurface_m) {
      level_m = here_m;  // inside already: no further in
    }
    free.beyond_m = level_m - (here_m + (1 - at) * along_m);
    if (free.beyond_m <= (level_m < 0 ? 0 : kSurface_m)) {
      return {};
    }
    free.part = at;
    if (here_m - level_m < kSurface_m) {
      break;
    }
    at += (here_m - level_m) / -along_m;
  }
  return free;
}

template <Region region>
[[gnu::noinline]] bool StageLimits::hold_before(hal::Vec3& point_m, bool stops) const NONBLOCKING {
  const FreeWay free = free_way<region>(point_m);
  if (free.part >= 1) {
    return false;
  }
  const hal::Vec3& here = set_point_.tip_m;
  if (stops) {
    point_m = here + free.part * (point_m - here);
  } else {
    point_m += free.beyond_m * free.away;
  }
  return true;
}

void StageLimits::keep_out(Checked& out, const StageConstraint& c) const NONBLOCKING {
#pragma GCC unroll 1  // likewise
  for (int round = 0; round < kCornerRounds; ++round) {
    // The way back leads along its line alone; and where limits meet, the needle stops.
    const bool stops = c.withdrawal_only || round + 1 == kCornerRounds;
    const bool by_floor = hold_before<Region::floor>(out.point_m, stops);
    const bool by_holder = hold_before<Region::holder>(out.point_m, stops);
    if (by_floor || by_holder) {
      out.alarms |= alarm_forbidden_region;
    }
    if (stops || !(by_floor || by_holder)) {
      return;
    }
    const Checked again = check_cell(out.point_m, c);
    out.point_m = again.point_m;
    out.alarms |= again.alarms;
  }
}

// Whether the needle may be turned to this axis where it is: not into a region, nor further into one.
bool StageLimits::may_point(const hal::Vec3& axis) const NONBLOCKING {
  if (axis == set_point_.axis) {
    return true;
  }
  for (const Region region : kRegions) {
    if (!regions_->has(region)) {
      continue;
    }
    const hal::Vec3& tip_m = set_point_.tip_m;
    const NeedlePose turned{tip_m, axis};
    if (regions_->apart_m(region, away_[static_cast<std::size_t>(region)], turned) >= 0) {
      continue;
    }
    const NeedlePose now{tip_m, set_point_.axis};
    const double now_m = regions_->widest_gap(region, now).apart_m;
    if (regions_->widest_gap(region, turned).apart_m < std::min(now_m, 0.0)) {
      return false;
    }
  }
  return true;
}

hal::Vec3 StageLimits::beside(const FixtureFrame& line, const hal::Vec3& point_m) const NONBLOCKING {
  const hal::Vec3 V = point_m - line.entry_m;
  return made(V - line.axis.dot(V) * line.axis);
}

std::uint32_t StageLimits::keep_to_line(hal::Vec3& point_m, const FixtureFrame& line) const NONBLOCKING {
  const hal::Vec3 wanted = beside(line, point_m);
  const hal::Vec3 now = beside(line, set_point_.tip_m);
  const double now2 = now.squaredNorm();
  const bool beyond = now2 > limits_.lateral_m * limits_.lateral_m;
  if (!beyond && wanted.norm() <= limits_.lateral_m) {
    return 0;
  }
  hal::Vec3 allowed = shortened(wanted, limits_.lateral_m);
  if (beyond) {
    // Beyond the limit already: it may stay or come straight back.
    allowed = std::clamp(wanted.dot(now) / now2, 0.0, 1.0) * now;
  }
  if ((wanted - allowed).squaredNorm() <= kRounding_m * kRounding_m) {
    return 0;
  }
  point_m += allowed - wanted;
  return alarm_lateral_limited;
}

double StageLimits::allowed_speed_m_s(const StageConstraint& c) const NONBLOCKING {
  const Membrane3D& m = c.membrane;
  if (!m.known) {
    return limits_.stage_velocity_m_s;
  }
  // The set-point comes after: it shall be as slow by the time that it is there.
  const double gap_m = (ahead_m_ - m.entry_m - m.R_m * m.axis).norm() - m.R_m - reach_m_;
  double speed_m_s = limits_.stage_velocity_m_s;
  if (gap_m < limits_.near_m) {
    speed_m_s = std::min(speed_m_s, limits_.stage_velocity_near_m_s);
  }
  if (gap_m < 0) {
    speed_m_s = std::min(speed_m_s, limits_.stage_velocity_inside_m_s);
  }
  return speed_m_s;
}

hal::Vec3 StageLimits::stop_of(const hal::Vec3& point_m, const hal::Vec3& velocity_m_s) const NONBLOCKING {
  return point_m + velocity_m_s * (velocity_m_s.norm() / (2 * hardest_m_s2_));
}

// A point that a region holds would be moved, whatever other limits make of it then.
bool StageLimits::may_be_at(const hal::Vec3& point_m, const StageConstraint& c) const NONBLOCKING {
  if (is_clear(point_m)) {
    return true;
  }
  const hal::Vec3 held_m = check_cell(point_m, c).point_m;
  if ((held_m - point_m).squaredNorm() > kRounding_m * kRounding_m) {
    return false;
  }
  if (is_far_from_regions(held_m)) {
    return true;
  }
  return free_way<Region::floor>(held_m).part >= 1 && free_way<Region::holder>(held_m).part >= 1;
}

void StageLimits::advance(const hal::Vec3& goal_m, const StageConstraint& c) NONBLOCKING {
  const hal::Vec3 way = goal_m - ahead_m_;
  const double distance_m = way.norm();
  const double braking_m_s2 = kPlanned * hardest_m_s2_;
  // Speed v from which braking over whole ticks ends at the goal: v^2/(2b) + v dt/2 = distance.
  const double stoppable_m_s =
      braking_m_s2 * dt_s_ * (std::sqrt(0.25 + 2 * distance_m / (braking_m_s2 * dt_s_ * dt_s_)) - 0.5);
  const double allowed_m_s = allowed_speed_m_s(c);
  const double speed_m_s = std::min({allowed_m_s, stoppable_m_s, distance_m / dt_s_});
  if (speed_m_s >= allowed_m_s && distance_m > allowed_m_s * dt_s_ * 1.001) {
    alarms_ |= alarm_travel_limited;
  }
  const hal::Vec3 wanted = distance_m > 0 ? hal::Vec3(way * (speed_m_s / distance_m)) : hal::Vec3::Zero();
  const double change_m_s = hardest_m_s2_ * dt_s_;
  const hal::Vec3 towards =
      shortened(ahead_m_s_ + shortened(wanted - ahead_m_s_, change_m_s), limits_.stage_velocity_m_s);
  hal::Vec3 next = towards;
  const auto ends_well = [&](const hal::Vec3& velocity_m_s) {
    return may_be_at(stop_of(ahead_m_ + velocity_m_s * dt_s_, velocity_m_s), c);
  };
  if (!ends_well(towards) && may_be_at(stops_at_m(), c)) {
    // Braking along the way ends well: as near to what is wanted as ends well too.
    const hal::Vec3 braking = ahead_m_s_ - shortened(ahead_m_s_, change_m_s);
    double part = 0;
    for (double half = 0.5; half > kFinestPart; half /= 2) {
      if (ends_well(braking + (part + half) * (towards - braking))) {
        part += half;
      }
    }
    next = braking + part * (towards - braking);
  }
  ahead_m_s_ = next;
  ahead_m_ += next * dt_s_;
}

// Nothing is left to be made up for when the limit goes.
void StageLimits::settle(const hal::Vec3& wanted_m, const hal::Vec3& held_m) NONBLOCKING {
  const hal::Vec3 held_back = held_m - wanted_m;
  const double length_m = held_back.norm();
  if (!(length_m > kRounding_m)) {
    return;
  }
  const hal::Vec3 normal = held_back / length_m;
  const auto along_the_limit = [&](const hal::Vec3& v) { return hal::Vec3(v - normal.dot(v) * normal); };
  bounds_jerk_.flatten(wanted_m, held_m, normal);
  ahead_m_ = held_m + along_the_limit(ahead_m_ - wanted_m);
  ahead_m_s_ = along_the_limit(ahead_m_s_);
}

const hal::StageCommand& StageLimits::step(const hal::StageCommand& target, const StageConstraint& c)
    NONBLOCKING {
  alarms_ = 0;
  finite_ = hal::is_finite(target.tip_m) && hal::is_finite(target.axis);
  if (c.frozen) {
    restart(set_point_.tip_m, set_point_.axis);
    return set_point_;
  }
  clear_m_ = clearance_m(c);
  const Checked goal = check_unless_clear(finite_ ? target.tip_m : stops_at_m(), c);
  alarms_ |= goal.alarms;
  advance(goal.point_m, c);

  // Position last: what momentum would carry across a limit stops at it.
  const hal::Vec3 wanted_m = bounds_jerk_.step(ahead_m_);
  const double longest_m = limits_.stage_velocity_m_s * dt_s_ * (1 + 1e-9);
  const double way_m = (wanted_m - set_point_.tip_m).norm();
  place(way_m < clear_m_ && way_m <= longest_m ? wanted_m : held(wanted_m, longest_m, c));
  if (finite_ && !(axis_stands_ && target.axis == turned_to_)) {
    turn(target.axis);
  }
  look_for_regions();
  return set_point_;
}

hal::Vec3 StageLimits::held(const hal::Vec3& wanted_m, double longest_m, const StageConstraint& c)
    NONBLOCKING {
  const hal::Vec3& here = set_point_.tip_m;
  Checked next = check_unless_clear(wanted_m, c);
  alarms_ |= next.alarms;
  if ((next.point_m - here).norm() > longest_m) {
    next = check_unless_clear(here + shortened(next.point_m - here, limits_.stage_velocity_m_s * dt_s_), c);
    if ((next.point_m - here).norm() > longest_m) {
      next.point_m = here;
    }
  }
  settle(wanted_m, next.point_m);
  return next.point_m;
}

void StageLimits::turn(const hal::Vec3& target) NONBLOCKING {
  const hal::Vec3 before = set_point_.axis;
  const hal::Vec3 axis = before + shortened(target - before, kTiltSpeed_rad_s * dt_s_);
  const double length = axis.norm();
  const bool may = length > 0.5 && (!regions_ || may_point(axis / length));
  if (may) {
    set_point_.axis = axis / length;
  }
  turned_to_ = target;
  axis_stands_ = may && set_point_.axis == before;
}

LimitedForce limit_hand_force(const hal::Vec3& wanted_N, double max_N) NONBLOCKING {
  LimitedForce out;
  if (!hal::is_finite(wanted_N)) {
    out.finite = false;
    return out;
  }
  const double largest = std::max({std::abs(wanted_N.x()), std::abs(wanted_N.y()), std::abs(wanted_N.z())});
  out.force_N = wanted_N;
  // No vector is twice as long as its largest part.
  if (largest > 0 && !(2 * largest <= max_N)) {
    // Scaled first, so that a huge but finite force does not overflow in the norm.
    const double length = (wanted_N / largest).norm() * largest;
    if (!(length <= max_N)) {
      out.force_N = wanted_N / largest * (max_N / (wanted_N / largest).norm());
      out.limited = true;
    }
  }
  return out;
}

}  // namespace punctum::rt
