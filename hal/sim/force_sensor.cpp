#include "hal/sim/force_sensor.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::sim {

SimForceSensor::SimForceSensor(const ForceSensorParams& params, std::uint64_t seed)
    : params_(params), noise_(seed, Noise::Stream::force_sensor) {}

void SimForceSensor::step(std::int64_t t_ns, double dt_s, double axial_N, Failure failure) noexcept {
  const double part = params_.lag_s > 0 ? -std::expm1(-dt_s / params_.lag_s) : 1.0;
  state_.lagged_N += (axial_N - state_.lagged_N) * part;
  const double rms_N = params_.noise_N + (failure == Failure::noise ? kInterference_N : 0.0);
  const double noise_N = rms_N * noise_.gaussian(static_cast<std::uint64_t>(t_ns));
  state_.reading_N = std::clamp(state_.lagged_N + noise_N, -kFullScale_N, kFullScale_N);
  reader_.push(t_ns, state_, failure);
}

hal::Status SimForceSensor::read(double& axial_force_N) noexcept {
  ForceSensorPlantState s;
  const hal::Status status = reader_.read(s);
  if (status != hal::Status::ok) return status;
  axial_force_N = s.reading_N;
  if (reader_.failure() == Failure::nan) axial_force_N = kNotANumber;
  if (reader_.failure() == Failure::saturate) axial_force_N = kFullScale_N;
  return hal::Status::ok;
}

}  // namespace punctum::sim
