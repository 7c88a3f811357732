// The force sensor in the needle's holder: axial force, compression positive, first-order lag and noise.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"

namespace punctum::sim {

struct ForceSensorPlantState {
  double lagged_N = 0;
  double reading_N = 0;
};

// saturate: it reads its full scale. noise: kInterference_N rms more noise.
class SimForceSensor final : public hal::ForceSensor {
 public:
  static constexpr double kFullScale_N = 200e-6;
  static constexpr double kInterference_N = 20e-6;

  SimForceSensor(const ForceSensorParams& params, std::uint64_t seed);

  // axial_N: the needle's true force, held over the interval.
  void step(std::int64_t t_ns, double dt_s, double axial_N, const Failing& failure) NONBLOCKING;

  [[nodiscard]] hal::Status read(hal::ForceState& out) NONBLOCKING override;

  [[nodiscard]] const ForceSensorPlantState& state() const NONBLOCKING { return state_; }
  void restore(const ForceSensorPlantState& state) NONBLOCKING { state_ = state; }

 private:
  ForceSensorParams params_;
  Noise noise_;
  ForceSensorPlantState state_;
  FailingReader<ForceSensorPlantState> reader_;
  Liar<hal::ForceState> liar_;
  Failing failure_;
};

}  // namespace punctum::sim
