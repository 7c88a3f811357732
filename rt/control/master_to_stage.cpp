#include "rt/control/master_to_stage.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "hal/frames.hpp"
#include "hal/math/elementary.hpp"

namespace punctum::rt {
namespace {

constexpr double kButterworth = std::numbers::sqrt2 / 2;  // damping ratio

// One step of x'' = w^2 (u - x) - 2 zeta w x' by the implicit mid-point rule: stable for every dt.
class LowPass {
 public:
  LowPass(double cutoff_Hz, double dt_s) NONBLOCKING : wt_(2 * std::numbers::pi * cutoff_Hz * dt_s),
                                                       dt_s_(dt_s) {}

  void step(hal::Vec3& x, hal::Vec3& v, const hal::Vec3& u) const NONBLOCKING {
    if (!(wt_ > 0)) {
      x = u;
      v.setZero();
      return;
    }
    const double damp = kButterworth * wt_;
    const double spring = wt_ * wt_ / 4;
    const hal::Vec3 v_next = (v * (1 - damp - spring) + (u - x) * (wt_ * wt_ / dt_s_)) / (1 + damp + spring);
    x += (v + v_next) * (dt_s_ / 2);
    v = v_next;
  }

 private:
  double wt_;
  double dt_s_;
};

// The handle's rotation vector in world axes, without its part along `axis`.
[[nodiscard]] hal::Vec3 tilt_of(const hal::Quat& q, const hal::Vec3& axis) NONBLOCKING {
  const hal::Vec3 vec = q.w() < 0 ? hal::Vec3(-q.vec()) : hal::Vec3(q.vec());
  const double sine = vec.norm();
  if (!(sine > 1e-12)) {
    return hal::Vec3::Zero();
  }
  const double angle = 2 * math::atan2(sine, std::abs(q.w()));
  const hal::Vec3 turn = world_from_hand(vec * (angle / sine));
  return turn - axis.dot(turn) * axis;
}

[[nodiscard]] hal::Vec3 bounded(const hal::Vec3& v, double longest) NONBLOCKING {
  const double length = v.norm();
  return length > longest ? hal::Vec3(v * (longest / length)) : v;
}

// `axis` turned by the rotation vector `tilt`, which stands across it.
[[nodiscard]] hal::Vec3 turned(const hal::Vec3& axis, const hal::Vec3& tilt) NONBLOCKING {
  const double angle = tilt.norm();
  if (!(angle > 1e-12)) {
    return axis;
  }
  const math::SinCos turn = math::sin_cos(angle);
  return (turn.cos * axis + turn.sin / angle * tilt.cross(axis)).normalized();
}

}  // namespace

void MasterToStage::anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis)
    NONBLOCKING {
  if (!anchored_) {
    base_axis_ = axis;
    handle_ = hal::Quat::Identity();
    handle_tilt_rad_.setZero();
  }
  tilt_stands_ = false;
  turned_by_rad_.setConstant(std::numeric_limits<double>::quiet_NaN());
  anchored_ = true;
  anchor_hand_m_ = hand.position_m;
  anchor_tip_m_ = tip_m;
  hand_point_m_ = tip_m;
  set_point_ = {tip_m, axis};
  filter_velocity_m_s_.setZero();

  // The tilt that the needle has now.
  const hal::Vec3 across = base_axis_.cross(axis);
  const double sine = across.norm();
  tilt_rad_ = sine > 1e-12 ? hal::Vec3(across * (math::atan2(sine, base_axis_.dot(axis)) / sine))
                           : hal::Vec3(hal::Vec3::Zero());
  tilt_wanted_rad_ = tilt_rad_;
  tilt_velocity_rad_s_.setZero();
  if (has_tilted_) {
    tilt_anchor_rad_ = tilt_rad_ - tilt_of(hand.orientation, base_axis_);
  }
}

void MasterToStage::step(const hal::HandState& hand, bool coupled, bool tilting) NONBLOCKING {
  if (!coupled) {
    anchor_hand_m_ = hand.position_m;
    anchor_tip_m_ = hand_point_m_;
  }
  hand_point_m_ = anchor_tip_m_ + world_from_hand(hand.position_m - anchor_hand_m_) / params_.position_scale;

  if (!(params_.max_tilt_rad > 0)) {
    return;
  }
  tilts_ = coupled && tilting;
  if (tilts_) {
    if (tilt_stands_) {
      tilt_anchor_rad_ = tilt_wanted_rad_ - handle_tilt_rad(stood_at_);
    }
    has_tilted_ = true;
    tilt_stands_ = false;
    tilt_wanted_rad_ = bounded(handle_tilt_rad(hand.orientation) + tilt_anchor_rad_, params_.max_tilt_rad);
  } else {
    tilt_wanted_rad_ = tilt_rad_;
    tilt_velocity_rad_s_.setZero();
    tilt_stands_ = has_tilted_;
    stood_at_ = hand.orientation;
  }
}

const hal::Vec3& MasterToStage::handle_tilt_rad(const hal::Quat& handle) NONBLOCKING {
  if (handle.coeffs() != handle_.coeffs()) {
    handle_ = handle;
    handle_tilt_rad_ = tilt_of(handle_, base_axis_);
  }
  return handle_tilt_rad_;
}

void MasterToStage::slip(const hal::Vec3& to) NONBLOCKING {
  anchor_tip_m_ += to - hand_point_m_;
  hand_point_m_ = to;
}

double MasterToStage::lag_s() const NONBLOCKING {
  const double cutoff_Hz = params_.tremor_cutoff_Hz;
  return cutoff_Hz > 0 ? 2 * kButterworth / (2 * std::numbers::pi * cutoff_Hz) : 0;
}

const hal::StageCommand& MasterToStage::filter(double dt_s) NONBLOCKING {
  if (!(dt_s > 0)) {
    return set_point_;
  }
  const LowPass low_pass(params_.tremor_cutoff_Hz, dt_s);
  low_pass.step(set_point_.tip_m, filter_velocity_m_s_, hand_point_m_);
  if (params_.max_tilt_rad > 0) {
    if (tilts_) {
      low_pass.step(tilt_rad_, tilt_velocity_rad_s_, tilt_wanted_rad_);
    }
    tilt_rad_ = bounded(tilt_rad_, params_.max_tilt_rad);
    if (tilt_rad_ != turned_by_rad_) {
      turned_by_rad_ = tilt_rad_;
      set_point_.axis = turned(base_axis_, tilt_rad_);
    }
  }
  return set_point_;
}

}  // namespace punctum::rt
