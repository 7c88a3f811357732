#include "hal/sim/plant/hand.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/math/elementary.hpp"

namespace punctum::sim {
namespace {

constexpr double kAtRest_m_s = 1e-12;  // slower is at rest as far as friction is concerned
constexpr int kMaxPieces = 256;        // per call; a handle comes to rest long before

// How m y'' + c y' + K y = 0 moves. The axes of a handle share it, and mostly the time that it is asked for.
class Swing {
 public:
  struct Modes {
    double C;  // e^(-alpha t) cosh(sqrt(D) t)
    double S;  // e^(-alpha t) sinh(sqrt(D) t) / sqrt(D)
  };

  // y'' + 2 alpha y' + w2 y = 0.
  Swing(double m, double c, double K) NONBLOCKING : alpha(c / (2 * m)),
                                                    w2(K / m),
                                                    D(alpha* alpha - w2),
                                                    root(std::sqrt(std::abs(D))) {}

  [[nodiscard]] const Modes& modes(double t) NONBLOCKING {
    if (t != asked_s_) {
      asked_s_ = t;
      modes_ = modes_at(t);
    }
    return modes_;
  }

  const double alpha, w2, D, root;

 private:
  [[nodiscard]] Modes modes_at(double t) const NONBLOCKING {
    if (root * t < 1e-9) {
      const double e = math::exp(-alpha * t);
      return {e, e * t};
    }
    if (D < 0) {
      const double e = math::exp(-alpha * t);
      const math::SinCos turn = math::sin_cos(root * t);
      return {e * turn.cos, e * turn.sin / root};
    }
    const double slow = math::exp(-w2 / (alpha + root) * t);  // alpha - sqrt(D) without cancellation
    const double fast = math::exp(-(alpha + root) * t);
    return {(slow + fast) / 2, -slow * math::expm1(-2 * root * t) / (2 * root)};
  }

  double asked_s_ = -1;
  Modes modes_{};
};

// m x'' + c x' + K x = g0 + K u t, from x0, v0 at t = 0.
class Slide {
 public:
  Slide(Swing& swing, double m, double c, double K, double g0, double u, double x0, double v0) NONBLOCKING
      : swing_(swing),
        u_(u),
        x0_(x0),
        v0_(v0),
        with_spring_(K > 0) {
    if (!with_spring_) {
      rate_ = c / m;
      g_ = g0 / m;
      a0_ = std::abs(g_) + rate_ * std::abs(v0);
      return;
    }
    // Particular solution A + u t; y = x - A - u t swings.
    A_ = (g0 - c * u) / K;
    y0_ = x0 - A_;
    P_ = v0 - u;
    Q_ = -(swing.w2 * y0_ + swing.alpha * P_);
    a0_ = Q_ - swing.alpha * P_;
    a1_ = P_ * swing.D - swing.alpha * Q_;
  }

  [[nodiscard]] HandAxis at(double t) const NONBLOCKING {
    if (!with_spring_) {
      const double z = rate_ * t;
      const double phi1 = z > 1e-8 ? -math::expm1(-z) / z : 1 - z / 2;
      const double phi2 = z > 1e-2 ? (1 - phi1) / z : 0.5 - z / 6 + z * z / 24 - z * z * z / 120;
      return {x0_ + t * (v0_ * phi1 + g_ * t * phi2), v0_ * math::exp(-z) + g_ * t * phi1};
    }
    const auto [C, S] = swing_.modes(t);
    return {A_ + u_ * t + y0_ * C + (P_ + swing_.alpha * y0_) * S, u_ + P_ * C + Q_ * S};
  }

  // First time in (0, end] at which sign * velocity becomes negative, or end.
  [[nodiscard]] double stops_at(double sign, double end) const NONBLOCKING {
    // It cannot change by more than this: the acceleration is a0 C + a1 S with |C| <= 1 and |S| <= t.
    if (sign * v0_ > end * (std::abs(a0_) + end * std::abs(a1_))) {
      return end;
    }
    // Between the zeros of the acceleration the velocity is monotone.
    double from = 0;
    for (int k = 0; k < kMaxPieces && from < end; ++k) {
      const double to = std::min(end, next_turn(from));
      if (sign * at(to).v_m_s < -kAtRest_m_s * 1e-2) {
        return root(sign, from, to);
      }
      from = to;
    }
    return end;
  }

 private:
  // The first zero of the acceleration a0 C + a1 S after `from`.
  [[nodiscard]] double next_turn(double from) const NONBLOCKING {
    constexpr double never = 1e300;
    if (!with_spring_) {
      return never;
    }
    const double after = from * (1 + 1e-12) + 1e-15;
    if (swing_.D < 0) {
      if (swing_.root <= 0) {
        return never;
      }
      double turn = math::atan2(-a0_, a1_ / swing_.root) / swing_.root;
      const double half_turn = std::numbers::pi / swing_.root;
      turn += half_turn * std::ceil((after - turn) / half_turn);
      return turn > from ? turn : turn + half_turn;
    }
    double turn = never;
    if (swing_.root > 0) {
      const double tanh_turn = -a0_ * swing_.root / a1_;
      if (a1_ != 0 && tanh_turn > 0 && tanh_turn < 1) {
        turn = math::atanh(tanh_turn) / swing_.root;
      }
    } else if (a1_ != 0) {
      turn = -a0_ / a1_;
    }
    return turn > after ? turn : never;
  }

  // The velocity changes sign between from and to, where it is monotone: Illinois, and halves. Ends on the
  // side where it still moves.
  [[nodiscard]] double root(double sign, double from, double to) const NONBLOCKING {
    double a = from;
    double b = to;
    double va = std::max(0.0, sign * at(a).v_m_s);
    double vb = sign * at(b).v_m_s;
    const double fine = 1e-17 + std::numeric_limits<double>::epsilon() * b;
    int side = 0;
    for (int i = 0; i < 100 && b - a > 2 * fine; ++i) {
      const double secant = a + (b - a) * va / (va - vb);
      const double t = va > 0 && i % 3 != 2 ? std::clamp(secant, a + fine, b - fine) : a + (b - a) / 2;
      const double v = sign * at(t).v_m_s;
      if (v == 0) {
        return t;
      }
      if (v > 0) {
        a = t;
        va = v;
        if (side == 1) {
          vb /= 2;
        }
        side = 1;
      } else {
        b = t;
        vb = v;
        if (side == -1) {
          va /= 2;
        }
        side = -1;
      }
    }
    return a;
  }

  Swing& swing_;
  double u_, x0_, v0_;
  bool with_spring_;
  double rate_ = 0, g_ = 0;
  double A_ = 0, y0_ = 0, P_ = 0, Q_ = 0;
  double a0_ = 0, a1_ = 0;  // acceleration a0 C + a1 S; without a spring a0 bounds it
};

[[nodiscard]] Swing swing_of(const HandParams& hand, const ArmImpedance& arm) NONBLOCKING {
  return {hand.mass_kg, arm.damping_Ns_m + hand.damping_Ns_m, arm.stiffness_N_m};
}

void advance(HandAxis& axis, Swing& swing, const HandParams& hand, const ArmImpedance& arm, double force_N,
             double p0_m, double u_m_s, double dt_s) NONBLOCKING {
  const double m = hand.mass_kg;
  const double K = arm.stiffness_N_m;
  const double B = arm.damping_Ns_m;
  const double c = B + hand.damping_Ns_m;
  const double friction = hand.coulomb_N;
  double t = 0;
  double breaks_away = 0;  // sign of the motion that just began from rest
  for (int piece = 0; piece < kMaxPieces && t < dt_s; ++piece) {
    const double left = dt_s - t;
    const double p = p0_m + u_m_s * t;
    const double drive = force_N + K * p + B * u_m_s;  // all but friction, at x = 0 and v = 0
    double sign = 0;
    if (friction > 0) {
      if (breaks_away != 0) {
        sign = breaks_away;
        breaks_away = 0;
      } else if (std::abs(axis.v_m_s) > kAtRest_m_s) {
        sign = axis.v_m_s > 0 ? 1 : -1;
      } else {
        axis.v_m_s = 0;
        const double pull = drive - K * axis.x_m;
        if (std::abs(pull) <= friction) {  // sticks until the arm's pull, linear in time, exceeds friction
          const double ramp = K * u_m_s;
          if (ramp == 0) {
            return;
          }
          const double until = ((ramp > 0 ? friction : -friction) - pull) / ramp;
          if (until >= left) {
            return;
          }
          t += std::max(0.0, until);
          breaks_away = ramp > 0 ? 1 : -1;
          continue;
        }
        sign = pull > 0 ? 1 : -1;
      }
    }
    const Slide slide(swing, m, c, K, drive - sign * friction, u_m_s, axis.x_m, axis.v_m_s);
    const double until = sign == 0 ? left : slide.stops_at(sign, left);
    axis = slide.at(until);
    if (until < left) {
      axis.v_m_s = 0;
    }
    t += until;
  }
}

}  // namespace

void advance(HandAxis& axis, const HandParams& hand, const ArmImpedance& arm, double force_N, double p0_m,
             double u_m_s, double dt_s) NONBLOCKING {
  Swing swing = swing_of(hand, arm);
  advance(axis, swing, hand, arm, force_N, p0_m, u_m_s, dt_s);
}

SimHand::SimHand(const HandParams& params, const ArmImpedance& arm, std::uint64_t seed)
    : params_(params), arm_(arm), noise_(seed, Noise::Stream::hand_reading), liar_(seed, Device::hand) {}

void SimHand::step(std::int64_t t_ns, double dt_s, const Vec3& p0, const Vec3& p1, bool power,
                   const Failing& failure) NONBLOCKING {
  failure_ = failure;
  const bool on = power && failure != Failure::drop && failure != Failure::disconnect;
  const double most = params_.force_max_N * (failure == Failure::saturate ? kSaturatedForce : 1.0);
  auto& under_way = state_.pending_N;
  const int late = std::clamp(params_.delay_ticks, 0, kMaxDelayTicks);
  const Point due = late > 0 ? under_way[static_cast<std::size_t>(late - 1)] : state_.commanded_N;
  std::copy_backward(under_way.begin(), under_way.end() - 1, under_way.end());
  under_way.front() = state_.commanded_N;
  Vec3 f = on ? due.vec() : Vec3::Zero();
  if (const double size = f.norm(); size > most) {
    f *= most / size;
  }

  const Vec3 u = dt_s > 0 ? Vec3((p1 - p0) / dt_s) : Vec3::Zero();
  Vec3 x = state_.position_m;
  Vec3 v = state_.velocity_m_s;
  const Vec3 before = x;
  Swing swing = swing_of(params_, arm_);
  for (int i = 0; i < 3; ++i) {
    HandAxis axis{x[i], v[i]};
    advance(axis, swing, params_, arm_, f[i], p0[i], u[i], dt_s);
    x[i] = axis.x_m;
    v[i] = axis.v_m_s;
  }
  state_.position_m = x;
  state_.velocity_m_s = v;
  state_.applied_N = f;
  state_.work_J += f.dot(x - before);
  state_.amplifier_on = on ? 1 : 0;
  reader_.push(t_ns, state_, failure);
}

void SimHand::follow_real(const hal::HandState& real, double dt_s) NONBLOCKING {
  state_.velocity_m_s =
      dt_s > 0 ? Vec3((real.position_m - state_.position_m.vec()) / dt_s) : Vec3(Vec3::Zero());
  state_.position_m = real.position_m;
  state_.buttons = real.buttons;
}

void SimHand::set_grip(double tilt_x_rad, double tilt_y_rad, std::uint32_t buttons) NONBLOCKING {
  state_.tilt_rad[0] = tilt_x_rad;
  state_.tilt_rad[1] = tilt_y_rad;
  state_.buttons = buttons;
}

hal::Status SimHand::read(hal::HandState& out) NONBLOCKING {
  Sample<HandPlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::HandState truth;
  const HandPlantState& s = sample.reading;
  const Vec3 true_position = s.position_m;
  Vec3 x;
  for (int i = 0; i < 3; ++i) {
    double xi = true_position[i];
    if (failure_ == Failure::noise) {
      const auto n = 3 * static_cast<std::uint64_t>(reader_.newest_ns()) + static_cast<std::uint64_t>(i);
      xi += kInterference_steps * params_.encoder_step_m * noise_.gaussian(n);
    }
    if (failure_ == Failure::saturate) {
      xi = std::clamp(xi, -kSaturatedReach_m, kSaturatedReach_m);
    }
    x[i] = params_.encoder_step_m > 0 ? params_.encoder_step_m * std::round(xi / params_.encoder_step_m) : xi;
  }
  if (failure_ == Failure::nan) {
    x.setConstant(kNotANumber);
  }
  truth.position_m = x;
  const Vec3 turn(s.tilt_rad[0], s.tilt_rad[1], 0);
  const double angle = turn.norm();
  truth.orientation = Quat::Identity();
  if (angle > 0) {
    const math::SinCos half = math::sin_cos(angle / 2);
    const Vec3 axis = half.sin / angle * turn;
    truth.orientation = Quat(half.cos, axis.x(), axis.y(), axis.z());
  }
  truth.buttons = s.buttons;
  truth.sample_ns = sample.sample_ns;
  return liar_.tell(failure_, truth, out);
}

hal::Status SimHand::write_force(const Vec3& force_N) NONBLOCKING {
  if (!commands_arrive(failure_)) {
    return command_status(failure_);
  }
  if (!force_N.allFinite()) {  // the amplifier refuses what is not a number
    state_.commanded_N = Point{};
    return hal::Status::fault;
  }
  state_.commanded_N = force_N;
  return hal::Status::ok;
}

}  // namespace punctum::sim
