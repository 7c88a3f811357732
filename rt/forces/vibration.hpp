// Vibration: a short burst along the needle that marks contact and puncture,
// F = A e^(-t/decay) sin(2 pi f t).
//
// The one effect that is active: it may give energy to the hand. What it gives is counted,
// sum of f_{k-1} (x_k - x_{k-1}) with the force that acts after the device's delay, and a burst ends with the
// tick on which it has given more than its budget. Real-time safe.
#pragma once

#include <array>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

class Vibration {
 public:
  Vibration(const VibrationParams& params, int delay_ticks) noexcept;

  // One tick. begins: a burst starts here, in place of one that may still run. gain: what the force is
  // multiplied by before it reaches the hand.
  [[nodiscard]] hal::Vec3 step(const hal::Vec3& hand_m, const hal::Vec3& axis, bool begins, double gain,
                               double dt_s) noexcept;

  [[nodiscard]] double injected_energy_J() const noexcept { return injected_J_; }  // signed, cumulative

 private:
  static constexpr int kKept = 8;  // forces; more than the longest delay

  VibrationParams params_;
  std::size_t delay_;
  bool running_ = false;
  double since_s_ = 0;  // the burst began
  double burst_J_ = 0;  // given by it
  double injected_J_ = 0;
  hal::Vec3 hand_before_m_ = hal::Vec3::Zero();
  bool seen_ = false;
  std::array<hal::Vec3, kKept> given_N_;  // newest first
};

}  // namespace punctum::rt
