#include "hal/sim/plant/vacuum.hpp"

#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::sim {

SimVacuum::SimVacuum(const HolderParams& params, std::uint64_t seed)
    : target_Pa_(params.vacuum_Pa), noise_(seed, Noise::Stream::vacuum), liar_(seed, Device::vacuum) {
  state_.pressure_Pa = target_Pa_;
  state_.reading_Pa = target_Pa_;
}

void SimVacuum::step(std::int64_t t_ns, double dt_s, const Failing& failure) NONBLOCKING {
  const double target = failure == Failure::saturate ? 0.0 : target_Pa_;
  if (state_.pressure_Pa != target) {
    state_.pressure_Pa += (target - state_.pressure_Pa) * -math::expm1(-dt_s / kLeak_s);
  }
  const double rms_Pa = kNoise_Pa + (failure == Failure::noise ? kInterference_Pa : 0.0);
  state_.reading_Pa = state_.pressure_Pa + rms_Pa * noise_.gaussian(static_cast<std::uint64_t>(t_ns));
  failure_ = failure;
  reader_.push(t_ns, state_, failure);
}

hal::Status SimVacuum::read(hal::VacuumState& out) NONBLOCKING {
  Sample<VacuumPlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::VacuumState truth;
  truth.pressure_Pa = failure_ == Failure::nan ? kNotANumber : sample.reading.reading_Pa;
  truth.sample_ns = sample.sample_ns;
  return liar_.tell(failure_, truth, out);
}

}  // namespace punctum::sim
