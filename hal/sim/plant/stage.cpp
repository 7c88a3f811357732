#include "hal/sim/plant/stage.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::sim {
namespace {

constexpr double kStandstill_m_s = 1e-6;

Vec3 rounded(const Vec3& v, double step) {
  if (step <= 0) {
    return v;
  }
  return (v / step).array().round().matrix() * step;
}

// `axis`, turned back towards `from` if it leans away by more than `most`.
Vec3 within(const Vec3& axis, const Vec3& from, double most) {
  const double cosine = axis.dot(from);
  if (cosine >= math::cos(most)) {
    return axis;
  }
  const Vec3 across = axis - cosine * from;
  const double size = across.norm();
  if (size <= 0) {
    return from;
  }
  return math::cos(most) * from + math::sin(most) * across / size;
}

}  // namespace

SimStage::SimStage(const StageParams& params, std::uint64_t seed)
    : params_(params), noise_(seed, Noise::Stream::stage_reading), liar_(seed, Device::stage) {
  params_.axis.normalize();
  state_.tip_m = params_.start_m;
  state_.set_point_m = params_.start_m;
  state_.axis = params_.axis;
  state_.set_axis = params_.axis;
}

void SimStage::step(std::int64_t t_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING {
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
  } else if (failure == Failure::creep && power &&
             state_.velocity_m_s.vec().norm() <= std::abs(failure.size)) {
    creep(dt_s);
  } else {
    brake(dt_s);
  }
  reader_.push(t_ns, state_, failure);
}

// v' = -brake until it stands.
void SimStage::brake(double dt_s) NONBLOCKING {
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

// Moves on by itself.
void SimStage::creep(double dt_s) NONBLOCKING {
  Vec3 v = Vec3::Zero();
  v[std::min(static_cast<int>(failure_.component), 2)] = failure_.size;
  state_.velocity_m_s = v;
  state_.tip_m = state_.tip_m.vec() + v * dt_s;
  state_.set_point_m = state_.tip_m;
  state_.set_axis = state_.axis;
}

// d' = -min(d / lag, speed) along the straight line to the set-point.
void SimStage::follow(double dt_s, double speed_m_s) NONBLOCKING {
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
      left = std::min(d, knee) * math::exp(-(dt_s - limited_s) / lag);
    }
    const Vec3 direction = to_go / d;
    state_.tip_m = Vec3(state_.set_point_m.vec() - direction * left);
    state_.velocity_m_s = Vec3(direction * (lag > 0 ? std::min(speed_m_s, left / lag) : 0.0));
  } else {
    state_.velocity_m_s = Point{};
  }
  const double part = lag > 0 ? -math::expm1(-dt_s / lag) : 1.0;
  const Vec3 axis = state_.axis.vec() + part * (state_.set_axis.vec() - state_.axis.vec());
  state_.axis = Vec3(axis.normalized());
}

void SimStage::follow_real(const hal::StageState& real, double dt_s) NONBLOCKING {
  const Vec3 tip_m = real.tip_m - params_.registration_m;
  state_.velocity_m_s = dt_s > 0 ? Vec3((tip_m - state_.tip_m.vec()) / dt_s) : Vec3::Zero();
  state_.tip_m = tip_m;
  state_.set_point_m = tip_m;
  state_.axis = real.axis;
  state_.set_axis = real.axis;
  state_.powered = real.enabled ? 1 : 0;
  state_.braking = 1;  // no set-point is known: its motion is taken at constant speed
}

hal::Status SimStage::read(hal::StageState& out) NONBLOCKING {
  Sample<StagePlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::StageState truth;
  const StagePlantState& s = sample.reading;
  Vec3 tip_m = s.tip_m;
  if (failure_ == Failure::noise) {
    for (int i = 0; i < 3; ++i) {
      const auto n = 3 * static_cast<std::uint64_t>(reader_.newest_ns()) + static_cast<std::uint64_t>(i);
      tip_m[i] += kInterference_steps * params_.resolution_m * noise_.gaussian(n);
    }
  }
  truth.tip_m = rounded(tip_m + params_.registration_m, params_.resolution_m);
  truth.axis = s.axis;
  truth.following_error_m = s.set_point_m.vec() - tip_m;
  if (failure_ == Failure::nan) {
    truth.tip_m.setConstant(kNotANumber);
    truth.following_error_m.setConstant(kNotANumber);
  }
  truth.powered = s.powered != 0;
  truth.enabled = truth.powered && s.quick_stopped == 0;
  truth.at_standstill = s.velocity_m_s.vec().norm() < kStandstill_m_s;
  truth.sample_ns = sample.sample_ns;
  return liar_.tell(failure_, truth, out);
}

hal::Status SimStage::command(const hal::StageCommand& set_point) NONBLOCKING {
  if (!commands_arrive(failure_)) {
    return command_status(failure_);
  }
  if (!set_point.tip_m.allFinite() || !set_point.axis.allFinite()) {
    return hal::Status::fault;
  }
  if (state_.braking != 0) {
    return hal::Status::ok;  // the drive is not in operation: it holds
  }
  Vec3 in_travel = set_point.tip_m;  // stage frame
  for (double& x : in_travel) {
    x = std::clamp(x, -params_.travel_m, params_.travel_m);
  }
  state_.set_point_m = Vec3(rounded(in_travel, params_.resolution_m) - params_.registration_m);
  if (const double size = set_point.axis.norm(); size > 0) {
    state_.set_axis = within(set_point.axis / size, params_.axis, kTiltMax_rad);
  }
  return hal::Status::ok;
}

void SimStage::quick_stop() NONBLOCKING {
  if (commands_arrive(failure_) && !ignores(failure_, Channel::quick_stop) && state_.enable_line != 0) {
    state_.quick_stopped = 1;
  }
}

void SimStage::enable(bool on) NONBLOCKING {
  if (!commands_arrive(failure_) || ignores(failure_, on ? Channel::enable : Channel::disable)) {
    return;
  }
  state_.enable_line = on ? 1 : 0;
  if (!on) {
    state_.quick_stopped = 0;
  }
}

}  // namespace punctum::sim
