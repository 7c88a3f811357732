#include "hal/sim/stage.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::sim {
namespace {

constexpr double kStandstill_m_s = 1e-6;

Vec3 rounded(const Vec3& v, double step) {
  if (step <= 0) return v;
  return (v / step).array().round().matrix() * step;
}

// `axis`, turned back towards `from` if it leans away by more than `most`.
Vec3 within(const Vec3& axis, const Vec3& from, double most) {
  const double cosine = axis.dot(from);
  if (cosine >= std::cos(most)) return axis;
  const Vec3 across = axis - cosine * from;
  const double size = across.norm();
  if (size <= 0) return from;
  return std::cos(most) * from + std::sin(most) * across / size;
}

}  // namespace

SimStage::SimStage(const StageParams& params, std::uint64_t seed)
    : params_(params), noise_(seed, Noise::Stream::stage_reading) {
  params_.axis.normalize();
  state_.tip_m = params_.start_m;
  state_.set_point_m = params_.start_m;
  state_.axis = params_.axis;
  state_.set_axis = params_.axis;
}

void SimStage::step(std::int64_t t_ns, double dt_s, bool power, Failure failure) noexcept {
  failure_ = failure;
  const bool linked = failure != Failure::freeze && failure != Failure::disconnect;
  const bool powered = power && linked && state_.enable_line != 0;
  const bool drives = powered && state_.quick_stopped == 0;
  if (drives && state_.braking != 0) {  // motion is possible again: from where it stands
    state_.set_point_m = state_.tip_m;
    state_.set_axis = state_.axis;
  }
  state_.powered = powered ? 1 : 0;
  state_.braking = drives ? 0 : 1;
  if (drives) {
    follow(dt_s, params_.velocity_max_m_s * (failure == Failure::saturate ? kSaturatedSpeed : 1.0));
  } else {
    brake(dt_s);
  }
  reader_.push(t_ns, state_, failure);
}

// v' = -brake until it stands.
void SimStage::brake(double dt_s) noexcept {
  const Vec3 v = state_.velocity_m_s;
  const double speed = v.norm();
  if (speed > 0) {
    const double t = std::min(dt_s, speed / params_.brake_m_s2);
    state_.tip_m = state_.tip_m.vec() + v * (t - params_.brake_m_s2 * t * t / (2 * speed));
    const double left = t < dt_s ? 0.0 : speed - params_.brake_m_s2 * t;
    state_.velocity_m_s = Vec3(v * (std::max(0.0, left) / speed));
  }
  state_.set_point_m = state_.tip_m;
  state_.set_axis = state_.axis;
}

// d' = -min(d / lag, speed) along the straight line to the set-point.
void SimStage::follow(double dt_s, double speed_m_s) noexcept {
  const double lag = params_.lag_s;
  const Vec3 to_go = state_.set_point_m.vec() - state_.tip_m.vec();
  const double d = to_go.norm();
  if (d > 0) {
    const double knee = speed_m_s * lag;  // nearer than this it is not limited any more
    const double limited_s = d > knee ? (d - knee) / speed_m_s : 0.0;
    double left = 0;
    if (limited_s >= dt_s) {
      left = d - speed_m_s * dt_s;
    } else if (lag > 0) {
      left = std::min(d, knee) * std::exp(-(dt_s - limited_s) / lag);
    }
    const Vec3 direction = to_go / d;
    state_.tip_m = Vec3(state_.set_point_m.vec() - direction * left);
    state_.velocity_m_s = Vec3(direction * (lag > 0 ? std::min(speed_m_s, left / lag) : 0.0));
  } else {
    state_.velocity_m_s = Point{};
  }
  const double part = lag > 0 ? -std::expm1(-dt_s / lag) : 1.0;
  const Vec3 axis = state_.axis.vec() + part * (state_.set_axis.vec() - state_.axis.vec());
  state_.axis = Vec3(axis.normalized());
}

hal::Status SimStage::read(hal::StageState& out) noexcept {
  StagePlantState s;
  const hal::Status status = reader_.read(s);
  if (status != hal::Status::ok) return status;
  Vec3 tip_m = s.tip_m;
  if (failure_ == Failure::noise) {
    for (int i = 0; i < 3; ++i) {
      const auto n = 3 * static_cast<std::uint64_t>(reader_.newest_ns()) + static_cast<std::uint64_t>(i);
      tip_m[i] += kInterference_steps * params_.resolution_m * noise_.gaussian(n);
    }
  }
  out.tip_m = rounded(tip_m + params_.registration_m, params_.resolution_m);
  out.axis = s.axis;
  out.following_error_m = s.set_point_m.vec() - tip_m;
  if (failure_ == Failure::nan) {
    out.tip_m.setConstant(kNotANumber);
    out.following_error_m.setConstant(kNotANumber);
  }
  out.enabled = s.powered != 0 && s.quick_stopped == 0;
  out.at_standstill = s.velocity_m_s.vec().norm() < kStandstill_m_s;
  return hal::Status::ok;
}

hal::Status SimStage::command(const hal::StageCommand& set_point) noexcept {
  if (!commands_arrive(failure_)) return command_status(failure_);
  if (!set_point.tip_m.allFinite() || !set_point.axis.allFinite()) return hal::Status::fault;
  if (state_.braking != 0) return hal::Status::ok;  // the drive is not in operation: it holds
  const Vec3 in_travel =
      set_point.tip_m.cwiseMax(-params_.travel_m).cwiseMin(params_.travel_m);  // stage frame
  state_.set_point_m = Vec3(rounded(in_travel, params_.resolution_m) - params_.registration_m);
  if (const double size = set_point.axis.norm(); size > 0) {
    state_.set_axis = within(set_point.axis / size, params_.axis, kTiltMax_rad);
  }
  return hal::Status::ok;
}

void SimStage::quick_stop() noexcept {
  if (commands_arrive(failure_) && state_.enable_line != 0) state_.quick_stopped = 1;
}

void SimStage::enable(bool on) noexcept {
  if (!commands_arrive(failure_)) return;
  state_.enable_line = on ? 1 : 0;
  if (!on) state_.quick_stopped = 0;
}

}  // namespace punctum::sim
