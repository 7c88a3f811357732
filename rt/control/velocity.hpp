// Velocity of the hand from its quantised positions. Sample times are the real ones, so a late tick does no
// harm; a position that is not finite, or no time passed, repeats the last velocity.
// In double for the servo, in float for comparison.
#pragma once

#include <array>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

// How the hand's velocity is made of its positions; at the hand.
struct VelocityParams {
  enum class Method : std::uint8_t { kalman, foaw };
  Method method = Method::kalman;
  double d_m = 0.03e-3;       // encoder step
  double jerk_m_s3_rtHz = 5;  // kalman: of the hand, root of its spectral density; more follows faster
  int window = 16;      // foaw: intervals between samples at most, at 1 kHz; grows with the rate, up to 64
  double smooth_s = 0;  // first-order low-pass behind it; 0 = off
};
constexpr auto keys_of(const VelocityParams*) {
  return hal::keys(hal::choice("method", &VelocityParams::method, "kalman", "foaw"),
                   hal::milli("d_mm", &VelocityParams::d_m, 1e-5, 1),
                   hal::real("jerk_m_s3_rtHz", &VelocityParams::jerk_m_s3_rtHz, 0.01, 1000),
                   hal::whole("window", &VelocityParams::window, 2, 64),
                   hal::milli("smooth_ms", &VelocityParams::smooth_s, 0, 100));
}

// The window is meant in time: as many intervals more as the rate is above 1 kHz.
[[nodiscard]] VelocityParams at_rate(VelocityParams params, double rate_Hz) NONBLOCKING;

// What the difference between a sample and its prediction adds: to position (1), velocity (1/s), acceleration
// (1/s^2).
template <class Real>
struct BasicKalmanGains {
  Real position = 1, velocity = 0, acceleration = 0;
};
using KalmanGains = BasicKalmanGains<double>;

// Where the gains of the Kalman filter settle, samples T_s apart: the hand's jerk is white noise of density
// jerk^2, the encoder's rounding noise of variance d^2/12. For start-up: runs the covariance until it stands.
[[nodiscard]] KalmanGains settled_gains(const VelocityParams& params, double T_s) NONBLOCKING;

// Kalman filter of a hand with nearly constant acceleration, at its settled gains: a third-order Butterworth
// filter of omega = (12 jerk^2/(d^2 T))^(1/6) which predicts over the real time between samples and does not
// lag behind constant acceleration. A late sample gets the gains of the same filter sampled that slowly;
// after a gap of kGap_s the mean velocity over it begins anew.
template <class Real>
class BasicKalman {
 public:
  using Vector = Eigen::Matrix<Real, 3, 1>;

  static constexpr Real kGap_s = static_cast<Real>(0.05);

  BasicKalman(const VelocityParams& params, double T_s) NONBLOCKING;

  // A new sample, dt_s after the one before. Returns the velocity, 0 for the first.
  const Vector& step(const Vector& position_m, Real dt_s) NONBLOCKING;
  // The next sample is the first.
  void restart() NONBLOCKING {
    begun_ = false;
    velocity_.setZero();
  }

 private:
  [[nodiscard]] BasicKalmanGains<Real> late_gains(Real dt_s) const NONBLOCKING;

  BasicKalmanGains<Real> settled_;
  Real late_s_;  // an interval longer than this is a late sample
  Real omega_;   // of the Butterworth filter, rad/s
  bool begun_ = false;
  Vector position_ = Vector::Zero();
  Vector velocity_ = Vector::Zero();
  Vector acceleration_ = Vector::Zero();
};

// First-order adaptive windowing, best fit (Janabi-Sharifi 2000). Per axis: the longest window, grown sample
// by sample, whose least-squares slope, drawn as a line through the newest sample, leaves every sample of the
// window within +-d. Slow motion gets a long window (little noise), fast motion a short one (little delay).
template <class Real>
class BasicFoaw {
 public:
  static constexpr int kMaxWindow = 64;
  using Vector = Eigen::Matrix<Real, 3, 1>;

  explicit BasicFoaw(const VelocityParams& params) NONBLOCKING;

  // A new sample, dt_s after the one before. Returns the velocity, 0 for the first.
  Vector step(const Vector& position_m, Real dt_s) NONBLOCKING;
  // The next sample is the first.
  void restart() NONBLOCKING {
    count_ = 0;
    velocity_.setZero();
  }

 private:
  struct Sample {
    Vector position_m = Vector::Zero();
    Real since_s = 0;  // the sample before
  };
  int window_;  // intervals at most
  Real d_m_;
  int newest_ = 0;
  int count_ = 0;
  std::array<Sample, kMaxWindow + 1> samples_{};
  Vector velocity_ = Vector::Zero();
};

extern template class BasicKalman<double>;
extern template class BasicKalman<float>;
extern template class BasicFoaw<double>;
extern template class BasicFoaw<float>;
using Kalman = BasicKalman<double>;
using Foaw = BasicFoaw<double>;

}  // namespace punctum::rt
