#include "rt/control/passivity.hpp"

#include <algorithm>
#include <cmath>

#include "rt/control/device_limits.hpp"

namespace punctum::rt {
namespace {

constexpr double kCompensation = 2;    // of K (T/2 + t_d): half of it may be lost to the velocity's delay
constexpr double kDamperShare = 0.5;   // of the damping that the device can render
constexpr double kForget_s = 0.1;      // dissipation counts this long
constexpr double kSurplusStays_s = 5;  // and surplus this long
constexpr double kRest_s = 0.3;        // or this long while the handle is given nothing
constexpr double kTakeBack_s = 0.02;   // the damper aims to take surplus back within this
constexpr double kDamperRise_s = 0.002;
constexpr double kLower_s = 0.5;     // the gain falls over this while surplus stays
constexpr double kMeanPeriod_s = 5;  // over which the kept period is averaged
constexpr double kSingleDelay = 8;   // periods: a longer one is an event of its own, not a rate
constexpr double kLate = 1.5;        // kept periods: from here on an interval's surplus is kept apart
constexpr double kLateReserve = 1.5;
constexpr double kPeriodUp = 1.03;       // the kept period steps up when its mean exceeds it by this ...
constexpr double kPeriodReserve = 1.25;  // ... to this above the mean, so that it rarely steps again,
constexpr double kPeriodDown = 1.6;      // steps back when the mean is this far below
constexpr double kOnTime = 1.005;        // or the nominal one, to this
constexpr double kPeriodUp_s = 0.1;      // the stiffness that follows from it moves without a click
constexpr double kPhase = 0.6;           // rad
constexpr double kFaster = 2.5;          // poles of the guard's velocity, over the fastest oscillation
constexpr double kSteadyForce_N = 0.02;

[[nodiscard]] bool finite(const GuardInput& in) noexcept {
  bool good = in.position_m.allFinite() && in.dissipative_N.allFinite() && in.active_N.allFinite() &&
              std::isfinite(in.stiffness_N_m) && std::isfinite(in.damping_Ns_m) &&
              std::isfinite(in.elapsed_s) && in.elapsed_s > 0;
  for (const Storing& s : in.storing) good = good && s.force_N.allFinite() && s.point_m.allFinite();
  return good;
}

[[nodiscard]] double square(double x) noexcept { return x * x; }
[[nodiscard]] double cube(double x) noexcept { return x * x * x; }

// Where the Kalman filter's poles are, and the jerk that puts them there; velocity.hpp.
[[nodiscard]] double poles_rad_s(const VelocityParams& velocity, double T_s) noexcept {
  return std::cbrt(velocity.jerk_m_s3_rtHz / velocity.d_m * std::sqrt(12 / T_s));
}

// Up to here the effects' velocity is some 45 degrees behind at most, and damps a spring.
[[nodiscard]] double in_phase_rad_s(const VelocityParams& velocity, double T_s) noexcept {
  const bool foaw = velocity.method == VelocityParams::Method::foaw;
  const double lag_s = velocity.smooth_s + (foaw ? 0.5 * at_rate(velocity, 1 / T_s).window * T_s
                                                 : 1 / poles_rad_s(velocity, T_s));
  return kPhase / lag_s;
}

// The guard's own velocity follows the fastest oscillation that the passive stiffness allows.
[[nodiscard]] VelocityParams fast_enough(const HandDevice& device, double T_s,
                                         double stiffness_N_m) noexcept {
  VelocityParams own;
  own.d_m = std::max(device.encoder_step_m, 1e-6);
  const double wanted_rad_s = kFaster * std::sqrt(stiffness_N_m / device.mass_kg);
  own.jerk_m_s3_rtHz *= std::max(1.0, cube(wanted_rad_s / poles_rad_s(own, T_s)));
  return own;
}

// Moves towards `to` with time constant tau_s.
void approach(double& x, double to, double dt_s, double tau_s) noexcept {
  x += (to - x) * std::min(1.0, dt_s / tau_s);
}

}  // namespace

PassivityGuard::PassivityGuard(const GuardParams& params, const HandDevice& device,
                               const VelocityParams& velocity, double rate_Hz) noexcept
    : params_(params),
      device_(device),
      T_s_(1 / rate_Hz),
      own_(fast_enough(device, T_s_, params.margin * passive_stiffness_N_m(device, T_s_))),
      velocity_(own_, T_s_),
      own_stable_Ns_m_(stable_damping_Ns_m(device, T_s_, own_)),
      stable_Ns_m_(stable_damping_Ns_m(device, T_s_, velocity)),
      in_phase_N_m_(device.mass_kg * square(in_phase_rad_s(velocity, T_s_))),
      reserved_s_(T_s_),
      kept_s_(T_s_),
      mean_s_(T_s_) {
  written_N_.fill(hal::Vec3::Zero());
}

double PassivityGuard::delay_s() const noexcept { return (0.5 + device_.delay_ticks) * kept_s_; }

double PassivityGuard::allowed_stiffness_N_m() const noexcept {
  return params_.margin * passive_stiffness_N_m(device_, kept_s_);
}

// What a few encoder steps come to.
double PassivityGuard::real_J(const GuardInput& in) const noexcept {
  return device_.encoder_step_m * (2 * gain_ * in.stored_N().norm() + kSteadyForce_N);
}

void PassivityGuard::follow_period(double elapsed_s) noexcept {
  const double counted_s = std::min(elapsed_s, kSingleDelay * T_s_);
  approach(mean_s_, counted_s, counted_s, kMeanPeriod_s);
  if (mean_s_ < kOnTime * T_s_) {
    reserved_s_ = T_s_;
  } else if (mean_s_ > kPeriodUp * reserved_s_ || kPeriodDown * mean_s_ < reserved_s_) {
    reserved_s_ = kPeriodReserve * mean_s_;
  }
  approach(kept_s_, reserved_s_, counted_s, reserved_s_ > kept_s_ ? kPeriodUp_s : params_.recover_s);
}

// The exact work of the held force over the last interval, less what the storing effects took up in it (the
// trapezoid of their force as rendered, which no path or parameter of theirs enters), less what half an
// encoder step of error at either end can pretend.
void PassivityGuard::observe(const GuardInput& in) noexcept {
  const auto ago = static_cast<std::size_t>(device_.delay_ticks);
  const hal::Vec3& acted_N = written_N_[(newest_ + kRing - ago) % kRing];
  const double given_J = acted_N.dot(in.position_m - position_m_);
  double more_J = given_J;
  for (std::size_t i = 0; i < in.storing.size(); ++i) {
    const hal::Vec3 force_N = 0.5 * (stored_[i].force_N + gain_ * in.storing[i].force_N);
    more_J -= force_N.dot(in.storing[i].point_m - stored_[i].point_m);
  }
  more_J -= 0.5 * device_.encoder_step_m * (acted_N - acted_N_).lpNorm<1>();
  if (surplus_J_ < 0) approach(surplus_J_, 0, in.elapsed_s, kForget_s);
  acted_N_ = acted_N;
  if (!std::isfinite(more_J)) return;
  approach(given_J_, 0, in.elapsed_s, kForget_s);
  given_J_ += given_J;
  surplus_J_ += more_J;
  if (in.elapsed_s > kLate * kept_s_) late_J_ += kLateReserve * std::max(more_J, 0.0);
}

hal::Vec3 PassivityGuard::step(const GuardInput& in) noexcept {
  active_N_.setZero();
  if (!finite(in)) return in.wanted_N();
  active_N_ = in.active_N;
  follow_period(in.elapsed_s);

  const double stiffness = std::max(in.stiffness_N_m, 0.0);
  const double passive = allowed_stiffness_N_m();
  const double passive_gain = stiffness > passive ? passive / stiffness : 1;
  if (passive_gain < stiff_gain_) {
    stiff_gain_ = passive_gain;
  } else {
    approach(stiff_gain_, passive_gain, in.elapsed_s, params_.recover_s);
  }
  gain_ = std::min(stiff_gain_, surplus_gain_);
  if (!first_) observe(in);

  const hal::Vec3 v = velocity_.step(in.position_m, in.elapsed_s);
  const double rendered = gain_ * stiffness;
  const double reserve = kDamperShare * (T_s_ / kept_s_);

  // Effects' damping that the device can render, and that a spring of this stiffness leaves in phase.
  const double in_phase = rendered > in_phase_N_m_ ? square(in_phase_N_m_ / rendered) : 1;
  const double most = reserve * stable_Ns_m_ * in_phase;
  const double share = in.damping_Ns_m > most ? most / in.damping_Ns_m : 1;

  const double bound = reserve * own_stable_Ns_m_;
  const double compensation = std::min(kCompensation * rendered * delay_s(), bound);
  const double room = std::max(0.0, bound - share * in.damping_Ns_m - compensation);
  const double speed2 = v.squaredNorm();
  const double to_take_J = std::max(surplus_J_ - kSteadyForce_N * device_.encoder_step_m, late_J_);
  const double wanted = to_take_J > 0 && speed2 > 0 ? to_take_J / (kTakeBack_s * speed2) : 0;
  approach(taking_Ns_m_, std::min(wanted, room), in.elapsed_s, kDamperRise_s);
  taking_Ns_m_ = std::min(taking_Ns_m_, room);
  late_J_ = std::max(0.0, late_J_ - taking_Ns_m_ * speed2 * in.elapsed_s);

  // Where the damper cannot suffice, stiffness falls. A late needle leaves surplus at a handle that rests:
  // the stage has paid for it, and nothing is given back yet.
  const bool at_its_bound = wanted > room && taking_Ns_m_ >= 0.95 * (room - 0.05 * bound);
  const bool gives = given_J_ > real_J(in);
  if (surplus_J_ > real_J(in) && at_its_bound && gives) {
    surplus_gain_ *= 1 - std::min(0.5, in.elapsed_s / kLower_s);
  } else {
    approach(surplus_gain_, 1, in.elapsed_s, params_.recover_s);
  }
  const double stays_s = gives ? kSurplusStays_s : kRest_s;
  if (surplus_J_ > 0) approach(surplus_J_, 0, in.elapsed_s, stays_s);
  approach(late_J_, 0, in.elapsed_s, stays_s);

  first_ = false;
  position_m_ = in.position_m;
  stored_ = in.storing;
  for (Storing& s : stored_) s.force_N *= gain_;
  damper_Ns_m_ = compensation + taking_Ns_m_;
  damper_N_ = -damper_Ns_m_ * v;
  return gain_ * in.stored_N() + share * in.dissipative_N + in.active_N + damper_N_;
}

void PassivityGuard::wrote(const hal::Vec3& force_N) noexcept {
  newest_ = (newest_ + 1) % kRing;
  written_N_[newest_] = force_N.allFinite() ? hal::Vec3(force_N - active_N_) : hal::Vec3::Zero();
}

}  // namespace punctum::rt
