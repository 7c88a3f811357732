#include "hal/sim/plant/positioner.hpp"

#include <algorithm>
#include <cmath>

#include "hal/sim/point.hpp"

namespace punctum::sim {

SimPositioner::SimPositioner(const PositionerParams& params, const hal::Clock& clock) noexcept
    : params_(params), clock_(clock) {
  motion_.from_m = params.start_m;
}

SimPositioner::Motion SimPositioner::move(const Vec3& from_m, const Vec3& to_m, std::int64_t start_ns) const {
  Motion m;
  m.from_m = from_m;
  m.start_ns = start_ns;
  m.length_m = (to_m - from_m).norm();
  if (m.length_m > 0) {
    m.direction = (to_m - from_m) / m.length_m;
    // Both ramps together cover v^2 / a: a shorter move turns round before it reaches full speed.
    m.top_m_s = std::min(params_.speed_m_s, std::sqrt(params_.acceleration_m_s2 * m.length_m));
    m.ramp_s = m.top_m_s / params_.acceleration_m_s2;
    m.total_s = m.length_m / m.top_m_s + m.ramp_s;
  }
  return m;
}

SimPositioner::Along SimPositioner::along(const Motion& m, std::int64_t t_ns) const {
  const double a = params_.acceleration_m_s2;
  const double t = std::clamp(static_cast<double>(t_ns - m.start_ns) * 1e-9, 0.0, m.total_s);
  const double left = m.total_s - t;
  if (left <= m.ramp_s) {
    return {m.length_m - 0.5 * a * left * left, a * left};
  }
  if (t < m.ramp_s) {
    return {0.5 * a * t * t, a * t};
  }
  return {m.top_m_s * (t - 0.5 * m.ramp_s), m.top_m_s};
}

std::int64_t SimPositioner::end_ns(const Motion& motion) { return motion.start_ns + to_ns(motion.total_s); }

void SimPositioner::advance(std::int64_t t_ns) {
  while (queued_ > 0 && t_ns >= end_ns(motion_)) {
    const Vec3 ends_at = motion_.from_m + motion_.length_m * motion_.direction;
    motion_ = move(ends_at, waiting_.front(), end_ns(motion_));
    std::copy(waiting_.begin() + 1, waiting_.begin() + queued_, waiting_.begin());
    --queued_;
  }
}

hal::Status SimPositioner::read(hal::PositionerState& out) {
  const std::int64_t now_ns = clock_.now_ns();
  advance(now_ns);
  out.position_m = motion_.from_m + along(motion_, now_ns).way_m * motion_.direction;
  out.queued = queued_;
  out.moving = now_ns < end_ns(motion_);
  out.fault = false;
  out.sample_ns = now_ns;
  return hal::Status::ok;
}

bool SimPositioner::move_to(const Vec3& position_m) {
  const std::int64_t now_ns = clock_.now_ns();
  advance(now_ns);
  if (!position_m.allFinite() || position_m.cwiseAbs().maxCoeff() > params_.travel_m || queued_ == kQueue) {
    return false;
  }
  if (now_ns < end_ns(motion_)) {
    waiting_[static_cast<std::size_t>(queued_)] = position_m;
    ++queued_;
  } else {
    motion_ = move(motion_.from_m + motion_.length_m * motion_.direction, position_m, now_ns);
  }
  return true;
}

void SimPositioner::stop() {
  const std::int64_t now_ns = clock_.now_ns();
  advance(now_ns);
  queued_ = 0;
  if (now_ns >= end_ns(motion_)) {
    return;
  }
  const Along here = along(motion_, now_ns);
  Motion brake;
  brake.from_m = motion_.from_m + here.way_m * motion_.direction;
  brake.direction = motion_.direction;
  brake.top_m_s = here.speed_m_s;
  brake.ramp_s = brake.total_s = here.speed_m_s / params_.acceleration_m_s2;
  brake.length_m = 0.5 * here.speed_m_s * brake.ramp_s;
  brake.start_ns = now_ns;
  motion_ = brake;
}

}  // namespace punctum::sim
