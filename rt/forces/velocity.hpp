// Velocity of the hand from quantised positions: first-order adaptive windowing, best fit (Janabi-Sharifi
// 2000).
//
// Per axis: the longest window, grown sample by sample, whose least-squares slope, drawn as a line through
// the newest sample, leaves every sample of the window within +-d. Slow motion gets a long window (little
// noise), fast motion a short one (little delay). Sample times are the real ones, so a late tick does no
// harm.
#pragma once

#include <array>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

// The window is meant in time: as many intervals more as the rate is above 1 kHz.
[[nodiscard]] VelocityParams at_rate(VelocityParams params, double rate_Hz) noexcept;

class Foaw {
 public:
  static constexpr int kMaxWindow = 64;

  explicit Foaw(const VelocityParams& params) noexcept;

  // A new sample, dt_s after the one before. Returns the velocity, 0 for the first. dt_s <= 0 repeats the
  // last.
  hal::Vec3 step(const hal::Vec3& position_m, double dt_s) noexcept;
  void reset() noexcept {
    count_ = 0;
    velocity_.setZero();
  }
  [[nodiscard]] const hal::Vec3& velocity() const noexcept { return velocity_; }

 private:
  int window_;  // intervals at most
  double d_m_;
  int newest_ = 0;
  int count_ = 0;
  std::array<double, kMaxWindow + 1> step_s_{};  // from the sample before to this one
  std::array<std::array<double, kMaxWindow + 1>, 3> x_{};
  hal::Vec3 velocity_ = hal::Vec3::Zero();
};

}  // namespace punctum::rt
