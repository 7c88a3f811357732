#include "hal/sim/plant/force_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::sim {

SimForceSensor::SimForceSensor(const ForceSensorParams& params, std::uint64_t seed)
    : params_(params), noise_(seed, Noise::Stream::force_sensor), liar_(seed, Device::force_sensor) {}

void SimForceSensor::step(std::int64_t t_ns, double dt_s, double axial_N, const Failing& failure)
    NONBLOCKING {
  const double part = params_.lag_s > 0 ? -math::expm1(-dt_s / params_.lag_s) : 1.0;
  state_.lagged_N += (axial_N - state_.lagged_N) * part;
  const double rms_N = params_.noise_N + (failure == Failure::noise ? kInterference_N : 0.0);
  const double noise_N = rms_N * noise_.gaussian(static_cast<std::uint64_t>(t_ns));
  state_.reading_N = std::clamp(state_.lagged_N + noise_N, -kFullScale_N, kFullScale_N);
  failure_ = failure;
  reader_.push(t_ns, state_, failure);
}

hal::Status SimForceSensor::read(hal::ForceState& out) NONBLOCKING {
  Sample<ForceSensorPlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::ForceState truth;
  truth.axial_force_N = sample.reading.reading_N;
  if (failure_ == Failure::nan) {
    truth.axial_force_N = kNotANumber;
  }
  if (failure_ == Failure::saturate) {
    truth.axial_force_N = kFullScale_N;
  }
  truth.sample_ns = sample.sample_ns;
  return liar_.tell(failure_, truth, out);
}

}  // namespace punctum::sim
