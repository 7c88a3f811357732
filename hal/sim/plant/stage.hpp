// The micromanipulator: three axes and a tilting needle, behind a drive.
//
// The tip follows its set-point as a first-order lag whose speed is bounded, solved in closed form along the
// straight line to the set-point. Encoders and set-points are in the stage's own frame, which lies
// registration_m beside the picture's. Quick stop and loss of power brake on a ramp, then hold; motion is
// possible again after enable() went off and on.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

struct StagePlantState {
  Point tip_m;  // truth, world frame
  Point axis{-1, 0, 0};
  Point set_point_m;  // world frame, as the drive understood it
  Point set_axis{-1, 0, 0};
  Point velocity_m_s;
  std::uint8_t enable_line = 0;    // as the core commands it
  std::uint8_t powered = 0;        // enable line and relay
  std::uint8_t quick_stopped = 0;  // until the enable line goes off
  std::uint8_t braking = 0;
  std::uint32_t reserved = 0;
};

// saturate: the drive gives kSaturatedSpeed of its speed. freeze: the drive hangs: it brakes and takes
// no command. disconnect: it brakes (link loss). noise: its encoders are kInterference_steps of their
// resolution rms beside the truth on each axis. drop: it moves on to its last set-point and holds there.
// creep: when it does not drive, it brakes to the given speed and keeps it as long as the relay is closed.
class SimStage final : public hal::Stage {
 public:
  static constexpr double kSaturatedSpeed = 0.02;
  static constexpr double kInterference_steps = 4;
  static constexpr double kTiltMax_rad = 0.35;  // of the axis from where it started

  explicit SimStage(const StageParams& params, std::uint64_t seed = 1);

  void step(std::int64_t t_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING;

  [[nodiscard]] hal::Status read(hal::StageState& out) NONBLOCKING override;
  [[nodiscard]] hal::Status command(const hal::StageCommand& set_point) NONBLOCKING override;
  void quick_stop() NONBLOCKING override;
  void enable(bool on) NONBLOCKING override;

  [[nodiscard]] const StagePlantState& state() const NONBLOCKING { return state_; }
  void restore(const StagePlantState& state) NONBLOCKING { state_ = state; }

  // In place of step(), where the stage is real: it stands where it was read.
  void follow_real(const hal::StageState& real, double dt_s) NONBLOCKING;

 private:
  void brake(double dt_s) NONBLOCKING;
  void creep(double dt_s) NONBLOCKING;
  void follow(double dt_s, double speed_m_s) NONBLOCKING;

  StageParams params_;
  Noise noise_;
  StagePlantState state_;
  FailingReader<StagePlantState> reader_;
  Liar<hal::StageState> liar_;
  Failing failure_;
};

}  // namespace punctum::sim
