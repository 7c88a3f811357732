// The holding vacuum: a pump that keeps its pressure whatever happens to the rest.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"

namespace punctum::sim {

struct VacuumPlantState {
  double pressure_Pa = 0;  // truth, below ambient, positive
  double reading_Pa = 0;
};

// saturate: the pump fails, the pressure goes to ambient with kLeak_s. The other failures concern the gauge
// only; noise: kInterference_Pa rms more noise.
class SimVacuum final : public hal::HoldingVacuum {
 public:
  static constexpr double kLeak_s = 0.1;
  static constexpr double kNoise_Pa = 2;  // of the gauge
  static constexpr double kInterference_Pa = 200;

  SimVacuum(const HolderParams& params, std::uint64_t seed);

  void step(std::int64_t t_ns, double dt_s, const Failing& failure) NONBLOCKING;

  [[nodiscard]] hal::Status read(hal::VacuumState& out) NONBLOCKING override;

  [[nodiscard]] const VacuumPlantState& state() const NONBLOCKING { return state_; }
  void restore(const VacuumPlantState& state) NONBLOCKING { state_ = state; }

 private:
  double target_Pa_;
  Noise noise_;
  VacuumPlantState state_;
  FailingReader<VacuumPlantState> reader_;
  Liar<hal::VacuumState> liar_;
  Failing failure_;
};

}  // namespace punctum::sim
