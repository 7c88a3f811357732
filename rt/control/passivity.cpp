#include "rt/control/passivity.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"
#include "rt/control/device_limits.hpp"

namespace punctum::rt {
namespace {

// Of K (T/2 + t_d): the rest makes up for the velocity's lag; more of it would cost a hand over 1 % of its
// work.
constexpr double kCompensation = 1.1;
// As much more of the velocity above the hand's own motion, 10 Hz: a chatter between two counts of the
// encoder is seen late and by half.
constexpr double kFastCompensation = 0.9;
constexpr double kSlow_s = 0.016;
// Of the damping that the device can render: the limit leaves out quantisation and a spring beside it.
constexpr double kDamperShare = 0.5;
// Dissipation counts as long as the slowest oscillation that it may belong to takes for a turn, 10 Hz. Within
// that the stiffness moves to what a longer period allows, a fifth less at most: without a click.
constexpr double kForget_s = 0.1;
// Surplus is remembered over several turns of a handle that swings to and fro between a push and a wall ...
constexpr double kSurplusStays_s = 5;
// ... and over a pause between two motions of a hand that is given nothing.
constexpr double kRest_s = 0.3;
// The damper takes surplus back within a quarter of a turn of the 10 Hz above.
constexpr double kTakeBack_s = 0.02;
// A handle that has rested goes its first step at the end of the time: the force lately acted.
constexpr double kStep_s = 0.002;
// It rises over a few ticks: a step of the damper is a step of the force.
constexpr double kDamperRise_s = 0.002;
// The gain falls more slowly than the damper works, so that it falls only where the damper does not suffice.
constexpr double kLower_s = 0.5;
// The mean period holds some tens of lost ticks, so that each of them moves the stiffness by a percent at
// most.
constexpr double kMeanPeriod_s = 5;
// Samples' periods. A position of this age misses one sample at most and is believed; the force is gone when
// it is twice as old. 3 N for 2 ms, then down by 300 N/s, the limit behind the guard, give a free handle of
// 75 g 0.28 m/s: 3 mJ.
constexpr double kSeen = 2;
constexpr double kBlind = 4;
// Periods: a longer interval is an event of its own, not a rate.
constexpr double kSingleDelay = 8;
// The kept period steps up when its mean exceeds it by more than the mean's own ripple ...
constexpr double kPeriodUp = 1.03;
// ... to this above the mean, so that it rarely steps again: more than the jitter of the ticks (20 %), ...
constexpr double kPeriodReserve = 1.25;
// ... steps back when the mean is so far below that it will not step up at once (kPeriodReserve squared), ...
constexpr double kPeriodDown = 1.6;
// ... and to the nominal one when hardly a tick is late.
constexpr double kOnTime = 1.005;
// Periods, halfway between one and two: the surplus of a longer interval is kept apart until it is taken.
constexpr double kLate = 1.5;
// The velocity is hardly known just after it: the damper aims at half as much again.
constexpr double kLateReserve = 1.5;
// Of kAllowed_J: so much the handle is left; at the other end as much is kept for what is on its way.
constexpr double kUnnoticed = 0.25;
// Of an account: once this much of it is used, the gain falls, so that it is gone only when all is used.
constexpr double kFallsFrom = 0.5;
// Of a damper's bound: within a twentieth it is at the bound, for it comes there as a low-pass does.
constexpr double kAtBound = 0.05;
// A single interval, however long, takes half of the stiffness at most: the next one shows what that was
// worth.
constexpr double kMostLowered = 0.5;
// Rad of lag, 35 degrees: a damper with more of it hardly damps.
constexpr double kPhase = 0.6;
// Poles of the guard's velocity over the fastest oscillation, so that its lag there is within kPhase.
constexpr double kFaster = 2.5;
// Below what a finger feels: the work of such a force within an encoder step is no surplus.
constexpr double kSteadyForce_N = 0.02;

// A sum is finite only where all of its terms are: one test for all of them.
[[nodiscard]] bool finite(const ForceParts& parts, const HandMotion& hand) NONBLOCKING {
  hal::Vec3 vectors = hand.position_m + parts.dissipative_N + parts.active_N;
  for (const StoringForce& s : parts.storing) {
    vectors += s.force_N + s.point_m;
  }
  const double sum = vectors.sum() + parts.stiffness_N_m + parts.damping_Ns_m + parts.stored_J +
                     hand.elapsed_s + hand.between_s + hand.age_s;
  return std::isfinite(sum) && hand.elapsed_s > 0;
}

[[nodiscard]] double square(double x) NONBLOCKING { return x * x; }
[[nodiscard]] double cube(double x) NONBLOCKING { return x * x * x; }

// Where the Kalman filter's poles are, and the jerk that puts them there; velocity.hpp.
[[nodiscard]] double poles_rad_s(const VelocityParams& velocity, double T_s) NONBLOCKING {
  return math::cbrt(velocity.jerk_m_s3_rtHz / velocity.d_m * std::sqrt(12 / T_s));
}

// Up to here the effects' velocity is some 45 degrees behind at most, and damps a spring.
[[nodiscard]] double in_phase_rad_s(const VelocityParams& velocity, double T_s) NONBLOCKING {
  const bool foaw = velocity.method == VelocityParams::Method::foaw;
  const double lag_s = velocity.smooth_s + (foaw ? 0.5 * at_rate(velocity, 1 / T_s).window * T_s
                                                 : 1 / poles_rad_s(velocity, T_s));
  return kPhase / lag_s;
}

// The guard's own velocity follows the fastest oscillation that the passive stiffness allows.
[[nodiscard]] VelocityParams fast_enough(const HandDevice& device, double T_s, double stiffness_N_m)
    NONBLOCKING {
  VelocityParams own;
  own.d_m = std::max(device.encoder_step_m, 1e-6);
  const double wanted_rad_s = kFaster * std::sqrt(stiffness_N_m / device.mass_kg);
  own.jerk_m_s3_rtHz *= std::max(1.0, cube(wanted_rad_s / poles_rad_s(own, T_s)));
  return own;
}

// Moves towards `to` with time constant tau_s. What is there stays there: most gains and accounts, mostly.
template <class T>
void approach(T& x, const T& to, double dt_s, double tau_s) NONBLOCKING {
  if (x != to) {
    x += (to - x) * std::min(1.0, dt_s / tau_s);
  }
}

}  // namespace

double left_of_force(double age_s, double sample_s) NONBLOCKING {
  return std::clamp((kBlind - age_s / sample_s) / (kBlind - kSeen), 0.0, 1.0);
}

PassivityGuard::Period::Period(double nominal_s) NONBLOCKING : nominal_s_(nominal_s),
                                                               mean_s_(nominal_s),
                                                               reserved_s_(nominal_s),
                                                               kept_s_(nominal_s) {
  last_s_.fill(0);
}

void PassivityGuard::Period::follow(double interval_s, double recover_s) NONBLOCKING {
  // A period that is never kept is another period, at once.
  newest_ = (newest_ + 1) % last_s_.size();
  last_s_[newest_] = interval_s;
  const double least_s = *std::min_element(last_s_.begin(), last_s_.end());
  if (least_s > kPeriodReserve * mean_s_) {
    mean_s_ = reserved_s_ = least_s;
    kept_s_ = std::max(kept_s_, least_s);
  }

  const double counted_s = std::min(interval_s, kSingleDelay * mean_s_);
  approach(mean_s_, counted_s, counted_s, kMeanPeriod_s);
  if (mean_s_ < kOnTime * nominal_s_) {
    reserved_s_ = nominal_s_;
  } else if (mean_s_ > kPeriodUp * reserved_s_ || kPeriodDown * mean_s_ < reserved_s_) {
    reserved_s_ = kPeriodReserve * mean_s_;
  }
  approach(kept_s_, reserved_s_, counted_s, reserved_s_ > kept_s_ ? kForget_s : recover_s);
}

PassivityGuard::PassivityGuard(const GuardParams& params, const HandDevice& device,
                               const VelocityParams& velocity, double rate_Hz, double slew_N_s) NONBLOCKING
    : params_(params),
      device_(device),
      T_s_(1 / rate_Hz),
      slew_N_s_(slew_N_s),
      own_(fast_enough(device, T_s_, params.margin* passive_stiffness_N_m(device, T_s_))),
      velocity_(own_, T_s_),
      own_stable_Ns_m_(stable_damping_Ns_m(device, T_s_, own_)),
      stable_Ns_m_(stable_damping_Ns_m(device, T_s_, velocity)),
      in_phase_N_m_(device.mass_kg* square(in_phase_rad_s(velocity, T_s_))),
      tick_(T_s_),
      sample_(T_s_) {}

double PassivityGuard::transport_s() const NONBLOCKING { return device_.delay_ticks * tick_.kept_s(); }

// A position is held for the samples' period and its force comes late by ticks.
PassivityGuard::Input PassivityGuard::input(const ForceParts& parts, const HandMotion& hand) const
    NONBLOCKING {
  const hal::Vec3 stored_N = parts.stored_N();
  const double delay_s = 0.5 * sample_.kept_s() + transport_s();
  return {.parts = parts,
          .hand = hand,
          .stored_N = stored_N,
          .wanted_N = stored_N.norm(),
          .stiffness_N_m = std::max(parts.stiffness_N_m, 0.0),
          .delay_s = delay_s,
          .passive_N_m = params_.margin * device_.damping_Ns_m / delay_s,
          .on_time = T_s_ / sample_.kept_s()};
}

// The time between two samples of a device that keeps its period.
double PassivityGuard::regular_s() const NONBLOCKING { return std::min(sample_.kept_s(), kSlowestSample_s); }

// What a few encoder steps come to.
double PassivityGuard::real_J(const Input& in) const NONBLOCKING {
  return device_.encoder_step_m * (2 * gain_ * in.wanted_N + kSteadyForce_N);
}

void PassivityGuard::lower_gain(const Input& in) NONBLOCKING {
  const double stiffness = in.stiffness_N_m;
  const double passive = in.passive_N_m;
  const double passive_gain = stiffness > passive ? passive / stiffness : 1;
  if (passive_gain < stiff_gain_) {
    stiff_gain_ = passive_gain;
  } else {
    approach(stiff_gain_, passive_gain, in.hand.elapsed_s, params_.recover_s);
  }
  gain_ = std::min(stiff_gain_ * net_gain_, surplus_gain_);
}

void PassivityGuard::forget_interval() NONBLOCKING {
  since_s_ = 0;
  acted_Ns_ = {};
  taken_up_J_ = 0;
}

// What the storing effects took up in the last interval: the trapezoid of their force as rendered, which no
// path or parameter of theirs enters.
void PassivityGuard::observe_tick(const Input& in) NONBLOCKING {
  const auto ago = static_cast<std::size_t>(device_.delay_ticks);
  const Forces& acted = written_[(newest_ + kRing - ago) % kRing];
  acted_Ns_.passive_N += in.hand.elapsed_s * acted.passive_N;
  acted_Ns_.active_N += in.hand.elapsed_s * acted.active_N;
  acted_Ns_.stored_J = acted.stored_J;
  for (std::size_t i = 0; i < in.parts.storing.size(); ++i) {
    const StoringForce& now = in.parts.storing[i];
    const hal::Vec3 force_N = 0.5 * (last_storing_[i].force_N + gain_ * now.force_N);
    taken_up_J_ += force_N.dot(now.point_m - last_storing_[i].point_m);
  }
}

// The work of the written forces between two samples, less what half an encoder step of error at either end
// can pretend: it is surplus where it exceeds what the storing effects took up, and goes to the net account.
void PassivityGuard::observe_sample(const Input& in) NONBLOCKING {
  const hal::Vec3 moved_m = in.hand.position_m - position_m_;
  const hal::Vec3 acted_N = acted_Ns_.passive_N / since_s_;
  const double given_J = acted_N.dot(moved_m);
  const double pretended_J = 0.5 * device_.encoder_step_m * (acted_N - acted_N_).lpNorm<1>();
  const double more_J = given_J - taken_up_J_ - pretended_J;
  const double active_J = acted_Ns_.active_N.dot(moved_m) / since_s_;
  if (surplus_J_ < 0) {
    approach(surplus_J_, 0.0, since_s_, kForget_s);
  }
  acted_N_ = acted_N;
  if (!std::isfinite(more_J) || !std::isfinite(active_J)) {
    return;
  }
  approach(given_J_, 0.0, since_s_, kForget_s);
  given_J_ += given_J;
  surplus_J_ += more_J;
  if (since_s_ > kLate * sample_.kept_s()) {
    late_J_ += kLateReserve * std::max(more_J, 0.0);
  }

  account(in, moved_m, acted_N);

  active_J_ = std::max(0.0, active_J_ + active_J - kActive_W * since_s_);
  active_gain_ = std::clamp((1 - active_J_ / kActive_J) / kFallsFrom, 0.0, 1.0);
}

// The net account. Between two steps of a coordinate the mean force acted on the way between the places where
// it stepped. An encoder that steps by one count after a while is where two counts meet, not in the middle of
// the new one: a handle that trembles about that place goes no way and gets nothing.
void PassivityGuard::account(const Input& in, const hal::Vec3& moved_m, const hal::Vec3& acted_N)
    NONBLOCKING {
  double given_J = 0, given_W = 0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Way& way = way_[static_cast<std::size_t>(i)];
    way.since_s += since_s_;
    ++way.samples;
    approach(way.acted_N, acted_N[i], since_s_, std::min(way.since_s, kStep_s));
    const double step_m = moved_m[i];
    if (step_m == 0) {
      continue;
    }
    const bool by_one = std::abs(step_m) < 1.5 * device_.encoder_step_m;
    const double at_m = in.hand.position_m[i] - (by_one ? 0.5 * step_m * (1 - 1.0 / way.samples) : 0);
    const double work_J = (by_one ? way.acted_N : acted_N[i]) * (at_m - way.at_m);
    given_J += work_J;
    given_W += work_J / way.since_s;
    way = {at_m};
  }
  net_J_ = std::min(net_J_ - given_J, std::max(gain_ * in.parts.stored_J, acted_Ns_.stored_J));
  if (net_J_ < 0) {
    net_J_ = std::min(0.0, net_J_ + kAllowed_W * since_s_);
  }
  // As much again, over hold and delay, is on its way already, and what the force gives as it comes down.
  const double falls_s = written_[newest_].passive_N.norm() / slew_N_s_;
  const double coming_s = sample_.kept_s() + transport_s() + 0.5 * falls_s;
  const double soon_J = net_J_ - std::max(given_W, 0.0) * coming_s;
  const double most = std::clamp((1 - kUnnoticed + soon_J / kAllowed_J) / kFallsFrom, 0.0, 1.0);
  approach(net_gain_, 1.0, since_s_, params_.recover_s);
  // A handle that presses in meets the passive stiffness from where it is: no effect falls away under it.
  const double room_N_m = in.passive_N_m - gain_ * in.stiffness_N_m;
  if (given_J < 0 && room_N_m > 0 && in.wanted_N > 0) {
    net_gain_ += room_N_m * moved_m.norm() / (stiff_gain_ * in.wanted_N);
  }
  net_gain_ = std::min(net_gain_, most);
}

// The guard's own velocity at a new sample, and how fast the handle is braked.
void PassivityGuard::follow_motion(const HandMotion& hand, double between_s) NONBLOCKING {
  const hal::Vec3 before_m_s = v_m_s_;
  v_m_s_ = velocity_.step(hand.position_m, between_s);
  const double speed_m_s = before_m_s.norm();
  braked_m_s2_ = !first_ && speed_m_s > 0
                     ? std::max(0.0, before_m_s.dot(before_m_s - v_m_s_) / (speed_m_s * between_s))
                     : 0;
}

// The damper beside the springs and against surplus, of a new sample. share: of the effects' damping that is
// rendered while nothing brakes the handle: what is left out then, the damper does not make up for.
void PassivityGuard::damp(const Input& in, double share) NONBLOCKING {
  const hal::Vec3& v = v_m_s_;
  const double bound = kDamperShare * in.on_time * own_stable_Ns_m_;
  const double stiffness = gain_ * in.stiffness_N_m;
  const double compensation = std::min(kCompensation * stiffness * in.delay_s, bound);
  const double fast = std::min(kFastCompensation / kCompensation * compensation, bound - compensation);
  const double room = std::max(0.0, bound - share * in.parts.damping_Ns_m - compensation - fast);
  approach(slow_m_s_, v, since_s_, kSlow_s);
  const double speed2 = v.squaredNorm();
  const double to_take_J = std::max(
      {surplus_J_ - kSteadyForce_N * device_.encoder_step_m, late_J_, -net_J_ - kUnnoticed * kAllowed_J});
  const double wanted = to_take_J > 0 && speed2 > 0 ? to_take_J / (kTakeBack_s * speed2) : 0;
  approach(taking_Ns_m_, std::min(wanted, room), since_s_, kDamperRise_s);
  taking_Ns_m_ = std::min(taking_Ns_m_, room);
  late_J_ = std::max(0.0, late_J_ - taking_Ns_m_ * speed2 * since_s_);

  // Where the damper cannot suffice, stiffness falls. A late needle leaves surplus at a handle that rests:
  // the stage has paid for it, and nothing is given back yet.
  const bool at_its_bound = wanted > room && taking_Ns_m_ >= (1 - kAtBound) * (room - kAtBound * bound);
  const double real = real_J(in);
  const bool gives = given_J_ > real;
  if (surplus_J_ > real && at_its_bound && gives) {
    surplus_gain_ *= 1 - std::min(kMostLowered, since_s_ / kLower_s);
  } else {
    approach(surplus_gain_, 1.0, since_s_, params_.recover_s);
  }
  const double stays_s = gives ? kSurplusStays_s : kRest_s;
  if (surplus_J_ > 0) {
    approach(surplus_J_, 0.0, since_s_, stays_s);
  }
  approach(late_J_, 0.0, since_s_, stays_s);

  damper_Ns_m_ = compensation + fast + taking_Ns_m_;
  damper_N_ = -damper_Ns_m_ * v + fast * slow_m_s_;
}

hal::Vec3 PassivityGuard::step(const ForceParts& parts, const HandMotion& hand) NONBLOCKING {
  if (!finite(parts, hand)) {
    asked_ = {};
    return parts.wanted_N();
  }
  if (hand.begins) {
    first_ = true;
    velocity_.restart();
    forget_interval();
  }
  tick_.follow(hand.elapsed_s, params_.recover_s);
  since_s_ += hand.elapsed_s;
  if (hand.fresh) {
    const double between_s = hand.between_s > 0 ? hand.between_s : since_s_;
    sample_.follow(between_s, params_.recover_s);
    gap_ = hand.leaps || between_s > kSeen * regular_s();
    follow_motion(hand, between_s);
  }
  const Input in = input(parts, hand);
  lower_gain(in);
  if (!first_) {
    observe_tick(in);
    if (hand.fresh) {
      observe_sample(in);
    }
  }

  // Effects' damping that the device can render, and that a spring of this stiffness leaves in phase.
  const double rendered = gain_ * in.stiffness_N_m;
  const double in_phase = rendered > in_phase_N_m_ ? square(in_phase_N_m_ / rendered) : 1;
  const double renders = kDamperShare * in.on_time * stable_Ns_m_ * in_phase;
  const double regular = parts.damping_Ns_m > renders ? renders / parts.damping_Ns_m : 1;
  // Of a handle that is braked hard only as much as the limit behind the guard lets go before the handle
  // turns round: what is left of the force then pushes it on.
  const double comes_down_Ns_m = slew_N_s_ / braked_m_s2_;
  const double share =
      regular * parts.damping_Ns_m > comes_down_Ns_m ? comes_down_Ns_m / parts.damping_Ns_m : regular;
  if (hand.fresh) {
    damp(in, regular);
    if (first_) {
      way_ = {Way{hand.position_m.x()}, Way{hand.position_m.y()}, Way{hand.position_m.z()}};
    }
    moved_m_ = first_ ? hal::Vec3::Zero().eval() : hal::Vec3(hand.position_m - position_m_);
    first_ = false;
    position_m_ = hand.position_m;
    forget_interval();
  }

  const double seen = left_of_force(hand.age_s, regular_s());
  const double rendered_gain = seen * gain_;
  // A velocity over a gap is the mean of it, and says little of now. After it, or after a false position, it
  // may be wrong for a while: a handle that has got too much is not pushed the way it goes.
  hal::Vec3 damping_N = gap_ ? hal::Vec3::Zero().eval() : hal::Vec3(share * parts.dissipative_N + damper_N_);
  const double along = damping_N.dot(moved_m_);
  if (net_J_ < -kUnnoticed * kAllowed_J && along > 0) {
    damping_N -= along / moved_m_.squaredNorm() * moved_m_;
  }

  for (std::size_t i = 0; i < parts.storing.size(); ++i) {
    last_storing_[i] = {rendered_gain * parts.storing[i].force_N, parts.storing[i].point_m};
  }
  asked_.passive_N = rendered_gain * in.stored_N + seen * damping_N;
  asked_.active_N = seen * active_gain_ * parts.active_N;
  asked_.stored_J = rendered_gain * parts.stored_J;
  return asked_.passive_N + asked_.active_N;
}

void PassivityGuard::wrote(const hal::Vec3& force_N) NONBLOCKING {
  newest_ = (newest_ + 1) % kRing;
  if (!hal::is_finite(force_N)) {
    written_[newest_] = {};
    return;
  }
  hal::Vec3 active_N = asked_.active_N;
  if (active_N != hal::Vec3::Zero()) {
    // A limit takes the same part of both.
    const double asked_N = (asked_.passive_N + asked_.active_N).norm();
    const double written_N = force_N.norm();
    if (written_N < asked_N) {
      active_N *= written_N / asked_N;
    }
  }
  written_[newest_] = {force_N - active_N, active_N, asked_.stored_J};
}

}  // namespace punctum::rt
