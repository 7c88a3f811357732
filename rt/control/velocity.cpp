#include "rt/control/velocity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::rt {
namespace {

// A sample exactly one encoder step off is still within d.
template <class Real>
constexpr double kRoundingSlack = sizeof(Real) == sizeof(double) ? 1 + 1e-9 : 1 + 1e-3;

}  // namespace

VelocityParams at_rate(VelocityParams params, double rate_Hz) NONBLOCKING {
  const double intervals = params.window * std::max(rate_Hz / 1000, 1.0);
  params.window = static_cast<int>(std::min(intervals, static_cast<double>(Foaw::kMaxWindow)));
  return params;
}

// P = F P F' + Q with F = [1 T T^2/2; 0 1 T; 0 0 1] and Q of white jerk, then the update by one position; in
// units of d^2/12 and T.
KalmanGains settled_gains(const VelocityParams& params, double T_s) NONBLOCKING {
  constexpr int kSteps = 100'000;
  constexpr double kSettled = 1e-14;
  const double T = T_s;
  const double T2 = T * T;
  const double q =
      12 * params.jerk_m_s3_rtHz * params.jerk_m_s3_rtHz / (params.d_m * params.d_m) * (T2 * T2 * T);
  double p00 = 1, p01 = 0, p02 = 0, p11 = 1, p12 = 0, p22 = 1;
  for (int k = 0; k < kSteps; ++k) {
    const double b11 = p11 + p12;
    const double b12 = p12 + p22;
    const double c00 = p00 + p01 + p02 / 2;
    const double c01 = p01 + p11 + p12 / 2;
    const double c02 = p02 + p12 + p22 / 2;
    const double n00 = c00 + c01 + c02 / 2 + q / 20;
    const double n01 = c01 + c02 + q / 8;
    const double n02 = c02 + q / 6;
    const double n11 = b11 + b12 + q / 3;
    const double n12 = b12 + q / 2;
    const double n22 = p22 + q;
    const double before = p02;
    p00 = n00 / (n00 + 1);
    p01 = n01 / (n00 + 1);
    p02 = n02 / (n00 + 1);
    p11 = n11 - p01 * n01;
    p12 = n12 - p01 * n02;
    p22 = n22 - p02 * n02;
    if (std::abs(p02 - before) <= kSettled * p02) {
      break;
    }
  }
  return {p00, p01 / T, p02 / (T * T)};
}

// ---- Kalman ----

template <class Real>
BasicKalman<Real>::BasicKalman(const VelocityParams& params, double T_s) NONBLOCKING {
  const KalmanGains settled = settled_gains(params, T_s);
  settled_ = {static_cast<Real>(settled.position), static_cast<Real>(settled.velocity),
              static_cast<Real>(settled.acceleration)};
  late_s_ = static_cast<Real>(1.5 * T_s);
  omega_ = static_cast<Real>(-math::log1p(-settled.position) / (2 * T_s));
}

template <class Real>
const typename BasicKalman<Real>::Vector& BasicKalman<Real>::step(const Vector& position_m, Real dt_s)
    NONBLOCKING {
  if (!hal::is_finite(position_m) || (begun_ && !(dt_s > 0))) {
    return velocity_;
  }
  if (!begun_ || dt_s > kGap_s) {
    velocity_ = begun_ ? Vector((position_m - position_) / dt_s) : Vector::Zero();
    acceleration_.setZero();
    position_ = position_m;
    begun_ = true;
    return velocity_;
  }
  const BasicKalmanGains<Real> gain = dt_s <= late_s_ ? settled_ : late_gains(dt_s);
  const Vector a = acceleration_;
  const Vector x = position_ + dt_s * (velocity_ + dt_s / 2 * a);
  const Vector difference = position_m - x;
  position_ = x + gain.position * difference;
  velocity_ += dt_s * a + gain.velocity * difference;
  acceleration_ = a + gain.acceleration * difference;
  return velocity_;
}

// Poles at e^(s dt), s the Butterworth filter's: -omega and omega (-1/2 +- j sqrt(3)/2). With e1, e2, e3 the
// elementary symmetric functions of the poles, the filter's characteristic polynomial asks for these gains.
template <class Real>
BasicKalmanGains<Real> BasicKalman<Real>::late_gains(Real dt_s) const NONBLOCKING {
  const Real theta = omega_ * dt_s;
  const Real p = static_cast<Real>(math::exp(static_cast<double>(-theta / 2)));
  const Real swing =
      static_cast<Real>(math::cos(static_cast<double>(std::numbers::sqrt3_v<Real> / 2 * theta)));
  const Real pair = 2 * p * swing;
  const Real e1 = p * p + pair;
  const Real e2 = p * p * (1 + pair);
  const Real e3 = p * p * p * p;
  const Real acceleration = 1 - e1 + e2 - e3;
  const Real velocity = acceleration * 3 / 2 + e1 - 2 * e2 + 3 * e3;
  return {1 - e3, velocity / dt_s, acceleration / (dt_s * dt_s)};
}

// ---- FOAW ----

template <class Real>
BasicFoaw<Real>::BasicFoaw(const VelocityParams& params) NONBLOCKING
    : window_(std::clamp(params.window, 1, kMaxWindow)),
      d_m_(static_cast<Real>(params.d_m* kRoundingSlack<Real>)) {}

// A line through the newest sample passes sample j within d if its slope lies between (y_j + d)/t_j and
// (y_j - d)/t_j. What the window's samples leave of these bounds is kept while it grows, so one sample more
// costs the same whatever the window.
template <class Real>
typename BasicFoaw<Real>::Vector BasicFoaw<Real>::step(const Vector& position_m, Real dt_s) NONBLOCKING {
  if (!hal::is_finite(position_m) || (count_ > 0 && !(dt_s > 0))) {
    return velocity_;
  }
  constexpr int kRing = kMaxWindow + 1;
  newest_ = newest_ + 1 < kRing ? newest_ + 1 : 0;
  samples_[static_cast<std::size_t>(newest_)] = {position_m, dt_s};
  count_ = std::min(count_ + 1, kRing);
  if (count_ < 2) {
    return velocity_;
  }

  // Times and positions are taken relative to the newest sample.
  constexpr Real kFar = std::numeric_limits<Real>::max();
  std::array<Real, 3> Sy{}, Sty{}, best{};
  std::array<Real, 3> least{-kFar, -kFar, -kFar}, most{kFar, kFar, kFar};
  std::array<bool, 3> grows{true, true, true};
  Real t = 0, St = 0, Stt = 0;
  const int longest = std::min(window_, count_ - 1);
  // At most kMaxWindow rounds.
  for (int n = 1, at = newest_; n <= longest && (grows[0] || grows[1] || grows[2]); ++n) {
    t -= samples_[static_cast<std::size_t>(at)].since_s;
    at = at > 0 ? at - 1 : kRing - 1;
    const Vector& position = samples_[static_cast<std::size_t>(at)].position_m;
    St += t;
    Stt += t * t;
    const Real samples = static_cast<Real>(n + 1);
    const Real per_t = 1 / t;
    const Real per_spread = 1 / (samples * Stt - St * St);
    const Real d_per_t = d_m_ * per_t;  // negative
    for (std::size_t i = 0; i < 3; ++i) {
      const Real y = position[static_cast<Eigen::Index>(i)] - position_m[static_cast<Eigen::Index>(i)];
      Sy[i] += y;
      Sty[i] += t * y;
      const Real slope = (samples * Sty[i] - St * Sy[i]) * per_spread;
      least[i] = std::max(least[i], y * per_t + d_per_t);
      most[i] = std::min(most[i], y * per_t - d_per_t);
      const bool fits = n == 1 || (least[i] <= slope && slope <= most[i]);
      grows[i] = grows[i] && fits;
      best[i] = grows[i] ? slope : best[i];
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    velocity_[static_cast<Eigen::Index>(i)] = best[i];
  }
  return velocity_;
}

template class BasicKalman<double>;
template class BasicKalman<float>;
template class BasicFoaw<double>;
template class BasicFoaw<float>;

}  // namespace punctum::rt
