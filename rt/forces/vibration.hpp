// Vibration: a short burst along the needle that marks contact and puncture,
// F = A e^(-t/decay) sin(2 pi f t).
//
// The one effect that is active: it may give energy to the hand. What it gives is counted,
// sum of f_{k-1} (x_k - x_{k-1}) with the force that acts after the device's delay, and a burst ends with the
// tick on which it has given more than its budget. Real-time safe.
#pragma once

#include <array>

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/forces/effect.hpp"

namespace punctum::rt {

// A burst that marks contact and puncture.
struct VibrationParams {
  double frequency_Hz = 150;
  double amplitude_N = 0.15;
  double decay_s = 0.03;
  double energy_J = 50e-6;  // of one burst: it ends once it has given more
};
constexpr auto keys_of(const VibrationParams*) {
  return hal::keys(hal::real("frequency_hz", &VibrationParams::frequency_Hz, 5, 2000),
                   hal::real("amplitude_N", &VibrationParams::amplitude_N, 0, 5),
                   hal::milli("decay_ms", &VibrationParams::decay_s, 1, 1000),
                   hal::micro("energy_uJ", &VibrationParams::energy_J, 0, 1e5));
}

class Vibration {
 public:
  using Params = VibrationParams;
  static constexpr Gives kGives{.active = true};

  Vibration(const VibrationParams& params, const EffectSetup& setup) NONBLOCKING;

  // When contact or puncture begins a burst starts, in place of one that may still run.
  [[nodiscard]] EffectOutput step(const EffectInput& in) NONBLOCKING;

  [[nodiscard]] double injected_energy_J() const NONBLOCKING { return injected_J_; }  // signed, cumulative

 private:
  static constexpr int kKept = 8;  // forces; more than the longest delay

  VibrationParams params_;
  std::size_t delay_;
  bool running_ = false;
  double since_s_ = 0;  // since the burst began
  double burst_J_ = 0;  // given by this burst
  double injected_J_ = 0;
  hal::Vec3 last_handle_m_ = hal::Vec3::Zero();
  bool stepped_ = false;
  std::array<hal::Vec3, kKept> given_N_;  // newest first
};

}  // namespace punctum::rt
