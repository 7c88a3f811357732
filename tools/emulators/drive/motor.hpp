// The motor of a drive, in counts and seconds: a position that follows its set-point with limited speed and
// acceleration, or brakes.
#pragma once

#include <algorithm>
#include <cmath>

namespace punctum::emulator {

struct MotorLimits {
  double speed_counts_s = 500'000;
  double acceleration_counts_s2 = 50'000'000;
  double friction_counts_s2 = 2'000'000;  // without power it coasts to a stop
};

class Motor {
 public:
  explicit Motor(const MotorLimits& limits, double start_counts) : limits_(limits), x_(start_counts) {}

  [[nodiscard]] double position() const { return x_; }
  [[nodiscard]] double speed() const { return v_; }
  [[nodiscard]] bool stands() const { return v_ == 0; }

  // Towards `to`, which it reaches without overshoot.
  void follow(double to, double dt_s) {
    const double d = to - x_;
    // The speed from which it still stops at the target, and that which gets there within this step.
    const double brakes = std::sqrt(2 * limits_.acceleration_counts_s2 * std::abs(d));
    const double wanted = std::copysign(std::min({limits_.speed_counts_s, brakes, std::abs(d) / dt_s}), d);
    const double change = limits_.acceleration_counts_s2 * dt_s;
    v_ = std::clamp(wanted, v_ - change, v_ + change);
    x_ += v_ * dt_s;
  }
  void run(double speed_counts_s, double acceleration_counts_s2, double dt_s) {
    const double change = acceleration_counts_s2 * dt_s;
    v_ = std::clamp(speed_counts_s, v_ - change, v_ + change);
    x_ += v_ * dt_s;
  }
  void brake(double deceleration_counts_s2, double dt_s) { run(0, deceleration_counts_s2, dt_s); }
  void coast(double dt_s) { brake(limits_.friction_counts_s2, dt_s); }
  void creep(double speed_counts_s, double dt_s) {
    v_ = speed_counts_s;
    x_ += v_ * dt_s;
  }
  void shift_origin(double counts) { x_ -= counts; }  // what was at `counts` is at zero

 private:
  MotorLimits limits_;
  double x_, v_ = 0;
};

}  // namespace punctum::emulator
