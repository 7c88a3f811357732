#include "hal/sim/operator.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace punctum::sim {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kVisualDelay_s = 0.2;   // of continuous correction; decisions take reaction_s
constexpr double kCorrection_1_s = 1.5;  // of an error she sees; times the delay well below pi/2
constexpr double kCorrectionMax_m_s = 20e-6;
constexpr double kSlowsAt_m = 10e-6;  // the needle lags this much: she goes slower
constexpr double kWaitsAt_m = 18e-6;  // and here she waits
constexpr double kRefusedAfter_s = 1.0;
constexpr double kRefusedLag_m = 6e-6;
constexpr double kProgress_m = 0.7e-6;        // the least she sees
constexpr double kStandoff_m = 8e-6;          // of the approach's end before the membrane
constexpr double kOut_m = 25e-6;              // withdrawn this far
constexpr double kHandSpeedMax_m_s = 200e-6;  // of a path, at the needle
constexpr double kSpeedUp_s = 0.3;            // to a steady speed
constexpr double kDepthFactor = 1.5;          // she judges depth (z) worse
constexpr double kLineError_rad = 0.015;      // of her idea of the axis, 1 sigma
constexpr double kGiveUpDepth = 0.8;          // of the radius
constexpr std::uint32_t kAttempts = 5;
constexpr double kFeel_s = 0.15;    // low-pass of the force she gives way to
constexpr double kClutchAt = 0.85;  // of the workspace's half-width
constexpr double kClutchMove_s = 1.0;
constexpr double kPress_s = 0.2;
constexpr double kStroke_m = 60e-6;  // without a cell, at the needle

}  // namespace

double minimum_jerk(double x) noexcept {
  const double c = std::clamp(x, 0.0, 1.0);
  return c * c * c * (10 + c * (-15 + 6 * c));
}

double minimum_jerk_rate(double x) noexcept {
  if (x <= 0 || x >= 1) return 0;
  return 30 * x * x * (1 - x) * (1 - x);
}

Tremor::Tremor(std::uint64_t seed, double rms_m, const HandParams& hand, double K, double B) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Noise noise(seed, Noise::Stream::tremor, axis);
    for (std::size_t i = 0; i < kLines; ++i) {
      Line& line = lines_[axis][i];
      // One frequency in each eighth of the band.
      const double part = (static_cast<double>(i) + noise.uniform(2 * i)) / kLines;
      line.omega = kTwoPi * (8 + 4 * part);
      line.phase = kTwoPi * noise.uniform(2 * i + 1);
      const std::complex<double> s(0, line.omega);
      const std::complex<double> arm = (B * s + K) / (hand.mass_kg * s * s + (B + hand.damping_Ns_m) * s + K);
      const double gain = K > 0 || B > 0 ? std::abs(arm) : 1.0;
      line.amplitude_m = rms_m * std::sqrt(2.0 / kLines) / gain;
    }
  }
}

Vec3 Tremor::at(double t_s) const noexcept {
  Vec3 sum = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const Line& line : lines_[axis]) {
      sum[static_cast<Eigen::Index>(axis)] += line.amplitude_m * std::sin(line.omega * t_s + line.phase);
    }
  }
  return sum;
}

Person::Person(const SimConfig& config)
    : config_(config),
      tremor_(config.seed, config.person.tremor_m, config.hand, config.person.arm_stiffness_N_m,
              config.person.arm_damping_Ns_m),
      aim_(config.seed, Noise::Stream::aim) {
  const Vec3 inward = config.stage.axis.normalized();
  deep_ = Vec3::UnitZ() - inward.z() * inward;
  if (deep_.norm() < 0.1) deep_ = Vec3::UnitX() - inward.x() * inward;
  deep_.normalize();
  across_ = deep_.cross(inward);
  const Noise drift(config.seed, Noise::Stream::drift);
  std::uint64_t n = 0;
  for (auto& direction : drift_) {
    for (Wave& w : direction) {
      w.omega = kTwoPi * (0.03 + 0.12 * drift.uniform(n++));
      w.phase = kTwoPi * drift.uniform(n++);
      // So that the velocities of the three add up to drift_m_s rms.
      w.amplitude = config.person.drift_m_s * std::sqrt(2.0 / 3.0) / w.omega;
    }
  }
  const Noise tilt(config.seed, Noise::Stream::tilt);
  for (std::size_t i = 0; i < 2; ++i) {
    tilt_mean_rad_[i] = config.person.tilt_rad * tilt.gaussian(i);
    tilt_[i] = {kTwoPi * (0.05 + 0.1 * tilt.uniform(100 + i)), kTwoPi * tilt.uniform(200 + i),
                0.15 * config.person.tilt_rad};
  }
  state_.wanted_tip_m = config.stage.start_m;
  state_.line = inward;
}

Vec3 Person::drift_at(double t_s) const noexcept {
  std::array<double, 2> d{};
  for (std::size_t i = 0; i < 2; ++i) {
    for (const Wave& w : drift_[i]) {
      d[i] += w.amplitude * (std::sin(w.omega * t_s + w.phase) - std::sin(w.phase));
    }
  }
  return d[0] * across_ + d[1] * deep_;
}

// The picture she is reacting to.
std::size_t Person::seen() const noexcept {
  const double delay = std::min(kVisualDelay_s, config_.person.reaction_s);
  const auto back =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(delay / kLook_s), PersonState::kLooks - 1);
  const std::uint64_t newest = state_.looks - 1;
  return static_cast<std::size_t>((newest - std::min(newest, back)) % PersonState::kLooks);
}

Vec3 Person::way() const noexcept {
  switch (state_.doing) {
    case Doing::indent:
      return state_.line;
    case Doing::withdraw:
      return -state_.line.vec();
    default: {
      const Vec3 d = state_.path_to_m.vec() - state_.path_from_m.vec();
      const double size = d.norm();
      return size > 0 ? Vec3(d / size) : state_.line.vec();
    }
  }
}

bool Person::moving() const noexcept {
  return state_.doing == Doing::approach || state_.doing == Doing::indent || state_.doing == Doing::push_on ||
         state_.doing == Doing::withdraw || state_.doing == Doing::go_back;
}

bool Person::refused() const noexcept {
  return moving() && state_.looks > 0 && state_.still_s >= kRefusedAfter_s &&
         state_.error_m[seen()].vec().dot(way()) > kRefusedLag_m;
}

// Something new: what she wants starts where the tip is, and what went wrong before is forgotten.
void Person::begin(Doing doing, const PersonView& view) noexcept {
  state_.doing = doing;
  state_.doing_s = 0;
  state_.path_s = 0;
  state_.path_T_s = 0;
  state_.path_speed_m_s = 0;
  state_.wanted_tip_m = view.tip_m;
  state_.path_from_m = view.tip_m;
  state_.path_to_m = view.tip_m;
  state_.error_m.fill(Point{});
  state_.tip_m.fill(view.tip_m);
  state_.still_s = 0;
  state_.still_at_m = -1e300;
  state_.buttons = 0;
}

void Person::begin_path(Doing doing, const PersonView& view, const Vec3& to, double least_s) noexcept {
  begin(doing, view);
  state_.path_to_m = to;
  const double distance = (to - view.tip_m).norm();
  state_.path_T_s = std::max(least_s, 1.875 * distance / kHandSpeedMax_m_s);
}

// Where she thinks the axis through the cell's middle runs.
void Person::judge(const PersonView& view) noexcept {
  const std::uint64_t n = 4 * static_cast<std::uint64_t>(state_.judged++);
  const double aim = config_.person.aim_error_m;
  const double slant = config_.person.aim_error_m > 0 ? kLineError_rad : 0.0;
  const Vec3 line =
      view.inward + slant * aim_.gaussian(n) * across_ + kDepthFactor * slant * aim_.gaussian(n + 1) * deep_;
  state_.line = Vec3(line.normalized());
  state_.target_m = Vec3(view.centre_m - view.R_m * view.inward + aim * aim_.gaussian(n + 2) * across_ +
                         kDepthFactor * aim * aim_.gaussian(n + 3) * deep_);
}

void Person::look(const PersonView& view) noexcept {
  const auto slot = static_cast<std::size_t>(state_.looks % PersonState::kLooks);
  state_.error_m[slot] = Vec3(state_.wanted_tip_m.vec() - view.tip_m);
  state_.tip_m[slot] = view.tip_m;
  ++state_.looks;
  const double along = state_.tip_m[seen()].vec().dot(way());
  if (along > state_.still_at_m + kProgress_m) {
    state_.still_at_m = along;
    state_.still_s = 0;
  } else {
    state_.still_s += kLook_s;
  }
}

void Person::after_withdrawal(const PersonView& view) noexcept {
  const bool injected = state_.noticed_s >= 0;
  if (!injected && ++state_.attempts < kAttempts) {
    begin(Doing::settle, view);
    return;
  }
  if (!injected) ++state_.given_up;
  ++state_.cells_done;
  const bool more = config_.cells == 0 || state_.cells_done < static_cast<std::uint32_t>(config_.cells);
  begin(more ? Doing::next_cell : Doing::rest, view);
}

void Person::decide(double to_s, const PersonView& view) noexcept {
  const OperatorParams& p = config_.person;
  PersonState& s = state_;
  if (view.cell && view.punctured && s.noticed_s < 0) {
    s.noticed_s = to_s + p.reaction_s;
    s.puncture_tip_m = view.tip_m;
  }
  const bool saw_puncture = s.noticed_s >= 0 && to_s >= s.noticed_s;
  switch (s.doing) {
    case Doing::settle:
      if (s.doing_s < (s.attempts == 0 ? 0.5 : 1.0)) break;
      if (!view.cell) {
        begin(Doing::strokes, view);
      } else {
        judge(view);
        begin_path(Doing::approach, view, s.target_m.vec() - kStandoff_m * s.line.vec(), p.approach_s);
      }
      break;
    case Doing::approach:
      if (refused()) {
        begin(Doing::withdraw, view);
      } else if (s.path_s >= s.path_T_s + 0.3) {
        begin(Doing::indent, view);
        s.path_speed_m_s = p.indentation_speed_m_s;
      }
      break;
    case Doing::indent:
      if (saw_puncture) {
        const double beyond = (view.tip_m - s.puncture_tip_m.vec()).dot(s.line.vec());
        const double rest = std::max(0.0, p.depth_m - beyond);
        begin_path(Doing::push_on, view, view.tip_m + rest * s.line.vec(),
                   std::max(0.5, 1.875 * rest / (3 * p.indentation_speed_m_s)));
      } else if (const double depth = (view.tip_m - s.target_m.vec()).dot(s.line.vec());
                 refused() || (s.noticed_s < 0 && depth > kGiveUpDepth * view.R_m)) {
        begin(Doing::withdraw, view);
      }
      break;
    case Doing::push_on:
      if (s.path_s >= s.path_T_s + 0.3 || refused()) begin(Doing::inject, view);
      break;
    case Doing::inject:
      s.buttons = s.doing_s >= 0.3 && s.doing_s < 0.3 + p.dwell_s ? hal::kButtonInject : 0U;
      if (s.doing_s >= 0.6 + p.dwell_s) begin(Doing::withdraw, view);
      break;
    case Doing::withdraw:
      s.path_speed_m_s = p.withdrawal_speed_m_s;
      if ((s.target_m.vec() - view.tip_m).dot(s.line.vec()) > kOut_m) {
        after_withdrawal(view);
      } else if (refused()) {
        begin(Doing::withdraw, view);  // tries again
      }
      break;
    case Doing::next_cell:
      s.buttons = s.doing_s >= 0.5 && s.doing_s < 0.5 + kPress_s ? hal::kButtonNextCell : 0U;
      if (s.doing_s >= 1.0 + kPress_s) {
        s.attempts = 0;
        s.noticed_s = -1;
        begin_path(Doing::go_back, view, config_.stage.start_m, 1.0);
      }
      break;
    case Doing::go_back:
      if (s.path_s >= s.path_T_s || refused()) begin(Doing::settle, view);
      break;
    case Doing::clutch:
    case Doing::rest:
    case Doing::strokes:
      break;
  }
}

// She moves what she wants of the tip along the path, and her intention with it.
void Person::lead(double dt_s, const PersonView& view) noexcept {
  PersonState& s = state_;
  const Vec3 line = way();
  const Vec3 error = s.looks > 0 ? s.error_m[seen()].vec() : Vec3::Zero();
  const double lag = error.dot(line);

  Vec3 velocity = Vec3::Zero();
  const bool waits = refused() || (moving() && s.still_s >= 0.5 * kRefusedAfter_s && lag > kRefusedLag_m);
  if (moving() && !waits) {
    const double rate = std::clamp((kWaitsAt_m - lag) / (kWaitsAt_m - kSlowsAt_m), 0.0, 1.0);
    s.path_s += rate * dt_s;
    if (s.path_T_s > 0) {
      const Vec3 span = s.path_to_m.vec() - s.path_from_m.vec();
      velocity = rate * span * (minimum_jerk_rate(s.path_s / s.path_T_s) / s.path_T_s);
    } else {
      const double x = std::min(1.0, s.path_s / kSpeedUp_s);
      velocity = rate * s.path_speed_m_s * x * x * (3 - 2 * x) * line;
    }
    s.wanted_tip_m = Vec3(s.wanted_tip_m.vec() + velocity * dt_s);
  }
  // Correction of what she sees: along the way all of it, across only what is more than she can judge.
  if (!waits && s.doing != Doing::rest && s.doing != Doing::settle) {
    const Vec3 in = s.line;
    const double along = error.dot(in);
    const Vec3 beside = error - along * in;
    const double size = std::hypot(beside.dot(across_), beside.dot(deep_) / kDepthFactor);
    const double tolerated = config_.person.aim_error_m;
    Vec3 correction = along * in;
    if (size > tolerated) correction += beside * (1 - tolerated / size);
    correction *= kCorrection_1_s;
    if (const double speed = correction.norm(); speed > kCorrectionMax_m_s) {
      correction *= kCorrectionMax_m_s / speed;
    }
    velocity += correction;
  }
  Vec3 hand_velocity = config_.position_scale * hand_from_world(velocity);
  // Giving way: a steady sideways force moves her intention, not only her arm.
  const Vec3 in_hand = hand_from_world(s.line);
  s.felt_m =
      Vec3(s.felt_m.vec() + (view.hand_m - s.shaken_m.vec() - s.felt_m.vec()) * (dt_s / (kFeel_s + dt_s)));
  const Vec3 sideways = s.felt_m.vec() - s.felt_m.vec().dot(in_hand) * in_hand;
  hand_velocity += config_.person.give_way_1_s * sideways;
  s.intention_m = Vec3(s.intention_m.vec() + hand_velocity * dt_s);
  maybe_clutch(view, hand_velocity);
}

void Person::maybe_clutch(const PersonView& view, const Vec3& hand_velocity) noexcept {
  const bool inside = state_.doing == Doing::indent || state_.doing == Doing::push_on;
  const double border = config_.hand.workspace_m * (inside ? 0.97 : kClutchAt);
  for (int i = 0; i < 3; ++i) {
    if (std::abs(view.hand_m[i]) > border && view.hand_m[i] * hand_velocity[i] > 0 && moving()) {
      state_.resume = state_.doing;
      state_.doing = Doing::clutch;
      state_.doing_s = 0;
      state_.hand_from_m = state_.intention_m;
      state_.buttons |= hal::kButtonClutch;
      ++state_.clutched;
      return;
    }
  }
}

void Person::clutch(double dt_s) noexcept {
  PersonState& s = state_;
  const double before = minimum_jerk((s.doing_s - dt_s - kPress_s) / kClutchMove_s);
  const double now = minimum_jerk((s.doing_s - kPress_s) / kClutchMove_s);
  s.intention_m = Vec3(s.intention_m.vec() - (now - before) * s.hand_from_m.vec());
  if (s.doing_s < kClutchMove_s + 2 * kPress_s) {
    s.buttons |= hal::kButtonClutch;
  } else {  // goes on where she was
    s.buttons &= ~hal::kButtonClutch;
    s.doing = s.resume;
    s.doing_s = 0;
    s.error_m.fill(Point{});
    s.still_s = 0;
    s.still_at_m = -1e300;
  }
}

// Without a cell: along the needle's axis and back, a little to the side.
void Person::strokes(double dt_s) noexcept {
  PersonState& s = state_;
  const double reach = std::min(kStroke_m * config_.position_scale, 0.6 * config_.hand.workspace_m);
  const Vec3 to = hand_from_world(reach * s.line.vec() + 0.3 * reach * across_);
  const double T = std::max(config_.person.approach_s, 0.2);
  const double cycle = 2 * (T + 0.5);
  const auto place = [&](double t) {
    const double in_cycle = std::fmod(std::max(0.0, t), cycle);
    return in_cycle < T + 0.5 ? minimum_jerk(in_cycle / T) : 1 - minimum_jerk((in_cycle - T - 0.5) / T);
  };
  s.intention_m = Vec3(s.intention_m.vec() + (place(s.doing_s) - place(s.doing_s - dt_s)) * to);
}

void Person::step(double from_s, double to_s, const PersonView& view) noexcept {
  const double dt_s = to_s - from_s;
  PersonState& s = state_;
  s.doing_s += dt_s;
  if (to_s >= s.next_look_s) {
    look(view);
    s.next_look_s = std::max(s.next_look_s + kLook_s, to_s - kLook_s);
  }
  decide(to_s, view);
  if (s.doing == Doing::clutch) {
    clutch(dt_s);
  } else if (s.doing == Doing::strokes) {
    strokes(dt_s);
  } else {
    lead(dt_s, view);
  }
  const Vec3 shake = tremor_.at(to_s) + config_.position_scale * hand_from_world(drift_at(to_s));
  s.shaken_m = Vec3(s.intention_m.vec() + shake);
  for (std::size_t i = 0; i < 2; ++i) {
    s.tilt_rad[i] =
        tilt_mean_rad_[i] * -std::expm1(-to_s) +
        tilt_[i].amplitude * (std::sin(tilt_[i].omega * to_s + tilt_[i].phase) - std::sin(tilt_[i].phase));
  }
}

}  // namespace punctum::sim
