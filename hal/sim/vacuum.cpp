#include "hal/sim/vacuum.hpp"

#include <cmath>

namespace punctum::sim {

SimVacuum::SimVacuum(const HolderParams& params, std::uint64_t seed)
    : target_Pa_(params.vacuum_Pa), noise_(seed, Noise::Stream::vacuum) {
  state_.pressure_Pa = target_Pa_;
  state_.reading_Pa = target_Pa_;
}

void SimVacuum::step(std::int64_t t_ns, double dt_s, Failure failure) noexcept {
  const double target = failure == Failure::saturate ? 0.0 : target_Pa_;
  state_.pressure_Pa += (target - state_.pressure_Pa) * -std::expm1(-dt_s / kLeak_s);
  const double rms_Pa = kNoise_Pa + (failure == Failure::noise ? kInterference_Pa : 0.0);
  state_.reading_Pa = state_.pressure_Pa + rms_Pa * noise_.gaussian(static_cast<std::uint64_t>(t_ns));
  reader_.push(t_ns, state_, failure);
}

hal::Status SimVacuum::read(double& pressure_Pa) noexcept {
  VacuumPlantState s;
  const hal::Status status = reader_.read(s);
  if (status != hal::Status::ok) return status;
  pressure_Pa = reader_.failure() == Failure::nan ? kNotANumber : s.reading_Pa;
  return hal::Status::ok;
}

}  // namespace punctum::sim
