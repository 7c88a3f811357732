#include "tools/report/closed_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "hal/sim/plant/hand.hpp"
#include "rt/control/device_limits.hpp"
#include "rt/control/passivity.hpp"
#include "rt/control/velocity.hpp"
#include "rt/forces/membrane.hpp"

namespace punctum::report {
namespace {

constexpr double kFrom_m = 5e-3;
constexpr double kLongest_s = 40;
constexpr double kSmallest_m = 0.1e-3;
constexpr double kEnergyPart = 0.05;
constexpr int kRing = 8;
constexpr double kRecovers_s = 6;                                   // three times GuardParams::recover_s
constexpr double kMoves_s = 5;                                      // a wall that moves does so for so long
constexpr double kReach_s = 0.2, kReach_m = 7e-3, kSwing_m = 8e-3;  // of what holds the handle then
constexpr double kStops_s = 0.5;                                    // and comes to a stand within this

// The effect against which the handle is pushed; x > 0 is inside.
class Wall {
 public:
  explicit Wall(const LoopCell& cell) : K_(cell.stiffness_N_m) {
    if (cell.membrane_E_Pa <= 0) {
      return;
    }
    rt::MembraneParams params;
    params.E_Pa = cell.membrane_E_Pa;
    R_m_ = params.R_m;
    membrane_.emplace(params);
  }
  struct At {
    double force_N = 0;  // at the hand
    double stiffness_N_m = 0;
    double energy_J = 0;
  };
  [[nodiscard]] At at(double x_m) const {
    if (x_m <= 0) {
      return {};
    }
    if (!membrane_) {
      return {-K_ * x_m, K_, 0.5 * K_ * x_m * x_m};
    }
    const auto s = membrane_->at(x_m / scale_.position_scale, R_m_, 1);
    const double k_f = scale_.force_scale;
    return {-k_f * s.force_N, k_f / scale_.position_scale * s.stiffness_N_m,
            k_f * scale_.position_scale * s.energy_J};
  }

 private:
  double K_;
  mutable std::optional<rt::MembraneLaw> membrane_;  // remembers
  double R_m_ = 0;
  rt::MappingParams scale_;
};

// What a wall that moves does at a time: where it is, and the part of its force that is there.
class Motion {
 public:
  explicit Motion(const LoopCell& cell) : cell_(cell), random_(cell.seed) {}

  struct At {
    double part = 1;
    double shift_m = 0;
  };
  At at(double t_s) {
    const double whole = std::clamp((kMoves_s + kStops_s - t_s) / kStops_s, 0.0, 1.0);
    const double swing = std::sin(2 * std::numbers::pi * cell_.frequency_Hz * t_s);
    switch (cell_.motion) {
      case WallMotion::still:
        break;
      case WallMotion::modulated:
        return {1 + whole * cell_.depth * swing, 0};
      case WallMotion::moving:
        return {1, whole * cell_.travel_m * swing};
      case WallMotion::corrected: {
        constexpr double kBetween_s = 0.12, kWithin_s = 0.03;
        if (t_s >= next_s_) {
          next_s_ += kBetween_s;
          from_m_ = to_m_;
          to_m_ = cell_.travel_m * std::uniform_real_distribution<double>(-1, 1)(random_);
        }
        const double done = std::min(1.0, 1 - (next_s_ - kBetween_s + kWithin_s - t_s) / kWithin_s);
        return {1, whole * (from_m_ + done * (to_m_ - from_m_))};
      }
      case WallMotion::switched: {
        constexpr double kRamp_s = 0.05;
        const double half_s = 0.5 / cell_.frequency_Hz;
        const double in_half_s = std::fmod(t_s, half_s);
        const double ramp = std::min(1.0, in_half_s / std::min(kRamp_s, half_s));
        const bool comes = std::fmod(t_s, 2 * half_s) < half_s;
        return {1 - whole * (comes ? 1 - ramp : ramp), 0};
      }
    }
    return {};
  }

 private:
  const LoopCell& cell_;
  std::mt19937_64 random_;
  double next_s_ = 0, from_m_ = 0, to_m_ = 0;
};

class Velocity {
 public:
  Velocity(const rt::VelocityParams& params, double rate_Hz) {
    if (params.method == rt::VelocityParams::Method::kalman) {
      kalman_.emplace(params, 1 / rate_Hz);
    } else {
      foaw_.emplace(rt::at_rate(params, rate_Hz));
    }
  }
  double step(double x_m, double dt_s) {
    const hal::Vec3 x(x_m, 0, 0);
    return kalman_ ? kalman_->step(x, dt_s).x() : foaw_->step(x, dt_s).x();
  }

 private:
  std::optional<rt::Kalman> kalman_;
  std::optional<rt::Foaw> foaw_;
};

class Ticks {
 public:
  Ticks(Timing timing, double T_s, std::uint64_t seed) : timing_(timing), T_s_(T_s), random_(seed) {}
  double next(double t_s) {
    switch (timing_) {
      case Timing::steady:
        break;
      case Timing::jitter:
        return T_s_ * (1 + 0.4 * (part() - 0.5));
      case Timing::lost_ticks:
        if (part() < 0.01) {
          return T_s_ * std::floor(2 + 4 * part());
        }
        break;
      case Timing::late_tick:
        if (t_s > 1 && !late_) {
          late_ = true;
          return 21 * T_s_;
        }
        break;
    }
    return T_s_;
  }

 private:
  double part() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Timing timing_;
  double T_s_;
  std::mt19937_64 random_;
  bool late_ = false;
};

// The effect of a wall that has moved.
Wall::At effect_at(const Wall& still, const Motion::At& moved, double x_m) {
  Wall::At a = still.at(x_m - moved.shift_m);
  a.force_N *= moved.part;
  a.stiffness_N_m *= moved.part;
  a.energy_J *= moved.part;
  return a;
}

// The part of the effect that acts, where the written force is limited in its rate: it is still there when
// the gain has fallen already, and what the handle has put into it comes back until it has come down.
double acting_part(const Wall::At& effect, double gain, double written_N) {
  return effect.force_N < 0 ? std::max(gain, std::min(1.0, written_N / effect.force_N)) : gain;
}

// What an effect can give back through an amplifier that saturates: the work of its force over the way out.
double returnable_J(const Wall& wall, const Motion::At& moved, double x_m, double gain, double force_max_N) {
  const Wall::At effect = wall.at(x_m - moved.shift_m);
  const double part = gain * moved.part;
  if (part * std::abs(effect.force_N) <= force_max_N) {
    return part * effect.energy_J;
  }
  double saturated_m = 0, free_m = x_m - moved.shift_m;  // between them the force saturates
  for (int i = 0; i < 30; ++i) {
    const double middle_m = 0.5 * (saturated_m + free_m);
    (part * std::abs(wall.at(middle_m).force_N) > force_max_N ? free_m : saturated_m) = middle_m;
  }
  return part * wall.at(saturated_m).energy_J + force_max_N * (x_m - moved.shift_m - saturated_m);
}

// What follows from a cell before its first tick.
struct Setting {
  Setting(const LoopCell& cell, const Wall& still) : T_s(1 / cell.rate_Hz) {
    estimate.d_m = std::max(cell.device.encoder_step_m, 1e-6);
    damping_Ns_m = cell.damping_share * rt::stable_damping_Ns_m(cell.device, T_s, estimate);
    moves = cell.motion != WallMotion::still;
    const double delay_s = T_s * (0.5 * cell.ticks_per_sample + cell.device.delay_ticks);
    passive_N_m = cell.device.damping_Ns_m / delay_s;
    const double soft_N_m = std::min(still.at(1e-3).stiffness_N_m, 0.9 * passive_N_m);
    push_N =
        moves || cell.holder == Holder::arm ? 0 : cell.coulomb_N + std::min(cell.push_N, 0.01 * soft_N_m);
    enough_m = std::max(4 * cell.device.encoder_step_m, kSmallest_m);
    moves_s = moves ? kMoves_s + kStops_s : 0;
    const double settles_s =
        cell.holder == Holder::nobody ? 24 * cell.device.mass_kg / cell.device.damping_Ns_m : 14;
    longest_s = moves_s + (cell.holder == Holder::arm
                               ? 12
                               : std::min(kLongest_s, std::max(settles_s, 8 + 6 * damping_Ns_m / soft_N_m)));
  }

  double T_s;
  rt::VelocityParams estimate;
  double damping_Ns_m = 0;  // rendered beside the wall
  bool moves = false;       // the wall does
  double passive_N_m = 0;
  double push_N = 0;
  double enough_m = 0;  // a swing that is more than this is a motion
  double moves_s = 0;   // until the wall stands still
  double longest_s = 0;
};

// The handle, and the hand that pushes it into the wall or swings it there.
class HeldHandle {
 public:
  HeldHandle(const LoopCell& cell, const Setting& setting)
      : cell_(cell), setting_(setting), handle_{-kFrom_m, cell.speed_m_s} {
    hand_.mass_kg = cell.device.mass_kg;
    hand_.damping_Ns_m = cell.device.damping_Ns_m;
    hand_.coulomb_N = cell.coulomb_N;
    if (cell.holder == Holder::fingertip) {
      arm_.damping_Ns_m = 1;
    }
    if (cell.holder == Holder::arm) {
      arm_ = {250, 6};
    }
    if (setting.moves && cell.holder != Holder::arm) {
      arm_.stiffness_N_m = cell.holder == Holder::nobody ? 10 : 50;
    }
  }

  [[nodiscard]] double x_m() const { return handle_.x_m; }
  void step(double t_s, double dt_s, double applied_N) {
    const double to_m = reaches_m(t_s, dt_s);
    const double pace_m_s = (to_m - intention_m_) / dt_s;
    sim::advance(handle_, hand_, arm_, applied_N + setting_.push_N, intention_m_, pace_m_s, dt_s);
    intention_m_ = to_m;
  }

 private:
  [[nodiscard]] double reaches_m(double t_s, double dt_s) const {
    if (setting_.moves) {  // to and fro about a place in the wall
      const double omega = std::numbers::pi * std::min(cell_.frequency_Hz, 4.0);
      const double pace_m_s = (t_s < kReach_s ? kReach_m / kReach_s : 0) +
                              (t_s < setting_.moves_s ? kSwing_m * omega * std::cos(omega * t_s) : 0);
      return intention_m_ + pace_m_s * dt_s;
    }
    return cell_.holder == Holder::arm ? std::min(intention_m_ + 0.05 * dt_s, 0.02) : intention_m_;
  }

  const LoopCell& cell_;
  const Setting& setting_;
  sim::HandParams hand_;
  sim::ArmImpedance arm_;
  sim::HandAxis handle_;
  double intention_m_ = -kFrom_m;
};

// The device's position sensor: its step, and a new value on one tick of so many.
class Sensed {
 public:
  Sensed(const LoopCell& cell, const Setting& setting)
      : cell_(cell), velocity_(setting.estimate, cell.rate_Hz) {}
  // Whether this tick has a new value.
  bool tick(std::int64_t n, double handle_m, double dt_s) {
    between_s_ += dt_s;
    if (n % cell_.ticks_per_sample != 0) {
      return false;
    }
    const double step_m = cell_.device.encoder_step_m;
    x_m = step_m > 0 ? step_m * std::round(handle_m / step_m) : handle_m;
    v_m_s = velocity_.step(x_m, between_s_);
    between_s_ = 0;
    return true;
  }
  double x_m = 0, v_m_s = 0;

 private:
  const LoopCell& cell_;
  Velocity velocity_;
  double between_s_ = 0;
};

// The device's amplifier: it limits the force and its slew, and the force acts some ticks later.
class Amplifier {
 public:
  explicit Amplifier(const LoopCell& cell) : cell_(cell) {}
  // What of a force is written.
  double limit(double force_N, double dt_s) {
    force_N = std::clamp(force_N, -cell_.device.force_max_N, cell_.device.force_max_N);
    if (cell_.slew_N_s > 0) {
      force_N = std::clamp(force_N, written_N_ - cell_.slew_N_s * dt_s, written_N_ + cell_.slew_N_s * dt_s);
    }
    written_N_ = force_N;
    return force_N;
  }
  [[nodiscard]] double written_N() const { return written_N_; }
  // Of the force that was written in tick n, and those before it: what acts.
  double acting_N(std::int64_t n) {
    commands_[static_cast<std::size_t>(n % kRing)] = written_N_;
    const std::int64_t acting = n - cell_.device.delay_ticks;
    return acting >= 0 ? commands_[static_cast<std::size_t>(acting % kRing)] : 0;
  }

 private:
  const LoopCell& cell_;
  double written_N_ = 0;
  std::array<double, kRing> commands_{};
};

// The passivity guard in the loop, and what is told of it. Without one, effect and damping as they are.
class Guarded {
 public:
  Guarded(const LoopCell& cell, const Setting& setting) : B_(setting.damping_Ns_m) {
    if (cell.guarded) {
      const double slew_N_s = cell.slew_N_s > 0 ? cell.slew_N_s : std::numeric_limits<double>::infinity();
      guard_.emplace(rt::GuardParams{}, cell.device, setting.estimate, cell.rate_Hz, slew_N_s);
    }
  }
  double force_N(const Wall::At& effect, const Sensed& sensed, bool fresh, double t_s, double dt_s,
                 LoopResult& r) {
    if (!guard_) {
      return effect.force_N - B_ * sensed.v_m_s;
    }
    rt::GuardInput in;
    in.position_m = {sensed.x_m, 0, 0};
    in.storing[0] = {{effect.force_N, 0, 0}, {sensed.x_m, 0, 0}};
    in.dissipative_N = {-B_ * sensed.v_m_s, 0, 0};
    in.stiffness_N_m = effect.stiffness_N_m;
    in.damping_Ns_m = B_;
    in.stored_J = effect.energy_J;
    in.elapsed_s = dt_s;
    in.fresh = fresh;
    const double force_N = guard_->step(in).x();
    r.least_gain = std::min(r.least_gain, guard_->gain());
    owed_from_s_ =
        guard_->net_J() < -0.25 * rt::PassivityGuard::kAllowed_J ? t_s + kRecovers_s : owed_from_s_;
    r.damper_Ns_m = std::max(r.damper_Ns_m, guard_->damper_Ns_m());
    noise_N2_ += guard_->damper_N().squaredNorm();
    ++noise_ticks_;
    return force_N;
  }
  void wrote(double force_N) {
    if (guard_) {
      guard_->wrote({force_N, 0, 0});
    }
  }
  [[nodiscard]] double gain() const { return guard_ ? guard_->gain() : 1; }
  [[nodiscard]] bool owes(double t_s) const { return t_s > owed_from_s_; }
  // Rms force of its damper since the last call.
  double take_rest_N() {
    const double rest_N = noise_ticks_ > 0 ? std::sqrt(noise_N2_ / static_cast<double>(noise_ticks_)) : 0;
    noise_N2_ = 0;
    noise_ticks_ = 0;
    return rest_N;
  }

 private:
  double B_;
  std::optional<rt::PassivityGuard> guard_;
  double owed_from_s_ = 0;
  double noise_N2_ = 0;
  std::int64_t noise_ticks_ = 0;
};

// The energy that has come out of the port, and the part of it that the effect still stores.
struct PortEnergy {
  // One tick's work; then what is stored, and the energy of the whole effect at the same place.
  void tick(double work_J, double stored, double effect_J, double gain, double t_s) {
    port_J += work_J;
    most_tick_J = std::max(most_tick_J, work_J);
    stored_J = stored;
    stored_max_J = std::max(stored_max_J, stored);
    const double beyond_J = port_J - rt::PassivityGuard::kAllowed_W * t_s;
    lowest_J_ = std::min(lowest_J_, beyond_J + stored);
    net_J = std::max(net_J, beyond_J - lowest_J_);
    raised_J += std::max(0.0, gain - gain_before_) * effect_J;
    gain_before_ = gain;
  }
  double port_J = 0, stored_J = 0, stored_max_J = 0, net_J = 0;
  double raised_J = 0;  // stored by a stiffness that came back
  double most_tick_J = 0;

 private:
  double lowest_J_ = 0;
  double gain_before_ = 1;
};

// How far the handle swings in every second, and whether it has come to rest.
class Swings {
 public:
  Swings(const LoopCell& cell, const Setting& setting, double x_m)
      : cell_(cell), setting_(setting), low_m_(x_m), high_m_(x_m), began_m_(x_m) {}
  // True at the end of a second.
  bool tick(double t_s, double x_m, double port_J) {
    low_m_ = std::min(low_m_, x_m);
    high_m_ = std::max(high_m_, x_m);
    if (t_s - second_s_ < 1) {
      return false;
    }
    // What a wall brought up under the handle may not push out at once creeps out: that is no swing.
    swings_m_.push_back(high_m_ - low_m_ - (setting_.moves ? std::abs(x_m - began_m_) : 0));
    if (high_m_ - low_m_ > setting_.enough_m) {
      counted_J_ += port_J - port_before_J_;
    }
    port_before_J_ = port_J;
    second_s_ = t_s;
    low_m_ = high_m_ = began_m_ = x_m;
    return true;
  }
  // After a second: at rest, or in a swing that lasts.
  [[nodiscard]] bool decided(double t_s) const {
    const std::size_t n = swings_m_.size();
    const double enough_m = setting_.enough_m;
    if (t_s > setting_.moves_s + 4 && swings_m_[n - 1] < 0.3 * enough_m && swings_m_[n - 2] < enough_m) {
      return true;
    }
    return !cell_.guarded && t_s > setting_.moves_s + 6 && swings_m_[n - 1] > 5 * enough_m &&
           swings_m_[n - 1] > 0.98 * swings_m_[n - 3];
  }
  [[nodiscard]] double last_m() const {
    return swings_m_.empty() ? std::numeric_limits<double>::infinity() : swings_m_.back();
  }
  [[nodiscard]] double counted_J() const { return counted_J_; }  // over the seconds with a motion

 private:
  const LoopCell& cell_;
  const Setting& setting_;
  double low_m_, high_m_, began_m_;
  double second_s_ = 0;
  double counted_J_ = 0, port_before_J_ = 0;
  std::vector<double> swings_m_;
};

void judge(const LoopCell& cell, const Setting& setting, const PortEnergy& energy, const Swings& swings,
           LoopResult& r) {
  r.peak_to_peak_m = swings.last_m();
  r.moving = !(r.peak_to_peak_m <= setting.enough_m);
  r.stored_max_J = energy.stored_max_J;
  r.net_J = energy.net_J;
  r.surplus_J = swings.counted_J() + energy.stored_J;
  const double count_J =
      4 * cell.device.encoder_step_m * std::min(cell.device.force_max_N, setting.push_N + 0.1);
  const double allowed_J = kEnergyPart * r.stored_max_J + count_J;
  // A limit of the force's rate is a delay of its own, which no such part of the energy holds for.
  if (!setting.moves && cell.slew_N_s == 0) {
    r.active = !(r.surplus_J <= allowed_J);
    r.active_at_rest = !(energy.port_J + energy.stored_J - energy.raised_J <= allowed_J);
  }
  r.given = !(r.net_J <= rt::PassivityGuard::kAllowed_J + allowed_J +
                             energy.most_tick_J * (cell.ticks_per_sample + cell.device.delay_ticks));
}

}  // namespace

LoopResult run_loop(const LoopCell& cell) {
  const Wall still(cell);
  const Setting setting(cell, still);
  Motion motion(cell);
  Ticks ticks(cell.timing, setting.T_s, cell.seed);
  HeldHandle handle(cell, setting);
  Sensed sensed(cell, setting);
  Guarded guarded(cell, setting);
  Amplifier amplifier(cell);
  PortEnergy energy;
  Swings swings(cell, setting, handle.x_m());

  LoopResult r;
  r.passive_N_m = setting.passive_N_m;
  double t_s = 0, dt_s = setting.T_s;
  while (t_s < setting.longest_s) {
    const bool fresh = sensed.tick(r.ticks, handle.x_m(), dt_s);
    const Motion::At moved = motion.at(t_s);
    const Wall::At effect = effect_at(still, moved, sensed.x_m);
    const double wanted_N = guarded.force_N(effect, sensed, fresh, t_s, dt_s, r);
    const double gain = guarded.gain();
    guarded.wrote(amplifier.limit(wanted_N, dt_s));
    r.commanded_N_m = effect.stiffness_N_m;
    r.rendered_N_m = gain * effect.stiffness_N_m;

    dt_s = ticks.next(t_s);
    const double applied_N = amplifier.acting_N(r.ticks);
    const double before_m = handle.x_m();
    handle.step(t_s, dt_s, applied_N);
    t_s += dt_s;
    ++r.ticks;
    const double x_m = handle.x_m();
    const Wall::At there = effect_at(still, moved, x_m);
    const double part = cell.slew_N_s > 0 ? acting_part(there, gain, amplifier.written_N()) : gain;
    energy.tick(applied_N * (x_m - before_m), returnable_J(still, moved, x_m, part, cell.device.force_max_N),
                there.energy_J, gain, t_s);

    if (swings.tick(t_s, x_m, energy.port_J)) {
      r.rest_N = guarded.take_rest_N();
      if (swings.decided(t_s) || !std::isfinite(x_m)) {
        break;
      }
    }
  }
  r.end_s = t_s;
  r.owes = guarded.owes(t_s);
  judge(cell, setting, energy, swings, r);
  return r;
}

LoopCell sweep_cell(std::uint64_t n, bool guarded) {
  std::mt19937_64 random(n * 7919 + 13);
  const auto one_of = [&random](std::initializer_list<double> list) {
    return *(list.begin() + static_cast<std::ptrdiff_t>(random() % list.size()));
  };
  const auto log_uniform = [&random](double from, double to) {
    return from * std::pow(to / from, std::uniform_real_distribution<double>(0, 1)(random));
  };
  LoopCell c;
  c.seed = n;
  c.guarded = guarded;
  c.rate_Hz = one_of({500, 1000, 2000, 4000, 8000});
  c.device.delay_ticks = static_cast<int>(random() % 6);
  c.device.mass_kg = one_of({0.045, 0.075, 0.15});
  c.device.damping_Ns_m = one_of({0.05, 0.1, 0.5});
  c.device.encoder_step_m = one_of({0.01e-3, 0.03e-3, 0.055e-3});
  c.coulomb_N = one_of({0, 0, 0.04, 0.1});
  c.stiffness_N_m = log_uniform(1e1, 1e6);
  if (random() % 3 == 0) {
    c.membrane_E_Pa = log_uniform(1, 1e9);
  }
  c.damping_share = one_of({0, 0, 0.1, 0.5, 1, 3, 10});
  c.timing = static_cast<Timing>(random() % 4);
  c.holder = static_cast<Holder>(random() % 3);
  c.speed_m_s = one_of({0, 0.05, 0.2});
  c.push_N = one_of({0.2, 0.5, 1});
  // A heavy handle in light bearings that nobody holds would swing by itself for a minute.
  if (c.holder == Holder::nobody && c.device.mass_kg / c.device.damping_Ns_m > 1.6) {
    c.device.damping_Ns_m = 0.1;
  }
  // Against a very soft wall a constant push would creep for minutes.
  if (Wall(c).at(1e-3).stiffness_N_m < 5) {
    c.holder = Holder::arm;
  }
  return c;
}

LoopCell moving_cell(std::uint64_t n, bool guarded) {
  LoopCell c = sweep_cell(n, guarded);
  std::mt19937_64 random(n * 6271 + 29);
  const auto one_of = [&random](std::initializer_list<double> list) {
    return *(list.begin() + static_cast<std::ptrdiff_t>(random() % list.size()));
  };
  c.motion = static_cast<WallMotion>(random() % 5);
  do {  // no device samples more slowly than 250 Hz
    c.ticks_per_sample = static_cast<int>(one_of({1, 1, 2, 4, 8}));
  } while (c.rate_Hz < 250 * c.ticks_per_sample);
  c.depth = one_of({0.1, 0.5, 0.9});
  c.travel_m = one_of({0.1e-3, 1e-3, 5e-3});
  c.frequency_Hz = one_of({0.5, 1, 2, 5, 10, 30});
  c.travel_m = std::min(c.travel_m, 0.3 / (2 * std::numbers::pi * c.frequency_Hz));  // no faster than a hand
  c.device.force_max_N = one_of({1, 3.3, 8.5});
  c.slew_N_s = one_of({0, 300, 1000, 3000});  // the core's own limit is 300
  return c;
}

bool faithful(const LoopCell& cell, const LoopResult& r) noexcept {
  if (r.commanded_N_m <= 0 || !r.owes || cell.timing == Timing::lost_ticks ||
      cell.timing == Timing::late_tick) {
    return true;
  }
  if (r.commanded_N_m < 0.8 * r.passive_N_m) {
    return r.rendered_N_m >= 0.9 * r.commanded_N_m;
  }
  return r.rendered_N_m >= 0.5 * r.passive_N_m;
}

double lost_part(const LoopCell& cell) {
  constexpr double kPress_m = 10e-3;
  constexpr int kBefore = 2, kPresses = 8;
  const double T = 1 / cell.rate_Hz;
  const auto per_press = static_cast<std::int64_t>(std::round(cell.rate_Hz));
  const Wall wall(cell);
  rt::PassivityGuard guard({}, cell.device, {}, cell.rate_Hz);
  std::array<double, kRing> commands{};
  double x = 0, before_m = 0, work_J = 0, pressed_J = 0;
  for (std::int64_t k = 0; k < (kBefore + kPresses) * per_press; ++k) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(k % per_press) * T;
    const double true_m = 0.5 * kPress_m * (1 - std::cos(turn));
    const auto acting = static_cast<std::size_t>((k + kRing - 1 - cell.device.delay_ticks) % kRing);
    const double tick_J = k > cell.device.delay_ticks ? commands[acting] * (true_m - before_m) : 0;
    before_m = true_m;
    if (k >= kBefore * per_press) {
      work_J += tick_J;
      pressed_J -= std::min(0.0, tick_J);
    }
    const bool fresh = k % cell.ticks_per_sample == 0;
    if (fresh) {
      const double step_m = cell.device.encoder_step_m;
      x = step_m > 0 ? step_m * std::round(true_m / step_m) : true_m;
    }
    const Wall::At effect = wall.at(x);
    double force_N = effect.force_N;
    if (cell.guarded) {
      rt::GuardInput in;
      in.position_m = {x, 0, 0};
      in.storing[0] = {{effect.force_N, 0, 0}, {x, 0, 0}};
      in.stiffness_N_m = effect.stiffness_N_m;
      in.stored_J = effect.energy_J;
      in.elapsed_s = T;
      in.fresh = fresh;
      force_N = guard.step(in).x();
      guard.wrote({force_N, 0, 0});
    }
    commands[static_cast<std::size_t>(k % kRing)] = force_N;
  }
  return -work_J / pressed_J;
}

double measured_boundary_N_m(const rt::HandDevice& device, double T_s, double B_Ns_m) {
  sim::HandParams hand;
  hand.mass_kg = device.mass_kg;
  hand.damping_Ns_m = device.damping_Ns_m;
  hand.coulomb_N = 0;
  constexpr int kTicks = 8000;
  const auto comes_to_rest = [&](double K) {
    sim::HandAxis handle{1e-3, 0};
    std::array<double, kRing> commands{};
    double before_m = handle.x_m, earlier_m = 0, later_m = 0;
    for (int k = 0; k < kTicks; ++k) {
      const double v = (handle.x_m - before_m) / T_s;
      before_m = handle.x_m;
      commands[static_cast<std::size_t>(k % kRing)] = -K * handle.x_m - B_Ns_m * v;
      const int acting = k - device.delay_ticks;
      const double force_N = acting >= 0 ? commands[static_cast<std::size_t>(acting % kRing)] : 0;
      sim::advance(handle, hand, {}, force_N, 0, 0, T_s);
      const double x = std::abs(handle.x_m);
      if (!(x < 1e3)) {
        return false;
      }
      if (k >= kTicks / 4 && k < kTicks / 2) {
        earlier_m = std::max(earlier_m, x);
      }
      if (k >= 3 * kTicks / 4) {
        later_m = std::max(later_m, x);
      }
    }
    return later_m < earlier_m || later_m < 1e-12;
  };
  double below = 0, above = 4 * device.mass_kg / (T_s * T_s);
  for (int i = 0; i < 50; ++i) {
    const double K = 0.5 * (below + above);
    (comes_to_rest(K) ? below : above) = K;
  }
  return below;
}

CycleEnergy cycle_energy(double K_N_m, double B_Ns_m, double tau_s, double T_s, int delay_ticks) {
  // Work of the held force and the integral of v^2 over many periods, both for amplitude 1.
  const auto needed = [&](double omega, double phase, double v2_per_tick) {
    constexpr int kSettle = 400, kCount = 200000;
    std::array<double, kRing> commands{};
    double v = 0, work = 0, before = std::sin(phase - omega * T_s);
    for (int k = 0; k < kSettle + kCount; ++k) {
      const double x = std::sin(omega * k * T_s + phase);
      v = (tau_s * v + (x - before)) / (tau_s + T_s);
      before = x;
      commands[static_cast<std::size_t>(k % kRing)] = -K_N_m * x - B_Ns_m * v;
      const int acting = k - delay_ticks;
      if (k < kSettle || acting < 0) {
        continue;
      }
      work +=
          commands[static_cast<std::size_t>(acting % kRing)] * (std::sin(omega * (k + 1) * T_s + phase) - x);
    }
    return work / (kCount * v2_per_tick);
  };
  CycleEnergy e;
  const double nyquist = std::numbers::pi / T_s;
  e.slow_Ns_m = -std::numeric_limits<double>::infinity();
  for (const double part : {0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9}) {
    const double omega = part * 0.99173 * nyquist;  // no period is a whole number of ticks
    e.slow_Ns_m = std::max(e.slow_Ns_m, needed(omega, 0.3, 0.5 * omega * omega * T_s));
  }
  const double peak = 0.5 * std::numbers::pi;  // samples at the turning points
  e.sinusoid_Ns_m = needed(nyquist, peak, 0.5 * nyquist * nyquist * T_s);
  e.triangle_Ns_m = needed(nyquist, peak, 4 / T_s);
  return e;
}

}  // namespace punctum::report
