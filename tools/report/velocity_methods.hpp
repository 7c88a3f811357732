// Velocity estimators that the core does not ship, for comparison with those that it does
// (rt/control/velocity.hpp). They get the same samples and treat late ones in the same way.
#pragma once

#include <array>
#include <cmath>

#include "rt/control/velocity.hpp"

namespace punctum::report {

// Finite difference over `stride` intervals.
template <class Real>
class Difference {
 public:
  using Vector = Eigen::Matrix<Real, 3, 1>;
  static constexpr std::size_t kLongest = 64;

  explicit Difference(std::size_t stride = 1) : stride_(stride) {}
  Vector step(const Vector& position_m, Real dt_s) {
    Sample& newest = samples_[count_ % kLongest];
    newest = {position_m, count_ > 0 ? dt_s : 0};
    span_s_ += newest.since_s;
    if (count_ > stride_) {
      span_s_ -= samples_[(count_ - stride_) % kLongest].since_s;
    }
    if (count_ >= stride_) {
      velocity_ = (position_m - samples_[(count_ - stride_) % kLongest].position_m) / span_s_;
    }
    ++count_;
    return velocity_;
  }

 private:
  struct Sample {
    Vector position_m = Vector::Zero();
    Real since_s = 0;
  };
  std::size_t stride_;
  std::size_t count_ = 0;
  Real span_s_ = 0;
  std::array<Sample, kLongest> samples_{};
  Vector velocity_ = Vector::Zero();
};

// First-order low-pass of the finite difference (exponential moving average).
template <class Real>
class Ema {
 public:
  using Vector = Eigen::Matrix<Real, 3, 1>;

  explicit Ema(double cutoff_Hz) : omega_(static_cast<Real>(2 * 3.14159265358979323846 * cutoff_Hz)) {}
  Vector step(const Vector& position_m, Real dt_s) {
    if (begun_) {
      velocity_ += (1 - std::exp(-omega_ * dt_s)) * ((position_m - last_) / dt_s - velocity_);
    }
    begun_ = true;
    last_ = position_m;
    return velocity_;
  }

 private:
  Real omega_;
  bool begun_ = false;
  Vector last_ = Vector::Zero();
  Vector velocity_ = Vector::Zero();
};

// FOAW, followed by a first-order low-pass.
class SmoothedFoaw {
 public:
  SmoothedFoaw(const rt::VelocityParams& params) : foaw_(params), tau_s_(params.smooth_s) {}
  hal::Vec3 step(const hal::Vec3& position_m, double dt_s) {
    const double part = 1 - std::exp(-dt_s / tau_s_);
    velocity_ += part * (foaw_.step(position_m, dt_s) - velocity_);
    return velocity_;
  }

 private:
  rt::Foaw foaw_;
  double tau_s_;
  hal::Vec3 velocity_ = hal::Vec3::Zero();
};

// The Kalman filter of rt/control with its covariance updated in every step, so that it is optimal from the
// first sample on and after late samples.
class CovarianceKalman {
 public:
  explicit CovarianceKalman(const rt::VelocityParams& params)
      : q_(params.jerk_m_s3_rtHz * params.jerk_m_s3_rtHz), r_(params.d_m * params.d_m / 12) {
    P_.diagonal() << r_, 0.01, 10;
  }
  hal::Vec3 step(const hal::Vec3& position_m, double T) {
    if (!begun_) {
      begun_ = true;
      state_.col(0) = position_m;
      return hal::Vec3::Zero();
    }
    const double T2 = T * T, T3 = T2 * T;
    Eigen::Matrix3d F, Q;
    F << 1, T, T2 / 2, 0, 1, T, 0, 0, 1;
    Q << T3 * T2 / 20, T2 * T2 / 8, T3 / 6, T2 * T2 / 8, T3 / 3, T2 / 2, T3 / 6, T2 / 2, T;
    P_ = (F * P_ * F.transpose() + q_ * Q).eval();
    const hal::Vec3 gain = P_.col(0) / (P_(0, 0) + r_);
    P_ = (P_ - gain * P_.row(0)).eval();
    state_ = (state_ * F.transpose()).eval();  // a row per axis
    state_ += ((position_m - state_.col(0)) * gain.transpose()).eval();
    return state_.col(1);
  }

 private:
  double q_, r_;
  bool begun_ = false;
  Eigen::Matrix3d P_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d state_ = Eigen::Matrix3d::Zero();  // column 0 position, 1 velocity, 2 acceleration
};

// The shipped filter with the force at the handle as an input: it knows mass and damping, and only the hand's
// part of the acceleration is estimated. force_N: applied by the device since the last sample.
class ForceKalman {
 public:
  ForceKalman(const rt::VelocityParams& params, double T_s, double mass_kg, double damping_Ns_m)
      : gain_(rt::settled_gains(params, T_s)), per_kg_(1 / mass_kg), damping_Ns_m_(damping_Ns_m) {}
  hal::Vec3 step(const hal::Vec3& position_m, double dt_s, const hal::Vec3& force_N) {
    if (!begun_) {
      begun_ = true;
      position_ = position_m;
      return velocity_;
    }
    const hal::Vec3 a = hand_ + per_kg_ * (force_N - damping_Ns_m_ * velocity_);
    const hal::Vec3 x = position_ + dt_s * (velocity_ + dt_s / 2 * a);
    const hal::Vec3 difference = position_m - x;
    position_ = x + gain_.position * difference;
    velocity_ += dt_s * a + gain_.velocity * difference;
    hand_ += gain_.acceleration * difference;
    return velocity_;
  }

 private:
  rt::KalmanGains gain_;
  double per_kg_, damping_Ns_m_;
  bool begun_ = false;
  hal::Vec3 position_ = hal::Vec3::Zero(), velocity_ = hal::Vec3::Zero();
  hal::Vec3 hand_ = hal::Vec3::Zero();  // acceleration by everything but the device
};

}  // namespace punctum::report
