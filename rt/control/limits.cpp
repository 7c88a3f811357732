#include "rt/control/limits.hpp"

#include <algorithm>
#include <cmath>

#include "rt/station/telemetry.hpp"

namespace punctum::rt {
namespace {

constexpr double kTiltSpeed_rad_s = 0.5;  // of the approach axis
constexpr double kAtLimit_m = 0.05e-6;    // nearer to a limit than this, the needle is said to be held by it
// Part of the acceleration that the approach to a target plans with; the rest is for what it did not foresee.
constexpr double kPlanned = 0.8;

[[nodiscard]] bool is_finite(const hal::Vec3& v) noexcept {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

[[nodiscard]] hal::Vec3 shortened(const hal::Vec3& v, double longest) noexcept {
  const double length = v.norm();
  return length > longest ? hal::Vec3(v * (longest / length)) : v;
}

}  // namespace

double Membrane3D::depth_m(const hal::Vec3& p) const noexcept {
  const hal::Vec3 V = p - entry_m;
  const double along = axis.dot(V);
  const double r2 = std::min((V - along * axis).squaredNorm(), R_m * R_m);
  // The sphere falls back from the entry plane with the distance from the axis.
  return along - r2 / (R_m + std::sqrt(R_m * R_m - r2));
}

double Membrane3D::chord_m(const hal::Vec3& p) const noexcept {
  const hal::Vec3 V = p - entry_m;
  const double r2 = (V - axis.dot(V) * axis).squaredNorm();
  return 2 * std::sqrt(std::max(R_m * R_m - r2, 0.0));
}

StageLimits::StageLimits(const LimitParams& limits, const MappingParams& mapping) noexcept
    : limits_(limits), low_m_(mapping.workspace_min_m), high_m_(mapping.workspace_max_m) {}

void StageLimits::restart(const hal::Vec3& tip_m, const hal::Vec3& axis) noexcept {
  set_point_ = {tip_m, axis};
  velocity_m_s_.setZero();
}

StageLimits::Checked StageLimits::check(const hal::Vec3& wanted_m, const StageConstraint& c) const noexcept {
  const hal::Vec3& here = set_point_.tip_m;
  Checked out{wanted_m, 0};
  if (c.frozen || !is_finite(wanted_m)) return {here, 0};

  // Workspace; a needle that is outside already may stay or come back.
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double low = std::min(low_m_[i], here[i]);
    const double high = std::max(high_m_[i], here[i]);
    if (out.point_m[i] < low + kAtLimit_m || out.point_m[i] > high - kAtLimit_m) {
      out.alarms |= alarm_travel_limited;
    }
    out.point_m[i] = std::clamp(out.point_m[i], low, high);
  }

  const Membrane3D& m = c.membrane;
  if (c.withdrawal_only) {
    // Outward along the axis, nothing else, and not out of the workspace.
    double outward = std::max(-m.axis.dot(out.point_m - here), 0.0);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double direction = -m.axis[i];
      if (direction == 0) continue;
      const double room =
          direction > 0 ? std::max(high_m_[i], here[i]) - here[i] : std::min(low_m_[i], here[i]) - here[i];
      outward = std::min(outward, room / direction);
    }
    out.point_m = here - std::max(outward, 0.0) * m.axis;
    return out;
  }
  if (!m.known) return out;

  // Depth along the axis: of the penetration limit, of the far wall, of the tip force. Points outside the
  // cell pass; a needle that is beyond a limit already is held there, not driven back.
  const double depth = m.depth_m(out.point_m);
  if (depth <= 0) return out;
  const double depth_here = std::max(m.depth_m(here), 0.0);
  const auto room = [&](const hal::Vec3& p) {
    return std::max(std::min(limits_.penetration_depth_m, m.chord_m(p) - limits_.far_wall_m), 0.0);
  };
  const double excess = std::max(depth_here - room(here), 0.0);
  double deepest = room(out.point_m) + excess;
  if (depth > deepest - kAtLimit_m) out.alarms |= alarm_depth_limited;
  if (c.no_deeper && depth > depth_here) {
    deepest = std::min(deepest, depth_here);
    out.alarms |= alarm_tip_force;
  }
  if (depth > deepest) {
    out.point_m -= (depth - deepest) * m.axis;
    for (Eigen::Index i = 0; i < 3; ++i) {
      // Out of the cell but out of the workspace too: stay.
      if (out.point_m[i] < std::min(low_m_[i], here[i]) || out.point_m[i] > std::max(high_m_[i], here[i])) {
        out.point_m = here;
      }
    }
  }
  return out;
}

const hal::StageCommand& StageLimits::step(const hal::StageCommand& target, const StageConstraint& c,
                                           double dt_s) noexcept {
  alarms_ = 0;
  finite_ = is_finite(target.tip_m) && is_finite(target.axis);
  if (!finite_ || c.frozen || !(dt_s > 0)) {
    velocity_m_s_.setZero();
    return set_point_;
  }

  const hal::Vec3 here = set_point_.tip_m;
  const Checked goal = check(target.tip_m, c);
  alarms_ |= goal.alarms;

  // Towards the goal as fast as the limits let it and still stop there.
  const hal::Vec3 way = goal.point_m - here;
  const double distance = way.norm();
  const double braking = kPlanned * limits_.stage_acceleration_m_s2;
  // Speed v from which braking over whole ticks ends at the goal: v^2/(2b) + v dt/2 = distance.
  const double stoppable = braking * dt_s * (std::sqrt(0.25 + 2 * distance / (braking * dt_s * dt_s)) - 0.5);
  const double speed = std::min(std::min(limits_.stage_velocity_m_s, stoppable), distance / dt_s);
  const hal::Vec3 wanted = distance > 0 ? hal::Vec3(way * (speed / distance)) : hal::Vec3::Zero();
  const hal::Vec3 change = wanted - velocity_m_s_;
  const hal::Vec3 possible = shortened(change, limits_.stage_acceleration_m_s2 * dt_s);
  hal::Vec3 velocity = shortened(velocity_m_s_ + possible, limits_.stage_velocity_m_s);
  if (distance > limits_.stage_velocity_m_s * dt_s * 1.001 && speed >= limits_.stage_velocity_m_s) {
    alarms_ |= alarm_travel_limited;
  }

  // Position last: what momentum would carry across a limit stops at it.
  Checked next = check(here + velocity * dt_s, c);
  alarms_ |= next.alarms;
  if ((next.point_m - here).norm() > limits_.stage_velocity_m_s * dt_s * (1 + 1e-9)) next.point_m = here;
  set_point_.tip_m = next.point_m;
  velocity_m_s_ = (next.point_m - here) / dt_s;

  const hal::Vec3 turn = shortened(target.axis - set_point_.axis, kTiltSpeed_rad_s * dt_s);
  const hal::Vec3 axis = set_point_.axis + turn;
  const double length = axis.norm();
  if (length > 0.5) set_point_.axis = axis / length;
  return set_point_;
}

LimitedForce limit_hand_force(const hal::Vec3& wanted_N, double max_N) noexcept {
  LimitedForce out;
  const double largest = wanted_N.cwiseAbs().maxCoeff();
  if (!is_finite(wanted_N)) {
    out.finite = false;
    return out;
  }
  out.force_N = wanted_N;
  if (largest > 0) {
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
