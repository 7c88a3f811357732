// The haptic device and the arm that holds it.
//
// Per axis  m x'' = f + K (p - x) + B (p' - x') - b x' - f_c sgn(x')  with the commanded force f held over
// the interval and the arm's intended position p linear in time. The equation is linear while the handle
// slides in one direction or sticks. Each piece is solved in closed form and the transitions between them are
// located, so the result does not depend on how an interval is cut. Friction acts on each axis by itself, as
// it does in a device with one bearing per axis.
#pragma once

#include <array>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

struct ArmImpedance {
  double stiffness_N_m = 0;
  double damping_Ns_m = 0;
};

// One axis of the handle.
struct HandAxis {
  double x_m = 0;
  double v_m_s = 0;
};

// Advances one axis by dt_s, any length. The arm's intended position runs from p0_m with velocity u_m_s.
void advance(HandAxis& axis, const HandParams& hand, const ArmImpedance& arm, double force_N, double p0_m,
             double u_m_s, double dt_s) NONBLOCKING;

struct HandPlantState {
  Point position_m;  // device frame
  Point velocity_m_s;
  Point applied_N;                              // by the amplifier over the last interval, after saturation
  Point commanded_N;                            // for the next one, or for delay_ticks later
  double tilt_rad[2]{};                         // of the handle about its x and y axes
  std::array<Point, kMaxDelayTicks> pending_N;  // commands of the last steps, newest first
  double work_J = 0;  // done by the amplifier on the handle: sum of f_{k-1} (x_k - x_{k-1})
  std::uint32_t buttons = 0;
  std::uint32_t amplifier_on = 0;
};

// saturate: the encoders end at kSaturatedReach_m and the amplifier gives kSaturatedForce of its force.
// noise: every reading is kInterference_steps encoder steps rms beside the truth on each axis.
// freeze: the amplifier keeps giving the last force. drop, disconnect: the amplifier gives none.
class SimHand final : public hal::HapticDevice {
 public:
  static constexpr double kSaturatedReach_m = 0.01;
  static constexpr double kSaturatedForce = 0.1;
  static constexpr double kInterference_steps = 4;

  SimHand(const HandParams& params, const ArmImpedance& arm, std::uint64_t seed = 1);

  // Advances to t_ns. p0 and p1: the arm's intended position at both ends of the interval, device frame.
  void step(std::int64_t t_ns, double dt_s, const Vec3& p0, const Vec3& p1, bool power,
            const Failing& failure) NONBLOCKING;
  void set_grip(double tilt_x_rad, double tilt_y_rad, std::uint32_t buttons) NONBLOCKING;

  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING override;
  [[nodiscard]] hal::Status write_force(const Vec3& force_N) NONBLOCKING override;

  [[nodiscard]] const HandPlantState& state() const NONBLOCKING { return state_; }
  void restore(const HandPlantState& state) NONBLOCKING { state_ = state; }

  // In place of step(), where the handle is real: it stands where it was read.
  void follow_real(const hal::HandState& real, double dt_s) NONBLOCKING;

 private:
  HandParams params_;
  ArmImpedance arm_;
  Noise noise_;
  HandPlantState state_;
  FailingReader<HandPlantState> reader_;
  Liar<hal::HandState> liar_;
  Failing failure_;
};

}  // namespace punctum::sim
