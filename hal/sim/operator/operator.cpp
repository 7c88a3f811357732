#include "hal/sim/operator/operator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/frames.hpp"
#include "hal/math/elementary.hpp"

namespace punctum::sim {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kVisualDelay_s = 0.2;   // of continuous correction; decisions take reaction_s
constexpr double kCorrection_1_s = 1.5;  // of a seen error; stable: times the delay it is well below pi/2
constexpr double kCorrectionMax_m_s = 20e-6;
constexpr double kLagToSlow_m = 10e-6;  // of the needle behind the wanted tip: the path slows down
constexpr double kLagToWait_m = 18e-6;  // here it stops
constexpr double kRefusedAfter_s = 1.0;
constexpr double kRefusedLag_m = 6e-6;
constexpr double kProgress_m = 0.7e-6;        // smallest advance of the tip that is seen
constexpr double kStandoff_m = 8e-6;          // the approach ends this far before the membrane
constexpr double kWithdrawn_m = 25e-6;        // this far before the membrane the withdrawal ends
constexpr double kHandSpeedMax_m_s = 200e-6;  // of a path, at the needle
constexpr double kAcceleration_s = 0.3;       // from rest to a steady speed
constexpr double kDepthFactor = 1.5;          // depth (z) is judged worse than the sideways position
constexpr double kLineError_rad = 0.015;      // of the intended line against the needle's axis, 1 sigma
constexpr double kGiveUpDepth =
    0.8;  // of the cell's radius: deeper without a puncture, the attempt is given up
constexpr std::uint32_t kAttempts = 5;
constexpr double kFeltLowPass_s = 0.15;  // time constant of felt_offset_m
constexpr double kClutchAt = 0.85;       // of the workspace's half-width
constexpr double kClutchMove_s = 1.0;
constexpr double kButtonPress_s = 0.2;
constexpr double kEnablingHeld_s = 1.0;  // without power for so long: once more
constexpr double kEnablingLetGo_s = 0.05;
constexpr double kResetEvery_s = 2.0;  // while the relay is open
constexpr double kResetFor_s = 0.2;
constexpr double kStroke_m = 60e-6;  // without a cell, at the needle

}  // namespace

double minimum_jerk(double x) NONBLOCKING {
  const double c = std::clamp(x, 0.0, 1.0);
  return c * c * c * (10 + c * (-15 + 6 * c));
}

double minimum_jerk_rate(double x) NONBLOCKING {
  if (x <= 0 || x >= 1) {
    return 0;
  }
  return 30 * x * x * (1 - x) * (1 - x);
}

Tremor::Tremor(std::uint64_t seed, double rms_m, const HandParams& hand, double K, double B) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Noise noise(seed, Noise::Stream::tremor, axis);
    for (std::size_t i = 0; i < Waves::kCount; ++i) {
      Waves& lines = lines_[axis];
      // One frequency in each eighth of the band.
      const double part = (static_cast<double>(i) + noise.uniform(2 * i)) / Waves::kCount;
      lines.omega[i] = kTwoPi * (8 + 4 * part);
      lines.phase[i] = kTwoPi * noise.uniform(2 * i + 1);
      // |(B s + K) / (m s^2 + (B + b) s + K)| at s = j omega: how much of the intention reaches the handle.
      const double w = lines.omega[i];
      const double through = B * w * (B * w) + K * K;
      const double inertia = K - hand.mass_kg * w * w;
      const double loss = (B + hand.damping_Ns_m) * w;
      const double gain = K > 0 || B > 0 ? std::sqrt(through / (inertia * inertia + loss * loss)) : 1.0;
      lines.amplitude[i] = rms_m * std::sqrt(2.0 / Waves::kCount) / gain;
    }
  }
}

Vec3 Tremor::at(double t_s) const NONBLOCKING {
  Vec3 sum = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double x_m : lines_[axis].at(t_s)) {
      sum[static_cast<Eigen::Index>(axis)] += x_m;
    }
  }
  return sum;
}

Operator::Operator(const SimConfig& config)
    : config_(config),
      tremor_(config.seed, config.operator_params.tremor_m, config.hand,
              config.operator_params.arm_stiffness_N_m, config.operator_params.arm_damping_Ns_m),
      aim_(config.seed, Noise::Stream::aim) {
  const Vec3 inward = config.stage.axis.normalized();
  depth_axis_ = Vec3::UnitZ() - inward.z() * inward;
  if (depth_axis_.norm() < 0.1) {
    depth_axis_ = Vec3::UnitX() - inward.x() * inward;
  }
  depth_axis_.normalize();
  sideways_axis_ = depth_axis_.cross(inward);
  const Noise drift(config.seed, Noise::Stream::drift);
  for (std::size_t i = 0; i < 2 * kDrifts; ++i) {
    wander_.omega[i] = kTwoPi * (0.03 + 0.12 * drift.uniform(2 * i));
    wander_.phase[i] = kTwoPi * drift.uniform(2 * i + 1);
    // So that the velocities of the three add up to drift_m_s rms.
    wander_.amplitude[i] = config.operator_params.drift_m_s * std::sqrt(2.0 / 3.0) / wander_.omega[i];
  }
  const Noise tilt(config.seed, Noise::Stream::tilt);
  for (std::size_t i = 0; i < 2; ++i) {
    tilt_mean_rad_[i] = config.operator_params.tilt_rad * tilt.gaussian(i);
    const std::size_t at = 2 * kDrifts + i;
    wander_.omega[at] = kTwoPi * (0.05 + 0.1 * tilt.uniform(100 + i));
    wander_.phase[at] = kTwoPi * tilt.uniform(200 + i);
    wander_.amplitude[at] = 0.15 * config.operator_params.tilt_rad;
  }
  wander_.taken_off = wander_.phase;
  math::sines(wander_.taken_off);
  state_.wanted_tip_m = config.stage.start_m;
  state_.line = inward;
}

// Index of the picture that the operator reacts to: visual delay old.
std::size_t Operator::seen_slot() const NONBLOCKING {
  const double delay = std::min(kVisualDelay_s, config_.operator_params.reaction_s);
  const auto back =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(delay / kLook_s), OperatorState::kLooks - 1);
  const std::uint64_t newest = state_.looks - 1;
  return static_cast<std::size_t>((newest - std::min(newest, back)) % OperatorState::kLooks);
}

Vec3 Operator::direction() const NONBLOCKING {
  switch (state_.activity) {
    case Activity::indent:
      return state_.line;
    case Activity::withdraw:
      return -state_.line.vec();
    default: {
      const Vec3 d = state_.path_to_m.vec() - state_.path_from_m.vec();
      const double size = d.norm();
      return size > 0 ? Vec3(d / size) : state_.line.vec();
    }
  }
}

bool Operator::moving() const NONBLOCKING {
  return state_.activity == Activity::approach || state_.activity == Activity::indent ||
         state_.activity == Activity::push_on || state_.activity == Activity::withdraw ||
         state_.activity == Activity::go_back;
}

bool Operator::refused() const NONBLOCKING {
  return moving() && state_.looks > 0 && state_.stalled_s >= kRefusedAfter_s &&
         state_.error_m[seen_slot()].vec().dot(direction()) > kRefusedLag_m;
}

// Begins an activity: the wanted tip starts where the tip is, and errors of the last activity are forgotten.
void Operator::begin(Activity activity, const OperatorView& view) NONBLOCKING {
  state_.activity = activity;
  state_.activity_s = 0;
  state_.path_s = 0;
  state_.path_T_s = 0;
  state_.path_speed_m_s = 0;
  state_.wanted_tip_m = view.tip_m;
  state_.path_from_m = view.tip_m;
  state_.path_to_m = view.tip_m;
  state_.error_m.fill(Point{});
  state_.tip_m.fill(view.tip_m);
  state_.stalled_s = 0;
  state_.furthest_m = -1e300;
  state_.buttons = 0;
}

void Operator::begin_path(Activity activity, const OperatorView& view, const Vec3& to, double least_s)
    NONBLOCKING {
  begin(activity, view);
  state_.path_to_m = to;
  const double distance = (to - view.tip_m).norm();
  state_.path_T_s = std::max(least_s, 1.875 * distance / kHandSpeedMax_m_s);
}

// The operator's estimate of the line through the cell's centre, with its error.
void Operator::judge(const OperatorView& view) NONBLOCKING {
  const std::uint64_t n = 4 * static_cast<std::uint64_t>(state_.judgements++);
  const double aim = config_.operator_params.aim_error_m;
  const double slant = config_.operator_params.aim_error_m > 0 ? kLineError_rad : 0.0;
  const Vec3 line = view.inward + slant * aim_.gaussian(n) * sideways_axis_ +
                    kDepthFactor * slant * aim_.gaussian(n + 1) * depth_axis_;
  state_.line = Vec3(line.normalized());
  state_.target_m =
      Vec3(view.centre_m - view.R_m * view.inward + aim * aim_.gaussian(n + 2) * sideways_axis_ +
           kDepthFactor * aim * aim_.gaussian(n + 3) * depth_axis_);
}

void Operator::look(const OperatorView& view) NONBLOCKING {
  const auto slot = static_cast<std::size_t>(state_.looks % OperatorState::kLooks);
  state_.error_m[slot] = Vec3(state_.wanted_tip_m.vec() - view.tip_m);
  state_.tip_m[slot] = view.tip_m;
  ++state_.looks;
  const double along = state_.tip_m[seen_slot()].vec().dot(direction());
  if (along > state_.furthest_m + kProgress_m) {
    state_.furthest_m = along;
    state_.stalled_s = 0;
  } else {
    state_.stalled_s += kLook_s;
  }
}

void Operator::after_withdrawal(const OperatorView& view) NONBLOCKING {
  const bool injected = state_.aware_s >= 0;
  if (!injected && ++state_.attempts < kAttempts) {
    begin(Activity::settle, view);
    return;
  }
  if (!injected) {
    ++state_.given_up;
  }
  ++state_.cells_done;
  const bool more = config_.cells == 0 || state_.cells_done < static_cast<std::uint32_t>(config_.cells);
  begin(more ? Activity::next_cell : Activity::rest, view);
}

void Operator::decide(double to_s, const OperatorView& view) NONBLOCKING {
  const OperatorParams& p = config_.operator_params;
  OperatorState& s = state_;
  if (view.cell && view.punctured && s.aware_s < 0) {
    s.aware_s = to_s + p.reaction_s;
    s.puncture_tip_m = view.tip_m;
  }
  const bool saw_puncture = s.aware_s >= 0 && to_s >= s.aware_s;
  switch (s.activity) {
    case Activity::settle:
      if (s.activity_s < (s.attempts == 0 ? 0.5 : 1.0)) {
        break;
      }
      if (!view.cell) {
        begin(Activity::strokes, view);
      } else {
        judge(view);
        begin_path(Activity::approach, view, s.target_m.vec() - kStandoff_m * s.line.vec(), p.approach_s);
      }
      break;
    case Activity::approach:
      if (refused()) {
        begin(Activity::withdraw, view);
      } else if (s.path_s >= s.path_T_s + 0.3) {
        begin(Activity::indent, view);
        s.path_speed_m_s = p.indentation_speed_m_s;
      }
      break;
    case Activity::indent:
      if (saw_puncture) {
        const double beyond = (view.tip_m - s.puncture_tip_m.vec()).dot(s.line.vec());
        const double rest = std::max(0.0, p.depth_m - beyond);
        begin_path(Activity::push_on, view, view.tip_m + rest * s.line.vec(),
                   std::max(0.5, 1.875 * rest / (3 * p.indentation_speed_m_s)));
      } else if (const double depth = (view.tip_m - s.target_m.vec()).dot(s.line.vec());
                 refused() || (s.aware_s < 0 && depth > kGiveUpDepth * view.R_m)) {
        begin(Activity::withdraw, view);
      }
      break;
    case Activity::push_on:
      if (s.path_s >= s.path_T_s + 0.3 || refused()) {
        begin(Activity::inject, view);
      }
      break;
    case Activity::inject:
      s.buttons = s.activity_s >= 0.3 && s.activity_s < 0.3 + p.dwell_s ? hal::kButtonInject : 0U;
      if (s.activity_s >= 0.6 + p.dwell_s) {
        begin(Activity::withdraw, view);
      }
      break;
    case Activity::withdraw:
      s.path_speed_m_s = p.withdrawal_speed_m_s;
      if ((s.target_m.vec() - view.tip_m).dot(s.line.vec()) > kWithdrawn_m) {
        after_withdrawal(view);
      } else if (refused()) {
        begin(Activity::withdraw, view);  // not followed: tries again
      }
      break;
    case Activity::next_cell:
      s.buttons = s.activity_s >= 0.5 && s.activity_s < 0.5 + kButtonPress_s ? hal::kButtonNextCell : 0U;
      if (s.activity_s >= 1.0 + kButtonPress_s) {
        s.attempts = 0;
        s.aware_s = -1;
        begin_path(Activity::go_back, view, config_.stage.start_m, 1.0);
      }
      break;
    case Activity::go_back:
      if (s.path_s >= s.path_T_s || refused()) {
        begin(Activity::settle, view);
      }
      break;
    case Activity::clutch:
    case Activity::rest:
    case Activity::strokes:
      break;
  }
}

// Moves the wanted tip along the path, and the intended hand position with it.
void Operator::follow_path(double dt_s, const OperatorView& view) NONBLOCKING {
  OperatorState& s = state_;
  const Vec3 line = direction();
  const Vec3 error = s.looks > 0 ? s.error_m[seen_slot()].vec() : Vec3::Zero();
  const double lag = error.dot(line);

  Vec3 velocity = Vec3::Zero();
  const bool waits = refused() || (moving() && s.stalled_s >= 0.5 * kRefusedAfter_s && lag > kRefusedLag_m);
  if (moving() && !waits) {
    const double rate = std::clamp((kLagToWait_m - lag) / (kLagToWait_m - kLagToSlow_m), 0.0, 1.0);
    s.path_s += rate * dt_s;
    if (s.path_T_s > 0) {
      const Vec3 span = s.path_to_m.vec() - s.path_from_m.vec();
      velocity = rate * span * (minimum_jerk_rate(s.path_s / s.path_T_s) / s.path_T_s);
    } else {
      const double x = std::min(1.0, s.path_s / kAcceleration_s);
      velocity = rate * s.path_speed_m_s * x * x * (3 - 2 * x) * line;
    }
    s.wanted_tip_m = Vec3(s.wanted_tip_m.vec() + velocity * dt_s);
  }
  // The seen error is corrected: along the line all of it, sideways only what exceeds the error of judgement.
  if (!waits && s.activity != Activity::rest && s.activity != Activity::settle) {
    const Vec3 in = s.line;
    const double along = error.dot(in);
    const Vec3 beside = error - along * in;
    const double size = math::hypot(beside.dot(sideways_axis_), beside.dot(depth_axis_) / kDepthFactor);
    const double tolerated = config_.operator_params.aim_error_m;
    Vec3 correction = along * in;
    if (size > tolerated) {
      correction += beside * (1 - tolerated / size);
    }
    correction *= kCorrection_1_s;
    if (const double speed = correction.norm(); speed > kCorrectionMax_m_s) {
      correction *= kCorrectionMax_m_s / speed;
    }
    velocity += correction;
  }
  Vec3 hand_velocity = config_.position_scale * hand_from_world(velocity);
  // A steady sideways force moves the intended position, not only the arm.
  const Vec3 in_hand = hand_from_world(s.line);
  s.felt_offset_m =
      Vec3(s.felt_offset_m.vec() +
           (view.hand_m - s.arm_target_m.vec() - s.felt_offset_m.vec()) * (dt_s / (kFeltLowPass_s + dt_s)));
  const Vec3 sideways = s.felt_offset_m.vec() - s.felt_offset_m.vec().dot(in_hand) * in_hand;
  hand_velocity += config_.operator_params.give_way_1_s * sideways;
  s.intention_m = Vec3(s.intention_m.vec() + hand_velocity * dt_s);
  maybe_clutch(view, hand_velocity);
}

void Operator::maybe_clutch(const OperatorView& view, const Vec3& hand_velocity) NONBLOCKING {
  const bool inside = state_.activity == Activity::indent || state_.activity == Activity::push_on;
  const double border = config_.hand.workspace_m * (inside ? 0.97 : kClutchAt);
  for (int i = 0; i < 3; ++i) {
    if (std::abs(view.hand_m[i]) > border && view.hand_m[i] * hand_velocity[i] > 0 && moving()) {
      state_.resume = state_.activity;
      state_.activity = Activity::clutch;
      state_.activity_s = 0;
      state_.hand_from_m = state_.intention_m;
      state_.buttons |= hal::kButtonClutch;
      ++state_.clutched;
      return;
    }
  }
}

void Operator::clutch(double dt_s) NONBLOCKING {
  OperatorState& s = state_;
  const double before = minimum_jerk((s.activity_s - dt_s - kButtonPress_s) / kClutchMove_s);
  const double now = minimum_jerk((s.activity_s - kButtonPress_s) / kClutchMove_s);
  s.intention_m = Vec3(s.intention_m.vec() - (now - before) * s.hand_from_m.vec());
  if (s.activity_s < kClutchMove_s + 2 * kButtonPress_s) {
    s.buttons |= hal::kButtonClutch;
  } else {  // the interrupted activity goes on
    s.buttons &= ~hal::kButtonClutch;
    s.activity = s.resume;
    s.activity_s = 0;
    s.error_m.fill(Point{});
    s.stalled_s = 0;
    s.furthest_m = -1e300;
  }
}

// Without a cell: strokes along the needle's axis and back, slightly to the side.
void Operator::strokes(double dt_s) NONBLOCKING {
  OperatorState& s = state_;
  const double reach = std::min(kStroke_m * config_.position_scale, 0.6 * config_.hand.workspace_m);
  const Vec3 to = hand_from_world(reach * s.line.vec() + 0.3 * reach * sideways_axis_);
  const double T = std::max(config_.operator_params.approach_s, 0.2);
  const double cycle = 2 * (T + 0.5);
  const auto place = [&](double t) {
    const double in_cycle = std::fmod(std::max(0.0, t), cycle);
    return in_cycle < T + 0.5 ? minimum_jerk(in_cycle / T) : 1 - minimum_jerk((in_cycle - T - 0.5) / T);
  };
  s.intention_m = Vec3(s.intention_m.vec() + (place(s.activity_s) - place(s.activity_s - dt_s)) * to);
}

// Holds the enabling device; while the drives stay without power, lets it go and presses it anew. A relay
// that has opened needs the reset button first; until the drives have power again nothing else is done, and
// an injection that was broken off begins anew.
void Operator::hold_to_run(double dt_s, const OperatorView& view) NONBLOCKING {
  OperatorState& s = state_;
  const bool held = s.enabling != 0;
  s.enabling_s = held && view.powered ? 0 : s.enabling_s + dt_s;  // how long in vain, or let go
  if (held ? !view.powered && s.enabling_s > kEnablingHeld_s : s.enabling_s > kEnablingLetGo_s) {
    s.enabling = held ? 0U : hal::kButtonEnable;
    s.enabling_s = 0;
  }
  s.relay_open_s = view.relay_open ? s.relay_open_s + dt_s : 0;
  s.reset = std::fmod(s.relay_open_s, kResetEvery_s) > kResetEvery_s - kResetFor_s ? 1U : 0U;
  s.waits = view.relay_open || (s.waits != 0 && !view.powered) ? 1U : 0U;
}

void Operator::step(double from_s, double to_s, const OperatorView& view) NONBLOCKING {
  const double dt_s = to_s - from_s;
  OperatorState& s = state_;
  hold_to_run(dt_s, view);
  if (to_s >= s.next_look_s) {
    look(view);
    s.next_look_s = std::max(s.next_look_s + kLook_s, to_s - kLook_s);
  }
  if (s.waits != 0) {
    s.buttons = 0;
    s.activity_s = s.activity == Activity::inject ? 0 : s.activity_s;
  } else {
    s.activity_s += dt_s;
    decide(to_s, view);
    if (s.activity == Activity::clutch) {
      clutch(dt_s);
    } else if (s.activity == Activity::strokes) {
      strokes(dt_s);
    } else {
      follow_path(dt_s, view);
    }
  }
  const auto wander = wander_.at(to_s);
  std::array<double, 2> drift_m{};
  for (std::size_t i = 0; i < kDrifts; ++i) {
    drift_m[0] += wander[i];
    drift_m[1] += wander[kDrifts + i];
  }
  const Vec3 drift = drift_m[0] * sideways_axis_ + drift_m[1] * depth_axis_;
  const Vec3 shake = tremor_.at(to_s) + config_.position_scale * hand_from_world(drift);
  s.arm_target_m = Vec3(s.intention_m.vec() + shake);
  const double taken_up = -math::expm1(-to_s);
  for (std::size_t i = 0; i < 2; ++i) {
    s.tilt_rad[i] = tilt_mean_rad_[i] * taken_up + wander[2 * kDrifts + i];
  }
}

}  // namespace punctum::sim
